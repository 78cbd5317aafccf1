"""Chebyshev polynomials of an interval variable: zeros and values."""

from __future__ import annotations

import numpy as np
import scipy
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
    nodes = zeros / zeros[0]
    nodes[[0, -1]] = 1.0, -1.0
    return nodes


def chebyshev_values(order: int, eta: np.ndarray) -> np.ndarray:
    """Return T_0 … T_order at η, shape (*eta.shape, order + 1)."""
    return chebyshev.chebvander(eta, order)


def cubic_spline(x: np.ndarray, y: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return `scipy.interpolate.CubicSpline` of y(x), (..., n), at places, bit for bit.

    Its package takes half a second to import. y is real or complex, and places are within x.
    """
    if len(x) < 4:
        return scipy.interpolate.CubicSpline(x, y, axis=-1)(at)
    y = np.moveaxis(y, -1, 0)
    dx = np.diff(x).astype(float).reshape(-1, *np.ones(y.ndim - 1, int))
    # Solve for the derivatives at the knots, with not-a-knot ends.
    slope = np.diff(y, axis=0) / dx
    start = x[2] - x[0]
    end = x[-1] - x[-3]
    right = np.concatenate(
        [
            ((dx[:1] + 2 * start) * dx[1:2] * slope[:1] + dx[:1] ** 2 * slope[1:2]) / start,
            3 * (dx[1:] * slope[:-1] + dx[:-1] * slope[1:]),
            (dx[-1:] ** 2 * slope[-2:-1] + (2 * end + dx[-1:]) * dx[-2:-1] * slope[-1:]) / end,
        ]
    )
    h = dx.ravel()
    bands = np.zeros((3, len(x)))
    bands[0, 1:] = [start, *h[:-1]]
    bands[1] = [h[1], *(2 * (h[:-1] + h[1:])), h[-2]]
    bands[2, :-1] = [*h[1:], end]
    solution = scipy.linalg.solve_banded((1, 1), bands, right.reshape(len(x), -1))
    derivative = solution.reshape(y.shape)
    bend = (derivative[:-1] + derivative[1:] - 2 * slope) / dx
    terms = y[:-1], derivative[:-1], (slope - derivative[:-1]) / dx - bend, bend / dx
    # Evaluate the cubic of each piece.
    piece = np.minimum(np.searchsorted(x, at, side="right") - 1, len(x) - 2)
    s = (at - x[piece]).astype(float).reshape(-1, *np.ones(y.ndim - 1, int))
    values = terms[0][piece]
    power = s
    for term in terms[1:]:
        values = values + term[piece] * power
        power = power * s
    return np.moveaxis(values, 0, -1)
