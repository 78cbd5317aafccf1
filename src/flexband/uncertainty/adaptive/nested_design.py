"""Sparse interpolation: one run a term, at points of nested sequences.

Further terms are those that are expected to add most, from how the terms so far decay, and those
that explain what check runs miss: of a term whose lower terms all vanish at the points so far,
as those of x³ do at 0 and ±√3, only check runs know.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np
from scipy.special import ndtr

from flexband.uncertainty.adaptive.fits import BATCH, Split
from flexband.uncertainty.adaptive.regression import MIN_RUNS, SampledDesign
from flexband.uncertainty.expansions.families import LEGENDRE, Family, existing_terms, mean_squares
from flexband.uncertainty.expansions.hybrid import HybridExpansion, map_in_place
from flexband.uncertainty.expansions.index_sets import (
    ROUNDING_DIGITS,
    Orders,
    TermSizes,
    above,
    first_terms,
    lower_terms,
)
from flexband.uncertainty.expansions.interpolation import Interpolation
from flexband.uncertainty.expansions.points.sequences import interval_sequence
from flexband.uncertainty.expansions.regression.sparse_fit import (
    SparseFitOptions,
    candidates,
    principal,
)
from flexband.uncertainty.phases.decomposition import Stage
from flexband.uncertainty.phases.layout import PartColumns


@dataclass(frozen=True)
class NestedDesign:
    """Terms and their runs, each at a point of nested sequences."""

    index: np.ndarray  # orders of the terms in each variable, η first, shape (terms, variables)
    families: Sequence[Family]  # the polynomials of each ξ
    discs: tuple[int, ...] = ()  # as of `HybridExpansion`

    sampled: ClassVar[bool] = False
    max_interval_order: ClassVar[int] = 20  # the highest order in an interval variable

    @staticmethod
    def first(
        m: int, families: Sequence[Family], budget: int, discs: tuple[int, ...] = ()
    ) -> NestedDesign:
        """Return the first terms in m variables η and in ξ, as far as the budget goes."""
        n = len(families)
        count = BATCH * -(-(1 + m + 2 * n) // BATCH)
        index = first_terms(m, n, min(count, budget))
        return NestedDesign(index[existing_terms(index, families)], families, discs)

    @property
    def interval_dimension(self) -> int:
        """Number m of variables η."""
        return self.index.shape[1] - len(self.families)

    @property
    def points(self) -> tuple[np.ndarray, np.ndarray]:
        """ξ and η, shapes (runs, n) and (runs, m)."""
        m = self.interval_dimension
        eta = interval_sequence(self.max_interval_order + 1)[self.index[:, :m]]
        random = zip(self.families, self.index[:, m:].T, strict=True)
        xi = [family.sequence(family.highest + 1)[k] for family, k in random]
        return np.reshape(xi, (-1, len(eta))).T.copy(), eta

    @property
    def highest(self) -> np.ndarray:
        """The highest order there may be in each variable, η first."""
        intervals = [self.max_interval_order] * self.interval_dimension
        return np.array([*intervals, *(family.highest for family in self.families)])

    @cached_property
    def matrix(self) -> np.ndarray:
        """The terms' values in the runs, shape (terms, terms)."""
        return self._values(self.index, *self.points)

    @cached_property
    def inverse(self) -> np.ndarray:
        """The coefficients of the terms of one run each, shape (terms, terms)."""
        return np.linalg.inv(self.matrix)

    @property
    def norms(self) -> np.ndarray:
        """√E[Ψ²] of the terms, shape (terms,)."""
        return np.sqrt(mean_squares(self.index[:, self.interval_dimension :], self.families))

    def __len__(self) -> int:
        return len(self.index)

    def fit(self, stage: Stage) -> HybridExpansion | Interpolation:
        """Return the expansion of the parts of runs at these points: it interpolates them."""
        if not stage.carriers:
            rows = np.arange(stage.base.shape[1])
            families = tuple(self.families)
            return Interpolation(families, self.index, self.inverse, stage.base, rows, self.discs)
        parts = PartColumns.of_stage(stage).pack(stage)  # a copy, since there are carriers
        columns = max(64, 2**18 // self.inverse.size)  # of products that are left to one thread
        parts = map_in_place(parts, self.inverse.__matmul__, columns)
        return HybridExpansion(tuple(self.families), self.index, parts)

    @property
    def few(self) -> int:
        """The number of runs that tell a linear function of all variables."""
        return min(len(self), 1 + self.index.shape[1])

    def small(self, series: np.ndarray) -> HybridExpansion:
        """Return the expansion of small series in the first few runs, shape (runs, series)."""
        first = replace(self, index=self.index[: len(series)])
        terms = first.inverse @ series
        return HybridExpansion(tuple(self.families), first.index, terms, self.discs)

    def extend(self, count: int, split: Split) -> NestedDesign:
        """Return the design with up to `count` further terms.

        Up to half of them explain what check runs miss, the others are expected to be large.
        """
        design_rows = slice(len(self))
        norms = self.norms[:, None, None]
        terms = norms * split.rows(lambda runs: self.inverse @ runs[design_rows])
        sizes = TermSizes(self.index, np.sqrt(np.mean(terms**2, axis=-1)).T)
        unforeseen = self._match_terms(split, count // 2)
        sizes.total(unforeseen)
        next_terms = sizes.next_terms(count - len(unforeseen), self.highest)
        return replace(self, index=np.concatenate([self.index, unforeseen, next_terms]))

    def weights(self, first: int) -> np.ndarray:
        """Return for what part of all inputs each run from number `first` on speaks.

        This is the probability of values that are nearer to its own than to those of other runs, in
        each variable in which it differs from the first run. Intervals are taken as uniform.
        """
        m = self.interval_dimension
        weights = np.ones(len(self) - first)
        for v, orders in enumerate(self.index[first:].T):
            count = 1 + self.index[:, v].max()
            family = self.families[v - m] if v >= m else LEGENDRE
            points = family.sequence(count) if v >= m else interval_sequence(count)
            weights *= np.where(orders > 0, _nearest(points, family)[orders], 1.0)
        return weights

    def _match_terms(self, split: Split, count: int) -> np.ndarray:
        """Select at most `count` terms that explain the residuals of check runs.

        Each of a further order is zero in the runs so far. They are taken by orthogonal matching,
        with the lower terms that they need, by how much they explain for each run.
        """
        # What the candidates add to values at held-out points, and what is missed there.
        present_terms = set(map(tuple, self.index.tolist()))
        index = self._candidates(present_terms)
        at_holdout = split.holdout.xi, split.holdout.eta
        predict = self._values(self.index, *at_holdout) @ self.inverse
        added = self._values(index, *at_holdout)
        added = added - predict @ self._values(index, *self.points)
        count_fitted = len(self)
        missed = split.rows(lambda runs: runs[count_fitted:] - predict @ runs[:count_fitted])
        rest = principal(missed.reshape(len(missed), -1).round(ROUNDING_DIGITS))
        min_gain = 1e-3 * np.sum(rest**2)  # this part of the energy need not be explained
        merit = SparseFitOptions().merit_per_order ** index.sum(axis=1)
        new_terms: list[Orders] = []
        missing_terms = [list(lower_terms(tuple(nu))) for nu in index.tolist()]
        # Add the candidate that gains most for each run, and project it out, until little is left.
        for _ in range(len(rest) // 2):
            missing_terms = [
                [mu for mu in terms if mu not in present_terms] for terms in missing_terms
            ]
            runs = np.array([len(terms) for terms in missing_terms], dtype=int)
            size = np.maximum(np.sum(added**2, axis=0), 1e-12)
            gain = np.sum((added.T @ rest) ** 2, axis=1) / size / np.maximum(runs, 1)
            gain[(runs == 0) | (runs > count - len(new_terms)) | (gain < min_gain)] = 0.0
            if not gain.any():
                break
            best = int(np.argmax((merit * gain / np.max(merit * gain)).round(ROUNDING_DIGITS)))
            new_terms += missing_terms[best]
            present_terms.update(missing_terms[best])
            q = added[:, best] / np.sqrt(size[best])
            rest = rest - np.outer(q, q @ rest)
            added = added - np.outer(q, q @ added)
        return np.array(new_terms, dtype=int).reshape(-1, self.index.shape[1])

    def _candidates(self, present_terms: set[Orders]) -> np.ndarray:
        """Return low orders and those next to the present ones, shape (terms, variables)."""
        low = map(tuple, candidates(self.index.shape[1]).tolist())
        index = np.array(sorted({*low, *above(present_terms)} - present_terms), dtype=int)
        index = index.reshape(-1, self.index.shape[1])
        return index[np.all(index <= self.highest, axis=1)]

    def _values(self, index: np.ndarray, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """Return terms at ξ and η, shape (points, terms)."""
        terms = HybridExpansion(tuple(self.families), index, np.zeros((len(index), 0)))
        return terms.terms(xi, eta)


def _nearest(points: np.ndarray, family: Family) -> np.ndarray:
    """Return the probability that each point is the nearest one to a variable of a family."""
    order = np.argsort(points)
    parts = np.empty(len(points))
    midpoints = (points[order][1:] + points[order][:-1]) / 2
    z = np.linspace(-8.0, 8.0, 4001)
    normals = np.interp(midpoints, family.of_normal(z), z)
    parts[order] = np.diff([0.0, *ndtr(normals), 1.0])
    return parts


def fewest_fitted(variables: int) -> int:
    """Return how many runs the smallest design has."""
    return min(1 + variables, MIN_RUNS)


def first_design(
    m: int,
    families: Sequence[Family],
    budget: int,
    max_interpolated: int,
    discs: tuple[int, ...] = (),
) -> NestedDesign | SampledDesign:
    """Return the first runs in m variables η and in ξ, within a budget."""
    many = 1 + m + 2 * len(families) > min(budget, max_interpolated)
    if many and budget >= MIN_RUNS:
        return SampledDesign(MIN_RUNS, m, families, discs)
    return NestedDesign.first(m, families, budget, discs)
