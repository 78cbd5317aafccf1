"""The family of polynomials of a variable that has finitely many values."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import ndtr

from flexband.uncertainty.expansions.recurrence import Recurrence, orthonormal, stieltjes


@dataclass(frozen=True)
class DiscretePolynomials:
    """P_j with |P_j| ≤ 1 that are orthogonal with respect to the probabilities of some values.

    K values have K polynomials, which make every function of the variable: an expansion of order
    K − 1 is exact. Between the values a polynomial is that of the nearest one.
    """

    points: tuple[float, ...]  # increasing, 0 among them, one apart at most
    probabilities: tuple[float, ...]

    name = "discrete"
    has_finite_bounds = True

    @property
    def last_order(self) -> int:
        return len(self.points) - 1

    @property
    def highest(self) -> int:
        return self.last_order

    @cached_property
    def _x(self) -> np.ndarray:
        return np.array(self.points)

    @cached_property
    def _recurrence(self) -> Recurrence:
        count = len(self.points)
        recurrence = Recurrence(
            *stieltjes(self._x, np.array(self.probabilities), count), np.zeros(0)
        )
        sizes = np.abs(orthonormal(recurrence, count - 1, self._x)).max(axis=0)
        return recurrence._replace(sizes=sizes)

    def nearest(self, x: np.ndarray) -> np.ndarray:
        """Return the number of the value that is nearest to each x."""
        midpoints = (self._x[1:] + self._x[:-1]) / 2
        return np.searchsorted(midpoints, x)

    def values(self, order: int, x: np.ndarray) -> np.ndarray:
        values = np.zeros((*np.shape(x), order + 1))
        highest_order = min(order, self.last_order)
        nearest = self._x[self.nearest(x)]
        values[..., : highest_order + 1] = (
            orthonormal(self._recurrence, highest_order, nearest)
            / self._recurrence.sizes[: highest_order + 1]
        )
        return values

    def norms(self, order: int) -> np.ndarray:
        norms = np.ones(order + 1)
        count = min(order, self.last_order) + 1
        norms[:count] = 1 / self._recurrence.sizes[:count] ** 2
        return norms

    def gauss(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return all values and their probabilities, or with a count of 1 the value 0."""
        if count == 1:
            return self.sequence(1), np.ones(1)
        return self._x, np.array(self.probabilities)

    def sequence(self, count: int) -> np.ndarray:
        middle = self.nearest(np.zeros(1))[0]
        others = np.argsort(-np.array(self.probabilities), kind="stable")
        return self._x[[middle, *others[others != middle]]][:count]

    def of_normal(self, x: np.ndarray) -> np.ndarray:
        ends = np.cumsum(self.probabilities)[:-1]
        return self._x[np.searchsorted(ends, ndtr(x), side="right")]
