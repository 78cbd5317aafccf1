"""Bounds over the interval variables: scan a grid, then polish by Newton's method on the box.

The paper scans, Eqs. (16)–(18). Here the scan only finds the right neighbourhood. The place of the
extreme is kept for every series: it shows which tolerances make the worst case.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import qmc

from flexband.uncertainty.expansions.expansion import Extremes
from flexband.uncertainty.expansions.hybrid import HybridExpansion, tensor_points
from flexband.uncertainty.expansions.polish import polish, sweep
from flexband.uncertainty.expansions.threads import in_threads

MAX_SCAN_POINTS = 2000
MAX_VERTICES = 64
"""Most vertices whose slopes are computed in the scan; beyond, every series is polished."""

CHUNK_SIZE = 500_000
"""Numbers in a temporary array: about as many as the processor's cache holds."""

ROWS = 256
"""Problems that are polished in one call."""


def extremes(expansion: HybridExpansion, sigmas: Sequence[float]) -> list[Extremes]:
    """Return what `Expansion.extremes` does, values of shape (2, series), places (2, series, m)."""
    grid = scan_grid(expansion.interval_orders)
    coarse = math.prod(2 * q + 3 for q in expansion.interval_orders if q) > MAX_SCAN_POINTS
    terms, random_terms, series = expansion.coefficients.shape
    # lower bounds minimize μ + c σ, upper bounds −(μ + c σ)
    targets = np.array([(c, sign) for c in sigmas for sign in (1, -1)])
    values = np.empty((len(targets), series))
    places = np.empty((len(targets), series, grid.shape[1]))
    settled = np.empty(values.shape, dtype=bool)
    step = max(1, CHUNK_SIZE // (len(grid) * random_terms))
    for first in range(0, series, step):
        here = slice(first, first + step)
        part = replace(expansion, coefficients=expansion.coefficients[:, :, here])
        values[:, here], places[:, here], settled[:, here] = _scan(part, targets, grid)
    if terms > 1 and not settled.all():
        target, row = np.nonzero(~settled)
        weighted = np.ascontiguousarray(np.moveaxis(expansion.weighted, 2, 0))
        found, at = values[target, row], places[target, row]

        def improve(part: slice) -> None:
            c, sign = targets[target[part]].T
            own = expansion.interval_index, weighted, row[part], c.copy(), sign.copy()
            if coarse:
                sweep(*own, at[part], found[part])
            polish(*own, at[part], found[part])

        starts = range(0, len(row), ROWS)
        in_threads(improve, [slice(first, first + ROWS) for first in starts])
        values[target, row], places[target, row] = found, at
    return [Extremes(values[k : k + 2], places[k : k + 2]) for k in range(0, len(targets), 2)]


def _scan(
    expansion: HybridExpansion, targets: np.ndarray, grid: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the best values on the grid, their η, and whether these are extremes on the box.

    A vertex of the box is a local extreme if every slope points outward.
    """
    mean, std = expansion.moments(grid)
    vertices = np.flatnonzero(np.all(np.abs(grid) == 1, axis=1))
    if len(vertices) > MAX_VERTICES:
        vertices = vertices[:0]
    slopes = _slopes(expansion, grid[vertices])
    series, found = np.arange(mean.shape[1]), []
    for c, sign in targets:
        scanned = mean + c * std
        best = np.argmin(sign * scanned, axis=0)
        slope = sign * (slopes[0] + c * slopes[1])
        outward = np.zeros(scanned.shape, dtype=bool)
        outward[vertices] = np.all(slope * grid[vertices][:, :, None] < 0, axis=1)
        found.append((scanned[best, series], grid[best], outward[best, series]))
    values, places, settled = map(np.stack, zip(*found, strict=True))
    return values, places, settled


def _slopes(expansion: HybridExpansion, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the gradients of μ and σ at η of shape (points, m), each (points, m, series)."""
    weighted, (count, m) = expansion.weighted, points.shape
    M, N, series = weighted.shape
    basis = expansion.chebyshev_gradient(points).reshape(count * (m + 1), M)
    terms = (basis @ weighted.reshape(M, -1)).reshape(count, m + 1, N, series)
    value, slope = terms[:, :1, 1:], terms[:, 1:, 1:]
    std = np.sqrt(np.einsum("vajs,vajs->vas", value, value))
    along = np.einsum("vajs,vbjs->vbs", value, slope)
    return terms[:, 1:, 0], along / np.where(std > 0, std, np.inf)


def scan_grid(orders: Sequence[int]) -> np.ndarray:
    """Return Chebyshev–Lobatto points, about two per wave of the highest order.

    If these are too many, there are fewer in each variable; if even the vertices are too many,
    quasi-random vertices.
    """
    counts = [2 * order + 3 if order else 1 for order in orders]
    while math.prod(counts) > MAX_SCAN_POINTS and max(counts) > 2:
        counts[counts.index(max(counts))] -= 1
    if math.prod(counts) > MAX_SCAN_POINTS:
        u = qmc.Sobol(len(counts), rng=np.random.default_rng(0)).random(1024)
        return np.where(u < 0.5, -1.0, 1.0) * (np.array(counts) > 1)
    return tensor_points([lobatto(count) for count in counts])


def lobatto(count: int) -> np.ndarray:
    """Return Chebyshev–Lobatto points of [−1, 1], ends included; a single point is 0."""
    return -np.cos(np.pi * np.arange(count) / (count - 1)) if count > 1 else np.zeros(1)
