"""Points in the box of the interval variables among which bounds are searched first."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import scipy

from flexband.uncertainty.expansions.bounds.bound_options import OPTIONS
from flexband.uncertainty.expansions.bounds.discs import RADIUS
from flexband.uncertainty.expansions.hybrid import tensor_index, tensor_points
from flexband.uncertainty.expansions.points.sobol import scrambled_sobol
from flexband.uncertainty.expansions.polynomials import chebyshev_values


@lru_cache(maxsize=16)
def scan(orders: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return η for a scan, (points, m), and the numbers of the points next to each.

    Chebyshev–Lobatto points, four per wave of the highest order, or fewer if these are many; if
    even four in each variable are too many, `scatter_points` points.
    """
    counts = [2 * order + 3 if order else 1 for order in orders]
    for max_points, smallest_counts in (
        (OPTIONS.many_scan_points, [order + 3 if order else 1 for order in orders]),
        (OPTIONS.max_scan_points, [min(4, count) for count in counts]),
    ):
        while math.prod(counts) > max_points and counts != smallest_counts:
            spare = [
                count if count > low else 0
                for count, low in zip(counts, smallest_counts, strict=True)
            ]
            counts[spare.index(max(spare))] -= 1
    if math.prod(counts) <= OPTIONS.max_scan_points:
        return tensor_grid(counts)
    return scatter_points(OPTIONS.scattered_points, np.array(orders) > 0)


def scatter_points(count: int, free_variables: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return quasi-random η, (count, m), vertices first, and the points next to each.

    Further points have fewer and fewer variables at their ends. Other variables are zero.
    """
    u = scrambled_sobol(count, len(free_variables))
    ends = np.linspace(1.0, 0.0, count)[:, None]
    interior_points = np.clip((u - ends / 2) / np.maximum(1 - ends, 1e-9), 0, 1)
    points = -np.cos(np.pi * interior_points) * free_variables
    neighbours = np.asarray(scipy.spatial.KDTree(points).query(points, OPTIONS.neighbours + 1)[1])
    return points, np.ascontiguousarray(neighbours[:, 1:])


def tensor_grid(counts: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return Chebyshev–Lobatto points, (points, m), and the numbers of the points next to each."""
    where = tensor_index([count - 1 for count in counts])
    step = np.concatenate([np.eye(len(counts), dtype=int), -np.eye(len(counts), dtype=int)])
    neighbours = np.clip(where[:, None] + step, 0, np.array(counts, dtype=int) - 1)
    strides = np.cumprod([1, *counts[:0:-1]])[::-1][: len(counts)]
    return tensor_points([lobatto(count) for count in counts]), neighbours @ strides


def lines(
    orders: tuple[int, ...], discs: Sequence[int] = ()
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return η to try in each variable, (m, count), their polynomials, and how many there are."""
    counts = np.array([2 * order + 3 if order else 1 for order in orders], dtype=int)
    points = np.zeros((len(counts), counts.max(initial=1)))
    for row, count in zip(points, counts, strict=True):
        row[:count] = lobatto(count)
    for first in discs:
        points[first : first + 2] *= RADIUS
    values = np.ascontiguousarray(chebyshev_values(max(orders, default=0), points))
    return points, values, counts


def lobatto(count: int) -> np.ndarray:
    """Return Chebyshev–Lobatto points of [−1, 1], ends included; a single point is 0."""
    return -np.cos(np.pi * np.arange(count) / (count - 1)) if count > 1 else np.zeros(1)
