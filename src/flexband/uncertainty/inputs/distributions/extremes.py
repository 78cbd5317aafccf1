"""Extreme values: strengths and lifetimes (Weibull), largest loads (Gumbel)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from flexband.errors import InputError, plausible_spread, positive
from flexband.uncertainty.inputs.distribution import Distribution, Spread

LEAST_SHAPE, LARGEST_SHAPE = 0.2, 1e4
"""Of a Weibull distribution."""


@dataclass(frozen=True, repr=False)
class Weibull(Distribution):
    """A number with a Weibull distribution: P(x > X) = exp(−((X − location)/scale)^shape).

    Parameters
    ----------
    scale : 63.2 % of the values are below location + scale.
    shape : the Weibull modulus.
    location : the least possible value.

    Raises
    ------
    InputError
        If scale or shape is not positive, or the shape is below 0.2, where moments are those of
        values that hardly ever occur.
    """

    scale: float
    shape: float
    location: float = 0.0

    @property
    def frozen(self) -> Any:
        """The distribution of SciPy."""
        from scipy import stats  # noqa: PLC0415

        return stats.weibull_min(self.shape, self.location, self.scale)

    def check(self) -> None:
        """Raise `InputError` if scale or shape is not positive."""
        positive("Weibull scale", self.scale)
        shape = float(positive("Weibull shape", self.shape))
        if not LEAST_SHAPE <= shape <= LARGEST_SHAPE:
            raise InputError(
                f"Weibull shape must be between {LEAST_SHAPE:g} and {LARGEST_SHAPE:g}; "
                f"got {shape:g}"
            )
        plausible_spread("Weibull scale", self.scale, self.location)


@dataclass(frozen=True, repr=False)
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
    def frozen(self) -> Any:
        """The distribution of SciPy."""
        from scipy import stats  # noqa: PLC0415

        scale = self.spread * np.sqrt(6) / np.pi
        return stats.gumbel_r(self.mean - np.euler_gamma * scale, scale)
