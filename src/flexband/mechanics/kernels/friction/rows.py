"""Dry friction, on lanes: rows of the matrix that either stick or slide.

Each friction has a travel s(q), whose rate u = ṡ is the sliding speed, a normal force N and a
multiplier λ, the last ones of a mechanism. Sticking is a constraint like any other, s(q) = s₀ with
the anchor s₀. Where it slides, the same row has the pivot 1 and no other entries, and its
multiplier is given,

    λ = ±µ(u) N + c u,   µ(u) = µk + (µs − µk) exp(−(u/v)²),

with the sign of u. The mode is held while a step is taken: `MODE.sticks`, or the sign of u, or
`MODE.inactive`, without a force. N is a sum of lengths of vectors in the state. The derivatives of
λ by the state are not in the matrix, which remains symmetric.

Where N is a reaction, it is that of the projected accelerations: those of Newton's method have
errors of a sign, whose friction would slow down what turns. So N is held while Newton's method
solves a step and follows after the projection, until both agree. That converges by the ratio
µ |∂N/∂λ|. Where two changes after each other are parallel, as those of a single friction are, their
ratio is known and the sum of all further ones is added at once. A ratio beyond ±1 is left to
diverge: then two motions are possible, or none.

The travel of circles has a term |d| φ, where d is the vector between their centres and φ its angle
against the second body. It is defined by its rate, |d| φ̇: while they stick, a step adds φ₁ − φ₀
times the mean of |d| at both ends of the step.

A row of a joint that switches sticks where its N is positive, and is free elsewhere. In place of
|d| and φ₀ it has the energy that it has taken, and the speed that it stops.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from flexband.mechanics.kernels.angles import polar_rate, vector, vector_rate
from flexband.mechanics.kernels.constraints import (
    add_constraint_tangent,
    add_constraints,
    add_products,
    subtract_acceleration_errors,
    subtract_velocity_errors,
)
from flexband.mechanics.kernels.friction.contacts_in_line import holds
from flexband.mechanics.kernels.friction.modes import sticks
from flexband.mechanics.kernels.lanes import (
    add_to,
    compiled,
    less,
    load,
    magnitude,
    maximum,
    power,
    splat,
    sqrt,
    store,
    where,
)
from flexband.mechanics.kernels.state import friction_rows, reaction_rows


class FollowOptions(NamedTuple):
    """When changes of reactions are summed up."""

    skew: float = 1e-2
    """Squared sine of the angle between two changes that count as parallel."""
    ratio: float = 0.995
    """Of their sizes, beyond which they are not summed up."""
    reference_floor: float = 1e-7
    """Part of m v² over the size to which changes are relative at least: less is rounding."""


FOLLOW = FollowOptions()


@compiled
def distance_of_centres(structure, values, z, n):
    """Return |d| of an orbit."""
    x, y = vector(structure, values, z, structure.friction.centres[n])
    return sqrt(x * x + y * y)


@compiled
def update_distances(structure, values, z):
    """Set the factors |d| of orbits to the present ones."""
    friction = structure.friction
    numbers = values.friction
    for n in range(len(friction.orbit_term)):
        distance = load(numbers.orbits, n) * distance_of_centres(structure, values, z, n)
        store(numbers.terms, friction.orbit_term[n], distance)


@compiled
def begin_sticking(structure, values, z):
    """Let circles that stick begin a step where they are."""
    friction = structure.friction
    rows = friction_rows(structure.state)
    for n in range(len(friction.orbit_term)):
        k = friction.of_orbit[n]
        t = friction.orbit_term[n]
        first = n == 0 or friction.of_orbit[n - 1] != k
        turn = rows.turn + k
        angle = load(values.friction.orbits, n) * load(z, friction.terms.j[t])
        store(z, turn, angle if first else load(z, turn) + angle)
        store(z, rows.distance + k, distance_of_centres(structure, values, z, n))
        store(z, rows.anchor + k, splat(0.0))
    for t in range(len(friction.terms.k)):
        k = friction.terms.k[t] - structure.state.friction
        if friction.circular[k] and not friction.is_orbit[t]:
            travel = load(values.friction.terms, t) * load(z, friction.terms.j[t])
            add_to(z, rows.anchor + k, travel)


@compiled
def hold_circles(structure, values, z, r):
    """Set the factors |d| of what sticks to their means in a step, and subtract φ₀ times these."""
    friction = structure.friction
    numbers = values.friction
    state = structure.state
    rows = friction_rows(state)
    for n in range(len(friction.orbit_term)):
        k = friction.of_orbit[n]
        t = friction.orbit_term[n]
        now = distance_of_centres(structure, values, z, n)
        stick_mask = sticks(state, z, k)
        before = load(z, rows.distance + k)
        before = where(less(splat(0.0), before), before, now)
        mean = where(stick_mask, 0.5 * (before + now), now)
        store(numbers.terms, t, load(numbers.orbits, n) * mean)
        if n == 0 or friction.of_orbit[n - 1] != k:
            add_to(r, state.friction + k, -mean * load(z, rows.turn + k))


@compiled
def first_component(structure):
    """Return the first row of the components of normal forces."""
    return structure.state.gap - 2 * len(structure.friction.of_components)


@compiled
def update_components(structure, values, now, z):
    """Set the components of normal forces."""
    for row in range(first_component(structure), structure.state.gap):
        store(z, row, splat(0.0))
    normals = structure.friction.normals
    coefficients = values.friction.normals
    add_products(normals, coefficients, values.functions, now, z, z, 1.0)


@compiled
def coefficient(values, k, u):
    """Return µ(u) of friction k at a sliding speed."""
    numbers = values.friction
    decay = power(splat(math.e), -u * u * load(numbers.inverse_square, k))
    return load(numbers.kinetic, k) + load(numbers.rise, k) * decay


@compiled
def update_friction(structure, values, now, z, r):
    """Set the normal forces, the sliding speeds, and λ of what slides; r is zero in its rows."""
    friction = structure.friction
    numbers = values.friction
    state = structure.state
    rows = friction_rows(state)
    components = first_component(structure)
    # Sum up the normal forces.
    for k in range(rows.frictions):
        store(z, rows.normal + k, splat(0.0))
    update_components(structure, values, now, z)
    for n in range(len(friction.of_components)):
        row = components + 2 * n
        k = friction.of_components[n]
        x = load(z, row)
        y = load(z, row + 1)
        add_to(z, rows.normal + k, x if friction.switched[k] else sqrt(x * x + y * y))
    # Find the sliding speeds and the forces of what slides.
    update_distances(structure, values, z)
    subtract_velocity_errors(structure, values, friction.terms, numbers.terms, now, z, r)
    for k in range(rows.frictions):
        row = state.friction + k
        u = -load(r, row)
        N = load(z, rows.normal + k)
        sign = load(z, rows.mode + k)
        store(r, row, splat(0.0))
        store(z, rows.speed + k, u)
        force = sign * coefficient(values, k, u) * N + load(numbers.viscous, k) * u
        force = where(sign, where(less(splat(0.0), N), force, splat(0.0)), splat(0.0))
        store(z, row, where(sticks(state, z, k), load(z, row), force))


@compiled
def add_to_contacts(structure, values, z):
    """Add friction to the forces of its contacts, on the first and on the second body."""
    friction = structure.friction
    for n in range(len(friction.rubbed)):
        row = friction.contact_force[n]
        first = friction.action + 3 * n
        force = load(z, structure.state.friction + friction.rubbed[n])
        x, y = vector(structure, values, z, first)
        ax, ay = vector(structure, values, z, first + 1)
        bx, by = vector(structure, values, z, first + 2)
        size = sqrt(x * x + y * y) + 1e-100
        couple = force * load(values.friction.radius, n)
        x = force * x / size
        y = force * y / size
        add_to(z, row, -x)
        add_to(z, row + 1, -y)
        add_to(z, row + 2, ay * x - ax * y - couple)
        add_to(z, row + 3, x)
        add_to(z, row + 4, y)
        add_to(z, row + 5, bx * y - by * x + couple)


@compiled
def force_of_motion(structure, values, z):
    """Return the largest m v² over the size of the mechanism."""
    mass = structure.mass
    first = structure.state.velocity
    momentum = splat(0.0)
    rate = splat(0.0)
    for p in range(len(mass.i)):
        if mass.i[p] == mass.j[p]:
            v = magnitude(load(z, first + mass.i[p]))
            momentum = maximum(momentum, load(values.mass, p) * v)
            rate = maximum(rate, v * load(values.inverse_scale, mass.i[p]))
    return momentum * rate


@compiled
def carry_reactions(structure, values, z, mask, begins):
    """Let normal forces follow the reactions of lanes in `mask`; return how much these change.

    That is relative to the largest one, to a millionth of the largest so far, or to the part
    `reference_floor` of the forces that turn the motion, whichever is most. Changes before it
    `begins` do not count.
    """
    friction = structure.friction
    state = structure.state
    none = splat(0.0)
    rows = reaction_rows(state)
    change = none
    largest = none
    if not friction.follows:
        return none
    count = rows.number
    first = rows.reaction
    past = rows.change
    # Find the size that changes are relative to.
    for i in range(1, state.coordinates + 1):
        largest = maximum(largest, 1e-6 * magnitude(load(values.weight, i)))
    largest = maximum(largest, FOLLOW.reference_floor * force_of_motion(structure, values, z))
    # Compare the changes with those before.
    squares = none
    products = none
    others = none
    for k in range(count):
        step = load(z, state.multiplier + k) - load(z, first + k)
        last = none if begins else load(z, past + k)
        squares = squares + last * last
        products = products + last * step
        others = others + step * step
    # Sum up the geometric series where they are parallel.
    scale = where(less(none, squares), squares, splat(1.0))
    ratio = products / scale
    skew = others - ratio * products
    parallel = where(less(skew, FOLLOW.skew * others), less(none, squares), none)
    parallel = where(less(magnitude(ratio), splat(FOLLOW.ratio)), parallel, none)
    factor = where(parallel, 1.0 / (1.0 - ratio), splat(1.0))
    for k in range(count):
        reaction = load(z, state.multiplier + k)
        before = load(z, first + k)
        step = reaction - before
        last = none if begins else load(z, past + k)
        change = maximum(change, magnitude(step))
        largest = maximum(largest, magnitude(reaction))
        store(z, first + k, where(mask, before + factor * step, before))
        store(z, past + k, where(mask, where(parallel, none, step), last))
    # Return the change relative to the largest reaction.
    largest_so_far = load(z, rows.largest)
    store(z, rows.largest, where(mask, maximum(largest_so_far, largest), largest_so_far))
    largest = maximum(largest, 1e-6 * largest_so_far)
    ratio = where(less(none, largest), change / largest, none)
    return where(mask, ratio, none)


@compiled
def keep_sticking(structure, z, r):
    """Clear the rows of what does not stick, or follows another."""
    state = structure.state
    for k in range(state.angle - state.friction):
        row = state.friction + k
        store(r, row, where(holds(structure, z, k), load(r, row), splat(0.0)))


@compiled
def add_friction(structure, values, now, z, r):
    """Add Φ_qᵀλ of friction to the coordinates' rows, and s − s₀ to the rows of what sticks."""
    state = structure.state
    rows = friction_rows(structure.state)
    hold_circles(structure, values, z, r)
    add_constraints(structure.friction.terms, values.friction.terms, values.functions, now, z, r)
    for k in range(rows.frictions):
        add_to(r, state.friction + k, -load(z, rows.anchor + k))
    keep_sticking(structure, z, r)


@compiled
def add_jacobian(structure, values, now, z, weight, matrix):
    """Add Φ_q, and `weight` times Σ λ Φ_qq without angles, of joints and of what sticks."""
    friction = structure.friction
    state = structure.state
    add_constraint_tangent(structure, values, structure.terms, values.terms, now, z, weight, matrix)
    if state.angle == state.friction:
        return
    add_constraint_tangent(
        structure, values, friction.terms, values.friction.terms, now, z, weight, matrix
    )
    for n in range(len(friction.slot)):
        hold_mask = holds(structure, z, friction.of_slot[n])
        entry = load(matrix, friction.slot[n])
        store(matrix, friction.slot[n], where(hold_mask, entry, splat(0.0)))
    for k in range(len(friction.diagonal)):
        hold_mask = holds(structure, z, k)
        store(matrix, friction.diagonal[k], where(hold_mask, splat(0.0), splat(1.0)))


@compiled
def subtract_speed_errors(structure, values, now, z, r):
    """Subtract Φ_q v + Φ_t of joints, and of what sticks, from the multipliers' rows of r."""
    friction = structure.friction
    numbers = values.friction
    state = structure.state
    subtract_velocity_errors(structure, values, structure.terms, values.terms, now, z, r)
    if state.angle > state.friction:
        update_distances(structure, values, z)
        subtract_velocity_errors(structure, values, friction.terms, numbers.terms, now, z, r)
        keep_sticking(structure, z, r)


@compiled
def subtract_rate_errors(structure, values, now, z, a, r, s):
    """Subtract Φ_q q̈ + γ of joints, and of what sticks, from r, and Φ_q a + γ from s."""
    friction = structure.friction
    numbers = values.friction
    state = structure.state
    subtract_acceleration_errors(structure, values, structure.terms, values.terms, now, z, a, r, s)
    if state.angle == state.friction:
        return
    update_distances(structure, values, z)
    subtract_acceleration_errors(structure, values, friction.terms, numbers.terms, now, z, a, r, s)
    subtract_drift_of_circles(structure, values, z, r, s)
    keep_sticking(structure, z, r)
    keep_sticking(structure, z, s)


@compiled
def subtract_drift_of_circles(structure, values, z, r, s):
    """Subtract the rate of |d| times that of φ."""
    friction = structure.friction
    state = structure.state
    for n in range(len(friction.orbit_term)):
        x, y = vector(structure, values, z, friction.centres[n])
        u, v = vector_rate(structure, values, z, z, state.velocity, friction.centres[n])
        angle = friction.terms.j[friction.orbit_term[n]] - state.angle
        turning = polar_rate(structure, values, z, z, state.velocity, angle)
        distance_rate = (x * u + y * v) / (sqrt(x * x + y * y) + 1e-100)
        drift = load(values.friction.orbits, n) * distance_rate * turning
        add_to(r, state.friction + friction.of_orbit[n], -drift)
        add_to(s, state.friction + friction.of_orbit[n], -drift)
