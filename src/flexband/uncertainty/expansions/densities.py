"""The family of polynomials that are orthogonal with respect to the density of a distribution."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar, Protocol

import numpy as np

from flexband.uncertainty.expansions.recurrence import (
    Recurrence,
    gauss,
    nested_points,
    orthonormal,
    stieltjes,
)


class Density(Protocol):
    """A distribution of a number x."""

    @property
    def name(self) -> str:
        """Its name."""
        ...

    @property
    def has_finite_bounds(self) -> bool:
        """Whether all its values are between finite bounds."""
        ...

    def at_normal(self, z: np.ndarray) -> np.ndarray:
        """Return the increasing function of a standard normal z that is distributed so."""
        ...

    def rule(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return points and weights for expectations of polynomials up to the degree 2 count."""
        ...


@dataclass(frozen=True)
class DensityPolynomials:
    """The polynomials of a density in (x − mean)/std, |P_j| > 1 with probability 7·10⁻⁶."""

    density: Density

    usual_normal: ClassVar[float] = 4.5
    """Values of a standard normal variable between which nested points are, and up to which
    polynomials are at most one: all but 7·10⁻⁶ of the values."""

    block: ClassVar[int] = 64
    """Orders are computed in multiples of this; nested points are weighted by that many
    polynomials."""

    max_order: ClassVar[int] = 20
    """Of an adaptive method."""

    max_condition: ClassVar[float] = 1000.0
    """Largest condition number of the orthonormal polynomials at the nested points of an order.
    That of normal variables is 130 at order 8."""

    _recurrences: dict[int, Recurrence] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    @property
    def name(self) -> str:
        return self.density.name

    @property
    def has_finite_bounds(self) -> bool:
        return self.density.has_finite_bounds

    @property
    def last_order(self) -> float:
        return math.inf

    @cached_property
    def scale(self) -> tuple[float, float]:
        """Mean and standard deviation of x."""
        x, w = self._rule
        mean = float(w @ x)
        size = float(np.abs(x - mean).max())  # squares of tiny and huge numbers are none
        return mean, size * float(np.sqrt(w @ ((x - mean) / size) ** 2))

    @cached_property
    def _rule(self) -> tuple[np.ndarray, np.ndarray]:
        return self.density.rule(self.block)

    def _usual(self, count: int) -> np.ndarray:
        """Return values of ξ between which all but few are, 8 `count` steps apart."""
        return self.of_normal(np.linspace(-self.usual_normal, self.usual_normal, 8 * count + 1))

    def standardize(self, x: np.ndarray) -> np.ndarray:
        """Return ξ of x: x less its mean, in standard deviations."""
        mean, std = self.scale
        return (x - mean) / std

    def of_normal(self, x: np.ndarray) -> np.ndarray:
        return self.standardize(self.density.at_normal(x))

    def values(self, order: int, x: np.ndarray) -> np.ndarray:
        recurrence = self._recurrence(order)
        return orthonormal(recurrence, order, x) / recurrence.sizes[: order + 1]

    def norms(self, order: int) -> np.ndarray:
        return 1 / self._recurrence(order).sizes[: order + 1] ** 2

    def gauss(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        return gauss(self._recurrence(count), count)

    def sequence(self, count: int) -> np.ndarray:
        return self._sequence[:count]

    @property
    def highest(self) -> int:
        """The highest even order whose nested points and those of all lower ones are stable."""
        return self._highest

    @cached_property
    def _highest(self) -> int:
        recurrence = self._recurrence(self.max_order)
        x = self._sequence
        for order in range(2, self.max_order + 1, 2):
            values = orthonormal(recurrence, order, x[: order + 1])
            if np.linalg.cond(values) > self.max_condition:
                return max(2, order - 2)
        return self.max_order

    @cached_property
    def _sequence(self) -> np.ndarray:
        usual = self._usual(self.block)
        return nested_points(
            self._recurrence(self.block - 1), usual[[0, -1]], usual, self.max_order + 1
        )

    def _recurrence(self, order: int) -> Recurrence:
        """Return the recurrence up to this order or a higher one, a multiple of `block`."""
        count = self.block * (1 + order // self.block)
        if count not in self._recurrences:
            x, w = self._rule if count == self.block else self.density.rule(count)
            recurrence = Recurrence(*stieltjes(self.standardize(x), w, count), np.zeros(0))
            lower = order - self.block
            before = self._recurrence(lower).sizes if lower >= 0 else np.zeros(0)
            values = orthonormal(recurrence, count - 1, self._usual(count))
            sizes = np.abs(values[:, len(before) :]).max(axis=0)
            self._recurrences[count] = recurrence._replace(sizes=np.append(before, sizes))
        return self._recurrences[count]
