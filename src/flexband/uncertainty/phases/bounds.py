"""Bounds of the moments of a phase-resolved surrogate over the intervals.

A moment oscillates in η as fast as the phases turn, but what it is made of does not: phases and
gentle moments (`phase_moments`) are found at few η, expanded in polynomials, and put together where
the extremes are searched (`phase_search`).
"""

from __future__ import annotations

import itertools
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from flexband.uncertainty.expansions.bounds import Extremes, extremes
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.sequences import interval_sequence
from flexband.uncertainty.phases.expansion import Layout, PhaseExpansion
from flexband.uncertainty.phases.moments import (
    by_points,
    put_together,
    table_width,
    turning_parts,
)
from flexband.uncertainty.phases.rules import (
    gentle_index,
    resolving_rule,
    saddle_rule,
    scan_points,
    sobol_normal,
)
from flexband.uncertainty.phases.saddles import SATURATED, WIDE, by_saddles
from flexband.uncertainty.phases.search import search

BLOCKS, SHORTEST = 12, 32
"""Blocks of times and the fewest times in one; early ones, whose phases have not moved far, take
fewer points."""

SPARE = 512
"""Points ξ for phases without saddles."""

STARTS = 3
"""Places from which an extreme is looked for."""

NEGLIGIBLE = 1e-9
"""Part of the largest coefficient below which one of a gentle moment is left out."""


def phase_extremes(surrogate: PhaseExpansion, sigmas: tuple[float, ...]) -> list[Extremes]:
    """Return the bounds of μ(η) + c σ(η) over η ∈ [−1, 1]^m for each c of `sigmas`.

    Series are the outputs and times of the response, as for `bounds.extremes`.
    """
    parts, layout = surrogate.complete(), surrogate.layout
    if not layout.carriers:
        return extremes(parts, sigmas)
    targets = np.array([(c, sign) for c in sigmas for sign in (1.0, -1.0)])
    series, m = (layout.outputs, layout.times), parts.interval_dimension
    values = np.empty((len(targets), *series))
    places = np.empty((len(targets), *series, m))
    terms = _Terms.of(parts, layout)

    def solve(times: slice) -> None:
        _block(terms.of_times(times), layout.outputs, targets, values[..., times], places, times)

    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        list(pool.map(solve, _blocks(layout.times)))
    values = values.reshape(len(sigmas), 2, -1)
    places = places.reshape(*values.shape, m)
    return [Extremes(v, p) for v, p in zip(values, places, strict=True)]


@dataclass(frozen=True)
class _Terms:
    """The parts as a list of terms that are not zero.

    coefficients : (times, terms, parts): base, then φ, Re Z and Im Z of each carrier.
    index : (terms, variables), η first.
    """

    expansion: HybridExpansion
    coefficients: np.ndarray
    index: np.ndarray
    i: np.ndarray
    j: np.ndarray
    phases: slice

    @staticmethod
    def of(expansion: HybridExpansion, layout: Layout) -> _Terms:
        M, N, series = expansion.coefficients.shape
        flat = expansion.coefficients.reshape(M * N, series)
        keep = np.flatnonzero(flat.any(axis=1))
        base, carriers = layout.unpack(flat[keep])
        parts = np.concatenate([base, *itertools.chain(*carriers)], axis=1)
        return _Terms(
            expansion,
            np.ascontiguousarray(np.moveaxis(parts, 2, 0)),
            expansion.index().T[keep],
            keep // N,
            keep % N,
            slice(layout.outputs, None, 1 + 2 * layout.outputs),
        )

    def of_times(self, times: slice) -> _Terms:
        """Return the terms at some times."""
        coefficients = self.coefficients[times]
        return _Terms(self.expansion, coefficients, self.index, self.i, self.j, self.phases)

    def reach(self, which: np.ndarray) -> np.ndarray:
        """Return how far phases are moved by some terms (…, terms) at most [rad]."""
        size = np.abs(self.coefficients[:, :, self.phases])
        return np.einsum("vk,tkc->vtc", which.astype(float), size).max(axis=(1, 2), initial=0.0)

    def slope(self) -> np.ndarray:
        """Return ∂φ/∂ξ in the middle, (times, carriers, n)."""
        m = self.expansion.interval_dimension
        first = (self.index.sum(axis=1) == 1)[:, None] * self.index[:, m:]
        return np.einsum("kv,tkc->tcv", first, self.coefficients[:, :, self.phases])

    def saturated(self, turning: np.ndarray) -> bool:
        """Return whether all averages over ξ of what turns vanish, at all η and times."""
        m, phases = self.expansion.interval_dimension, self.coefficients[:, :, self.phases]
        random = self.index[:, m:]
        others = self.index.sum(axis=1) > 1
        weight = others * random.sum(axis=1) * WIDE ** np.maximum(random.sum(axis=1) - 1, 0)
        bend = np.einsum("k,tkc->tc", weight, np.abs(phases))
        slope = self.slope()
        for c, d, s in turning:
            one = slope[:, c] + s * slope[:, d] * (s != 0)
            most = bend[:, c] + bend[:, d] * (s != 0)
            if np.any(np.linalg.norm(one, axis=1) - most < SATURATED):
                return False
        return True


def standard_moments(surrogate: PhaseExpansion, eta: np.ndarray) -> np.ndarray:
    """Return μ and σ at η of shape (points, m), shape (2, points, outputs, times)."""
    parts, layout = surrogate.complete(), surrogate.layout
    outputs, times = layout.outputs, layout.times
    if not layout.carriers:
        return np.stack(parts.moments(eta)).reshape(2, len(eta), outputs, times)
    terms, found = _Terms.of(parts, layout), np.empty((2, len(eta), outputs, times))
    for times in _blocks(layout.times):
        table = _table(terms.of_times(times), outputs, layout.carriers, eta)
        found[..., times] = np.moveaxis(put_together(table, outputs, layout.carriers), 1, 3)
    return found


def _blocks(times: int) -> list[slice]:
    """Return slices of the times."""
    count = max(1, min(BLOCKS, times // SHORTEST))
    ends = [times * k // count for k in range(count + 1)]
    return list(itertools.starmap(slice, itertools.pairwise(ends)))


def _table(terms: _Terms, outputs: int, carriers: int, eta: np.ndarray) -> np.ndarray:
    """Return the gentle moments at η of shape (points, m), shape (times, points, width)."""
    expansion, m = terms.expansion, terms.expansion.interval_dimension
    n, turning = terms.index.shape[1] - m, turning_parts(carriers)
    orders, reach = terms.index.max(axis=0), terms.reach(terms.index.T > 0)
    rule = None
    if not terms.saturated(turning):
        rule = resolving_rule(orders[m:], reach[m:], np.concatenate(terms.slope()))
    table = np.empty((len(terms.coefficients), len(eta), table_width(outputs, carriers)))
    own = terms.coefficients, terms.i, terms.j, expansion.chebyshev(eta)
    if rule is None:
        random, norms = expansion.random_index, expansion.norms
        points, spare = saddle_rule(n), sobol_normal(n, SPARE)
        by_saddles(*own, random, norms, *points, spare, outputs, turning, table)
    else:
        xi, weights = rule
        by_points(*own, expansion.hermite(xi), weights, outputs, turning, table)
    return table


def _block(terms: _Terms, outputs: int, targets, values, places, times: slice) -> None:
    """Fill the bounds and their places of one block of times."""
    expansion, m = terms.expansion, terms.expansion.interval_dimension
    carriers = (terms.coefficients.shape[2] - outputs) // (1 + 2 * outputs)
    turning = turning_parts(carriers)
    orders, reach = terms.index.max(axis=0), terms.reach(terms.index.T > 0)
    with_xi = np.any(terms.index[:, m:] > 0, axis=1)
    mixed = terms.reach((terms.index[:, :m].T > 0) & with_xi)
    still = terms.saturated(turning)
    highest = 2 * orders[:m] + np.ceil(np.where(reach[:m] > 0, 1 + 8 * mixed, 0)).astype(int)
    highest = np.where(orders[:m] > 0, 2 * orders[:m] if still else highest, 0)
    index = gentle_index(expansion.interval_index, highest.tolist())
    eta = interval_sequence(int(index.max(initial=0)) + 1)[index]
    table = _table(terms, outputs, carriers, eta)
    polynomials = HybridExpansion(np.zeros((1, 0), int), index, np.zeros((len(index), 1, 0)))
    transform = np.linalg.inv(polynomials.chebyshev(eta))
    gentle = transform @ table
    size = np.abs(gentle).max(axis=0)
    matter = np.any(np.abs(gentle) > NEGLIGIBLE * size.max(axis=0), axis=(0, 2))
    gentle, index = np.ascontiguousarray(gentle[:, matter]), index[matter]
    points, beside = scan_points(2 * orders[:m], reach[:m] * (not still))
    basis = np.ascontiguousarray(polynomials.chebyshev(points)[:, matter])
    found = np.empty((*values.shape, m))
    search(gentle, index, basis, points, beside, outputs, turning, targets, STARTS, values, found)
    places[..., times, :] = found
