"""The terms of the parts of a phase expansion, and the moments of the response at given η."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np

from flexband.uncertainty.expansions.families import HERMITE
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.inputs.sampling import of_normals
from flexband.uncertainty.phases.integration.filon import Grid, by_axes
from flexband.uncertainty.phases.integration.rules import (
    PhaseChange,
    Rule,
    resolving_rule,
    saddle_rule,
    sobol_normal,
)
from flexband.uncertainty.phases.integration.saddles import by_saddles
from flexband.uncertainty.phases.layout import MomentColumns, PartColumns, turning_parts
from flexband.uncertainty.phases.moments import Sections, by_points, without_turning
from flexband.uncertainty.phases.phase_options import MOMENTS


@dataclass(frozen=True)
class PartTerms:
    """The terms of the parts, time by time."""

    expansion: HybridExpansion  # of the parts
    columns: PartColumns  # of the parts
    coefficients: np.ndarray  # shape (times, terms, parts)

    @staticmethod
    def from_expansion(expansion: HybridExpansion, columns: PartColumns) -> PartTerms:
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
    def phase_combinations(self) -> np.ndarray:
        """The combinations of phases that turn in σ², as rows of `turning_parts`."""
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
        return MomentColumns.from_outputs(self.columns.outputs, self.columns.carriers)

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

    def slopes(self) -> np.ndarray:
        """Return ∂φ/∂x, (values, n), where ξ is a function of a standard normal variable x.

        These are values at some times and η, at x along each axis and in some directions.
        """
        n = len(self.normal)
        m = self.interval_dimension
        step = 1e-4
        x = _far_normals(n)
        eta = corners(m)
        times = np.unique(np.linspace(0, len(self.phases) - 1, MOMENTS.max_slope_times).astype(int))
        expansion = self.expansion
        sections = expansion.chebyshev(eta)[:, expansion.i]  # (η, terms)
        phases = np.einsum("ek,tkc->ketc", sections, self.phases[times]).reshape(
            len(self.phases[0]), -1
        )
        slopes = np.zeros((len(x), phases.shape[1], n))
        for v, shift in enumerate(step * np.eye(n)):
            ends = [
                expansion.orthogonal(of_normals(x + s * shift, expansion.families)) for s in (1, -1)
            ]
            slopes[:, :, v] = ((ends[0] - ends[1]) / (2 * step))[:, expansion.j] @ phases
        return slopes.reshape(len(x) * phases.shape[1], n)

    def slope(self) -> np.ndarray:
        """Return ∂φ/∂ξ at ξ = η = 0, shape (times, carriers, n)."""
        first = (self.expansion.index.sum(axis=1) == 1)[:, None] * self.random_orders
        return np.einsum("kv,tkc->tcv", first, self.phases)

    @cached_property
    def averages_vanish(self) -> bool:
        """Whether all averages over ξ of parts that turn vanish, at all η and times.

        Those over normal variables do if the phase changes fast enough with them, whatever the
        values of the others. Those over uniform variables decrease too slowly.
        """
        order = self.random_orders[:, self.normal].sum(axis=1)
        nonlinear = self.expansion.index.sum(axis=1) > 1
        weight = nonlinear * order * MOMENTS.slope_range ** np.maximum(order - 1, 0)
        bend = np.einsum("k,tkc->tc", weight, np.abs(self.phases))
        slope = self.slope()[:, :, self.normal]
        for c, d, s in self.phase_combinations:
            turn_slope = slope[:, c] + s * slope[:, d] * (s != 0)
            max_bend = bend[:, c] + bend[:, d] * (s != 0)
            if np.any(np.linalg.norm(turn_slope, axis=1) - max_bend < MOMENTS.saturated):
                return False
        return True

    @cached_property
    def over_random(self) -> PhaseChange:
        """What phases do over ξ, of which rules are made."""
        orders = self.orders[self.interval_dimension :]
        return PhaseChange(self.expansion.families, orders, self.turns(), self.slopes())

    def table(self, eta: np.ndarray, rule: Rule | None = None) -> np.ndarray:
        """Return the smooth moments at η of shape (points, m), shape (times, points, width).

        The rule has points ξ and weights of expectations; by default it is the best that is
        affordable.
        """
        expansion = self.expansion
        families = expansion.families
        norms = expansion.norms
        table = np.empty((len(self.coefficients), len(eta), self.moments.width))
        phi = np.ascontiguousarray(expansion.chebyshev(eta))  # loops are compiled for one layout
        sections = Sections(self.coefficients, expansion.i, expansion.j, phi)
        index = np.ascontiguousarray(expansion.random_index)
        filled = self.columns, self.moments, self.phase_combinations, table
        # Choose the cheapest way to integrate that resolves the phases.
        if rule is None and self.averages_vanish:
            without_turning(sections, norms, *filled)
            return table
        rule = rule or resolving_rule(self.over_random)
        if rule is not None:
            xi, weights = rule
            psi = np.ascontiguousarray(expansion.orthogonal(xi).T)
            by_points(sections, psi, weights, *filled)
        elif self.normal.all():
            xi = sobol_normal(len(families), MOMENTS.samples)
            psi = np.ascontiguousarray(expansion.orthogonal(xi).T)
            by_saddles(sections, index, norms, *saddle_rule(len(families)), psi, *filled)
        else:
            grid = Grid.from_change(self.over_random)
            psi = grid.values(index)
            by_axes(sections, index, norms, grid, psi, *filled)
        return table


@cache
def _far_normals(n: int) -> np.ndarray:
    """Return standard normal variables along each axis and in some directions, (points, n)."""
    directions = sobol_normal(n, MOMENTS.slope_directions) if n > 1 else np.zeros((0, n))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    lines = np.concatenate([np.eye(n), -np.eye(n), directions])
    points = [distance * lines for distance in MOMENTS.slope_distances]
    return np.concatenate([np.zeros((1, n)), *points])


@cache
def corners(m: int) -> np.ndarray:
    """Return the middle of a box and corners, (places, m)."""
    corners = np.array(list(itertools.islice(itertools.product((-1.0, 1.0), repeat=m), 256)))
    return np.concatenate([np.zeros((1, m)), corners[: MOMENTS.max_slope_places - 1]])
