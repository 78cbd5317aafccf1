"""The equations of motion, Eq. (26), on lanes: residual and tangent, assembled from the parts.

With z = [1, q, λ] the constraints enter through the potential Σ c f(t) z_k z_i z_j, where z_k is
the multiplier of the row: its derivative by z_k is the constraint Φ_k, by z_i and z_j the
constraint force Φ_qᵀλ, and its second derivatives are Φ_q and Σ λ Φ_qq. One loop serves every
joint.

State `z` also holds velocities and accelerations: z = [1, q, λ | 0, v | 0, a], in rows of lanes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexband.lanes import WIDTH, compiled, load, sqrt, store
from flexband.mechanics.beam import GAUSS_POINTS, POSITIONS, hermite_slope
from flexband.mechanics.element import gradient, hessian
from flexband.mechanics.factorization import Pattern


class Structure(NamedTuple):
    """What is the same for all samples: sizes, and which number goes where."""

    coordinates: int
    multipliers: int
    functions: int  # of time, the constant one included
    mass_i: np.ndarray
    mass_j: np.ndarray
    mass_slot: np.ndarray
    element_first: np.ndarray  # first coordinate of the element's twelve
    element_slot: np.ndarray  # (elements, 12, 12)
    term_k: np.ndarray  # multiplier
    term_i: np.ndarray
    term_j: np.ndarray
    term_f: np.ndarray
    term_slot: np.ndarray  # (terms, 3): of (k, i), (k, j), (i, j)
    spring_start: np.ndarray  # spring -> first of its coordinates
    spring_coordinate: np.ndarray
    spring_slot: np.ndarray  # (springs, most coordinates, most coordinates)
    sensor_row: np.ndarray
    sensor_i: np.ndarray
    sensor_j: np.ndarray
    sensor_f: np.ndarray
    pattern: Pattern


class Values(NamedTuple):
    """The numbers of one block of samples, each of shape (rows, WIDTH)."""

    start: np.ndarray  # guess of [1, q]
    inverse_scale: np.ndarray  # of [1, q]: one over the size of the mechanism, or one
    mass: np.ndarray
    force: np.ndarray  # constant forces on [1, q]
    inverse_length: np.ndarray  # of elements
    stiffness: np.ndarray  # nine rows a Gauss point
    rigidity: np.ndarray  # weight of K against M in the projections at the start [s²]
    coefficient: np.ndarray  # of terms
    spring_x: np.ndarray  # of the spring's coordinates, in the X component of its vector
    spring_y: np.ndarray
    spring_stiffness: np.ndarray
    rest_length: np.ndarray  # negative: relaxed at the start
    sensor: np.ndarray
    functions: np.ndarray  # `Structure.functions` rows a time
    rates: np.ndarray  # values, first and second derivatives of the functions at the start


class Work(NamedTuple):
    """Work space of one block, each array of shape (rows, WIDTH)."""

    z: np.ndarray
    a: np.ndarray  # the integrator's acceleration-like variable, rows as [1, q]
    r: np.ndarray  # residual, then solution, rows as [1, q, λ]
    matrix: np.ndarray
    factor: np.ndarray
    inverse_pivots: np.ndarray
    blocks: np.ndarray  # second derivatives at the Gauss points of an element
    rate: np.ndarray  # of Newton's convergence, one row

    @staticmethod
    def of(structure: Structure) -> Work:
        """Return work space for a mechanism, zeros."""
        unknowns, slots = structure.pattern.size, structure.pattern.slots + 1
        q = structure.coordinates + 1
        rows = (unknowns + 1 + 2 * q, q, unknowns + 1, slots, slots, unknowns)
        rows += (GAUSS_POINTS * HESSIAN_ROWS, 1)
        return Work(*(np.zeros((count, WIDTH)) for count in rows))


# Shape functions at the Gauss points: rows h, h_i, h_j of p and 1−ξ, ξ of d.
_SLOPE = hermite_slope(POSITIONS)
SHAPES = np.stack([_SLOPE[2], _SLOPE[1], _SLOPE[3], 1 - POSITIONS, POSITIONS])
PRODUCTS = SHAPES[:, None, :] * SHAPES[None, :, :]
ONES = np.ones(GAUSS_POINTS)
P_SHAPE, P_COORDINATE = (0, 1, 0, 2), (0, 2, 6, 8)  # r_i, r_xi, r_j, r_xj
D_SHAPE, D_COORDINATE = (3, 4), (4, 10)  # r_yi, r_yj
# Rows of a Gauss point's second derivatives in the work space.
PP, PW, PD, WW, WD, DD, HESSIAN_ROWS = 0, 3, 7, 11, 14, 18, 21


@compiled
def _pair(z, row):
    return load(z, row), load(z, row + 1)


@compiled
def _element_vectors(z, first, inverse_length):
    """Return u, r_xi, r_xj, d_i, d_j and w of an element."""
    xi, yi = _pair(z, first)
    xj, yj = _pair(z, first + 6)
    dxi, dyi = _pair(z, first + 4)
    dxj, dyj = _pair(z, first + 10)
    u = ((xj - xi) * inverse_length, (yj - yi) * inverse_length)
    w = ((dxj - dxi) * inverse_length, (dyj - dyi) * inverse_length)
    return u, _pair(z, first + 2), _pair(z, first + 8), (dxi, dyi), (dxj, dyj), w


@compiled
def _at_gauss_point(g, u, gi, gj, di, dj):
    """Return p and d at a Gauss point."""
    h, hi, hj, ni, nj = SHAPES[0, g], SHAPES[1, g], SHAPES[2, g], SHAPES[3, g], SHAPES[4, g]
    p = (h * u[0] + hi * gi[0] + hj * gj[0], h * u[1] + hi * gi[1] + hj * gj[1])
    return p, (ni * di[0] + nj * dj[0], ni * di[1] + nj * dj[1])


@compiled
def _stiffness(values, e, g):
    c, row = values.stiffness, (e * GAUSS_POINTS + g) * 9
    return (
        load(c, row),
        load(c, row + 1),
        load(c, row + 2),
        load(c, row + 3),
        load(c, row + 4),
        load(c, row + 5),
        load(c, row + 6),
        load(c, row + 7),
        load(c, row + 8),
    )


@compiled
def _add(array, row, value):
    store(array, row, load(array, row) + value)


@compiled
def add_elastic_forces(structure, values, z, r):
    """Add F(q) of the beams."""
    for e in range(len(structure.element_first)):
        first = structure.element_first[e]
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
        for g in range(GAUSS_POINTS):
            p, d = _at_gauss_point(g, u, gi, gj, di, dj)
            fp, fwg, fd = gradient(_stiffness(values, e, g), p, w, d)
            h, hi, hj, ni, nj = SHAPES[0, g], SHAPES[1, g], SHAPES[2, g], SHAPES[3, g], SHAPES[4, g]
            fu = (fu[0] + h * fp[0], fu[1] + h * fp[1])
            fgi = (fgi[0] + hi * fp[0], fgi[1] + hi * fp[1])
            fgj = (fgj[0] + hj * fp[0], fgj[1] + hj * fp[1])
            fdi = (fdi[0] + ni * fd[0], fdi[1] + ni * fd[1])
            fdj = (fdj[0] + nj * fd[0], fdj[1] + nj * fd[1])
            fw = (fw[0] + fwg[0], fw[1] + fwg[1])
        for axis in range(2):
            _add(r, first + axis, -il * fu[axis])
            _add(r, first + 2 + axis, fgi[axis])
            _add(r, first + 4 + axis, fdi[axis] - il * fw[axis])
            _add(r, first + 6 + axis, il * fu[axis])
            _add(r, first + 8 + axis, fgj[axis])
            _add(r, first + 10 + axis, fdj[axis] + il * fw[axis])


@compiled
def _sum3(blocks, k, weights):
    """Return Σ over Gauss points of weight × the symmetric block at row k, as xx, xy, yx, yy."""
    xx, xy, yy = 0.0 * load(blocks, 0), 0.0 * load(blocks, 0), 0.0 * load(blocks, 0)
    for g in range(GAUSS_POINTS):
        weight, row = weights[g], g * HESSIAN_ROWS + k
        xx += weight * load(blocks, row)
        xy += weight * load(blocks, row + 1)
        yy += weight * load(blocks, row + 2)
    return xx, xy, xy, yy


@compiled
def _sum4(blocks, k, weights):
    """Return Σ over Gauss points of weight × the block at row k, as xx, xy, yx, yy."""
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
    """Add a 2 × 2 block, rows from coordinate `a` and columns from coordinate `b`."""
    _add(matrix, slot[a, b], factor * block[0])
    _add(matrix, slot[a, b + 1], factor * block[1])
    if a != b:
        _add(matrix, slot[a + 1, b], factor * block[2])
    _add(matrix, slot[a + 1, b + 1], factor * block[3])


@compiled
def add_elastic_tangent(structure, values, z, weight, matrix, blocks):
    """Add `weight` times K = ∂F/∂q of the beams; `blocks` is work space."""
    for e in range(len(structure.element_first)):
        il = load(values.inverse_length, e)
        u, gi, gj, di, dj, w = _element_vectors(z, structure.element_first[e], il)
        for g in range(GAUSS_POINTS):
            p, d = _at_gauss_point(g, u, gi, gj, di, dj)
            pp, pw, pd, ww, wd, dd = hessian(_stiffness(values, e, g), p, w, d)
            row = g * HESSIAN_ROWS
            for k in range(3):
                store(blocks, row + PP + k, pp[k])
                store(blocks, row + WW + k, ww[k])
                store(blocks, row + DD + k, dd[k])
            for k in range(4):
                store(blocks, row + PW + k, pw[k])
                store(blocks, row + PD + k, pd[k])
                store(blocks, row + WD + k, wd[k])
        _scatter_tangent(structure.element_slot[e], il, weight, matrix, blocks)


@compiled
def _scatter_tangent(slot, il, weight, matrix, blocks):
    """Sum the Gauss points' blocks; p moves with r and r_x, d and w with r_y of both nodes."""
    p_factor = (-il, 1.0 + 0.0 * il, il, 1.0 + 0.0 * il)
    w_factor = (-il, il)
    for a in range(4):
        for b in range(a, 4):
            pp = _sum3(blocks, PP, PRODUCTS[P_SHAPE[a], P_SHAPE[b]])
            factor = weight * p_factor[a] * p_factor[b]
            _add_block(matrix, slot, P_COORDINATE[a], P_COORDINATE[b], factor, pp)
        for b in range(2):
            pd = _sum4(blocks, PD, PRODUCTS[P_SHAPE[a], D_SHAPE[b]])
            pw = _sum4(blocks, PW, SHAPES[P_SHAPE[a]])
            f = w_factor[b]
            block = (pd[0] + f * pw[0], pd[1] + f * pw[1], pd[2] + f * pw[2], pd[3] + f * pw[3])
            factor = weight * p_factor[a]
            _add_block(matrix, slot, P_COORDINATE[a], D_COORDINATE[b], factor, block)
    ww = _sum3(blocks, WW, ONES)
    for a in range(2):
        for b in range(a, 2):
            dd = _sum3(blocks, DD, PRODUCTS[D_SHAPE[a], D_SHAPE[b]])
            wb = _sum4(blocks, WD, SHAPES[D_SHAPE[b]])
            wa = _sum4(blocks, WD, SHAPES[D_SHAPE[a]])  # w follows d_b here: transposed below
            fa, fb = w_factor[a], w_factor[b]
            block = (
                dd[0] + fa * fb * ww[0] + fa * wb[0] + fb * wa[0],
                dd[1] + fa * fb * ww[1] + fa * wb[1] + fb * wa[2],
                dd[2] + fa * fb * ww[2] + fa * wb[2] + fb * wa[1],
                dd[3] + fa * fb * ww[3] + fa * wb[3] + fb * wa[3],
            )
            _add_block(matrix, slot, D_COORDINATE[a], D_COORDINATE[b], weight, block)


@compiled
def add_spring_forces(structure, values, z, r):
    """Add the forces k (ℓ − ℓ₀) of the springs."""
    for s in range(len(structure.spring_start) - 1):
        begin, end = structure.spring_start[s], structure.spring_start[s + 1]
        x, y, length = spring_vector(structure, values, z, s)
        stiffness = load(values.spring_stiffness, s)
        tension = stiffness * (1.0 - load(values.rest_length, s) / length)  # over the length
        for p in range(begin, end):
            force = x * load(values.spring_x, p) + y * load(values.spring_y, p)
            _add(r, structure.spring_coordinate[p], tension * force)


@compiled
def add_spring_tangent(structure, values, z, weight, matrix):
    """Add `weight` times the tangent of the springs, k n nᵀ + k (1 − ℓ₀/ℓ) (I − n nᵀ)."""
    for s in range(len(structure.spring_start) - 1):
        begin, end = structure.spring_start[s], structure.spring_start[s + 1]
        x, y, length = spring_vector(structure, values, z, s)
        stiffness = weight * load(values.spring_stiffness, s)
        ratio = load(values.rest_length, s) / length
        nx, ny = x / length, y / length
        for p in range(begin, end):
            px, py = load(values.spring_x, p), load(values.spring_y, p)
            for q in range(p, end):
                qx, qy = load(values.spring_x, q), load(values.spring_y, q)
                along = (nx * px + ny * py) * (nx * qx + ny * qy)
                entry = stiffness * ((1.0 - ratio) * (px * qx + py * qy) + ratio * along)
                _add(matrix, structure.spring_slot[s, p - begin, q - begin], entry)


@compiled
def spring_vector(structure, values, z, s):
    """Return the components and the length of a spring's vector."""
    x, y = 0.0 * load(z, 0), 0.0 * load(z, 0)
    for p in range(structure.spring_start[s], structure.spring_start[s + 1]):
        coordinate = load(z, structure.spring_coordinate[p])
        x += load(values.spring_x, p) * coordinate
        y += load(values.spring_y, p) * coordinate
    return x, y, sqrt(x * x + y * y)


@compiled
def add_constraints(structure, values, now, z, r):
    """Add Φ to the multipliers' rows and Φ_qᵀλ to the coordinates'."""
    for t in range(len(structure.term_k)):
        k, i, j = structure.term_k[t], structure.term_i[t], structure.term_j[t]
        c = load(values.coefficient, t) * load(values.functions, now + structure.term_f[t])
        zi, zj, zk = load(z, i), load(z, j), c * load(z, k)
        _add(r, k, c * zi * zj)
        _add(r, i, zk * zj)
        _add(r, j, zk * zi)


@compiled
def add_constraint_tangent(structure, values, now, z, weight, matrix):
    """Add Φ_q, and `weight` times Σ λ Φ_qq."""
    for t in range(len(structure.term_k)):
        i, j = structure.term_i[t], structure.term_j[t]
        c = load(values.coefficient, t) * load(values.functions, now + structure.term_f[t])
        slot = structure.term_slot[t]
        _add(matrix, slot[0], c * load(z, j))
        _add(matrix, slot[1], c * load(z, i))
        curvature = weight * c * load(z, structure.term_k[t])
        _add(matrix, slot[2], curvature if i != j else curvature + curvature)


@compiled
def add_mass_product(structure, values, z, first, r):
    """Add M x, where x₀ = 0, x₁, x₂, … start in row `first` of z."""
    for p in range(len(structure.mass_i)):
        i, j = structure.mass_i[p], structure.mass_j[p]
        mass = load(values.mass, p)
        _add(r, i, mass * load(z, first + j))
        if i != j:
            _add(r, j, mass * load(z, first + i))


@compiled
def velocity_row(structure):
    """Return the row of z where [0, v] starts."""
    return structure.coordinates + structure.multipliers + 1


@compiled
def acceleration_row(structure):
    """Return the row of z where [0, a] starts."""
    return velocity_row(structure) + structure.coordinates + 1


@compiled
def add_mass(structure, values, matrix):
    """Add M."""
    for p in range(len(structure.mass_slot)):
        _add(matrix, structure.mass_slot[p], load(values.mass, p))


@compiled
def clear(array):
    """Set all rows to zero."""
    for row in range(array.shape[0]):
        for k in range(array.shape[1]):
            array[row, k] = 0.0


@compiled
def residual(structure, values, now, z, r):
    """Set r to [M a + Φ_qᵀλ + F(q) − Q; Φ(q, t)] of Eq. (27), rows numbered as z."""
    clear(r)
    add_mass_product(structure, values, z, acceleration_row(structure), r)
    for i in range(1, structure.coordinates + 1):
        _add(r, i, -load(values.force, i))
    add_elastic_forces(structure, values, z, r)
    add_spring_forces(structure, values, z, r)
    add_constraints(structure, values, now, z, r)


@compiled
def tangent(structure, values, now, z, weight, matrix, blocks):
    """Set the matrix to [M + weight (K + Σ λ Φ_qq), Φ_qᵀ; Φ_q, 0]."""
    clear(matrix)
    add_mass(structure, values, matrix)
    add_elastic_tangent(structure, values, z, weight, matrix, blocks)
    add_spring_tangent(structure, values, z, weight, matrix)
    add_constraint_tangent(structure, values, now, z, weight, matrix)


@compiled
def sense(structure, values, now, z, outputs):
    """Set the outputs, one row a component of a sensor."""
    clear(outputs)
    for t in range(len(structure.sensor_row)):
        c = load(values.sensor, t) * load(values.functions, now + structure.sensor_f[t])
        product = load(z, structure.sensor_i[t]) * load(z, structure.sensor_j[t])
        _add(outputs, structure.sensor_row[t], c * product)
