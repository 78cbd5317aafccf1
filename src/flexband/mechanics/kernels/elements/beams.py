"""Elastic forces, tangent and energy of the elements of beams, on lanes.

An element has nine strains, all without a unit. With e = d/|d|, d = r_y, the direction of a node's
section, n its normal of angle φ, γ the angle from n to g = r_x, and κ of the centre line times l:

    axial      Γ = g · n − 1 at both ends, Γ_m = |p| cos((γ_i + γ_j)/2) − 1 in the middle
    bending    φ_j − φ_i, and κ₂ − κ₁ between the two Gauss points
    shear      Q = g · e at both ends
    thickness  b = (d · d − 1)/2 at both ends

They are those of Reissner's beam, whose section has the angle of the centre line less γ, with γ
linear between the nodes. All but the last depend on d through φ alone.
"""

from __future__ import annotations

import numpy as np

from flexband.mechanics.kernels.elements.centre_line import (
    SUM,
    VARIABLES,
    add_change_of_curvature,
    add_line_tangent,
    add_middle,
    add_row,
    add_to_sum,
    angle_between,
    bend,
    change_row,
    chord,
    dot6,
    line_resultants,
    middle,
    middle_row,
    scale_stiffness,
    stretch,
    sum_products,
)
from flexband.mechanics.kernels.lanes import (
    add_block,
    add_to,
    compiled,
    less,
    load,
    load_rows,
    plus,
    splat,
    sqrt,
    times,
    where,
)

NUMBERS = 23
"""Of an element: the stiffness (axial 6, bending 3, shear 3, thickness 2), nine initial strains."""


@compiled
def _node(z, first):
    """Return g, d, e, n, t, f, g·n, g·e, cos γ/2 and sin γ/2 of the node that starts at z_first.

    t and f are the derivatives of the angles of g and of d. The last two are NaN where γ is more
    than 90°: the section is turned over.
    """
    gx, gy, dx, dy = load_rows(z, first + 2, 4)
    id = 1.0 / sqrt(dx * dx + dy * dy)
    ig = 1.0 / sqrt(gx * gx + gy * gy)
    ex = dx * id
    ey = dy * id
    along = gx * ey - gy * ex
    across = gx * ex + gy * ey
    twice = where(less(splat(0.0), along), 2.0 + 2.0 * along * ig, splat(np.nan))
    c = 0.5 * sqrt(twice)
    s = 0.5 * across * ig / c
    t = (-gy * ig * ig, gx * ig * ig)
    f = (-ey * id, ex * id)
    return (gx, gy), (dx, dy), (ex, ey), (ey, -ex), t, f, along, across, c, s


@compiled
def _element(node_i, node_j, z, first, il):
    """Return p/|p|, |p| and the cosine and sine of γ in the middle, and κ with its derivatives."""
    u = chord(z, first, first + 6, il)
    gi = node_i[0]
    gj = node_j[0]
    p = middle(u, gi, gj)
    length, (ci, si), (cj, sj) = stretch(p, gi, gj), node_i[8:10], node_j[8:10]
    inverse = 1.0 / length
    centre = (p[0] * inverse, p[1] * inverse), length, ci * cj - si * sj, si * cj + ci * sj
    return centre, bend(0, u, gi, gj), bend(1, u, gi, gj)


@compiled
def _strains(node_i, node_j, element):
    ((_, length, cos, _), bent_1, bent_2), di, dj = element, node_i[1], node_j[1]
    return (
        node_i[6] - 1.0,
        length * cos - 1.0,
        node_j[6] - 1.0,
        angle_between(node_i[2], node_j[2]),
        bent_2[0] - bent_1[0],
        node_i[7],
        node_j[7],
        0.5 * (di[0] * di[0] + di[1] * di[1] - 1.0),
        0.5 * (dj[0] * dj[0] + dj[1] * dj[1] - 1.0),
    )


@compiled
def _product(c, strain):
    """Return the resultants: the derivatives of the energy by the strains."""
    Qi, Qj, bi, bj = strain[5:9]
    shear = c[9] * Qi + c[10] * Qj, c[10] * Qi + c[11] * Qj
    return line_resultants(c, strain) + shear + (c[12] * bi, c[13] * bj)


@compiled
def _resultants(beams, values, z, velocity, e, il, node_i, node_j, element):
    """Return the resultants of element e with those of its damping, and its stiffness."""
    numbers = load_rows(values.stiffness, NUMBERS * e, NUMBERS)
    strain = plus(_strains(node_i, node_j, element), -1.0, numbers[14:23])
    if beams.damped[e]:  # the stresses of a Kelvin–Voigt solid are those of E + τ Ė
        rates = _strain_rates(z, velocity + beams.first[e], il, node_i, node_j, element)
        tau = load(values.retardation, 2 * e)
        axial = plus(strain[0:3], tau, rates[0:3])
        rest = plus(strain[5:9], tau, rates[5:9])
        bent = plus(strain[3:5], load(values.retardation, 2 * e + 1), rates[3:5])
        strain = axial + bent + rest
    return _product(numbers[0:14], strain), numbers[0:14]


@compiled
def _node_rates(z, first, node):
    """Return ġ, and the rates of Γ, Q, b, φ and γ of a node whose velocities start at z_first."""
    gx, gy, dx, dy = load_rows(z, first + 2, 4)
    _, d, e, n, t, f, along, across = node[0:8]
    turning = f[0] * dx + f[1] * dy
    axial = n[0] * gx + n[1] * gy + across * turning
    shear = e[0] * gx + e[1] * gy - along * turning
    sheared = t[0] * gx + t[1] * gy - turning
    return (gx, gy), axial, shear, d[0] * dx + d[1] * dy, turning, sheared


@compiled
def _strain_rates(z, first, il, node_i, node_j, element):
    """Return the rates of the strains; the element's velocities start at z_first."""
    gi, axial_i, shear_i, bi, turn_i, gamma_i = _node_rates(z, first, node_i)
    gj, axial_j, shear_j, bj, turn_j, gamma_j = _node_rates(z, first + 6, node_j)
    u = chord(z, first, first + 6, il)
    ((tx, ty), length, cos, sin), bent_1, bent_2 = element
    px, py = middle(u, gi, gj)
    axial_m = cos * (tx * px + ty * py) - 0.5 * length * sin * (gamma_i + gamma_j)
    return (
        axial_i,
        axial_m,
        axial_j,
        turn_j - turn_i,
        dot6(change_row(bent_1, bent_2), u + gi + gj),
        shear_i,
        shear_j,
        bi,
        bj,
    )


@compiled
def _by_shear(forces, element):
    """Return the derivative of the energy by γ_i, and by γ_j, apart from those of Γ and Q."""
    _, length, _, sin = element[0]
    return -0.5 * forces[1] * length * sin


@compiled
def _add_node_force(r, first, fx, fy, sheared, moment, N, Q, b, node):
    """Add the forces on g and d of a node.

    (fx, fy), `sheared`, `moment`, N, Q and b are the derivatives of the energy by g, γ, φ, Γ, Q and
    the strain of thickness.
    """
    _, d, e, n, t, f, along, across = node[0:8]
    by_angle = moment + N * across - Q * along - sheared
    force = (fx, fy)
    for axis in range(2):
        by_g = force[axis] + N * n[axis] + Q * e[axis] + sheared * t[axis]
        add_to(r, first + axis, by_g)
        add_to(r, first + 2 + axis, by_angle * f[axis] + b * d[axis])


@compiled
def add_beam_forces(beams, values, z, velocity, r):
    """Add the elastic and damping forces F(q, q̇) to `r`; [0, v] starts in row `velocity` of z."""
    for e in range(len(beams.first)):
        first = beams.first[e]
        il = load(values.inverse_length, e)
        # Elements that follow each other share a node.
        if e == 0 or beams.first[e - 1] + 6 != first:
            node_j = _node(z, first)
        node_i = node_j  # pyright: ignore[reportPossiblyUnboundVariable]
        node_j = _node(z, first + 6)
        element = _element(node_i, node_j, z, first, il)
        forces, _ = _resultants(beams, values, z, velocity, e, il, node_i, node_j, element)
        (tx, ty), _, cos, _ = element[0]
        sheared = _by_shear(forces, element)
        M = forces[3]
        # Add the forces on the chord.
        along = forces[1] * cos
        force = times(forces[4], change_row(element[1], element[2]))
        force = plus(force, along, middle_row(tx, ty))
        ux = il * force[0]
        uy = il * force[1]
        add_to(r, first, -ux)
        add_to(r, first + 1, -uy)
        add_to(r, first + 6, ux)
        add_to(r, first + 7, uy)
        # Add those on the sections of both nodes.
        N = forces[0]
        Q = forces[5]
        b = forces[7]
        _add_node_force(r, first + 2, force[2], force[3], sheared, -M, N, Q, b, node_i)
        N = forces[2]
        Q = forces[6]
        b = forces[8]
        _add_node_force(r, first + 8, force[4], force[5], sheared, M, N, Q, b, node_j)


@compiled
def beam_energy(beams, values, z):
    """Return the elastic energy of all beams [J]."""
    total = 0.0 * load(z, 0)
    for e in range(len(beams.first)):
        first = beams.first[e]
        il = load(values.inverse_length, e)
        node_i = _node(z, first)
        node_j = _node(z, first + 6)
        numbers = load_rows(values.stiffness, NUMBERS * e, NUMBERS)
        strain = _strains(node_i, node_j, _element(node_i, node_j, z, first, il))
        strain = plus(strain, -1.0, numbers[14:23])
        forces = _product(numbers[0:14], strain)
        for k in range(9):
            total += 0.5 * forces[k] * strain[k]
    return total


@compiled
def add_beam_tangent(beams, values, z, velocity, weight, rate, matrix, blocks):
    """Add weight × (∂F/∂q + rate ∂F/∂q̇) of the beams to `matrix`; `blocks` is work space."""
    for e in range(len(beams.first)):
        first = beams.first[e]
        il = load(values.inverse_length, e)
        slot = beams.slot[e]
        # Elements that follow each other share a node.
        if e == 0 or beams.first[e - 1] + 6 != first:
            node_j = _node(z, first)
        node_i = node_j  # pyright: ignore[reportPossiblyUnboundVariable]
        node_j = _node(z, first + 6)
        element = _element(node_i, node_j, z, first, il)
        forces, c = _resultants(beams, values, z, velocity, e, il, node_i, node_j, element)
        if beams.damped[e]:
            factor = 1.0 + rate * load(values.retardation, 2 * e)
            bending = 1.0 + rate * load(values.retardation, 2 * e + 1)
            c = scale_stiffness(c[0:9], factor, bending) + times(factor, c[9:14])
        sheared = _by_shear(forces, element)
        M = forces[3]
        # Add the second derivatives by the chord and the slopes.
        _sum_tangent(c, forces, sheared, node_i, node_j, element, blocks)
        add_line_tangent(slot, 2, 6, 8, il, weight, blocks, matrix)
        # Add those by the sections of both nodes, and what couples these.
        N = forces[0]
        Q = forces[5]
        b = forces[7]
        _add_section(slot, 0, il, weight, -M - sheared, N, Q, b, c[12], node_i, blocks, matrix)
        N = forces[2]
        Q = forces[6]
        b = forces[8]
        _add_section(slot, 1, il, weight, M - sheared, N, Q, b, c[13], node_j, blocks, matrix)
        coupling = load(blocks, SUM + VARIABLES * 6 + 7)
        fi = node_i[5]
        fj = node_j[5]
        block = times(coupling * fi[0], fj) + times(coupling * fi[1], fj)
        add_block(matrix, slot, 4, 10, weight, block)


@compiled
def _add_section(slot, side, il, weight, moment, N, Q, b, stiffness, node, blocks, matrix):
    """Add the sum's part of the angle φ of a section, and the stiffness of its thickness.

    `moment` is the derivative of the energy by φ, apart from those of Γ and Q.
    """
    _, d, _, _, _, f, along, across = node[0:8]
    column = 4 + 6 * side
    u = _rotate_block(0, side, f, blocks)
    add_block(matrix, slot, 0, column, -weight * il, u)
    add_block(matrix, slot, 6, column, weight * il, u)
    add_block(matrix, slot, 2, column, weight, _rotate_block(1, side, f, blocks))
    add_block(matrix, slot, 8, column, weight, _rotate_block(2, side, f, blocks))
    by_angle = moment + N * across - Q * along
    twice = load(blocks, SUM + (VARIABLES + 1) * (6 + side))
    skew = 2.0 * by_angle * f[0] * f[1]
    xx = twice * f[0] * f[0] - skew + b + stiffness * d[0] * d[0]
    xy = twice * f[0] * f[1] + by_angle * (f[0] * f[0] - f[1] * f[1]) + stiffness * d[0] * d[1]
    yy = twice * f[1] * f[1] + skew + b + stiffness * d[1] * d[1]
    add_block(matrix, slot, column, column, weight, (xx, xy, xy, yy))


@compiled
def _rotate_block(a, side, f, blocks):
    """Return the block of vector a of u, g_i and g_j and of d from that of a and φ."""
    first = SUM + 2 * VARIABLES * a + 6 + side
    x = load(blocks, first)
    y = load(blocks, first + VARIABLES)
    return x * f[0], x * f[1], y * f[0], y * f[1]


@compiled
def _sum_tangent(c, forces, sheared, node_i, node_j, element, blocks):
    """Set the sum to the second derivatives of the energy by u, g_i, g_j, φ_i and φ_j."""
    ((tx, ty), length, cos, sin), bent_1, bent_2 = element
    _, _, (eix, eiy), (nix, niy), (tix, tiy), _, along_i, across_i = node_i[0:8]
    _, _, (ejx, ejy), (njx, njy), (tjx, tjy), _, along_j, across_j = node_j[0:8]
    zero = 0.0 * length
    unity = 1.0 + 0.0 * length
    none = (zero, zero)

    ax = cos * tx
    ay = cos * ty
    half = 0.5 * length * sin
    row = (
        1.5 * ax,
        1.5 * ay,
        c[1] * nix - 0.25 * ax - half * tix,
        c[1] * niy - 0.25 * ay - half * tiy,
        c[2] * njx - 0.25 * ax - half * tjx,
        c[2] * njy - 0.25 * ay - half * tjy,
        half + c[1] * across_i,
        half + c[2] * across_j,
    )
    add_row(0, row, times(c[0], row), blocks)
    change = change_row(bent_1, bent_2) + none
    row = plus((zero, zero, zero, zero, zero, zero, -unity, unity), c[7], change)
    add_row(1, row, times(c[6], row), blocks)
    add_row(2, change, times(c[8], change), blocks)

    # Those of N |p| cos γ by p, and by p and γ = (γ_i + γ_j)/2, as a sum of squares.
    inverse = 1.0 / (length * cos)
    N = forces[1]
    px = sin * inverse * tx
    py = sin * inverse * ty
    row = (
        1.5 * px,
        1.5 * py,
        0.5 * tix - 0.25 * px,
        0.5 * tiy - 0.25 * py,
        0.5 * tjx - 0.25 * px,
        0.5 * tjy - 0.25 * py,
        -0.5 * unity,
        -0.5 * unity,
    )
    add_row(3, row, times(-N * length * cos, row), blocks)
    sum_products(4, VARIABLES, blocks)
    N = N * inverse
    add_middle((N * sin * sin, (tx, ty)), (N * cos * cos, (-ty, tx)), blocks)
    add_change_of_curvature(forces[4], bent_1, bent_2, blocks)

    # Those of the sections, and the terms that couple both nodes.
    _add_node(1, sheared, forces[0], forces[5], c[3], c[9], node_i, blocks)
    _add_node(2, sheared, forces[2], forces[6], c[5], c[11], node_j, blocks)
    axial = c[4]
    shear = c[10]
    nx = axial * nix
    ny = axial * niy
    ex = shear * eix
    ey = shear * eiy
    block = nx * njx + ex * ejx, nx * njy + ex * ejy, ny * njx + ey * ejx, ny * njy + ey * ejy
    add_to_sum(1, 2, block, blocks)
    place = SUM + 2 * VARIABLES + 7  # of g_i and φ_j
    add_to(blocks, place, nx * across_j - ex * along_j)
    add_to(blocks, place + VARIABLES, ny * across_j - ey * along_j)
    place = SUM + 4 * VARIABLES + 6  # of g_j and φ_i
    N = axial * across_i
    Q = shear * along_i
    add_to(blocks, place, N * njx - Q * ejx)
    add_to(blocks, place + VARIABLES, N * njy - Q * ejy)
    add_to(blocks, SUM + 6 * VARIABLES + 7, N * across_j + Q * along_j)


@compiled
def _add_node(a, sheared, N, Q, axial, shear, node, blocks):
    """Add the second derivatives of the energy of a node's Γ and Q, and of `sheared` γ, to the sum.

    N, Q, `axial` and `shear` are the derivatives by Γ and Q; a is 1 for node i and 2 for node j.
    """
    _, _, (ex, ey), (nx, ny), (tx, ty), _, along, across = node[0:8]
    Nx = axial * nx
    Ny = axial * ny
    Qx = shear * ex
    Qy = shear * ey
    skew = 2.0 * sheared * tx * ty
    xy = Nx * ny + Qx * ey + sheared * (tx * tx - ty * ty)
    add_to_sum(a, a, (Nx * nx + Qx * ex - skew, xy, xy, Ny * ny + Qy * ey + skew), blocks)
    first = SUM + 2 * VARIABLES * a + 5 + a
    add_to(blocks, first, Nx * across - Qx * along + N * ex - Q * nx)
    add_to(blocks, first + VARIABLES, Ny * across - Qy * along + N * ey - Q * ny)
    second = axial * across * across + shear * along * along - N * along - Q * across
    add_to(blocks, SUM + (VARIABLES + 1) * (5 + a), second)
