"""Elastic forces, tangent and energy of all beam elements, on lanes."""

from __future__ import annotations

import numpy as np

from flexband.mechanics.kernels.beam_strains import (
    energy,
    gradient,
    hessian,
    resultants,
    retarded,
    strain_rates,
    strains,
    without,
)
from flexband.mechanics.kernels.hermite import GAUSS_POINTS, POSITIONS, hermite_slope
from flexband.mechanics.kernels.lanes import add_to, compiled, load, load_rows, store_rows

# Shape functions at the Gauss points: h, h_i, h_j of p, and 1 − ξ, ξ of d.
_SLOPE = hermite_slope(POSITIONS)
SHAPES = np.stack([_SLOPE[2], _SLOPE[1], _SLOPE[3], 1 - POSITIONS, POSITIONS])
PRODUCTS = SHAPES[:, None, :] * SHAPES[None, :, :]
ONES = np.ones(GAUSS_POINTS)
P_COORDINATE = (-1, 2, 8)  # index of r_xi and r_xj in the element; the chord depends on r_i and r_j
D_SHAPE, D_COORDINATE = (3, 4), (4, 10)  # shape and index of r_yi and r_yj
# Rows of the second derivatives of a Gauss point in the work space.
PP, PW, PD, WW, WD, DD, HESSIAN_ROWS = 0, 3, 7, 11, 14, 18, 21


@compiled
def _element_vectors(z, first, inverse_length):
    """Return u, r_xi, r_xj, d_i, d_j and w of the element whose coordinates start at z_first."""
    xi, yi = load_rows(z, first, 2)
    xj, yj = load_rows(z, first + 6, 2)
    dxi, dyi = load_rows(z, first + 4, 2)
    dxj, dyj = load_rows(z, first + 10, 2)
    u = ((xj - xi) * inverse_length, (yj - yi) * inverse_length)
    w = ((dxj - dxi) * inverse_length, (dyj - dyi) * inverse_length)
    return u, load_rows(z, first + 2, 2), load_rows(z, first + 8, 2), (dxi, dyi), (dxj, dyj), w


@compiled
def _at_gauss_point(g, u, gi, gj, di, dj):
    """Return p and d at Gauss point g."""
    h, hi, hj, ni, nj = SHAPES[0, g], SHAPES[1, g], SHAPES[2, g], SHAPES[3, g], SHAPES[4, g]
    p = (h * u[0] + hi * gi[0] + hj * gj[0], h * u[1] + hi * gi[1] + hj * gj[1])
    return p, (ni * di[0] + nj * dj[0], ni * di[1] + nj * dj[1])


@compiled
def _section(beams, values, e, g, p, w, d):
    """Return the stiffness coefficients and the strains of the section at Gauss point g."""
    c, strain = load_rows(values.stiffness, 9 * (GAUSS_POINTS * e + g), 9), strains(p, w, d)
    if beams.initial[e] >= 0:
        strain = without(strain, load_rows(values.initial, beams.initial[e] + 6 * g, 6))
    return c, strain


@compiled
def _scaled(c, factor):
    """Return the nine stiffness coefficients times a factor."""
    c0, c1, c2, c3, c4, c5, c6, c7, c8 = c
    return (
        factor * c0,
        factor * c1,
        factor * c2,
        factor * c3,
        factor * c4,
        factor * c5,
        factor * c6,
        factor * c7,
        factor * c8,
    )


@compiled
def add_elastic_forces(beams, values, z, velocity, r):
    """Add the elastic and damping forces F(q, q̇) to `r`; [0, v] starts in row `velocity` of z."""
    for e in range(len(beams.first)):
        first = beams.first[e]
        il = load(values.inverse_length, e)
        u, gi, gj, di, dj, w = _element_vectors(z, first, il)
        fu, fgi, fgj, fdi, fdj, fw = (
            (0.0 * il, 0.0 * il),
            (0.0 * il, 0.0 * il),
            (0.0 * il, 0.0 * il),
            (0.0 * il, 0.0 * il),
            (0.0 * il, 0.0 * il),
            (0.0 * il, 0.0 * il),
        )
        time, damped = load(values.retardation, e), beams.damped[e]
        u1, gi1, gj1, di1, dj1, w1 = _element_vectors(z, velocity + first, il)
        for g in range(GAUSS_POINTS):
            p, d = _at_gauss_point(g, u, gi, gj, di, dj)
            c, strain = _section(beams, values, e, g, p, w, d)
            if damped:
                p1, d1 = _at_gauss_point(g, u1, gi1, gj1, di1, dj1)
                strain = retarded(strain, strain_rates(p, w, d, p1, w1, d1), time)
            fp, fwg, fd = gradient(resultants(c, strain), p, w, d)
            h, hi, hj, ni, nj = SHAPES[0, g], SHAPES[1, g], SHAPES[2, g], SHAPES[3, g], SHAPES[4, g]
            fu = (fu[0] + h * fp[0], fu[1] + h * fp[1])
            fgi = (fgi[0] + hi * fp[0], fgi[1] + hi * fp[1])
            fgj = (fgj[0] + hj * fp[0], fgj[1] + hj * fp[1])
            fdi = (fdi[0] + ni * fd[0], fdi[1] + ni * fd[1])
            fdj = (fdj[0] + nj * fd[0], fdj[1] + nj * fd[1])
            fw = (fw[0] + fwg[0], fw[1] + fwg[1])
        for axis in range(2):
            add_to(r, first + axis, -il * fu[axis])
            add_to(r, first + 2 + axis, fgi[axis])
            add_to(r, first + 4 + axis, fdi[axis] - il * fw[axis])
            add_to(r, first + 6 + axis, il * fu[axis])
            add_to(r, first + 8 + axis, fgj[axis])
            add_to(r, first + 10 + axis, fdj[axis] + il * fw[axis])


@compiled
def beam_energy(beams, values, z):
    """Return the elastic energy of all beams [J]."""
    total = 0.0 * load(z, 0)
    for e in range(len(beams.first)):
        il = load(values.inverse_length, e)
        u, gi, gj, di, dj, w = _element_vectors(z, beams.first[e], il)
        for g in range(GAUSS_POINTS):
            p, d = _at_gauss_point(g, u, gi, gj, di, dj)
            c, strain = _section(beams, values, e, g, p, w, d)
            total += energy(resultants(c, strain), strain)
    return total


@compiled
def _sum3(blocks, k, weights):
    """Return Σ weight × symmetric block at row k over the Gauss points, as xx, xy, yx, yy."""
    xx, xy, yy = 0.0 * load(blocks, 0), 0.0 * load(blocks, 0), 0.0 * load(blocks, 0)
    for g in range(GAUSS_POINTS):
        weight, row = weights[g], g * HESSIAN_ROWS + k
        xx += weight * load(blocks, row)
        xy += weight * load(blocks, row + 1)
        yy += weight * load(blocks, row + 2)
    return xx, xy, xy, yy


@compiled
def _sum4(blocks, k, weights):
    """Return Σ weight × block at row k over the Gauss points, as xx, xy, yx, yy."""
    zero = 0.0 * load(blocks, 0)
    xx, xy, yx, yy = zero, zero, zero, zero
    for g in range(GAUSS_POINTS):
        weight, row = weights[g], g * HESSIAN_ROWS + k
        xx += weight * load(blocks, row)
        xy += weight * load(blocks, row + 1)
        yx += weight * load(blocks, row + 2)
        yy += weight * load(blocks, row + 3)
    return xx, xy, yx, yy


@compiled
def _add_block(matrix, slot, a, b, factor, block):
    """Add factor × a 2 × 2 block to the rows from coordinate `a` and the columns from `b`."""
    add_to(matrix, slot[a, b], factor * block[0])
    add_to(matrix, slot[a, b + 1], factor * block[1])
    if a != b:
        add_to(matrix, slot[a + 1, b], factor * block[2])
    add_to(matrix, slot[a + 1, b + 1], factor * block[3])


@compiled
def add_elastic_tangent(beams, values, z, velocity, weight, rate, matrix, blocks):
    """Add weight × (∂F/∂q + rate ∂F/∂q̇) of the beams to `matrix`; `blocks` is work space.

    The derivative of the damping forces by q is neglected.
    """
    for e in range(len(beams.first)):
        il, first = load(values.inverse_length, e), beams.first[e]
        u, gi, gj, di, dj, w = _element_vectors(z, first, il)
        time, damped = load(values.retardation, e), beams.damped[e]
        u1, gi1, gj1, di1, dj1, w1 = _element_vectors(z, velocity + first, il)
        for g in range(GAUSS_POINTS):
            p, d = _at_gauss_point(g, u, gi, gj, di, dj)
            c, strain = _section(beams, values, e, g, p, w, d)
            if damped:
                p1, d1 = _at_gauss_point(g, u1, gi1, gj1, di1, dj1)
                strain = retarded(strain, strain_rates(p, w, d, p1, w1, d1), time)
            forces = resultants(c, strain)
            if damped:
                c = _scaled(c, 1.0 + rate * time)
            pp, pw, pd, ww, wd, dd = hessian(c, forces, p, w, d)
            row = g * HESSIAN_ROWS
            store_rows(blocks, row + PP, pp)
            store_rows(blocks, row + PW, pw)
            store_rows(blocks, row + PD, pd)
            store_rows(blocks, row + WW, ww)
            store_rows(blocks, row + WD, wd)
            store_rows(blocks, row + DD, dd)
        _scatter_tangent(beams.slot[e], il, weight, matrix, blocks)


@compiled
def _scatter_tangent(slot, il, weight, matrix, blocks):
    """Sum the blocks of the Gauss points and add them to `matrix`.

    p depends on u = (r_j − r_i)/l and on r_x of both nodes, d and w on r_y of both nodes.
    """
    uu, r_i, r_j = _sum3(blocks, PP, PRODUCTS[0, 0]), 0, 6
    _add_block(matrix, slot, r_i, r_i, weight * il * il, uu)
    _add_block(matrix, slot, r_i, r_j, -weight * il * il, uu)
    _add_block(matrix, slot, r_j, r_j, weight * il * il, uu)
    for b in range(1, 3):
        ug = _sum3(blocks, PP, PRODUCTS[0, b])
        _add_block(matrix, slot, r_i, P_COORDINATE[b], -weight * il, ug)
        _add_block(matrix, slot, r_j, P_COORDINATE[b], weight * il, ug)
        for a in range(1, b + 1):
            gg = _sum3(blocks, PP, PRODUCTS[a, b])
            _add_block(matrix, slot, P_COORDINATE[a], P_COORDINATE[b], weight, gg)
    w_factor = (-il, il)
    for a in range(3):
        pw = _sum4(blocks, PW, SHAPES[a])
        for b in range(2):
            pd, f = _sum4(blocks, PD, PRODUCTS[a, D_SHAPE[b]]), w_factor[b]
            block = (pd[0] + f * pw[0], pd[1] + f * pw[1], pd[2] + f * pw[2], pd[3] + f * pw[3])
            if a == 0:
                _add_block(matrix, slot, r_i, D_COORDINATE[b], -weight * il, block)
                _add_block(matrix, slot, r_j, D_COORDINATE[b], weight * il, block)
            else:
                _add_block(matrix, slot, P_COORDINATE[a], D_COORDINATE[b], weight, block)
    ww = _sum3(blocks, WW, ONES)
    wd = _sum4(blocks, WD, SHAPES[D_SHAPE[0]]), _sum4(blocks, WD, SHAPES[D_SHAPE[1]])
    for a in range(2):
        for b in range(a, 2):
            dd = _sum3(blocks, DD, PRODUCTS[D_SHAPE[a], D_SHAPE[b]])
            wa, wb, fa, fb = wd[a], wd[b], w_factor[a], w_factor[b]
            block = (  # dd, ww, wd, and dw, which is wd transposed
                dd[0] + fa * fb * ww[0] + fa * wb[0] + fb * wa[0],
                dd[1] + fa * fb * ww[1] + fa * wb[1] + fb * wa[2],
                dd[2] + fa * fb * ww[2] + fa * wb[2] + fb * wa[1],
                dd[3] + fa * fb * ww[3] + fa * wb[3] + fb * wa[3],
            )
            _add_block(matrix, slot, D_COORDINATE[a], D_COORDINATE[b], weight, block)
