"""Vectors that are linear in the coordinates, and their angles as variables, on lanes.

The angles θ = atan2(n_y, n_x) of the first vectors n, with full turns counted, have rows in the
state z. What acts on θ, the derivative of the constraints' potential or a moment, is summed in the
same row of the residual and then passed on to the coordinates by ∂θ/∂q. Some of these variables are
not the angle but the length |n|. Following forces, springs and force laws use the other vectors.
"""

from __future__ import annotations

import math

from flexband.mechanics.kernels.lanes import (
    add_to,
    atan2,
    compiled,
    load,
    nearest_whole,
    sqrt,
    store,
)


@compiled
def vector(structure, values, z, first, a):
    """Return vector `a`, or its rate if z holds the coordinates' rates from row `first` on."""
    vectors, x, y = structure.vectors, 0.0 * load(z, 0), 0.0 * load(z, 0)
    for p in range(vectors.start[a], vectors.start[a + 1]):
        coordinate = load(z, first + vectors.coordinate[p])
        x += load(values.vectors.x, p) * coordinate
        y += load(values.vectors.y, p) * coordinate
    return x, y


@compiled
def _square(x, y):
    """Return x² + y², which is not zero: a vector without length has an angle that stays."""
    return x * x + y * y + 1e-100


@compiled
def _update_angle(z, row, x, y):
    """Set the angle of a vector (x, y) on the turn nearest to its present value."""
    angle = atan2(y, x)
    turns = nearest_whole((load(z, row) - angle) / math.tau)
    store(z, row, angle + math.tau * turns)


@compiled
def update_angles(structure, values, z):
    """Set the angles, each on the turn nearest to its present value, lengths and unit vectors."""
    vectors, state = structure.vectors, structure.state
    for a in range(state.sensor_angle - state.angle):
        x, y = vector(structure, values, z, 0, a)
        if vectors.length[a]:
            store(z, state.angle + a, sqrt(x * x + y * y))
        else:
            _update_angle(z, state.angle + a, x, y)
    for d in range((state.law - state.direction) // 2):
        x, y = vector(structure, values, z, 0, vectors.direction + d)
        size = sqrt(x * x + y * y)
        store(z, state.direction + 2 * d, x / size)
        store(z, state.direction + 2 * d + 1, y / size)


@compiled
def update_sensor_angles(structure, values, z):
    """Set the angles that sensors alone read, as `update_angles` does."""
    vectors, state = structure.vectors, structure.state
    for k in range(state.velocity - state.sensor_angle):
        x, y = vector(structure, values, z, 0, vectors.sensor_angle + k)
        _update_angle(z, state.sensor_angle + k, x, y)


@compiled
def angle_rate(structure, values, z, a):
    """Return θ̇."""
    x, y = vector(structure, values, z, 0, a)
    u, v = vector(structure, values, z, structure.state.velocity, a)
    return (x * v - y * u) / _square(x, y)


@compiled
def angle_gradient(values, p, x, y):
    """Return ∂θ/∂q for entry p of the vector (x, y)."""
    return (x * load(values.vectors.y, p) - y * load(values.vectors.x, p)) / _square(x, y)


@compiled
def polar_rate(structure, values, z, rates, first, a):
    """Return θ̇, or the rate of a length, from the rates of q in `rates` from row `first` on."""
    x, y = vector(structure, values, z, 0, a)
    u, v = vector(structure, values, rates, first, a)
    square = _square(x, y)
    if structure.vectors.length[a]:
        return (x * u + y * v) / sqrt(square)
    return (x * v - y * u) / square


@compiled
def _gradient(structure, values, a, p, x, y):
    """Return ∂θ/∂q, or ∂|n|/∂q if the variable is a length, for entry p of the vector (x, y)."""
    if structure.vectors.length[a]:
        along = x * load(values.vectors.x, p) + y * load(values.vectors.y, p)
        return along / sqrt(_square(x, y))
    return angle_gradient(values, p, x, y)


@compiled
def pass_on_moments(structure, values, z, r):
    """Pass what acts on the angles on to the coordinates, and keep it in z for the tangent."""
    vectors, state = structure.vectors, structure.state
    for a in range(state.sensor_angle - state.angle):
        moment = load(r, state.angle + a)
        store(z, state.moment + a, moment)
        x, y = vector(structure, values, z, 0, a)
        for p in range(vectors.start[a], vectors.start[a + 1]):
            add_to(r, vectors.coordinate[p], moment * _gradient(structure, values, a, p, x, y))


@compiled
def add_angle_gradients(structure, values, z, a, factor, matrix):
    """Add `factor` times ∂θ/∂q to the row of the constraint that variable `a` belongs to."""
    x, y = vector(structure, values, z, 0, a)
    vectors = structure.vectors
    first = vectors.start[a]
    for p in range(first, vectors.start[a + 1]):
        entry = factor * _gradient(structure, values, a, p, x, y)
        add_to(matrix, vectors.multiplier_slot[a, p - first], entry)


@compiled
def add_angle_tangent(structure, values, z, weight, matrix):
    """Add `weight` times moment × θ_qq of all angles and lengths."""
    vectors, state, numbers = structure.vectors, structure.state, values.vectors
    for a in range(state.sensor_angle - state.angle):
        x, y = vector(structure, values, z, 0, a)
        square = _square(x, y)
        factor = weight * load(z, state.moment + a) / (square * square)
        xx, xy = factor * 2.0 * x * y, factor * (y * y - x * x)
        first, same = vectors.start[a], 0.0 * factor
        if vectors.length[a]:  # (n × ∂n/∂q)²/|n|³
            factor = 0.5 * factor * sqrt(square)
            xx, xy, same = factor * (y * y - x * x), -2.0 * factor * x * y, factor * square
        for p in range(first, vectors.start[a + 1]):
            px, py = load(numbers.x, p), load(numbers.y, p)
            for q in range(p, vectors.start[a + 1]):
                qx, qy = load(numbers.x, q), load(numbers.y, q)
                entry = xx * (px * qx - py * qy) + xy * (px * qy + py * qx)
                entry = entry + same * (px * qx + py * qy)
                add_to(matrix, vectors.slot[a, p - first, q - first], entry)


@compiled
def angle_drift(structure, values, z, a):
    """Return θ̈ without ∂θ/∂q q̈, which is −2 (n · ṅ)(n × ṅ)/(n · n)², or the same of a length."""
    x, y = vector(structure, values, z, 0, a)
    u, v = vector(structure, values, z, structure.state.velocity, a)
    square, turning = _square(x, y), x * v - y * u
    if structure.vectors.length[a]:
        return turning * turning / (square * sqrt(square))
    return -2.0 * (x * u + y * v) * turning / (square * square)
