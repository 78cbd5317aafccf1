"""The normal and the uniform distribution."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from flexband.errors import InputError, plausible_spread, positive
from flexband.uncertainty.expansions.families import LEGENDRE
from flexband.uncertainty.inputs.distribution import Distribution
from flexband.uncertainty.inputs.inputs import between, place_between


@dataclass(frozen=True)
class Normal(Distribution):
    """A normally distributed number.

    Raises
    ------
    InputError
        If a number is not finite or the standard deviation is not positive.
    """

    mean: float
    std: float

    @property
    def frozen(self) -> Any:
        """The distribution of SciPy."""
        from scipy import stats  # noqa: PLC0415

        return stats.norm(self.mean, self.std)

    def check(self) -> None:
        """Raise `InputError` if the standard deviation is not positive."""
        positive("Normal std", self.std)
        plausible_spread("Normal std", self.std, self.mean)

    def value(self, standard: np.ndarray) -> np.ndarray:
        """Return mean + std ξ."""
        return self.mean + self.std * standard[:, 0]

    def standard(self, value: np.ndarray) -> np.ndarray:
        """Return ξ of values."""
        return (value - self.mean) / self.std


@dataclass(frozen=True)
class Uniform(Distribution):
    """A uniformly distributed number.

    Raises
    ------
    InputError
        If a bound is not finite or the lower bound is not below the upper.
    """

    lower: float
    upper: float

    family = LEGENDRE

    @property
    def frozen(self) -> Any:
        """The distribution of SciPy."""
        from scipy import stats  # noqa: PLC0415

        return stats.uniform(self.lower, self.upper - self.lower)

    def check(self) -> None:
        """Raise `InputError` if there is no number between the bounds."""
        if self.lower >= self.upper:
            raise InputError(f"Uniform lower {self.lower:g} must be below upper {self.upper:g}")
        plausible_spread("width of the Uniform", self.upper - self.lower, self.upper)

    def value(self, standard: np.ndarray) -> np.ndarray:
        """Return midpoint + radius ξ; exactly the bounds at ξ = −1 and 1."""
        return between(self.lower, self.upper, standard[:, 0])

    def standard(self, value: np.ndarray) -> np.ndarray:
        """Return ξ of values, within rounding of the bounds."""
        return place_between(self.lower, self.upper, value)
