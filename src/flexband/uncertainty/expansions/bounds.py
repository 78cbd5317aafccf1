"""Bounds over the interval variables: scan, then descend from the best points of the scan.

The paper scans, Eqs. (16)–(18). Here the scan only finds the right neighbourhoods. The place of the
extreme is kept for every series: it shows which tolerances make the worst case.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.spatial import KDTree
from scipy.stats import qmc

from flexband.uncertainty.expansions.expansion import Extremes
from flexband.uncertainty.expansions.hybrid import HybridExpansion, tensor_index, tensor_points
from flexband.uncertainty.expansions.polynomials import chebyshev_values
from flexband.uncertainty.expansions.search import SparseTerms, search
from flexband.uncertainty.expansions.threads import in_threads

MAX_SCAN_POINTS = 1400
SCATTERED_POINTS = 1024
"""Points of a scan in more variables than a grid can have."""

NEIGHBOURS = 12
"""Scattered points next to a point."""

SERIES = 256
"""Series that are searched in one call."""


def extremes(expansion: HybridExpansion, sigmas: Sequence[float]) -> list[Extremes]:
    """Return what `Expansion.extremes` does, values of shape (2, series), places (2, series, m)."""
    orders = expansion.interval_orders
    order = np.argsort(expansion.j, kind="stable")
    i, j, series = expansion.i[order], expansion.j[order], expansion.coefficients.shape[1]
    terms = SparseTerms.of(expansion.interval_index[i], j)
    points, neighbours = scan(orders)
    grid = np.ascontiguousarray(expansion.chebyshev(points)[:, i].T), points, neighbours
    weight, tried, beta = np.sqrt(expansion.norms)[j, None], lines(orders), expansion.coefficients
    # lower bounds minimize μ + c σ, upper bounds −(μ + c σ); without random terms σ = 0
    searched = sigmas if j.any() else [0.0]
    targets = np.array([(c, sign) for c in searched for sign in (1.0, -1.0)])
    values = np.empty((len(targets), series))
    places = np.empty((len(targets), series, len(orders)))

    def solve(first: int) -> None:
        own = np.ascontiguousarray((beta[order, first : first + SERIES] * weight).T)
        search(terms, grid, tried, own, first, targets, values, places)

    in_threads(solve, range(0, series, SERIES))
    found = [Extremes(values[k : k + 2], places[k : k + 2]) for k in range(0, len(targets), 2)]
    return found if j.any() else found * len(sigmas)


def scan(orders: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return η for a scan, (points, m), and the numbers of the points next to each.

    Chebyshev–Lobatto points, about two per wave of the highest order. If these are too many, there
    are fewer in each variable, but four at least; if even these are too many, `scattered` points.
    """
    counts = [2 * order + 3 if order else 1 for order in orders]
    while math.prod(counts) > MAX_SCAN_POINTS and max(counts) > 4:
        counts[counts.index(max(counts))] -= 1
    if math.prod(counts) <= MAX_SCAN_POINTS:
        return tensor_grid(counts)
    return scattered(SCATTERED_POINTS, np.array(orders) > 0)


def scattered(count: int, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return quasi-random η, (count, m), and the numbers of the points next to each.

    The first points are vertices; further ones have fewer and fewer variables at their ends. Those
    that are not free are zero.
    """
    u = qmc.Sobol(len(free), rng=np.random.default_rng(0)).random(count)
    ends = np.linspace(1.0, 0.0, count)[:, None]
    inside = np.clip((u - ends / 2) / np.maximum(1 - ends, 1e-9), 0, 1)
    points = -np.cos(np.pi * inside) * free
    beside = np.asarray(KDTree(points).query(points, NEIGHBOURS + 1)[1])
    return points, np.ascontiguousarray(beside[:, 1:])


def tensor_grid(counts: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return Chebyshev–Lobatto points, (points, m), and the numbers of the points next to each."""
    where = tensor_index([count - 1 for count in counts])
    step = np.concatenate([np.eye(len(counts), dtype=int), -np.eye(len(counts), dtype=int)])
    beside = np.clip(where[:, None] + step, 0, np.array(counts, dtype=int) - 1)
    strides = np.cumprod([1, *counts[:0:-1]])[::-1][: len(counts)]
    return tensor_points([lobatto(count) for count in counts]), beside @ strides


def lines(orders: Sequence[int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return η to try in each variable, (m, count), their polynomials, and how many there are."""
    counts = np.array([2 * order + 3 if order else 1 for order in orders], dtype=int)
    points = np.zeros((len(counts), counts.max(initial=1)))
    for own, count in zip(points, counts, strict=True):
        own[:count] = lobatto(count)
    return points, chebyshev_values(max(orders, default=0), points), counts


def lobatto(count: int) -> np.ndarray:
    """Return Chebyshev–Lobatto points of [−1, 1], ends included; a single point is 0."""
    return -np.cos(np.pi * np.arange(count) / (count - 1)) if count > 1 else np.zeros(1)
