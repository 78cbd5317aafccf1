"""The terms of the parts of a phase expansion, and the moments of the response at given η."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from flexband.uncertainty.expansions.families import HERMITE, Family
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.phases.filon import Grid, by_axes
from flexband.uncertainty.phases.layout import MomentColumns, PartColumns, turning_parts
from flexband.uncertainty.phases.moments import Sections, by_points, without_turning
from flexband.uncertainty.phases.options import MOMENTS
from flexband.uncertainty.phases.rules import Rule, resolving_rule, saddle_rule, sobol_normal
from flexband.uncertainty.phases.saddles import by_saddles


@dataclass(frozen=True)
class PartTerms:
    """The terms of the parts, time by time."""

    expansion: HybridExpansion  # of the parts
    columns: PartColumns  # of the parts
    coefficients: np.ndarray  # shape (times, terms, parts)

    @staticmethod
    def of(expansion: HybridExpansion, columns: PartColumns) -> PartTerms:
        parts = expansion.coefficients.reshape(len(expansion.index), columns.width, -1)
        coefficients = np.ascontiguousarray(np.moveaxis(parts, 2, 0))
        return PartTerms(expansion, columns, coefficients)

    @property
    def interval_dimension(self) -> int:
        """Number m of variables η."""
        return self.expansion.interval_dimension

    @property
    def random_orders(self) -> np.ndarray:
        """Orders of the terms in each ξ, shape (terms, n)."""
        return self.expansion.index[:, self.interval_dimension :]

    @property
    def normal(self) -> np.ndarray:
        """Which ξ are normal, shape (n,)."""
        return np.array([family == HERMITE for family in self.expansion.families], dtype=bool)

    @property
    def turning(self) -> np.ndarray:
        """The turning parts of σ²."""
        return turning_parts(self.columns.carriers)

    @property
    def phases(self) -> np.ndarray:
        """The coefficients of the phases, shape (times, terms, carriers)."""
        return self.coefficients[:, :, self.columns.phases]

    @property
    def orders(self) -> np.ndarray:
        """The highest order in each variable, η first."""
        return self.expansion.index.max(axis=0)

    @property
    def moments(self) -> MomentColumns:
        """The columns of the table of smooth moments."""
        return MomentColumns.of(self.columns.outputs, self.columns.carriers)

    def blocks(self) -> list[tuple[slice, PartTerms]]:
        """Return slices that divide the times into blocks, and the terms of each."""
        times = len(self.coefficients)
        count = max(1, min(MOMENTS.max_blocks, times // MOMENTS.min_block_times))
        ends = [times * k // count for k in range(count + 1)]
        blocks = itertools.starmap(slice, itertools.pairwise(ends))
        return [(block, replace(self, coefficients=self.coefficients[block])) for block in blocks]

    def reach(self, which: np.ndarray | None = None) -> np.ndarray:
        """Return how far the terms `which`, (…, terms), move a phase at most [rad].

        By default these are the terms of each variable.
        """
        which = self.expansion.index.T > 0 if which is None else which
        moved = np.einsum("vk,tkc->vtc", which.astype(float), np.abs(self.phases))
        return moved.max(axis=(1, 2), initial=0.0)

    def turns(self) -> np.ndarray:
        """Return how far each ξ moves a phase at most [rad], for `resolving_rule`, shape (n,).

        Where ξ is not normal, P_j counts j times, since it bends more the higher its order, and
        products with normal variables where these are `slope_range`.
        """
        beyond = MOMENTS.slope_range ** self.random_orders[:, self.normal].sum(axis=1)
        reach = self.reach()[self.interval_dimension :]
        return np.where(self.normal, reach, self.reach(self.random_orders.T * beyond))

    def slope(self) -> np.ndarray:
        """Return ∂φ/∂ξ at ξ = η = 0, shape (times, carriers, n)."""
        first = (self.expansion.index.sum(axis=1) == 1)[:, None] * self.random_orders
        return np.einsum("kv,tkc->tcv", first, self.phases)

    @cached_property
    def saturated(self) -> bool:
        """Whether all averages of turning parts over ξ vanish, at all η and times.

        Those over normal variables do if the phase changes fast enough with them, whatever the
        values of the others. Those over uniform variables decrease too slowly.
        """
        order = self.random_orders[:, self.normal].sum(axis=1)
        nonlinear = self.expansion.index.sum(axis=1) > 1
        weight = nonlinear * order * MOMENTS.slope_range ** np.maximum(order - 1, 0)
        bend = np.einsum("k,tkc->tc", weight, np.abs(self.phases))
        slope = self.slope()[:, :, self.normal]
        for c, d, s in self.turning:
            turn_slope = slope[:, c] + s * slope[:, d] * (s != 0)
            most = bend[:, c] + bend[:, d] * (s != 0)
            if np.any(np.linalg.norm(turn_slope, axis=1) - most < MOMENTS.saturated):
                return False
        return True

    def over_random(self) -> tuple[tuple[Family, ...], np.ndarray, np.ndarray, np.ndarray]:
        """Return families, orders, phase changes and slopes over ξ, which rules are made for."""
        orders = self.orders[self.interval_dimension :]
        return self.expansion.families, orders, self.turns(), np.concatenate(self.slope())

    def table(self, eta: np.ndarray, rule: Rule | None = None) -> np.ndarray:
        """Return the smooth moments at η of shape (points, m), shape (times, points, width).

        The rule has points ξ and weights of expectations; by default it is the best that is
        affordable.
        """
        m, expansion = self.interval_dimension, self.expansion
        families, norms = expansion.families, expansion.norms
        table = np.empty((len(self.coefficients), len(eta), self.moments.width))
        phi = np.ascontiguousarray(expansion.chebyshev(eta))  # loops are compiled for one layout
        sections = Sections(self.coefficients, expansion.i, expansion.j, phi)
        index = np.ascontiguousarray(expansion.random_index)
        filled = self.columns, self.moments, self.turning, table
        if rule is None and self.saturated:
            without_turning(sections, norms, *filled)
            return table
        rule = rule or resolving_rule(*self.over_random())
        if rule is not None:
            xi, weights = rule
            psi = np.ascontiguousarray(expansion.orthogonal(xi).T)
            by_points(sections, psi, weights, *filled)
        elif self.normal.all():
            xi = sobol_normal(len(families), MOMENTS.samples)
            psi = np.ascontiguousarray(expansion.orthogonal(xi).T)
            by_saddles(sections, index, norms, *saddle_rule(len(families)), psi, *filled)
        else:
            grid = Grid.of(families, self.orders[m:], self.turns())
            psi = grid.values(index)
            by_axes(sections, index, norms, grid, psi, *filled)
        return table
