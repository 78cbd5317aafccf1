"""Strains of a beam's section and derivatives of its energy, formulas on floats or lanes.

The energy of an element depends on five vectors: the chord u = (r_j − r_i)/l, the slopes r_x at
both ends and the section directions d = r_y at both ends. At a Gauss point

    p = h u + h_i r_xi + h_j r_xj        (r₀' of the Hermite cubic)
    d = (1−ξ) d_i + ξ d_j,   w = (d_j − d_i)/l

and the energy of the section is a quadratic form in its six generalized strains, whose nine
coefficients are those of `flexband.mechanics.bodies.section_stiffness.SectionStiffness`. The
functions differentiate it once and twice with respect to (p, w, d).
"""

from __future__ import annotations

from flexband.mechanics.kernels.lanes import compiled


@compiled
def strains(p, w, d):
    """Return a₀, a₁, a₂, b, g₀, g₁: Green–Lagrange strains as polynomials across the section."""
    (px, py), (wx, wy), (dx, dy) = p, w, d
    a0 = 0.5 * (px * px + py * py - 1.0)
    a1 = px * wx + py * wy
    a2 = 0.5 * (wx * wx + wy * wy)
    b = 0.5 * (dx * dx + dy * dy - 1.0)
    g0 = px * dx + py * dy
    g1 = wx * dx + wy * dy
    return a0, a1, a2, b, g0, g1


@compiled
def strain_rates(p, w, d, p_rate, w_rate, d_rate):
    """Return the time derivatives of the six strains."""
    (px, py), (wx, wy), (dx, dy) = p, w, d
    (pu, pv), (wu, wv), (du, dv) = p_rate, w_rate, d_rate
    return (
        px * pu + py * pv,
        pu * wx + pv * wy + px * wu + py * wv,
        wx * wu + wy * wv,
        dx * du + dy * dv,
        pu * dx + pv * dy + px * du + py * dv,
        wu * dx + wv * dy + wx * du + wy * dv,
    )


@compiled
def retarded(strain, rate, time):
    """Return strain + time × rate, the strains that the stresses of a Kelvin–Voigt solid follow."""
    a0, a1, a2, b, g0, g1 = strain
    ra0, ra1, ra2, rb, rg0, rg1 = rate
    return (
        a0 + time * ra0,
        a1 + time * ra1,
        a2 + time * ra2,
        b + time * rb,
        g0 + time * rg0,
        g1 + time * rg1,
    )


@compiled
def resultants(c, strain):
    """Return N₀, N₁, N₂, N_b, Q₀, Q₁, the derivatives of the energy by the six strains."""
    c00, c02, c22, c11, c0b, c2b, cbb, s0, s1 = c
    a0, a1, a2, b, g0, g1 = strain
    return (
        c00 * a0 + c02 * a2 + c0b * b,
        c11 * a1,
        c02 * a0 + c22 * a2 + c2b * b,
        c0b * a0 + c2b * a2 + cbb * b,
        s0 * g0,
        s1 * g1,
    )


@compiled
def without(strain, initial):
    """Return strain − initial."""
    a0, a1, a2, b, g0, g1 = strain
    i0, i1, i2, ib, j0, j1 = initial
    return a0 - i0, a1 - i1, a2 - i2, b - ib, g0 - j0, g1 - j1


@compiled
def energy(forces, strain):
    """Return the energy, half the product of resultants and strains."""
    N0, N1, N2, Nb, Q0, Q1 = forces
    a0, a1, a2, b, g0, g1 = strain
    return 0.5 * (N0 * a0 + N1 * a1 + N2 * a2 + Nb * b + Q0 * g0 + Q1 * g1)


@compiled
def gradient(forces, p, w, d):
    """Return the generalized forces on p, w and d of the resultants N₀, …, Q₁.

    Without damping they are the derivatives of the energy by p, w and d.
    """
    (px, py), (wx, wy), (dx, dy) = p, w, d
    N0, N1, N2, Nb, Q0, Q1 = forces
    return (
        (N0 * px + N1 * wx + Q0 * dx, N0 * py + N1 * wy + Q0 * dy),
        (N1 * px + N2 * wx + Q1 * dx, N1 * py + N2 * wy + Q1 * dy),
        (Nb * dx + Q0 * px + Q1 * wx, Nb * dy + Q0 * py + Q1 * wy),
    )


@compiled
def hessian(c, forces, p, w, d):
    """Return the second derivatives pp, pw, pd, ww, wd, dd of the energy; `forces` are N₀, …, Q₁.

    The symmetric blocks pp, ww, dd are (xx, xy, yy), the others (xx, xy, yx, yy), row by row.
    """
    c00, c02, c22, c11, c0b, c2b, cbb, s0, s1 = c
    (px, py), (wx, wy), (dx, dy) = p, w, d
    N0, N1, N2, Nb, Q0, Q1 = forces
    return (
        (
            N0 + c00 * px * px + c11 * wx * wx + s0 * dx * dx,
            c00 * px * py + c11 * wx * wy + s0 * dx * dy,
            N0 + c00 * py * py + c11 * wy * wy + s0 * dy * dy,
        ),
        (
            N1 + (c02 + c11) * px * wx,
            c02 * px * wy + c11 * wx * py,
            c02 * py * wx + c11 * wy * px,
            N1 + (c02 + c11) * py * wy,
        ),
        (
            Q0 + (c0b + s0) * px * dx,
            c0b * px * dy + s0 * dx * py,
            c0b * py * dx + s0 * dy * px,
            Q0 + (c0b + s0) * py * dy,
        ),
        (
            N2 + c22 * wx * wx + c11 * px * px + s1 * dx * dx,
            c22 * wx * wy + c11 * px * py + s1 * dx * dy,
            N2 + c22 * wy * wy + c11 * py * py + s1 * dy * dy,
        ),
        (
            Q1 + (c2b + s1) * wx * dx,
            c2b * wx * dy + s1 * dx * wy,
            c2b * wy * dx + s1 * dy * wx,
            Q1 + (c2b + s1) * wy * dy,
        ),
        (
            Nb + cbb * dx * dx + s0 * px * px + s1 * wx * wx,
            cbb * dx * dy + s0 * px * py + s1 * wx * wy,
            Nb + cbb * dy * dy + s0 * py * py + s1 * wy * wy,
        ),
    )
