"""Hermite cubics on [0, 1], and the Gauss points of an element."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

GAUSS_POINTS = 5
"""Gauss points per element: (r_x·r_x)² has degree 8, and five points are exact up to degree 9."""

POSITIONS, WEIGHTS = (a / 2 for a in np.polynomial.legendre.leggauss(GAUSS_POINTS))
POSITIONS = POSITIONS + 0.5  # on [0, 1]


def hermite(xi: ArrayLike) -> np.ndarray:
    """Return the cubics for the value and slope at 0 and at 1, shape (4, …), at ξ in [0, 1]."""
    x = np.asarray(xi, dtype=float)
    return np.stack(
        [1 - 3 * x**2 + 2 * x**3, x - 2 * x**2 + x**3, 3 * x**2 - 2 * x**3, x**3 - x**2]
    )


def hermite_slope(xi: ArrayLike) -> np.ndarray:
    """Return the first derivatives of `hermite` by ξ, shape (4, …)."""
    x = np.asarray(xi, dtype=float)
    return np.stack([6 * x**2 - 6 * x, 1 - 4 * x + 3 * x**2, 6 * x - 6 * x**2, 3 * x**2 - 2 * x])


def hermite_curvature(xi: ArrayLike) -> np.ndarray:
    """Return the second derivatives of `hermite` by ξ, shape (4, …)."""
    x = np.asarray(xi, dtype=float)
    return np.stack([12 * x - 6, 6 * x - 4, 6 - 12 * x, 6 * x - 2])
