"""Extreme values: strengths and lifetimes (Weibull), largest loads (Gumbel)."""

from __future__ import annotations

import numpy as np
from scipy.special import gamma, gammaln

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_spread
from flexband.errors import InputError
from flexband.uncertainty.inputs.distribution import FrozenDistribution, Moments, Spread, of_scipy
from flexband.uncertainty.inputs.inputs import Numbers

MIN_SHAPE = 0.2
LARGEST_SHAPE = 1e4
"""Of a Weibull distribution."""


@frozen(repr=False)
class Weibull(Moments):
    """A number with a Weibull distribution: P(x > X) = exp(−((X − location)/scale)^shape).

    Parameters
    ----------
    scale : 63.2 % of the values are below location + scale.
    shape : the Weibull modulus.
    location : the least possible value.
    mean, std : mean and standard deviation, instead of scale and shape.
    cv : coefficient of variation, the standard deviation over |mean|, instead of `std`.

    Raises
    ------
    InputError
        If scale or shape is not positive, or the shape is below 0.2, where moments are those of
        values that hardly ever occur; if moments are not those of such a distribution, or if
        parameters are missing or given twice.
    """

    scale: float | None = None
    shape: float | None = None
    location: float = 0.0

    parameter_names = ("scale", "shape")

    @property
    def frozen(self) -> FrozenDistribution:
        scale, shape = self.parameters
        return of_scipy("weibull_min")(shape, self.location, scale)

    def of_moments(self, mean: Numbers, std: Numbers) -> tuple[Numbers, Numbers]:
        """Return scale and shape: (std/m)² = Γ(1 + 2/shape)/Γ(1 + 1/shape)² − 1."""
        from scipy.optimize import elementwise  # noqa: PLC0415

        above = mean - self.location
        variation = np.log1p((std / above) ** 2)
        shape = elementwise.find_root(
            lambda k, target: _variation(k) - target,
            (np.float64(MIN_SHAPE), np.float64(LARGEST_SHAPE)),
            args=(variation,),
        ).x
        return above / gamma(1 + 1 / shape), shape

    def check_moments(self, mean: float, std: float) -> None:
        """Raise `InputError` if the mean is not above the location, or the shape out of range."""
        if not mean > self.location:
            raise InputError(
                f"Weibull mean must be above the location {self.location:g}; got {mean:g}"
            )
        smallest_std, largest_std = (
            (mean - self.location) * np.sqrt(np.expm1(_variation(shape)))
            for shape in (LARGEST_SHAPE, MIN_SHAPE)
        )
        if not smallest_std < std < largest_std:
            raise InputError(
                f"Weibull std must be above {smallest_std:.3g} and below {largest_std:.3g} for "
                f"mean - location = {mean - self.location:g}; got {std:g}"
            )

    def check(self) -> None:
        """Raise `InputError` if scale or shape is not positive."""
        super().check()
        scale, shape = map(float, self.parameters)
        if not MIN_SHAPE <= shape <= LARGEST_SHAPE:
            raise InputError(
                f"Weibull shape must be from {MIN_SHAPE:g} to {LARGEST_SHAPE:g}; got {shape:g}"
            )
        check_spread("Weibull scale", scale, self.location)


def _variation(shape: Numbers) -> Numbers:
    """Return log(1 + (std/mean)²) of a Weibull distribution at location 0."""
    return gammaln(1 + 2 / shape) - 2 * gammaln(1 + 1 / shape)


@frozen(repr=False)
class Gumbel(Spread):
    """A largest value, as of a load in a year, with a Gumbel distribution.

    Parameters
    ----------
    mean, std : mean and standard deviation.
    cv : coefficient of variation, the standard deviation over |mean|, instead of `std`.

    Raises
    ------
    InputError
        If a number is not finite, the spread is not positive, or both or none are given.
    """

    @property
    def frozen(self) -> FrozenDistribution:
        scale = self.spread * np.sqrt(6) / np.pi
        return of_scipy("gumbel_r")(self.mean - np.euler_gamma * scale, scale)
