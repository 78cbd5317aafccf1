"""Pairs of interval variables in a disc: the one around the square of both.

A method fits its expansion in the box η ∈ [−1, 1]^m, which is inscribed in the product of all discs
and intervals, so its design needs to know nothing of discs. Bounds, and runs that judge an
expansion, are over the whole discs.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

RADIUS = 2.0**0.5
"""Of a disc in its two variables η, whose square has the corners (±1, ±1)."""


def in_discs(eta: np.ndarray, discs: Sequence[int]) -> np.ndarray:
    """Return η of the box, (points, m), moved into discs: squares around 0 become circles."""
    eta = eta.copy()
    for first in discs:
        pair = eta[:, first : first + 2]
        size = np.hypot(*pair.T)
        pair *= (RADIUS * np.abs(pair).max(axis=1) / np.where(size > 0, size, 1.0))[:, None]
    return eta


def farthest(eta: np.ndarray, discs: Sequence[int]) -> np.ndarray:
    """Return how far out points (points, m) are, 1 at the bounds, shape (points, m)."""
    reach = np.abs(eta)
    for first in discs:
        pair = eta[:, first : first + 2]
        reach[:, first : first + 2] = np.hypot(*pair.T)[:, None] / RADIUS
    return reach
