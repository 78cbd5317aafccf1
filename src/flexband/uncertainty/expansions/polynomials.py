"""Hermite and Chebyshev polynomials in one variable: nodes, values, transforms."""

from __future__ import annotations

from functools import cache
from math import factorial

import numpy as np
from numpy.polynomial import chebyshev, hermite_e


def hermite_nodes(order: int) -> np.ndarray:
    """Return the roots of the Hermite polynomial of degree order + 1, Eq. (13)."""
    return hermite_e.hermegauss(order + 1)[0]


def hermite_values(order: int, xi: np.ndarray) -> np.ndarray:
    """Return He_0 … He_order at ξ, shape (*xi.shape, order + 1)."""
    return hermite_e.hermevander(xi, order)


def hermite_norms(order: int) -> np.ndarray:
    """Return γ_j = E[He_j(ξ)²] = j!, as in Eq. (15)."""
    return np.array([float(factorial(j)) for j in range(order + 1)])


def hermite_transform(order: int) -> np.ndarray:
    """Return the matrix from values at `hermite_nodes` to coefficients, by Gauss quadrature.

    It is the inverse of the matrix of `hermite_values` at the nodes, since the polynomials are
    orthogonal on these nodes too.
    """
    nodes, weights = hermite_e.hermegauss(order + 1)
    values = hermite_values(order, nodes)
    return (values * (weights / weights.sum())[:, None]).T / hermite_norms(order)[:, None]


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


@cache
def chebyshev_derivative(order: int) -> np.ndarray:
    """Return D with T_i′ = Σ_j T_j D_ji, shape (order + 1, order + 1)."""
    D = np.zeros((order + 1, order + 1))
    for i in range(1, order + 1):
        D[:i, i] = chebyshev.chebder(np.eye(order + 1)[i])[:i]
    return D
