"""Elastic forces, tangent and energy of all cable elements, on lanes."""

from __future__ import annotations

from flexband.mechanics.kernels.hermite import (
    GAUSS_POINTS,
    POSITIONS,
    hermite_curvature,
    hermite_slope,
)
from flexband.mechanics.kernels.lanes import (
    add_block,
    add_to,
    compiled,
    load,
    load_rows,
    plus,
    sqrt,
    store_rows,
)

SLOPE, CURVE = hermite_slope(POSITIONS), hermite_curvature(POSITIONS)
PLACES = (0, 2, 4, 6)  # index of r and r_x of both nodes in the element
HESSIAN_ROWS = 10  # of a Gauss point in the work space


@compiled
def retarded(c, p, w, p_rate, w_rate, time):
    """Return EA, EI and the initial strains minus time × (ε̇, κ̇).

    The forces of a Kelvin–Voigt solid are those of the strains ε + time ε̇ and κ + time κ̇.
    """
    EA, EI, strain, curvature = c
    (px, py), (wx, wy), (pu, pv), (wu, wv) = p, w, p_rate, w_rate
    nn = px * px + py * py
    half = px * pu + py * pv  # half the time derivative of nn
    turning = pu * wy + px * wv - pv * wx - py * wu
    kappa = (px * wy - py * wx) / nn
    strain -= time * half / sqrt(nn)
    return EA, EI, strain, curvature - time * (turning - 2.0 * kappa * half) / nn


@compiled
def _section(c, p, w):
    """Return p·p, |p|, κ, the axial force N and the bending moment M."""
    (px, py), (wx, wy) = p, w
    nn = px * px + py * py
    n, kappa = sqrt(nn), (px * wy - py * wx) / nn
    return nn, n, kappa, c[0] * (n - 1.0 - c[2]), c[1] * (kappa - c[3])


@compiled
def gradient(c, p, w):
    """Return the derivatives of ½ EA (|p| − 1 − ε₀)² + ½ EI (κ − κ₀)² by p and by w."""
    (px, py), (wx, wy) = p, w
    nn, n, kappa, N, M = _section(c, p, w)
    b = M / nn
    a = N / n - 2.0 * b * kappa
    return (a * px + b * wy, a * py - b * wx), (-b * py, b * px)


@compiled
def hessian(c, p, w, stiffening):
    """Return the second derivatives pp (xx, xy, yy), pw (xx, xy, yx, yy) and ww side by side.

    Damping multiplies EA and EI by `stiffening`, except in the section forces.
    """
    EA, EI = stiffening * c[0], stiffening * c[1]
    (px, py), (wx, wy) = p, w
    nn, n, kappa, N, M = _section(c, p, w)
    kx, ky = (wy - 2.0 * kappa * px) / nn, (-wx - 2.0 * kappa * py) / nn  # κ by p
    qx, qy = -py / nn, px / nn  # κ by w
    b = M / nn
    round_ = N / n - 2.0 * b * kappa  # of the unit matrix
    along = (EA - N / n) / nn + 8.0 * b * kappa / nn  # of p pᵀ
    bend = -2.0 * b / nn  # of p (wy, −wx) and its transpose
    pp = (
        round_ + along * px * px + bend * 2.0 * px * wy + EI * kx * kx,
        along * px * py + bend * (py * wy - px * wx) + EI * kx * ky,
        round_ + along * py * py - bend * 2.0 * py * wx + EI * ky * ky,
    )
    pw = (
        EI * kx * qx - bend * px * py,
        EI * kx * qy + b + bend * px * px,
        EI * ky * qx - b - bend * py * py,
        EI * ky * qy + bend * px * py,
    )
    return pp + pw + (EI * qx * qx, EI * qx * qy, EI * qy * qy)


@compiled
def _at_gauss_point(z, first, il, g):
    """Return p and w at Gauss point g of the element whose coordinates start at z_first."""
    px, py, wx, wy = 0.0 * il, 0.0 * il, 0.0 * il, 0.0 * il
    for a in range(4):
        x, y = load(z, first + PLACES[a]), load(z, first + PLACES[a] + 1)
        slope, curve = _shapes(a, g, il)
        px, py, wx, wy = px + slope * x, py + slope * y, wx + curve * x, wy + curve * y
    return (px, py), (wx, wy)


@compiled
def _shapes(a, g, il):
    """Return the first and second derivative of shape a by x; that of an r_x has the factor l."""
    if a % 2 == 0:
        return SLOPE[a, g] * il, CURVE[a, g] * il * il
    return SLOPE[a, g] + 0.0 * il, CURVE[a, g] * il


@compiled
def add_cable_forces(cables, values, z, velocity, r):
    """Add the elastic and damping forces F(q, q̇) to `r`; [0, v] starts in row `velocity` of z."""
    for e in range(len(cables.first)):
        first, il = cables.first[e], load(values.inverse_length, e)
        for g in range(GAUSS_POINTS):
            p, w = _at_gauss_point(z, first, il, g)
            c = load_rows(values.stiffness, 4 * (GAUSS_POINTS * e + g), 4)
            if cables.damped[e]:
                p1, w1 = _at_gauss_point(z, velocity + first, il, g)
                c = retarded(c, p, w, p1, w1, load(values.retardation, e))
            fp, fw = gradient(c, p, w)
            for a in range(4):
                slope, curve = _shapes(a, g, il)
                row = first + PLACES[a]
                add_to(r, row, slope * fp[0] + curve * fw[0])
                add_to(r, row + 1, slope * fp[1] + curve * fw[1])


@compiled
def cable_energy(cables, values, z):
    """Return the elastic energy of all cables [J]."""
    total = 0.0 * load(z, 0)
    for e in range(len(cables.first)):
        first, il = cables.first[e], load(values.inverse_length, e)
        for g in range(GAUSS_POINTS):
            (px, py), (wx, wy) = _at_gauss_point(z, first, il, g)
            EA, EI, strain, curvature = load_rows(values.stiffness, 4 * (GAUSS_POINTS * e + g), 4)
            nn = px * px + py * py
            stretch, bend = sqrt(nn) - 1.0 - strain, (px * wy - py * wx) / nn - curvature
            total += 0.5 * (EA * stretch * stretch + EI * bend * bend)
    return total


@compiled
def add_cable_tangent(cables, values, z, velocity, weight, rate, matrix, blocks):
    """Add weight × (∂F/∂q + rate ∂F/∂q̇) of the cables to `matrix`; `blocks` is work space.

    The derivative of the damping forces by q is neglected.
    """
    for e in range(len(cables.first)):
        first, il, slot = cables.first[e], load(values.inverse_length, e), cables.slot[e]
        for g in range(GAUSS_POINTS):
            p, w = _at_gauss_point(z, first, il, g)
            c = load_rows(values.stiffness, 4 * (GAUSS_POINTS * e + g), 4)
            stiffening = 1.0 + 0.0 * il
            if cables.damped[e]:
                time = load(values.retardation, e)
                p1, w1 = _at_gauss_point(z, velocity + first, il, g)
                c, stiffening = retarded(c, p, w, p1, w1, time), 1.0 + rate * time
            store_rows(blocks, g * HESSIAN_ROWS, hessian(c, p, w, stiffening))
        for a in range(4):
            for b in range(a, 4):
                _add_block(a, b, il, weight, blocks, slot, matrix)


@compiled
def _add_block(a, b, il, weight, blocks, slot, matrix):
    """Add the sum over the Gauss points of the block of shapes a and b."""
    total = (0.0 * il, 0.0 * il, 0.0 * il, 0.0 * il)
    for g in range(GAUSS_POINTS):
        (pa, wa), (pb, wb) = _shapes(a, g, il), _shapes(b, g, il)
        xx, xy, yy, pw_xx, pw_xy, pw_yx, pw_yy, ww_xx, ww_xy, ww_yy = load_rows(
            blocks, g * HESSIAN_ROWS, HESSIAN_ROWS
        )
        total = plus(total, pa * pb, (xx, xy, xy, yy))
        total = plus(total, pa * wb, (pw_xx, pw_xy, pw_yx, pw_yy))
        total = plus(total, wa * pb, (pw_xx, pw_yx, pw_xy, pw_yy))
        total = plus(total, wa * wb, (ww_xx, ww_xy, ww_xy, ww_yy))
    add_block(matrix, slot, PLACES[a], PLACES[b], weight, total)
