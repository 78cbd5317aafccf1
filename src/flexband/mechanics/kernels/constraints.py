"""Constraints from a table of products, on lanes: Φ, Φ_qᵀλ, Φ_q, and the derivatives of Φ in time.

With z = [1, q, λ] the constraints enter through the potential Σ c f(t) z_k z_i z_j, where z_k is
the multiplier of the row: its derivative by z_k is the constraint Φ_k, by z_i and z_j the
constraint force Φ_qᵀλ, and its second derivatives are Φ_q and Σ λ Φ_qq. One loop serves every
joint.

The derivatives of Φ(q, t) = 0 are Φ_q v + Φ_t = 0 and Φ_q q̈ + γ = 0 with
γ = (Φ_q v)_q v + 2 Φ_qt v + Φ_tt.
"""

from __future__ import annotations

from flexband.mechanics.kernels.angles import add_angle_gradients, angle_drift, polar_rate
from flexband.mechanics.kernels.lanes import add_to, compiled, load


@compiled
def add_products(products, coefficient, functions, now, z, rows, sign):
    """Add `sign` c f(t) z_i z_j to each product's row."""
    for t in range(len(products.row)):
        c = sign * load(coefficient, t) * load(functions, now + products.f[t])
        add_to(rows, products.row[t], c * load(z, products.i[t]) * load(z, products.j[t]))


@compiled
def add_constraints(terms, coefficient, functions, now, z, r):
    """Add Φ to the multipliers' rows and Φ_qᵀλ to the coordinates'."""
    for t in range(terms.products):
        k = terms.k[t]
        i = terms.i[t]
        j = terms.j[t]
        c = load(coefficient, t) * load(functions, now + terms.f[t])
        zi = load(z, i)
        zj = load(z, j)
        zk = c * load(z, k)
        add_to(r, k, c * zi * zj)
        add_to(r, j, zk * zi)
        add_to(r, i, zk * zj)
    for t in range(terms.products, len(terms.k)):
        k = terms.k[t]
        j = terms.j[t]
        c = load(coefficient, t)
        if terms.f[t] != 0:
            c = c * load(functions, now + terms.f[t])
        add_to(r, k, c * load(z, j))
        add_to(r, j, c * load(z, k))


@compiled
def add_constraint_tangent(structure, values, terms, coefficient, now, z, weight, matrix):
    """Add Φ_q, and `weight` times Σ λ Φ_qq of all terms without angles."""
    functions = values.functions
    for t in range(terms.products):
        i = terms.i[t]
        j = terms.j[t]
        slot = terms.slot[t]
        c = load(coefficient, t) * load(functions, now + terms.f[t])
        add_to(matrix, slot[1], c * load(z, i))
        add_to(matrix, slot[0], c * load(z, j))
        curvature = weight * c * load(z, terms.k[t])
        add_to(matrix, slot[2], curvature if i != j else curvature + curvature)
    for t in range(terms.products, terms.polynomials):
        c = load(coefficient, t) * load(functions, now + terms.f[t])
        add_to(matrix, terms.slot[t, 1], c)
    for t in range(terms.polynomials, len(terms.k)):
        c = load(coefficient, t) * load(functions, now + terms.f[t])
        add_angle_gradients(structure, values, z, terms.j[t] - structure.state.angle, c, matrix)


@compiled
def subtract_velocity_errors(structure, values, terms, coefficient, now, z, r):
    """Subtract Φ_q v + Φ_t from the multipliers' rows of r."""
    state = structure.state
    velocity = state.velocity
    for t in range(terms.steady):
        i = terms.i[t]
        j = terms.j[t]
        f = terms.f[t]
        zi = load(z, i)
        zj = load(z, j)
        moved = load(z, velocity + i) * zj + zi * load(z, velocity + j)
        rate = load(values.functions, now + f) * moved
        rate += load(values.rates, 2 * now + f) * zi * zj
        add_to(r, terms.k[t], -load(coefficient, t) * rate)
    for t in range(terms.steady, terms.polynomials):
        add_to(r, terms.k[t], -load(coefficient, t) * load(z, velocity + terms.j[t]))
    for t in range(terms.polynomials, len(terms.k)):
        angle = terms.j[t]
        f = terms.f[t]
        rate = polar_rate(structure, values, z, z, velocity, angle - state.angle)
        rate = load(values.functions, now + f) * rate
        rate += load(values.rates, 2 * now + f) * load(z, angle)
        add_to(r, terms.k[t], -load(coefficient, t) * rate)


@compiled
def subtract_acceleration_errors(structure, values, terms, coefficient, now, z, a, r, s):
    """Subtract Φ_q q̈ + γ from the multipliers' rows of r, and Φ_q a + γ from those of s."""
    state = structure.state
    functions = structure.functions
    velocity = state.velocity
    acceleration = state.acceleration
    # Products of two coordinates, and those with functions of time.
    for t in range(terms.steady):
        k = terms.k[t]
        i = terms.i[t]
        j = terms.j[t]
        f = terms.f[t]
        zi = load(z, i)
        zj = load(z, j)
        vi = load(z, velocity + i)
        vj = load(z, velocity + j)
        value = load(values.functions, now + f)
        rate = load(values.rates, 2 * now + f)
        drift = load(values.rates, 2 * now + functions + f) * zi * zj
        drift += 2.0 * (rate * (vi * zj + zi * vj) + value * vi * vj)
        c = load(coefficient, t)
        moved = load(z, acceleration + i) * zj + zi * load(z, acceleration + j)
        add_to(r, k, -c * (drift + value * moved))
        add_to(s, k, -c * (drift + value * (load(a, i) * zj + zi * load(a, j))))
    # Linear terms with constant factors.
    for t in range(terms.steady, terms.polynomials):
        k = terms.k[t]
        j = terms.j[t]
        c = load(coefficient, t)
        add_to(r, k, -c * load(z, acceleration + j))
        add_to(s, k, -c * load(a, j))
    # Terms of angles and lengths.
    for t in range(terms.polynomials, len(terms.k)):
        k = terms.k[t]
        f = terms.f[t]
        angle = terms.j[t] - state.angle
        value = load(values.functions, now + f)
        rate = load(values.rates, 2 * now + f)
        drift = load(values.rates, 2 * now + functions + f) * load(z, terms.j[t])
        drift += 2.0 * rate * polar_rate(structure, values, z, z, velocity, angle)
        drift += value * angle_drift(structure, values, z, angle)
        c = load(coefficient, t)
        moved = polar_rate(structure, values, z, z, acceleration, angle)
        add_to(r, k, -c * (drift + value * moved))
        moved = polar_rate(structure, values, z, a, 0, angle)
        add_to(s, k, -c * (drift + value * moved))
