"""Expansions whose coefficients are linear in runs, and are formed only where they are needed.

Coefficients take as much memory as the runs. While fits are compared, only few of them are needed
at a time; in the end they take the place of the runs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.expansions.hybrid import HybridExpansion


@dataclass(frozen=True)
class Interpolation:
    """The hybrid expansion through runs, Eq. (11), with the coefficients β = inverse · values."""

    families: tuple[Family, ...]
    index: np.ndarray
    inverse: np.ndarray  # of the expansion through one run each, shape (terms, runs)
    values: np.ndarray  # of the runs, which are not copied, shape (runs, rows, times)
    rows: np.ndarray  # the numbers of those that are expanded
    discs: tuple[int, ...] = ()

    @cached_property
    def polynomials(self) -> HybridExpansion:
        """The expansion of no series, which has the polynomials only."""
        nothing = np.zeros((len(self.index), 0))
        return HybridExpansion(self.families, self.index, nothing, self.discs)

    @property
    def orders(self) -> tuple[int, ...]:
        """The highest order in each variable, η first."""
        return self.polynomials.orders

    @property
    def random_orders(self) -> tuple[int, ...]:
        """The highest order of every random variable."""
        return self.polynomials.random_orders

    def evaluate(self, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """Return its series at points of shape (points, n) and (points, m)."""
        return self._combine_runs(self.polynomials.terms(xi, eta) @ self.inverse)

    def of_rows(self, rows: int, which: np.ndarray, times: slice | np.ndarray) -> Interpolation:
        del rows
        return replace(self, values=self.values[..., times], rows=self.rows[which])

    def to_hybrid(self) -> HybridExpansion:
        """Return the expansion with the coefficients of its polynomials."""
        return replace(self.polynomials, coefficients=self._combine_runs(self.inverse))

    def _combine_runs(self, factors: np.ndarray) -> np.ndarray:
        """Return linear combinations of the runs, shape (combinations, rows × times)."""
        if len(self.rows) == self.values.shape[1]:
            return factors @ self.values.reshape(len(self.values), -1)
        sums = np.empty((len(factors), len(self.rows), self.values.shape[2]))
        for k, row in enumerate(self.rows):
            sums[:, k] = factors @ self.values[:, row]
        return sums.reshape(len(sums), -1)


def in_place(parts: Sequence[Interpolation]) -> HybridExpansion:
    """Return one expansion of the rows of all parts, whose coefficients take the place of the runs.

    Parts begin with the same runs and terms; further terms become zero.
    """
    longest = max(parts, key=lambda part: len(part.index))
    values = longest.values
    for part in parts:
        terms = len(part.index)
        for row in part.rows:
            values[:terms, row] = part.inverse @ part.values[:, row]
            values[terms:, row] = 0.0
    expansion = replace(longest.polynomials, coefficients=values.reshape(len(values), -1))
    rows = np.sort(np.concatenate([part.rows for part in parts]))
    return expansion.of_rows(values.shape[1], rows, slice(None))
