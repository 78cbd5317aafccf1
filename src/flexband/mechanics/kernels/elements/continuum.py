"""Elastic forces, tangent and energy of all continuum elements, on lanes."""

from __future__ import annotations

import numpy as np

from flexband.mechanics.kernels.elements.continuum_strains import (
    energy,
    gradient,
    hessian,
    resultants,
    strain_rates,
    strains,
)
from flexband.mechanics.kernels.elements.hermite import GAUSS_POINTS, POSITIONS, hermite_slope
from flexband.mechanics.kernels.lanes import (
    add_block,
    add_to,
    compiled,
    load,
    load_rows,
    plus,
    store_rows,
    times,
)

# Shape functions at the Gauss points: h, h_i, h_j of p, and 1 − ξ, ξ of d.
_SLOPE = hermite_slope(POSITIONS)
SHAPES = np.stack([_SLOPE[2], _SLOPE[1], _SLOPE[3], 1 - POSITIONS, POSITIONS])
PRODUCTS = SHAPES[:, None, :] * SHAPES[None, :, :]
ONES = np.ones(GAUSS_POINTS)
P_COORDINATE = (-1, 2, 8)  # index of r_xi and r_xj in the element; the chord depends on r_i and r_j
D_SHAPE = (3, 4)
D_COORDINATE = (4, 10)  # shape and index of r_yi and r_yj
# Rows of the second derivatives of a Gauss point in the work space.
PP = 0
PW = 3
PD = 7
WW = 11
WD = 14
DD = 18
HESSIAN_ROWS = 21


@compiled
def _vectors(z, first, il):
    """Return u, r_xi, r_xj, d_i, d_j and w of the element whose coordinates start at z_first."""
    xi, yi, gxi, gyi, dxi, dyi, xj, yj, gxj, gyj, dxj, dyj = load_rows(z, first, 12)
    u = ((xj - xi) * il, (yj - yi) * il)
    w = ((dxj - dxi) * il, (dyj - dyi) * il)
    return u, (gxi, gyi), (gxj, gyj), (dxi, dyi), (dxj, dyj), w


@compiled
def _section(vectors, g):
    """Return (p, w, d) at Gauss point g."""
    (ux, uy), (xi, yi), (xj, yj), (dxi, dyi), (dxj, dyj), w = vectors
    h = SHAPES[0, g]
    hi = SHAPES[1, g]
    hj = SHAPES[2, g]
    ni = SHAPES[3, g]
    nj = SHAPES[4, g]
    p = (h * ux + hi * xi + hj * xj, h * uy + hi * yi + hj * yj)
    return p, w, (ni * dxi + nj * dxj, ni * dyi + nj * dyj)


@compiled
def _strains_and_stiffness(elements, values, e, g, section):
    """Return the strains and the stiffness coefficients of a section at Gauss point g."""
    strain = strains(section)
    c = load_rows(values.stiffness, 9 * (GAUSS_POINTS * e + g), 9)
    if elements.initial[e] >= 0:
        strain = plus(strain, -1.0, load_rows(values.initial, elements.initial[e] + 6 * g, 6))
    return strain, c


@compiled
def _resultants(elements, values, e, g, section, rates):
    """Return the resultants of a section with those of its damping, and its stiffness."""
    strain, c = _strains_and_stiffness(elements, values, e, g, section)
    if elements.damped[e]:  # the stresses of a Kelvin–Voigt solid are those of E + τ Ė
        rate = strain_rates(section, _section(rates, g))
        strain = plus(strain, load(values.retardation, e), rate)
    return resultants(c, strain), c


@compiled
def add_continuum_forces(elements, values, z, velocity, r):
    """Add the elastic and damping forces F(q, q̇) to `r`; [0, v] starts in row `velocity` of z."""
    for e in range(len(elements.first)):
        il = load(values.inverse_length, e)
        first = elements.first[e]
        vectors = _vectors(z, first, il)
        rates = _vectors(z, velocity + first, il)
        fu = fgi = fgj = fdi = fdj = fw = (0.0 * il, 0.0 * il)
        for g in range(GAUSS_POINTS):
            section = _section(vectors, g)
            forces, _ = _resultants(elements, values, e, g, section, rates)
            fp, fwg, fd = gradient(forces, section)
            fu = plus(fu, SHAPES[0, g], fp)
            fw = plus(fw, 1.0, fwg)
            fgi = plus(fgi, SHAPES[1, g], fp)
            fgj = plus(fgj, SHAPES[2, g], fp)
            fdi = plus(fdi, SHAPES[3, g], fd)
            fdj = plus(fdj, SHAPES[4, g], fd)
        for axis in range(2):
            row = first + axis
            add_to(r, row, -il * fu[axis])
            add_to(r, row + 2, fgi[axis])
            add_to(r, row + 4, fdi[axis] - il * fw[axis])
            add_to(r, row + 6, il * fu[axis])
            add_to(r, row + 8, fgj[axis])
            add_to(r, row + 10, fdj[axis] + il * fw[axis])


@compiled
def continuum_energy(elements, values, z):
    """Return the elastic energy of all continuum elements [J]."""
    total = 0.0 * load(z, 0)
    for e in range(len(elements.first)):
        vectors = _vectors(z, elements.first[e], load(values.inverse_length, e))
        for g in range(GAUSS_POINTS):
            section = _section(vectors, g)
            strain, c = _strains_and_stiffness(elements, values, e, g, section)
            total += energy(resultants(c, strain), strain)
    return total


@compiled
def _sum3(blocks, k, weights):
    """Return Σ weight × symmetric block at row k over the Gauss points, as xx, xy, yx, yy."""
    total = times(weights[0], load_rows(blocks, k, 3))
    for g in range(1, GAUSS_POINTS):
        total = plus(total, weights[g], load_rows(blocks, g * HESSIAN_ROWS + k, 3))
    return total[0], total[1], total[1], total[2]


@compiled
def _sum4(blocks, k, weights):
    """Return Σ weight × block at row k over the Gauss points, as xx, xy, yx, yy."""
    total = times(weights[0], load_rows(blocks, k, 4))
    for g in range(1, GAUSS_POINTS):
        total = plus(total, weights[g], load_rows(blocks, g * HESSIAN_ROWS + k, 4))
    return total


@compiled
def add_continuum_tangent(elements, values, z, velocity, weight, rate, matrix, blocks):
    """Add weight × (∂F/∂q + rate ∂F/∂q̇) of the elements to `matrix`; `blocks` is work space."""
    for e in range(len(elements.first)):
        il = load(values.inverse_length, e)
        first = elements.first[e]
        vectors = _vectors(z, first, il)
        rates = _vectors(z, velocity + first, il)
        for g in range(GAUSS_POINTS):
            section = _section(vectors, g)
            forces, c = _resultants(elements, values, e, g, section, rates)
            if elements.damped[e]:
                c = plus(c, rate * load(values.retardation, e), c)
            store_rows(blocks, g * HESSIAN_ROWS, hessian(c, forces, section))
        _scatter_tangent(elements.slot[e], il, weight, matrix, blocks)


@compiled
def _scatter_tangent(slot, il, weight, matrix, blocks):
    """Sum the blocks of the Gauss points and add them to `matrix`."""
    # Blocks of the places and slopes of the nodes.
    uu = _sum3(blocks, PP, PRODUCTS[0, 0])
    r_i = 0
    r_j = 6
    add_block(matrix, slot, r_i, r_i, weight * il * il, uu)
    add_block(matrix, slot, r_i, r_j, -weight * il * il, uu)
    add_block(matrix, slot, r_j, r_j, weight * il * il, uu)
    for b in range(1, 3):
        ug = _sum3(blocks, PP, PRODUCTS[0, b])
        add_block(matrix, slot, r_i, P_COORDINATE[b], -weight * il, ug)
        add_block(matrix, slot, r_j, P_COORDINATE[b], weight * il, ug)
        for a in range(1, b + 1):
            gg = _sum3(blocks, PP, PRODUCTS[a, b])
            add_block(matrix, slot, P_COORDINATE[a], P_COORDINATE[b], weight, gg)
    # Blocks that couple these with the directors.
    w_factor = (-il, il)
    for a in range(3):
        pw = _sum4(blocks, PW, SHAPES[a])
        for b in range(2):
            block = plus(_sum4(blocks, PD, PRODUCTS[a, D_SHAPE[b]]), w_factor[b], pw)
            if a == 0:
                add_block(matrix, slot, r_i, D_COORDINATE[b], -weight * il, block)
                add_block(matrix, slot, r_j, D_COORDINATE[b], weight * il, block)
            else:
                add_block(matrix, slot, P_COORDINATE[a], D_COORDINATE[b], weight, block)
    # Blocks of the directors.
    ww = _sum3(blocks, WW, ONES)
    wd = _sum4(blocks, WD, SHAPES[D_SHAPE[0]]), _sum4(blocks, WD, SHAPES[D_SHAPE[1]])
    for a in range(2):
        for b in range(a, 2):
            xx, xy, yx, yy = wd[a]
            block = _sum3(blocks, DD, PRODUCTS[D_SHAPE[a], D_SHAPE[b]])
            block = plus(block, w_factor[a] * w_factor[b], ww)
            block = plus(plus(block, w_factor[a], wd[b]), w_factor[b], (xx, yx, xy, yy))
            add_block(matrix, slot, D_COORDINATE[a], D_COORDINATE[b], weight, block)
