"""Bounds over the interval variables: scan a grid, then polish by Newton's method on the box.

The paper scans, Eqs. (16)–(18). Here the scan only finds the right neighbourhood, and for every
series the place of the extreme is kept: which tolerances make the worst case.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from scipy.stats import qmc

from flexband.uncertainty.expansions.expansion import Extremes
from flexband.uncertainty.expansions.hybrid import HybridExpansion, tensor_points
from flexband.uncertainty.expansions.polish import polish, sweep

LARGEST_SCAN = 2000
MOST_VERTICES = 64
"""Vertices whose slopes are looked at all at once; where there are more, every row is polished."""

CHUNK = 500_000  # numbers in a temporary array: as many as the processor's cache holds


def extremes(expansion: HybridExpansion, sigmas: Sequence[float]) -> list[Extremes]:
    """Return the bounds of μ(η) + c σ(η) over η ∈ [−1, 1]^m for each c of `sigmas`."""
    grid = scan_grid(expansion.interval_orders)
    coarse = math.prod(2 * q + 3 for q in expansion.interval_orders if q) > LARGEST_SCAN
    terms, random_terms, series = expansion.coefficients.shape
    targets = np.array([(c, sign) for c in sigmas for sign in (1, -1)])  # least sign (μ + c σ)
    values = np.empty((len(targets), series))
    places = np.empty((len(targets), series, grid.shape[1]))
    settled = np.empty(values.shape, dtype=bool)
    step = max(1, CHUNK // (len(grid) * random_terms))
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

        cores = os.cpu_count() or 1
        ends = [len(row) * k // cores for k in range(cores + 1)]
        with ThreadPoolExecutor(cores) as pool:
            list(pool.map(improve, map(slice, ends, ends[1:])))
        values[target, row], places[target, row] = found, at
    return [Extremes(values[k : k + 2], places[k : k + 2]) for k in range(0, len(targets), 2)]


def _scan(
    expansion: HybridExpansion, targets: np.ndarray, grid: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the best values on the grid, their η, and whether they are extremes of the box.

    A vertex of the box is one where every slope points outward.
    """
    mean, std = expansion.moments(grid)
    vertices = np.flatnonzero(np.all(np.abs(grid) == 1, axis=1))
    if len(vertices) > MOST_VERTICES:
        vertices = vertices[:0]
    slopes = _slopes(expansion, grid[vertices])
    values, starts, settled = [], [], []
    series = np.arange(mean.shape[1])
    for c, sign in targets:
        scanned = mean + c * std
        best = np.argmin(sign * scanned, axis=0)
        values.append(scanned[best, series])
        starts.append(best)
        slope = sign * (slopes[0] + c * slopes[1])
        outward = np.zeros(scanned.shape, dtype=bool)
        outward[vertices] = np.all(slope * grid[vertices][:, :, None] < 0, axis=1)
        settled.append(outward[best, series])
    return np.stack(values), grid[np.stack(starts)], np.stack(settled)


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
    """Return Chebyshev–Lobatto points with the ends, about two a wave of the highest order.

    Fewer where these are too many; where even the vertices are, quasi-random vertices.
    """
    counts = [2 * order + 3 if order else 1 for order in orders]
    while math.prod(counts) > LARGEST_SCAN and max(counts) > 2:
        counts[counts.index(max(counts))] -= 1
    if math.prod(counts) > LARGEST_SCAN:
        u = qmc.Sobol(len(counts), rng=np.random.default_rng(0)).random(1024)
        return np.where(u < 0.5, -1.0, 1.0) * (np.array(counts) > 1)
    return tensor_points([lobatto(count) for count in counts])


def lobatto(count: int) -> np.ndarray:
    """Return Chebyshev–Lobatto points of [−1, 1], ends included; 0 where there is one."""
    return -np.cos(np.pi * np.arange(count) / (count - 1)) if count > 1 else np.zeros(1)
