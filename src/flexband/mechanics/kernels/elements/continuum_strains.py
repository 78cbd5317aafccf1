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
def strains(section):
    """Return a₀, a₁, a₂, b, g₀, g₁ of (p, w, d): Green–Lagrange strains across the section."""
    (px, py), (wx, wy), (dx, dy) = section
    return (
        0.5 * (px * px + py * py - 1.0),
        px * wx + py * wy,
        0.5 * (wx * wx + wy * wy),
        0.5 * (dx * dx + dy * dy - 1.0),
        px * dx + py * dy,
        wx * dx + wy * dy,
    )


@compiled
def strain_rates(section, rates):
    """Return the time derivatives of the six strains; `rates` are those of p, w and d."""
    (px, py), (wx, wy), (dx, dy) = section
    (pu, pv), (wu, wv), (du, dv) = rates
    return (
        px * pu + py * pv,
        pu * wx + pv * wy + px * wu + py * wv,
        wx * wu + wy * wv,
        dx * du + dy * dv,
        pu * dx + pv * dy + px * du + py * dv,
        wu * dx + wv * dy + wx * du + wy * dv,
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
def energy(forces, strain):
    """Return the energy, half the product of resultants and strains."""
    N0, N1, N2, Nb, Q0, Q1 = forces
    a0, a1, a2, b, g0, g1 = strain
    return 0.5 * (N0 * a0 + N1 * a1 + N2 * a2 + Nb * b + Q0 * g0 + Q1 * g1)


@compiled
def gradient(forces, section):
    """Return the forces on p, w and d: without damping the derivatives of the energy by them."""
    (px, py), (wx, wy), (dx, dy) = section
    N0, N1, N2, Nb, Q0, Q1 = forces
    return (
        (N0 * px + N1 * wx + Q0 * dx, N0 * py + N1 * wy + Q0 * dy),
        (N1 * px + N2 * wx + Q1 * dx, N1 * py + N2 * wy + Q1 * dy),
        (Nb * dx + Q0 * px + Q1 * wx, Nb * dy + Q0 * py + Q1 * wy),
    )


@compiled
def hessian(c, forces, section):
    """Return the second derivatives pp, pw, pd, ww, wd, dd of the energy, side by side.

    `forces` are N₀, …, Q₁. The symmetric blocks pp, ww, dd are xx, xy, yy, the others xx, xy, yx,
    yy.
    """
    c00, c02, c22, c11, c0b, c2b, cbb, s0, s1 = c
    p, w, d = section
    N0, N1, N2, Nb, Q0, Q1 = forces
    pp = _symmetric(N0, c00, p, c11, w, s0, d)
    pw = _mix(N1, c02, c11, p, w)
    pd = _mix(Q0, c0b, s0, p, d)
    ww = _symmetric(N2, c22, w, c11, p, s1, d)
    wd = _mix(Q1, c2b, s1, w, d)
    dd = _symmetric(Nb, cbb, d, s0, p, s1, w)
    return pp + pw + pd + ww + wd + dd


@compiled
def _symmetric(force, ca, a, cb, b, cc, c):
    """Return force I + ca a aᵀ + cb b bᵀ + cc c cᵀ as xx, xy, yy."""
    return (
        force + ca * a[0] * a[0] + cb * b[0] * b[0] + cc * c[0] * c[0],
        ca * a[0] * a[1] + cb * b[0] * b[1] + cc * c[0] * c[1],
        force + ca * a[1] * a[1] + cb * b[1] * b[1] + cc * c[1] * c[1],
    )


@compiled
def _mix(force, ab, ba, a, b):
    """Return force I + ab a bᵀ + ba b aᵀ as xx, xy, yx, yy."""
    return (
        force + (ab + ba) * a[0] * b[0],
        ab * a[0] * b[1] + ba * b[0] * a[1],
        ab * a[1] * b[0] + ba * b[1] * a[0],
        force + (ab + ba) * a[1] * b[1],
    )
