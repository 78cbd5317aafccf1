"""Numbers between two bounds: uniform, triangular and beta distributions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import ndtri

from flexband.errors import InputError, plausible_spread, positive
from flexband.uncertainty.expansions.families import LEGENDRE, Family
from flexband.uncertainty.inputs.distribution import Distribution
from flexband.uncertainty.inputs.inputs import between, place_between

LEAST_SHAPE = 0.02
"""Of a beta distribution; below it, nearly all values are the bounds."""


@dataclass(frozen=True, repr=False)
class Uniform(Distribution):
    """A uniformly distributed number.

    Raises
    ------
    InputError
        If a bound is not finite or the lower bound is not below the upper.
    """

    lower: float
    upper: float

    @property
    def frozen(self) -> Any:
        """The distribution of SciPy."""
        from scipy import stats  # noqa: PLC0415

        return stats.uniform(self.lower, self.upper - self.lower)

    @property
    def family(self) -> Family:
        """Legendre polynomials."""
        return LEGENDRE

    def check(self) -> None:
        """Raise `InputError` if there is no number between the bounds."""
        _check_bounds(self, self.lower, self.upper)

    def value(self, standard: np.ndarray) -> np.ndarray:
        """Return midpoint + radius ξ; exactly the bounds at ξ = −1 and 1."""
        return between(self.lower, self.upper, standard[:, 0])

    def standard(self, value: np.ndarray) -> np.ndarray:
        """Return ξ of values, within rounding of the bounds."""
        return place_between(self.lower, self.upper, value)


@dataclass(frozen=True, repr=False)
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
    def frozen(self) -> Any:
        """The distribution of SciPy."""
        from scipy import stats  # noqa: PLC0415

        width = self.upper - self.lower
        return stats.triang((self.mode - self.lower) / width, self.lower, width)

    @property
    def kinks(self) -> list[float]:
        """The mode."""
        place = float(ndtri((self.mode - self.lower) / (self.upper - self.lower)))
        return [place] if np.isfinite(place) else []

    def check(self) -> None:
        """Raise `InputError` if the mode is not between the bounds."""
        _check_bounds(self, self.lower, self.upper)
        if not self.lower <= self.mode <= self.upper:
            raise InputError(
                f"Triangular mode must be between lower {self.lower:g} and upper {self.upper:g}; "
                f"got {self.mode:g}"
            )


@dataclass(frozen=True, repr=False)
class Beta(Distribution):
    """A number between two bounds with a beta distribution.

    Its density is proportional to (x − lower)^(alpha − 1) (upper − x)^(beta − 1).

    Raises
    ------
    InputError
        If a number is not finite, the lower bound is not below the upper, or a shape is not
        positive, or so small that nearly all values are the bounds.
    """

    alpha: float
    beta: float
    lower: float = 0.0
    upper: float = 1.0

    @property
    def frozen(self) -> Any:
        """The distribution of SciPy."""
        from scipy import stats  # noqa: PLC0415

        return stats.beta(self.alpha, self.beta, self.lower, self.upper - self.lower)

    def check(self) -> None:
        """Raise `InputError` if a shape is too small, or there is nothing between the bounds."""
        _check_bounds(self, self.lower, self.upper)
        for name in ("alpha", "beta"):
            shape = float(positive(f"Beta {name}", getattr(self, name)))
            if shape < LEAST_SHAPE:
                raise InputError(f"Beta {name} must be {LEAST_SHAPE:g} or more; got {shape:g}")


def _check_bounds(one: Distribution, lower: float, upper: float) -> None:
    """Raise `InputError` if there is no number between two bounds."""
    name = type(one).__name__
    if lower >= upper:
        raise InputError(f"{name} lower {lower:g} must be below upper {upper:g}")
    plausible_spread(f"width of the {name}", upper - lower, upper)
