"""Bounds of the moments of a phase expansion over the intervals.

A moment oscillates in η as fast as the phases turn, but the phases and the smooth moments that it
is made of do not. They are computed at few η, expanded in polynomials, and put together where the
extremes are searched.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from flexband.uncertainty.expansions.expansion import Extremes
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.sequences import interval_sequence
from flexband.uncertainty.phases.layout import MomentColumns, PartColumns
from flexband.uncertainty.phases.rules import scan_points, smooth_index
from flexband.uncertainty.phases.search import search
from flexband.uncertainty.phases.terms import Terms, time_blocks

DESCENTS = 3
"""Points of the scan from which an extreme is searched."""

NEGLIGIBLE = 1e-9
"""Fraction of the largest coefficient below which a coefficient of a smooth moment is dropped."""


def phase_extremes(
    parts: HybridExpansion, columns: PartColumns, sigmas: Sequence[float]
) -> list[Extremes]:
    """Return the bounds of μ(η) + c σ(η) over η ∈ [−1, 1]^m for each c of `sigmas`.

    Values have shape (2, outputs, times), places (2, outputs, times, m).
    """
    targets = np.array([(c, sign) for c in sigmas for sign in (1.0, -1.0)])
    terms = Terms.of(parts, columns)
    shape = len(targets), columns.outputs, len(terms.coefficients)
    values, places = np.empty(shape), np.empty((*shape, parts.interval_dimension))

    def solve(block: slice) -> None:
        _search(terms.of_times(block), targets, values[..., block], places, block)

    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        list(pool.map(solve, time_blocks(len(terms.coefficients))))
    return [Extremes(values[k : k + 2], places[k : k + 2]) for k in range(0, len(targets), 2)]


def _search(terms: Terms, targets, values, places, block: slice) -> None:
    """Fill the bounds and their places of one block of times."""
    m, columns = terms.interval_dimension, terms.columns
    orders, reach = terms.index.max(axis=0), terms.reach(terms.index.T > 0)
    with_xi = np.any(terms.index[:, m:] > 0, axis=1)
    mixed = terms.reach((terms.index[:, :m].T > 0) & with_xi)
    saturated = terms.saturated()
    highest = 2 * orders[:m] + np.ceil(np.where(reach[:m] > 0, 1 + 8 * mixed, 0)).astype(int)
    highest = np.where(orders[:m] > 0, 2 * orders[:m] if saturated else highest, 0)
    index = smooth_index(terms.expansion.interval_index, highest.tolist())
    eta = interval_sequence(int(index.max(initial=0)) + 1)[index]
    polynomials = HybridExpansion(np.zeros((1, 0), int), index, np.zeros((len(index), 1, 0)))
    smooth = np.linalg.inv(polynomials.chebyshev(eta)) @ terms.table(eta)
    size = np.abs(smooth).max(axis=0)
    matter = np.any(np.abs(smooth) > NEGLIGIBLE * size.max(axis=0), axis=(0, 2))
    points, beside = scan_points(2 * orders[:m], reach[:m] * (not saturated))
    found = np.empty((*values.shape, m))
    search(
        np.ascontiguousarray(smooth[:, matter]),
        index[matter],
        np.ascontiguousarray(polynomials.chebyshev(points)[:, matter]),
        points,
        beside,
        MomentColumns.of(columns.outputs, columns.carriers),
        terms.turning,
        targets,
        DESCENTS,
        values,
        found,
    )
    places[..., block, :] = found
