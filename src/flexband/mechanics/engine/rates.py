"""Constraints at the levels of velocity and acceleration, on lanes.

The first and second derivatives of Φ(q, t) = 0 are Φ_q v + Φ_t = 0 and Φ_q q̈ + γ = 0 with
γ = (Φ_q v)_q v + 2 Φ_qt v + Φ_tt. `rates` holds f′ and then f″ of all functions of time, time by
time.
"""

from __future__ import annotations

from flexband.mechanics.kernels.angles import angle_drift, polar_rate
from flexband.mechanics.kernels.lanes import add_to, inlined, load


@inlined
def subtract_velocity_errors(structure, values, now, z, r):
    """Subtract Φ_q v + Φ_t from the multipliers' rows of r."""
    state, terms = structure.state, structure.terms
    velocity = state.velocity
    for t in range(terms.polynomials):
        i, j, f = terms.i[t], terms.j[t], terms.f[t]
        zi, zj = load(z, i), load(z, j)
        moved = load(z, velocity + i) * zj + zi * load(z, velocity + j)
        rate = load(values.functions, now + f) * moved
        rate += load(values.rates, 2 * now + f) * zi * zj
        add_to(r, terms.k[t], -load(values.terms, t) * rate)
    for t in range(terms.polynomials, len(terms.k)):
        angle, f = terms.j[t], terms.f[t]
        rate = polar_rate(structure.vectors, values.vectors, z, z, velocity, angle - state.angle)
        rate = load(values.functions, now + f) * rate
        rate += load(values.rates, 2 * now + f) * load(z, angle)
        add_to(r, terms.k[t], -load(values.terms, t) * rate)


@inlined
def subtract_acceleration_errors(structure, values, now, z, a, r, s):
    """Subtract Φ_q q̈ + γ from the multipliers' rows of r, and Φ_q a + γ from those of s."""
    state, terms, functions = structure.state, structure.terms, structure.functions
    velocity, acceleration = state.velocity, state.acceleration
    for t in range(terms.polynomials):
        k, i, j, f = terms.k[t], terms.i[t], terms.j[t], terms.f[t]
        zi, zj, vi, vj = load(z, i), load(z, j), load(z, velocity + i), load(z, velocity + j)
        value, rate = load(values.functions, now + f), load(values.rates, 2 * now + f)
        drift = load(values.rates, 2 * now + functions + f) * zi * zj
        drift += 2.0 * (rate * (vi * zj + zi * vj) + value * vi * vj)
        c = load(values.terms, t)
        moved = load(z, acceleration + i) * zj + zi * load(z, acceleration + j)
        add_to(r, k, -c * (drift + value * moved))
        add_to(s, k, -c * (drift + value * (load(a, i) * zj + zi * load(a, j))))
    for t in range(terms.polynomials, len(terms.k)):
        k, f, angle = terms.k[t], terms.f[t], terms.j[t] - state.angle
        value, rate = load(values.functions, now + f), load(values.rates, 2 * now + f)
        drift = load(values.rates, 2 * now + functions + f) * load(z, terms.j[t])
        turning = polar_rate(structure.vectors, values.vectors, z, z, velocity, angle)
        drift += 2.0 * rate * turning
        drift += value * angle_drift(structure.vectors, values.vectors, state, z, angle)
        c = load(values.terms, t)
        moved = polar_rate(structure.vectors, values.vectors, z, z, acceleration, angle)
        add_to(r, k, -c * (drift + value * moved))
        moved = polar_rate(structure.vectors, values.vectors, z, a, 0, angle)
        add_to(s, k, -c * (drift + value * moved))
