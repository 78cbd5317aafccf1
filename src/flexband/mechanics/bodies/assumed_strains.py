"""Strains of an element at a few points, and the polynomials through them.

With more points an element whose axis can hardly change its length locks: its axial strains would
outnumber the degrees of freedom that can make them vanish.

The axial strain is right where it is the mean of an element, and at the two Gauss points of a line.
Between them its parabola makes up for what the others miss: the shear strains at the ends alone,
and the change of curvature, do work where the axis is stretched at the ends and compressed in the
middle, which no section force does.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from flexband.mechanics.kernels.elements.hermite import POSITIONS, hermite_curvature, hermite_slope

AXIAL = (0.0, 0.5, 1.0)
ENDS = (0.0, 1.0)
GAUSS = (0.5 - 0.5 / np.sqrt(3), 0.5 + 0.5 / np.sqrt(3))


def interpolation(points: Sequence[float], xi: np.ndarray | float) -> np.ndarray:
    """Return the Lagrange polynomials of some points at ξ, shape (points, …)."""
    xi = np.asarray(xi, dtype=float)
    factors = [[(xi - b) / (a - b) for b in points if b != a] for a in points]
    return np.stack([np.prod(point_factors, axis=0) for point_factors in factors])


def curvature_shapes(xi: np.ndarray | float) -> np.ndarray:
    """Return the shapes at ξ of the mean curvature and of its difference between Gauss points."""
    xi = np.asarray(xi, dtype=float)
    return np.stack([1.0 + 0.0 * xi, np.sqrt(3) * (xi - 0.5)])


def stiffness(shapes: np.ndarray, number: np.ndarray) -> list[np.ndarray]:
    """Return ∫ c L_a L_b ds, upper triangle by rows, from weighted c (n or 1, elements, points)."""
    pairs = [(a, b) for a in range(len(shapes)) for b in range(a, len(shapes))]
    return [np.sum(number * shapes[a] * shapes[b], axis=-1) for a, b in pairs]


def line_stiffness(
    EA: np.ndarray, EI: np.ndarray, length: np.ndarray, excess_stiffness: ArrayLike = 0.0
) -> list[np.ndarray]:
    """Return E_m, α, β, E_ii, E_ij, E_jj, B_0, ρ and B_1, see `kernels.elements.centre_line`.

    EA [N] and EI [N m²] are as in `stiffness`, `length` [m] has shape (n or 1, elements).
    `excess_stiffness` is added to EA where the axis is stretched at the ends and compressed in the
    middle.
    """
    # The stiffness by Legendre's parabola, whose factors are below.
    parabola_term = np.sum(excess_stiffness * np.ones_like(EA), axis=-1) / 45
    ii, im, ij, mm, mj, jj = (
        number + factor * parabola_term
        for number, factor in zip(
            stiffness(interpolation(AXIAL, POSITIONS), EA), (1, -2, 1, 4, -2, 1), strict=True
        )
    )
    axial = [mm, im / mm, mj / mm, ii - im**2 / mm, ij - im * mj / mm, jj - mj**2 / mm]
    mean, mixed, change = (c / length**2 for c in stiffness(curvature_shapes(POSITIONS), EI))
    return [*axial, mean, mixed / mean, change - mixed**2 / mean]


def bent(angle: np.ndarray, q: np.ndarray, length: np.ndarray) -> list[np.ndarray]:
    """Return the strains of bending at q as in `slope`: the angle, less than π, and κ₂ − κ₁."""
    turn = np.remainder(angle + np.pi, 2 * np.pi) - np.pi
    return [turn, curvature(q, GAUSS[1], length) - curvature(q, GAUSS[0], length)]


def interpolate(points: Sequence[float], strains: np.ndarray, xi: float) -> np.ndarray:
    """Return the polynomial through the strains at some points, shape (points, …), at ξ."""
    return np.tensordot(interpolation(points, xi), strains, axes=1)


def axial_strain(
    xi: float,
    axial: np.ndarray,
    bend_strains: np.ndarray,
    shear: np.ndarray,
    pull: ArrayLike,
    load_term: np.ndarray,
) -> np.ndarray:
    """Return N/EA at ξ, shape (…), from axial strains (3, …), bending (2, …) and shear Q/EA.

    It is the line through the axial strain at the two Gauss points, and the parabola beside it that
    N has where no force acts: N′ = Qφ′ and Q′ = −Nφ′ give N″ = Qφ″ − Nφ′². The line misses a
    `pull`, 5 times that of Qγ/EA: where the axis shears by γ, Γ at the ends is that of N − 5 Qγ, in
    the middle that of N + 5/2 Qγ. Forces along the member bend the parabola by `load_term`.
    """
    first, last = (interpolate(AXIAL, axial, point) for point in GAUSS)
    middle, (angle, change) = 0.5 * (first + last), bend_strains
    parabola = np.sqrt(3) * shear * change - angle**2 * middle - load_term
    line = middle + (np.sqrt(3) * (last - first) + pull) * (xi - 0.5)
    return line + 0.5 * parabola * (xi**2 - xi + 1 / 6)


def load_curvature(force: np.ndarray, chord: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Return −N″ times the length [N/m] by forces per length at both ends, shape (2, 2, …).

    N′ = Qφ′ − p·t and Q′ = −Nφ′ − p·n make it (p·t)′ + (p·n)φ′ = p′·t + 2 (p·n)φ′.
    """
    tx, ty = chord / np.hypot(*chord)
    (px, py), (mx, my) = force[1] - force[0], 0.5 * (force[0] + force[1])
    return px * tx + py * ty + 2 * angle * (my * tx - mx * ty)


def slope(q: np.ndarray, xi: float, length: np.ndarray) -> np.ndarray:
    """Return p = r₀′ at ξ, (2, …), from r and r_x of both nodes, (4, 2, …), and the length [m]."""
    ri, gi, rj, gj = q
    _, hi, h, hj = hermite_slope(xi)
    return h / length * (rj - ri) + hi * gi + hj * gj


def curvature(q: np.ndarray, xi: float, length: np.ndarray) -> np.ndarray:
    """Return the curvature times the length at ξ, shape (…); `q` as in `slope`."""
    ri, gi, rj, gj = q
    _, ki, k, kj = hermite_curvature(xi)
    p = slope(q, xi, length)
    w = k / length * (rj - ri) + ki * gi + kj * gj
    return (p[0] * w[1] - p[1] * w[0]) / (p[0] ** 2 + p[1] ** 2)
