"""Strains of an element at a few points, and the polynomials through them.

With more points an element whose axis can hardly change its length locks: its axial strains would
outnumber the degrees of freedom that can make them vanish.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexband.mechanics.kernels.elements.hermite import (
    POSITIONS,
    hermite_curvature,
    hermite_slope,
)

AXIAL = (0.0, 0.5, 1.0)
ENDS = (0.0, 1.0)
GAUSS = (0.5 - 0.5 / np.sqrt(3), 0.5 + 0.5 / np.sqrt(3))


def interpolation(points: Sequence[float], xi: np.ndarray | float) -> np.ndarray:
    """Return the Lagrange polynomials of some points at ξ, shape (points, …)."""
    xi = np.asarray(xi, dtype=float)
    factors = [[(xi - b) / (a - b) for b in points if b != a] for a in points]
    return np.stack([np.prod(own, axis=0) for own in factors])


def bending(xi: np.ndarray | float) -> np.ndarray:
    """Return the shapes at ξ of the mean curvature and of its difference between Gauss points."""
    xi = np.asarray(xi, dtype=float)
    return np.stack([1.0 + 0.0 * xi, np.sqrt(3) * (xi - 0.5)])


def stiffness(shapes: np.ndarray, number: np.ndarray) -> list[np.ndarray]:
    """Return ∫ c L_a L_b ds for shapes L at the Gauss points, the upper triangle row by row.

    `number` holds c at the Gauss points times their weights, shape (n or 1, elements, points). The
    integrals have the shape (n or 1, elements).
    """
    pairs = [(a, b) for a in range(len(shapes)) for b in range(a, len(shapes))]
    return [np.sum(number * shapes[a] * shapes[b], axis=-1) for a, b in pairs]


def line_stiffness(EA: np.ndarray, EI: np.ndarray, length: np.ndarray) -> list[np.ndarray]:
    """Return E_m, α, β, E_ii, E_ij, E_jj, B_0, ρ and B_1, see `kernels.elements.centre_line`.

    EA [N], EI [N m²] and the result are as in `stiffness`; `length` [m] is that of an element.
    """
    ii, im, ij, mm, mj, jj = stiffness(interpolation(AXIAL, POSITIONS), EA)
    axial = [mm, im / mm, mj / mm, ii - im**2 / mm, ij - im * mj / mm, jj - mj**2 / mm]
    mean, mixed, change = (c / length[..., None] ** 2 for c in stiffness(bending(POSITIONS), EI))
    return [*axial, mean, mixed / mean, change - mixed**2 / mean]


def bent(angle: np.ndarray, q: np.ndarray, length: np.ndarray) -> list[np.ndarray]:
    """Return the two strains of bending: an angle less than a half turn, and κ₂ − κ₁.

    `q` as in `slope`.
    """
    turned = np.remainder(angle + np.pi, 2 * np.pi) - np.pi
    return [turned, curvature(q, GAUSS[1], length) - curvature(q, GAUSS[0], length)]


def interpolated(points: Sequence[float], strains: np.ndarray, xi: float) -> np.ndarray:
    """Return the polynomial through the strains at some points, shape (points, …), at ξ."""
    return np.tensordot(interpolation(points, xi), strains, axes=1)


def slope(q: np.ndarray, xi: float, length: np.ndarray) -> np.ndarray:
    """Return p = r₀′ at ξ, shape (2, …).

    `q` holds r and r_x of both nodes of elements of this length [m], shape (4, 2, …).
    """
    ri, gi, rj, gj = q
    _, hi, h, hj = hermite_slope(xi)
    return h / length * (rj - ri) + hi * gi + hj * gj


def curvature(q: np.ndarray, xi: float, length: np.ndarray) -> np.ndarray:
    """Return the curvature times the length at ξ, shape (…); `q` as in `slope`."""
    ri, gi, rj, gj = q
    _, ki, k, kj = hermite_curvature(xi)
    p, w = slope(q, xi, length), k / length * (rj - ri) + ki * gi + kj * gj
    return (p[0] * w[1] - p[1] * w[0]) / (p[0] ** 2 + p[1] ** 2)
