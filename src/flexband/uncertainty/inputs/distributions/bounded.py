"""Numbers between two bounds: uniform, triangular and beta distributions."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtri

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_spread
from flexband.errors import InputError
from flexband.uncertainty.expansions.families import LEGENDRE, Family
from flexband.uncertainty.inputs.distribution import (
    NO_SCATTER,
    Distribution,
    FrozenDistribution,
    Moments,
    of_scipy,
)
from flexband.uncertainty.inputs.inputs import Numbers, number_between, place_between

MIN_SHAPE = 0.02
LARGEST_SHAPE = 1e10
"""Of a beta distribution. Below the least, nearly all values are the bounds; one that is given by
its moments is no narrower than the largest tells."""


@frozen(repr=False)
class Uniform(Distribution):
    """A uniformly distributed number.

    Raises
    ------
    InputError
        If a bound is not finite or the lower bound is not below the upper.

    Examples
    --------
    >>> bands = fb.propagate(lambda x: 12**0.5 * x, {"x": fb.Uniform(-1.0, 1.0)}, fb.PCCI(1, 0))
    >>> bands["error_bar"].values.round(4)  # the standard deviation is 2/√12
    array([-2.,  2.])
    """

    lower: float
    upper: float

    @property
    def frozen(self) -> FrozenDistribution:
        return of_scipy("uniform")(self.lower, self.upper - self.lower)

    @property
    def family(self) -> Family:
        return LEGENDRE

    def check(self) -> None:
        """Raise `InputError` if there is no number between the bounds."""
        _check_bounds(self, self.lower, self.upper)

    def value(self, standard: np.ndarray) -> np.ndarray:
        """Return midpoint + radius ξ; exactly the bounds at ξ = −1 and 1."""
        return number_between(self.lower, self.upper, standard[:, 0])

    def standard(self, value: np.ndarray) -> np.ndarray:
        """Return ξ of values, within rounding of the bounds."""
        return place_between(self.lower, self.upper, value)


@frozen(repr=False)
class Triangular(Distribution):
    """A number whose density rises from the lower bound to the mode, and falls to the upper bound.

    Raises
    ------
    InputError
        If a number is not finite, the lower bound is not below the upper, or the mode is outside.
    """

    lower: float
    mode: float
    upper: float

    @property
    def frozen(self) -> FrozenDistribution:
        width = self.upper - self.lower
        return of_scipy("triang")((self.mode - self.lower) / width, self.lower, width)

    @property
    def kinks(self) -> list[float]:
        place = float(ndtri((self.mode - self.lower) / (self.upper - self.lower)))
        return [place] if np.isfinite(place) else []

    def check(self) -> None:
        """Raise `InputError` if the mode is not between the bounds."""
        _check_bounds(self, self.lower, self.upper)
        if not self.lower <= self.mode <= self.upper:
            raise InputError(
                f"Triangular mode must be from lower {self.lower:g} to upper {self.upper:g}; "
                f"got {self.mode:g}"
            )


@frozen(repr=False)
class Beta(Moments):
    """A number between two bounds with a beta distribution.

    Its density is proportional to (x − lower)^(alpha − 1) (upper − x)^(beta − 1).

    Parameters
    ----------
    alpha, beta : the shapes.
    lower, upper : the bounds.
    mean, std : mean and standard deviation, instead of the shapes.
    cv : coefficient of variation, the standard deviation over |mean|, instead of `std`.

    Raises
    ------
    InputError
        If a number is not finite, the lower bound is not below the upper, or a shape is not
        positive, or so small that nearly all values are the bounds; if moments are not those of
        such a distribution, or if parameters are missing or given twice.
    """

    alpha: float | None = None
    beta: float | None = None
    lower: float = 0.0
    upper: float = 1.0

    parameter_names = ("alpha", "beta")

    @property
    def frozen(self) -> FrozenDistribution:
        return of_scipy("beta")(*self.parameters, self.lower, self.upper - self.lower)

    def of_moments(self, mean: Numbers, std: Numbers) -> tuple[Numbers, Numbers]:
        """Return the shapes m s and (1 − m) s, with m (1 − m)/(1 + s) the variance on (0, 1)."""
        width = self.upper - self.lower
        m = (mean - self.lower) / width
        complement = (self.upper - mean) / width
        total = m * complement / (std / width) ** 2 - 1
        return m * total, complement * total

    def check_moments(self, mean: float, std: float) -> None:
        """Raise `InputError` if the mean is not between the bounds, or the spread too large."""
        _check_bounds(self, self.lower, self.upper)
        if not self.lower < mean < self.upper:
            raise InputError(
                f"Beta mean must be above lower {self.lower:g} and below upper {self.upper:g}; "
                f"got {mean:g}"
            )
        below = mean - self.lower
        above = self.upper - mean
        width = self.upper - self.lower
        smallest_std = width / LARGEST_SHAPE**0.5
        largest_std = np.sqrt(below * above / (1 + MIN_SHAPE * width / min(below, above)))
        if not smallest_std < std < largest_std:
            raise InputError(
                f"Beta std must be above {smallest_std:.3g} and below {largest_std:.4g} for the "
                f"mean {mean:g} between {self.lower:g} and {self.upper:g}; got {std:g}"
            )

    def check(self) -> None:
        """Raise `InputError` if a shape is too small, or there is nothing between the bounds."""
        super().check()
        _check_bounds(self, self.lower, self.upper)
        for name, shape in zip(self.parameter_names, self.parameters, strict=True):
            if shape < MIN_SHAPE:
                raise InputError(f"Beta {name} must be {MIN_SHAPE:g} or more; got {shape:g}")


def _check_bounds(distribution: Distribution, lower: float, upper: float) -> None:
    name = type(distribution).__name__
    if lower >= upper:
        also = f". {NO_SCATTER}" if lower == upper else ""
        raise InputError(f"{name} lower {lower:g} must be below upper {upper:g}{also}")
    check_spread(f"width of the {name}", upper - lower, upper)
