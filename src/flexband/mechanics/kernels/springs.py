"""Forces and tangent of springs, dampers and actuators, on lanes.

A spring acts along its elongation s with the tension

    T = k x + k₃ x³ + d ṡ + f(t),   x = s − s₀.

The elongation of a translational spring is the length ℓ = |d| of a vector d; that of a torsion
spring is the difference of the angles of two vectors. The translational springs come first.
"""

from __future__ import annotations

import math

from flexband.mechanics.kernels.angles import angle_gradient, angle_rate, vector
from flexband.mechanics.kernels.lanes import (
    add_to,
    compiled,
    filled,
    less,
    load,
    maximum,
    nearest_whole,
    sqrt,
    store,
    where,
)

SHORTEST = 1e-300
"""Lets a spring of rest length 0 pass through length 0."""

RELAXED = 1e300
"""In place of the rest elongation s₀ of a spring that is relaxed at the start."""


@compiled
def _length(x, y):
    """Return the length of a vector, which is never 0."""
    return maximum(sqrt(x * x + y * y), filled(SHORTEST))


@compiled
def _angles_of(springs, s):
    """Return the numbers of both angles of a torsion spring."""
    place = 2 * s - springs.translational
    return springs.vector[place], springs.vector[place + 1]


@compiled
def elongation(springs, vectors, vector_values, state, z, s):
    """Return s."""
    if s < springs.translational:
        x, y = vector(vectors, vector_values, z, 0, springs.vector[s])
        return _length(x, y)
    first, second = _angles_of(springs, s)
    return load(z, state.angle + first) - load(z, state.angle + second)


@compiled
def _rate(springs, vectors, vector_values, state, z, s):
    """Return ṡ."""
    if s < springs.translational:
        x, y = vector(vectors, vector_values, z, 0, springs.vector[s])
        vx, vy = vector(vectors, vector_values, z, state.velocity, springs.vector[s])
        return (x * vx + y * vy) / _length(x, y)
    first, second = _angles_of(springs, s)
    rate = angle_rate(vectors, vector_values, state, z, first)
    return rate - angle_rate(vectors, vector_values, state, z, second)


@compiled
def update_springs(springs, values, vectors, vector_values, state, functions, now, z):
    """Set the tension T and the elongation s of every spring."""
    for s in range(len(springs.f)):
        length = elongation(springs, vectors, vector_values, state, z, s)
        stretch = length - load(values.rest, s)
        elastic = load(values.stiffness, s) + load(values.cubic, s) * stretch * stretch
        rate = _rate(springs, vectors, vector_values, state, z, s)
        pull = load(values.pull, s) * load(functions, now + springs.f[s])
        store(z, state.tension + s, elastic * stretch + load(values.damping, s) * rate + pull)
        store(z, state.elongation + s, length)


@compiled
def add_spring_forces(springs, vectors, vector_values, state, z, r):
    """Add T ∂s/∂q, or T to the rows of the angles; the springs are up to date."""
    for s in range(springs.translational):
        a = springs.vector[s]
        x, y = vector(vectors, vector_values, z, 0, a)
        tension = load(z, state.tension + s) / load(z, state.elongation + s)
        for p in range(vectors.start[a], vectors.start[a + 1]):
            force = x * load(vector_values.x, p) + y * load(vector_values.y, p)
            add_to(r, vectors.coordinate[p], tension * force)
    for s in range(springs.translational, len(springs.f)):
        first, second = _angles_of(springs, s)
        add_to(r, state.angle + first, load(z, state.tension + s))
        add_to(r, state.angle + second, -load(z, state.tension + s))


@compiled
def _slope(values, state, z, rate, s):
    """Return ∂T/∂s + rate ∂T/∂ṡ."""
    stretch = load(z, state.elongation + s) - load(values.rest, s)
    slope = load(values.stiffness, s) + 3.0 * load(values.cubic, s) * stretch * stretch
    return slope + rate * load(values.damping, s)


@compiled
def add_spring_tangent(springs, values, vectors, vector_values, state, z, weight, rate, matrix):
    """Add `weight` times the tangent of translational springs, (T′ + rate d) n nᵀ + T/ℓ (I − n nᵀ).

    The change of the damper's ℓ̇ with the direction is left out.
    """
    for s in range(springs.translational):
        a = springs.vector[s]
        begin, end = vectors.start[a], vectors.start[a + 1]
        x, y = vector(vectors, vector_values, z, 0, a)
        length = load(z, state.elongation + s)
        slope = weight * _slope(values, state, z, rate, s)
        across = weight * load(z, state.tension + s) / length
        nx, ny = x / length, y / length
        for p in range(begin, end):
            px, py = load(vector_values.x, p), load(vector_values.y, p)
            for q in range(p, end):
                qx, qy = load(vector_values.x, q), load(vector_values.y, q)
                along = (nx * px + ny * py) * (nx * qx + ny * qy)
                entry = across * (px * qx + py * qy) + (slope - across) * along
                add_to(matrix, springs.slot[s, p - begin, q - begin], entry)


@compiled
def _angle_entry(springs, vectors, vector_values, z, s, e):
    """Return the coordinate of entry `e` of a torsion spring, and ∂s/∂q there."""
    a, second = _angles_of(springs, s)
    count, sign = vectors.start[a + 1] - vectors.start[a], 1.0
    if e >= count:
        a, e, sign = second, e - count, -1.0
    x, y = vector(vectors, vector_values, z, 0, a)
    p = vectors.start[a] + e
    return vectors.coordinate[p], sign * angle_gradient(vector_values, p, x, y)


@compiled
def add_torsion_tangent(springs, values, vectors, vector_values, state, z, weight, rate, matrix):
    """Add `weight` times (T′ + rate d) ∂s/∂q ∂s/∂qᵀ of torsion springs.

    `angles.add_angle_tangent` adds T times the second derivatives of the angles.
    """
    for s in range(springs.translational, len(springs.f)):
        slope = weight * _slope(values, state, z, rate, s)
        first, second = _angles_of(springs, s)
        count = vectors.start[first + 1] - vectors.start[first]
        count += vectors.start[second + 1] - vectors.start[second]
        for e in range(count):
            i, gradient = _angle_entry(springs, vectors, vector_values, z, s, e)
            for f in range(e, count):
                j, other = _angle_entry(springs, vectors, vector_values, z, s, f)
                entry = slope * gradient * other
                if i == j and e != f:  # both angles depend on this coordinate
                    entry = entry + entry
                add_to(matrix, springs.slot[s, e, f], entry)


@compiled
def spring_energy(springs, values, state, z):
    """Return ½ k x² + ¼ k₃ x⁴ of all springs; actuators have no part in it."""
    total = 0.0 * load(z, 0)
    for s in range(len(springs.f)):
        stretch = load(z, state.elongation + s) - load(values.rest, s)
        square = stretch * stretch
        total += 0.5 * load(values.stiffness, s) * square
        total += 0.25 * load(values.cubic, s) * square * square
    return total


@compiled
def set_rest(springs, values, vectors, vector_values, state, z, known):
    """Set s₀ of springs that are relaxed at the start.

    A given angle at rest is counted from the turn on which the torsion spring starts, unless it is
    `known` which one that was.
    """
    for s in range(len(springs.f)):
        start = elongation(springs, vectors, vector_values, state, z, s)
        given = load(values.rest, s)
        relaxed = less(filled(0.5 * RELAXED), given)
        if s >= springs.translational and not known:
            given = given + math.tau * nearest_whole(start / math.tau)
        store(values.rest, s, where(relaxed, start, given))
