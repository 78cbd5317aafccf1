"""Chebyshev polynomials of an interval variable: zeros and values."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import chebyshev


def chebyshev_zeros(order: int) -> np.ndarray:
    """Return the zeros of the Chebyshev polynomial of degree order + 1, Eq. (14)."""
    # cos of Eq. (14), written as a sine so that the points are symmetric about 0 to the last bit
    return np.sin(np.pi * (order - 2 * np.arange(order + 1)) / (2 * (order + 1)))


def scaled_chebyshev_zeros(order: int) -> np.ndarray:
    """Return the zeros, scaled so that the outermost are −1 and 1, Eq. (19); 0 for order 0."""
    if order == 0:
        return np.zeros(1)
    zeros = chebyshev_zeros(order)
    scaled = zeros / zeros[0]
    scaled[[0, -1]] = 1.0, -1.0
    return scaled


def chebyshev_values(order: int, eta: np.ndarray) -> np.ndarray:
    """Return T_0 … T_order at η, shape (*eta.shape, order + 1)."""
    return chebyshev.chebvander(eta, order)
