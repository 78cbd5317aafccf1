"""Elastic forces, tangent and energy of all cable elements, on lanes.

An element has five strains, all without a unit: |p| − 1 at both ends and in the middle, the angle
from r_x of one end to that of the other, and κ₂ − κ₁ of the centre line.
"""

from __future__ import annotations

from flexband.mechanics.kernels.elements.centre_line import (
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
from flexband.mechanics.kernels.lanes import add_to, compiled, load, load_rows, plus, sqrt, times

NUMBERS = 14
"""Of an element: the stiffness (axial 6, bending 3), five initial strains."""


@compiled
def _element(cables, z, e, il):
    """Return (direction, length) of p at both ends and in the middle, and κ with derivatives."""
    first = cables.first[e]
    gi = load_rows(z, first + 2, 2)
    gj = load_rows(z, first + 6, 2)
    u = chord(z, first, first + 4, il)
    p = middle(u, gi, gj)
    li = _length(gi)
    lj = _length(gj)
    lm = stretch(p, gi, gj)
    ends = (gi[0] / li, gi[1] / li, li), (gj[0] / lj, gj[1] / lj, lj)
    return ends[0], (p[0] / lm, p[1] / lm, lm), ends[1], bend(0, u, gi, gj), bend(1, u, gi, gj)


@compiled
def _length(g):
    return sqrt(g[0] * g[0] + g[1] * g[1])


@compiled
def _strains(element):
    i, m, j, bent_1, bent_2 = element
    change = bent_2[0] - bent_1[0]
    return i[2] - 1.0, m[2] - 1.0, j[2] - 1.0, angle_between(i, j), change


@compiled
def _resultants(cables, values, z, velocity, e, il, element):
    """Return the resultants of element e with those of its damping, and its stiffness."""
    numbers = load_rows(values.stiffness, NUMBERS * e, NUMBERS)
    strain = plus(_strains(element), -1.0, numbers[9:14])
    if cables.damped[e]:  # the forces of a Kelvin–Voigt solid are those of ε + τ ε̇ and κ + τ κ̇
        rates = _strain_rates(z, velocity + cables.first[e], il, element)
        axial = plus(strain[0:3], load(values.retardation, 2 * e), rates[0:3])
        strain = axial + plus(strain[3:5], load(values.retardation, 2 * e + 1), rates[3:5])
    return line_resultants(numbers[0:9], strain), numbers[0:9]


@compiled
def _strain_rates(z, first, il, element):
    """Return the rates of the strains; the element's velocities start at z_first."""
    (ix, iy, li), (mx, my, _), (jx, jy, lj), bent_1, bent_2 = element
    gi = load_rows(z, first + 2, 2)
    gj = load_rows(z, first + 6, 2)
    u = chord(z, first, first + 4, il)
    px, py = middle(u, gi, gj)
    return (
        ix * gi[0] + iy * gi[1],
        mx * px + my * py,
        jx * gj[0] + jy * gj[1],
        (jx * gj[1] - jy * gj[0]) / lj - (ix * gi[1] - iy * gi[0]) / li,
        dot6(change_row(bent_1, bent_2), u + gi + gj),
    )


@compiled
def add_cable_forces(cables, values, z, velocity, r):
    """Add the elastic and damping forces F(q, q̇) to `r`; [0, v] starts in row `velocity` of z."""
    for e in range(len(cables.first)):
        first = cables.first[e]
        il = load(values.inverse_length, e)
        element = _element(cables, z, e, il)
        forces, _ = _resultants(cables, values, z, velocity, e, il, element)
        (ix, iy, li), (mx, my, _), (jx, jy, lj), bent_1, bent_2 = element
        force = times(forces[4], change_row(bent_1, bent_2))
        force = plus(force, forces[1], middle_row(mx, my))
        across_i = -forces[3] / li
        across_j = forces[3] / lj
        ux = il * force[0]
        uy = il * force[1]
        add_to(r, first, -ux)
        add_to(r, first + 1, -uy)
        add_to(r, first + 2, force[2] + forces[0] * ix - across_i * iy)
        add_to(r, first + 3, force[3] + forces[0] * iy + across_i * ix)
        add_to(r, first + 4, ux)
        add_to(r, first + 5, uy)
        add_to(r, first + 6, force[4] + forces[2] * jx - across_j * jy)
        add_to(r, first + 7, force[5] + forces[2] * jy + across_j * jx)


@compiled
def cable_energy(cables, values, z):
    """Return the elastic energy of all cables [J]."""
    total = 0.0 * load(z, 0)
    for e in range(len(cables.first)):
        element = _element(cables, z, e, load(values.inverse_length, e))
        numbers = load_rows(values.stiffness, NUMBERS * e, NUMBERS)
        strain = plus(_strains(element), -1.0, numbers[9:14])
        forces = line_resultants(numbers[0:9], strain)
        for k in range(5):
            total += 0.5 * forces[k] * strain[k]
    return total


@compiled
def add_cable_tangent(cables, values, z, velocity, weight, rate, matrix, blocks):
    """Add weight × (∂F/∂q + rate ∂F/∂q̇) of the cables to `matrix`; `blocks` is work space."""
    for e in range(len(cables.first)):
        il = load(values.inverse_length, e)
        element = _element(cables, z, e, il)
        forces, c = _resultants(cables, values, z, velocity, e, il, element)
        if cables.damped[e]:
            axial = 1.0 + rate * load(values.retardation, 2 * e)
            c = scale_stiffness(c, axial, 1.0 + rate * load(values.retardation, 2 * e + 1))
        _sum_tangent(c, forces, element, blocks)
        add_line_tangent(cables.slot[e], 2, 4, 6, il, weight, blocks, matrix)


@compiled
def _sum_tangent(c, forces, element, blocks):
    """Set the sum to the second derivatives of the energy by u, g_i and g_j."""
    (ix, iy, li), (mx, my, lm), (jx, jy, lj), bent_1, bent_2 = element
    row = (
        1.5 * mx,
        1.5 * my,
        c[1] * ix - 0.25 * mx,
        c[1] * iy - 0.25 * my,
        c[2] * jx - 0.25 * mx,
        c[2] * jy - 0.25 * my,
    )
    add_row(0, row, times(c[0], row), blocks)
    zero = 0.0 * li
    change = change_row(bent_1, bent_2)
    turn = (zero, zero, iy / li, -ix / li, -jy / lj, jx / lj)
    row = plus(turn, c[7], change)
    add_row(1, row, times(c[6], row), blocks)
    add_row(2, change, times(c[8], change), blocks)
    sum_products(3, VARIABLES - 2, blocks)
    # The second derivative of |p| is the unit matrix across p, over |p|.
    add_middle((zero, (mx, my)), (forces[1] / lm, (-my, mx)), blocks)
    add_change_of_curvature(forces[4], bent_1, bent_2, blocks)
    _add_end(1, c[3], forces[0], -forces[3], element[0], blocks)
    _add_end(2, c[5], forces[2], forces[3], element[2], blocks)
    x = c[4] * ix
    y = c[4] * iy
    add_to_sum(1, 2, (x * jx, x * jy, y * jx, y * jy), blocks)


@compiled
def _add_end(a, stiffness, N, M, end, blocks):
    """Add the second derivatives of an end's energy by g to the sum.

    N and M are the derivatives of the energy by |g| and by the angle of g, and `stiffness` that of
    N by |g|; a is 1 for node i and 2 for node j.
    """
    x, y, length = end
    across = N / length
    skew = M / (length * length)
    xx = stiffness * x * x + across * y * y + 2.0 * skew * x * y
    xy = (stiffness - across) * x * y + skew * (y * y - x * x)
    yy = stiffness * y * y + across * x * x - 2.0 * skew * x * y
    add_to_sum(a, a, (xx, xy, xy, yy), blocks)
