"""The centre line of beams and cables: stretch in the middle, change of the curvature, angles.

The centre line of an element is the Hermite cubic of its chord u = (r_j − r_i)/l and of the
slopes g = r_x at both ends. With η = ξ − 1/2 its derivatives are

    p = r₀′    = (3/2 − 6η²) u + (3η² − η − 1/4) g_i + (3η² + η − 1/4) g_j
    w = l r₀″  = −12η u + (6η − 1) g_i + (6η + 1) g_j

and the curvature times l is κ = p × w / p·p. An axis that cannot change its length has as many
degrees of freedom as an element has axial strains if these are taken at ξ = 0, 1/2 and 1: with more
of them it locks. The curvature is a line: its mean is the angle by which the element bends, and the
difference κ₂ − κ₁ between the two Gauss points gives its slope.

The axial strains enter the energy as ½ (E_m Γ_m*² + E_ii Γ_i² + 2 E_ij Γ_i Γ_j + E_jj Γ_j²) with
Γ_m* = Γ_m + α Γ_i + β Γ_j, those of bending as ½ (B_0 (φ + ρ D)² + B_1 D²) with the angle φ and D =
κ₂ − κ₁, which is how `bodies.assumed_strains` gives them. So the tangent is a sum of products L Rᵀ
of few rows over the variables, and of parts that depend on few of them. It is collected in work
space: `PRODUCTS` pairs of rows, then the `SUM`, a square matrix whose upper triangle is used.
"""

from __future__ import annotations

import numpy as np

from flexband.mechanics.kernels.lanes import (
    add_block,
    add_to,
    compiled,
    less,
    load,
    load_rows,
    maximum,
    plus,
    splat,
    sqrt,
    store,
    store_rows,
    times,
    where,
)

_GAUSS = np.array([-1.0, 1.0]) / np.sqrt(12.0)  # η of the Gauss points
SLOPES = np.stack([1.0 + 0.0 * _GAUSS, -_GAUSS, _GAUSS])  # p by u, g_i and g_j
CURVES = np.stack([-12.0 * _GAUSS, 6.0 * _GAUSS - 1.0, 6.0 * _GAUSS + 1.0])  # w by u, g_i and g_j

# The arc tangent of x ≤ tan 22.5° over x as a polynomial of x².
_ARCTAN = (
    np.polynomial.Chebyshev.interpolate(
        lambda y: np.arctan(np.sqrt(y)) / np.sqrt(y), 12, [0.0, (np.sqrt(2) - 1) ** 2]
    )
    .convert(kind=np.polynomial.Polynomial)
    .coef
)

VARIABLES = 8  # u, g_i, g_j and, of a beam, the angles of both sections
PRODUCTS = 4
SUM = 2 * PRODUCTS * VARIABLES
ROWS = SUM + VARIABLES**2  # of the work space


@compiled
def chord(z, i, j, il):
    """Return u for nodes whose coordinates start at z_i and z_j."""
    (xi, yi), (xj, yj) = load_rows(z, i, 2), load_rows(z, j, 2)
    return (xj - xi) * il, (yj - yi) * il


@compiled
def middle(u, gi, gj):
    """Return p in the middle."""
    return 1.5 * u[0] - 0.25 * (gi[0] + gj[0]), 1.5 * u[1] - 0.25 * (gi[1] + gj[1])


@compiled
def middle_row(x, y):
    """Return the derivatives by u, g_i and g_j of the component of p in the middle along (x, y)."""
    return 1.5 * x, 1.5 * y, -0.25 * x, -0.25 * y, -0.25 * x, -0.25 * y


@compiled
def dot6(a, b):
    """Return the product of two rows over u, g_i and g_j."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]


@compiled
def stretch(p, gi, gj):
    """Return |p| in the middle, or NaN where an end points backwards from there.

    An element that bends by more than a half turn has folded states without any strain.
    """
    backwards = maximum(-(p[0] * gi[0] + p[1] * gi[1]), -(p[0] * gj[0] + p[1] * gj[1]))
    return where(less(backwards, splat(0.0)), sqrt(p[0] * p[0] + p[1] * p[1]), splat(np.nan))


@compiled
def bend(g, u, gi, gj):
    """Return κ at Gauss point g, p, 1/p·p, and the derivatives of κ by p and w."""
    (h, hi, hj), (k, ki, kj) = (
        (SLOPES[0, g], SLOPES[1, g], SLOPES[2, g]),
        (CURVES[0, g], CURVES[1, g], CURVES[2, g]),
    )
    px = h * u[0] + hi * gi[0] + hj * gj[0]
    py = h * u[1] + hi * gi[1] + hj * gj[1]
    wx = k * u[0] + ki * gi[0] + kj * gj[0]
    wy = k * u[1] + ki * gi[1] + kj * gj[1]
    inverse = 1.0 / (px * px + py * py)
    kappa = (px * wy - py * wx) * inverse
    by_p = ((wy - 2.0 * kappa * px) * inverse, (-wx - 2.0 * kappa * py) * inverse)
    return kappa, (px, py), inverse, by_p, (-py * inverse, px * inverse)


@compiled
def change_row(bent_1, bent_2):
    """Return the derivatives of κ₂ − κ₁ by u, g_i and g_j."""
    _, _, _, (px, py), (qx, qy) = bent_1
    _, _, _, (rx, ry), (sx, sy) = bent_2
    h = SLOPES[2, 1]
    k = CURVES[1, 0]
    m = CURVES[1, 1]  # κ₁ has −h, k, m; κ₂ has h, −m, −k
    px = h * (px + rx)
    py = h * (py + ry)
    return (
        rx - bent_1[3][0] + CURVES[0, 1] * (sx + qx),
        ry - bent_1[3][1] + CURVES[0, 1] * (sy + qy),
        m * sx - k * qx - px,
        m * sy - k * qy - py,
        px - k * sx + m * qx,
        py - k * sy + m * qy,
    )


@compiled
def angle_between(a, b):
    """Return the angle from a unit vector to another one, less than a half turn."""
    cos = a[0] * b[0] + a[1] * b[1]
    sin = a[0] * b[1] - a[1] * b[0]
    half = sqrt(0.5 + 0.5 * cos)
    quarter = 0.5 * sin / (half * (1.0 + half))  # its tangent
    x = quarter / (1.0 + sqrt(1.0 + quarter * quarter))
    y = x * x
    total = _ARCTAN[12] + 0.0 * y
    for k in range(1, 13):
        total = total * y + _ARCTAN[12 - k]
    return 8.0 * x * total


@compiled
def line_resultants(c, strain):
    """Return the derivatives of the energy by Γ_i, Γ_m, Γ_j, φ and D, the first strains.

    The stiffness c starts with E_m, α, β, E_ii, E_ij, E_jj, B_0, ρ and B_1.
    """
    first, centre, last, angle, change = strain[0:5]
    N = c[0] * (centre + c[1] * first + c[2] * last)
    M = c[6] * (angle + c[7] * change)
    ends = c[3] * first + c[4] * last, c[4] * first + c[5] * last
    return ends[0] + c[1] * N, N, ends[1] + c[2] * N, M, c[8] * change + c[7] * M


@compiled
def add_row(place, left_row, right_row, blocks):
    """Store a pair of rows, whose product L Rᵀ is a part of the tangent."""
    store_rows(blocks, 2 * VARIABLES * place, left_row)
    store_rows(blocks, 2 * VARIABLES * place + VARIABLES, right_row)


@compiled
def sum_products(count, variables, blocks):
    """Set the sum to Σ L Rᵀ over the first `count` pairs of rows, in its upper triangle."""
    for a in range(variables):
        for b in range(a, variables):
            total = 0.0 * load(blocks, 0)
            for row in range(count):
                first = 2 * VARIABLES * row
                total += load(blocks, first + a) * load(blocks, first + VARIABLES + b)
            store(blocks, SUM + VARIABLES * a + b, total)


@compiled
def add_to_sum(a, b, block, blocks):
    """Add a block (xx, xy, yx, yy) of the vectors a and b of u, g_i and g_j to the sum."""
    first = SUM + 2 * VARIABLES * a + 2 * b
    add_to(blocks, first, block[0])
    add_to(blocks, first + 1, block[1])
    if a != b:
        add_to(blocks, first + VARIABLES, block[2])
    add_to(blocks, first + VARIABLES + 1, block[3])


@compiled
def scale_stiffness(c, axial, bending):
    """Return the nine stiffness numbers times two factors; α, β and ρ are without a unit."""
    a = times(axial, c)
    b = times(bending, c)
    return a[0:1] + c[1:3] + a[3:6] + b[6:7] + c[7:8] + b[8:9]


@compiled
def _bend_hessian(moment, bent):
    """Return `moment` times the second derivatives pp, pw and its transpose of κ."""
    kappa, (px, py), inverse, (kx, ky), (qx, qy) = bent
    factor = 2.0 * moment * inverse
    px = factor * px
    py = factor * py
    half = 0.5 * factor
    skew = -px * ky - py * kx
    pp = (-factor * kappa - 2.0 * px * kx, skew, skew, -factor * kappa - 2.0 * py * ky)
    xy = half - px * qy
    yx = -half - py * qx
    return pp, (-px * qx, xy, yx, -py * qy), (-px * qx, yx, xy, -py * qy)


@compiled
def add_change_of_curvature(moment, bent_1, bent_2, blocks):
    """Add `moment` times the second derivatives of κ₂ − κ₁ to the sum."""
    pp, pw, wp = _bend_hessian(-moment, bent_1)
    qq, qw, wq = _bend_hessian(moment, bent_2)
    for a in range(3):
        for b in range(a, 3):
            block = times(SLOPES[a, 0] * SLOPES[b, 0] + 0.0 * moment, pp)
            block = plus(block, SLOPES[a, 0] * CURVES[b, 0], pw)
            block = plus(block, CURVES[a, 0] * SLOPES[b, 0], wp)
            block = plus(block, SLOPES[a, 1] * SLOPES[b, 1], qq)
            block = plus(block, SLOPES[a, 1] * CURVES[b, 1], qw)
            add_to_sum(a, b, plus(block, CURVES[a, 1] * SLOPES[b, 1], wq), blocks)


@compiled
def add_middle(along, across, blocks):
    """Add the products of p's shapes in the middle with along alongᵀ + across acrossᵀ to the sum.

    `along` and `across` are pairs of a factor and a vector.
    """
    (a, (ax, ay)), (b, (bx, by)) = along, across
    block = (
        a * ax * ax + b * bx * bx,
        a * ax * ay + b * bx * by,
        a * ax * ay + b * bx * by,
        a * ay * ay + b * by * by,
    )
    add_to_sum(0, 0, times(2.25 + 0.0 * a, block), blocks)
    block = times(0.0625 + 0.0 * a, block)
    add_to_sum(0, 1, times(-6.0 + 0.0 * a, block), blocks)
    add_to_sum(0, 2, times(-6.0 + 0.0 * a, block), blocks)
    add_to_sum(1, 1, block, blocks)
    add_to_sum(1, 2, block, blocks)
    add_to_sum(2, 2, block, blocks)


@compiled
def block_of(a, b, blocks):
    """Return the block (xx, xy, yx, yy) of the vectors a and b of the sum; yx only if a < b."""
    first = SUM + 2 * VARIABLES * a + 2 * b
    return load_rows(blocks, first, 2) + load_rows(blocks, first + VARIABLES, 2)


@compiled
def add_line_tangent(slot, gi, rj, gj, il, weight, blocks, matrix):
    """Add the sum's part of u, g_i and g_j to `matrix`.

    The first node's r is coordinate 0 of the element; g_i, r_j and g_j are the coordinates where
    the other vectors start.
    """
    uu = block_of(0, 0, blocks)
    uu = (uu[0], uu[1], uu[1], uu[3])
    add_block(matrix, slot, 0, 0, weight * il * il, uu)
    add_block(matrix, slot, 0, rj, -weight * il * il, uu)
    add_block(matrix, slot, rj, rj, weight * il * il, uu)
    ui = block_of(0, 1, blocks)
    uj = block_of(0, 2, blocks)
    add_block(matrix, slot, 0, gi, -weight * il, ui)
    add_block(matrix, slot, rj, gi, weight * il, ui)
    add_block(matrix, slot, 0, gj, -weight * il, uj)
    add_block(matrix, slot, rj, gj, weight * il, uj)
    add_block(matrix, slot, gi, gi, weight, block_of(1, 1, blocks))
    add_block(matrix, slot, gi, gj, weight, block_of(1, 2, blocks))
    add_block(matrix, slot, gj, gj, weight, block_of(2, 2, blocks))
