"""Uncertain inputs: what is known of a parameter.

Every input is a function of standard variables: ξ ~ N(0, 1) of random inputs, η ∈ [−1, 1] of
interval inputs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from scipy.special import ndtr, ndtri

from flexband.errors import InputError, numbers, positive, whole
from flexband.uncertainty.inputs.correlation import squared_exponential
from flexband.uncertainty.inputs.fields import Correlation, Eole

FunctionOfPosition = Callable[[np.ndarray], np.ndarray]


class Input(Protocol):
    """What a method asks of an input."""

    @property
    def random(self) -> bool:
        """Whether the standard variables are ξ rather than η."""
        ...

    @property
    def dimension(self) -> int:
        """Number of standard variables."""
        ...

    def value(self, standard: np.ndarray) -> np.ndarray | FunctionOfPosition:
        """Return the input for standard variables of shape (n, dimension): shape (n,)."""
        ...

    def standard(self, value: np.ndarray) -> np.ndarray:
        """Return the standard variables, shape (n, dimension), of values of shape (n,) or ()."""
        ...


def _column(value: np.ndarray) -> np.ndarray:
    """Return values of shape (n,) or () as shape (n, 1).

    Raises
    ------
    InputError
        Where the shape is another.
    """
    if value.ndim > 1:
        raise InputError(f"values must have shape (n,); got {value.shape}")
    return value.reshape(-1, 1)


@dataclass(frozen=True)
class Interval:
    """A number known only to lie between two bounds.

    Raises
    ------
    InputError
        Where a bound is not finite or the lower is above the upper.
    """

    lower: float
    upper: float

    random = False
    dimension = 1

    def __post_init__(self) -> None:
        lower, upper = numbers("Interval lower", self.lower), numbers("Interval upper", self.upper)
        if lower > upper:
            raise InputError(f"Interval lower {lower:g} must not be above upper {upper:g}")

    def value(self, standard: np.ndarray) -> np.ndarray:
        """Return midpoint + radius η; exactly the bounds at η = −1 and 1."""
        eta = standard[:, 0]
        return 0.5 * ((1 - eta) * self.lower + (1 + eta) * self.upper)

    def standard(self, value: np.ndarray) -> np.ndarray:
        """Return η of values of shape (n,) or (), shape (n, 1); 0 where the bounds are one.

        Raises
        ------
        InputError
            Where a value is outside the bounds by more than rounding.
        """
        middle, radius = (self.lower + self.upper) / 2, (self.upper - self.lower) / 2
        eta = (_column(value) - middle) / (radius or 1.0)
        if np.any(np.abs(eta) > 1 + 1e-9):
            worst = _column(value).ravel()[np.abs(eta).argmax()]
            raise InputError(
                f"values must be between {self.lower:g} and {self.upper:g}; got {worst:g}"
            )
        return np.clip(eta, -1.0, 1.0)


@dataclass(frozen=True)
class Normal:
    """A normally distributed number.

    Raises
    ------
    InputError
        Where a number is not finite or the standard deviation is not positive.
    """

    mean: float
    std: float

    random = True
    dimension = 1

    def __post_init__(self) -> None:
        numbers("Normal mean", self.mean)
        positive("Normal std", numbers("Normal std", self.std))

    def value(self, standard: np.ndarray) -> np.ndarray:
        """Return mean + std ξ."""
        return self.mean + self.std * standard[:, 0]

    def standard(self, value: np.ndarray) -> np.ndarray:
        """Return ξ of values of shape (n,) or (), shape (n, 1)."""
        return (_column(value) - self.mean) / self.std


@dataclass(frozen=True)
class Uniform:
    """A number distributed evenly between two bounds, as a function of a normal variable.

    Raises
    ------
    InputError
        Where a bound is not finite or the lower is not below the upper.
    """

    lower: float
    upper: float

    random = True
    dimension = 1

    def __post_init__(self) -> None:
        lower, upper = numbers("Uniform lower", self.lower), numbers("Uniform upper", self.upper)
        if lower >= upper:
            raise InputError(f"Uniform lower {lower:g} must be below upper {upper:g}")

    def value(self, standard: np.ndarray) -> np.ndarray:
        """Return lower + (upper − lower) P(ξ), P being the normal distribution function."""
        return self.lower + (self.upper - self.lower) * ndtr(standard[:, 0])

    def standard(self, value: np.ndarray) -> np.ndarray:
        """Return ξ of values of shape (n,) or (), shape (n, 1).

        Raises
        ------
        InputError
            Where a value is not between the bounds.
        """
        part = (_column(value) - self.lower) / (self.upper - self.lower)
        if np.any((part <= 0) | (part >= 1)):
            raise InputError(
                f"values must be between {self.lower:g} and {self.upper:g}, these not included"
            )
        return ndtri(part)


@dataclass(frozen=True)
class RandomField:
    """A homogeneous Gaussian random field along a line, discretized by EOLE.

    Parameters
    ----------
    mean, std : mean and standard deviation at every position.
    correlation_length : a of Eq. (30) [m].
    domain : positions (start, end) [m] on which the field is used. Where None, `propagate` finds
        it by runs at the means and at the ends of the intervals, in which it notes the positions
        asked for.
    terms : number of terms, each with one standard variable; where None, as few as `tolerance`
        allows.
    tolerance : largest variance error, as a part of the variance.
    correlation : function of distance over correlation length.
    nodes : number of equidistant EOLE nodes on the domain; where None, eight a correlation length
        and at least 21.

    Raises
    ------
    InputError
        Where a number is out of its range or the expansion is not possible.
    """

    mean: float
    std: float
    correlation_length: float
    domain: tuple[float, float] | None = None
    terms: int | None = None
    tolerance: float = 0.05
    correlation: Correlation = field(default=squared_exponential)
    nodes: int | None = None

    random = True

    def __post_init__(self) -> None:
        numbers("RandomField mean", self.mean)
        for name in ("std", "correlation_length", "tolerance"):
            label = f"RandomField {name}"
            positive(label, numbers(label, getattr(self, name)))
        if self.terms is not None:
            whole("RandomField terms", self.terms, 1)
        if self.nodes is not None:
            whole("RandomField nodes", self.nodes, 2)
        if self.domain is not None:
            start, end = numbers("RandomField domain [m]", self.domain, 2)
            if start >= end:
                raise InputError(f"RandomField domain must run upwards; got {self.domain}")

    def on(self, domain: tuple[float, float]) -> RandomField:
        """Return the same field on a domain [m]."""
        return replace(self, domain=domain)

    @cached_property
    def expansion(self) -> Eole:
        """The EOLE expansion of the standardized field.

        Raises
        ------
        InputError
            Where the field has no domain.
        """
        if self.domain is None:
            raise InputError("RandomField domain must be given here; got None")
        start, end = self.domain
        count = self.nodes or max(21, int(np.ceil(8 * (end - start) / self.correlation_length)) + 1)
        points = np.linspace(start, end, count)
        return Eole.on(
            points, self.correlation, self.correlation_length, self.terms, self.tolerance
        )

    @property
    def dimension(self) -> int:
        """Number of standard variables, one a term."""
        return self.expansion.terms

    def variance_error(self, x: np.ndarray) -> np.ndarray:
        """Return the variance the expansion lacks at positions x [m], Eq. (31), over σ²."""
        return self.expansion.variance_error(x)

    def largest_variance_error(self) -> float:
        """Return the largest variance error on the domain, on 1001 positions."""
        start, end = self.expansion.nodes[[0, -1]]
        return float(self.variance_error(np.linspace(start, end, 1001)).max())

    def standard(self, value: np.ndarray) -> np.ndarray:
        """Return `value`: a field is given by its standard variables, shape (n, terms).

        Raises
        ------
        InputError
            Where the shape is another.
        """
        if value.ndim != 2 or value.shape[1] != self.dimension:
            raise InputError(
                f"a RandomField is given by standard variables of shape (n, {self.dimension}); "
                f"got shape {value.shape}"
            )
        return value

    def value(self, standard: np.ndarray) -> FunctionOfPosition:
        """Return the samples as a function of position, Eq. (29).

        It takes positions of shape (points,) or (n, points) and returns shape (n, points); it
        raises `InputError` for positions outside the domain.
        """
        start, end = self.expansion.nodes[[0, -1]]
        slack = 1e-9 * (end - start)

        def samples(x: np.ndarray) -> np.ndarray:
            outside = (np.asarray(x) < start - slack) | (np.asarray(x) > end + slack)
            if np.any(outside):
                raise InputError(
                    f"RandomField is asked for at {np.asarray(x)[outside][0]:g} m, outside its "
                    f"domain ({start:g}, {end:g}) m; give a larger domain"
                )
            basis = self.expansion.basis(np.atleast_2d(x))
            return self.mean + self.std * np.einsum("nt,tnp->np", standard, basis)

        return samples
