"""Bounds over the interval variables: scan, then descend from the best points of the scan.

The paper scans, Eqs. (16)–(18). Here the scan only finds the right neighbourhoods. The place of the
extreme is kept for every series: it shows which tolerances make the worst case.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexband.uncertainty.expansions.bounds.bound_options import OPTIONS
from flexband.uncertainty.expansions.bounds.discs import in_discs
from flexband.uncertainty.expansions.bounds.scan import lines, scan
from flexband.uncertainty.expansions.bounds.search import search
from flexband.uncertainty.expansions.bounds.terms import ExpansionTerms
from flexband.uncertainty.expansions.expansion import Extremes
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.threads import in_threads


def extremes(expansion: HybridExpansion, sigmas: Sequence[float]) -> list[Extremes]:
    """Return what `Expansion.extremes` does, values of shape (2, series), places (2, series, m)."""
    of_mean = expansion.j == 0
    if of_mean.all():  # without random terms σ = 0
        return _extremes(expansion, of_mean, [0.0]) * len(sigmas)
    means = iter(_extremes(expansion, of_mean, [c for c in sigmas if not c]))
    others = iter(_extremes(expansion, np.full(len(of_mean), True), [c for c in sigmas if c]))
    return [next(others if c else means) for c in sigmas]


def _extremes(
    expansion: HybridExpansion, which: np.ndarray, sigmas: Sequence[float]
) -> list[Extremes]:
    """Return the bounds of μ + c σ of some of the terms, which must be those of μ if c is zero."""
    order = np.flatnonzero(which)[np.lexsort((expansion.j[which], expansion.i[which]))]
    interval_terms, i = np.unique(expansion.i[order], return_inverse=True)
    index = expansion.interval_index[interval_terms]
    j = expansion.j[order]
    orders, weight = tuple(index.max(axis=0, initial=0).tolist()), np.sqrt(expansion.norms)[j, None]
    points, neighbours = scan(orders)
    points = in_discs(points, expansion.discs)
    grid = (
        np.ascontiguousarray(expansion.chebyshev(points).T[interval_terms[i]]),
        points,
        neighbours,
    )
    terms = ExpansionTerms.from_index(index, i, j, expansion.discs)
    line_points = lines(orders, expansion.discs)
    series = expansion.coefficients.shape[1]
    # lower bounds minimize μ + c σ, upper bounds −(μ + c σ)
    targets = np.array([(c, sign) for c in sigmas for sign in (1.0, -1.0)]).reshape(-1, 2)
    values, places = (np.empty((len(targets), series, *m)) for m in ((), (len(orders),)))

    def solve(first: int) -> None:
        columns = slice(first, first + OPTIONS.series_at_once)
        coefficients = np.ascontiguousarray((expansion.coefficients[order, columns] * weight).T)
        # arrays of one layout, since the search is compiled for each that it is given
        minima, place = (
            np.empty((len(targets), len(coefficients), *m)) for m in ((), (len(orders),))
        )
        search(terms, grid, line_points, coefficients, targets, minima, place)
        values[:, columns] = minima
        places[:, columns] = place

    in_threads(solve, range(0, series if sigmas else 0, OPTIONS.series_at_once))
    return [Extremes(values[k : k + 2], places[k : k + 2]) for k in range(0, len(targets), 2)]
