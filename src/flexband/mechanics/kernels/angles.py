"""Vectors that are at most quadratic in the coordinates, and angles as variables, on lanes.

The angles θ = atan2(n_y, n_x) of the first vectors n, with full turns counted, have rows in the
state z. What acts on θ, the derivative of the constraints' potential or a moment, is summed in the
same row of the residual and then passed on to the coordinates by ∂θ/∂q. Some of these variables are
not the angle but the length |n|. Following forces, springs and force laws use the other vectors.

An entry of a linear vector is a coefficient of one coordinate. A product c q_i q_j has two entries,
each with the other coordinate as its partner, so that ½ Σ c q_partner q is the vector and
Σ c q_partner q̇ its rate; the square of a coordinate has one, with 2 c.
"""

from __future__ import annotations

import math

from flexband.mechanics.kernels.lanes import (
    add_to,
    atan2,
    compiled,
    less,
    load,
    nearest_whole,
    sqrt,
    store,
    where,
)


@compiled
def vector(structure, values, z, a):
    """Return the first two components of vector `a`."""
    vectors = structure.vectors
    x, y = 0.0 * load(z, 0), 0.0 * load(z, 0)
    for p in range(vectors.start[a], vectors.start[a + 1]):
        coordinate = load(z, vectors.coordinate[p])
        if vectors.partner[p] > 0:
            coordinate = 0.5 * coordinate * load(z, vectors.partner[p])
        x += load(values.vectors.x, p) * coordinate
        y += load(values.vectors.y, p) * coordinate
    return x, y


@compiled
def vector_rate(structure, values, z, rates, first, a):
    """Return the rate of vector `a` from the rates of q in `rates` from row `first` on."""
    vectors = structure.vectors
    x, y = 0.0 * load(z, 0), 0.0 * load(z, 0)
    for p in range(vectors.start[a], vectors.start[a + 1]):
        rate = load(rates, first + vectors.coordinate[p])
        if vectors.partner[p] > 0:
            rate = rate * load(z, vectors.partner[p])
        x += load(values.vectors.x, p) * rate
        y += load(values.vectors.y, p) * rate
    return x, y


@compiled
def third_component(structure, values, z, first, a):
    """Return the third component of a linear vector, or its rate; `z` has these from `first` on."""
    vectors = structure.vectors
    component = 0.0 * load(z, 0)
    if vectors.spatial:
        for p in range(vectors.start[a], vectors.start[a + 1]):
            component += load(values.vectors.z, p) * load(z, first + vectors.coordinate[p])
    return component


@compiled
def entry_gradient(vectors, values, z, p):
    """Return the derivatives of both components of a vector by the coordinate of entry p."""
    x = load(values.vectors.x, p)
    y = load(values.vectors.y, p)
    if vectors.partner[p] > 0:
        partner = load(z, vectors.partner[p])
        x = x * partner
        y = y * partner
    return x, y


@compiled
def add_curvature(vectors, p, factor, matrix):
    """Add `factor`, which has the coefficient, times the second derivative of a product's entry."""
    if vectors.partner[p] != vectors.coordinate[p]:
        factor = 0.5 * factor  # the other half is that of the other entry
    add_to(matrix, vectors.partner_slot[p], factor)


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
    vectors = structure.vectors
    state = structure.state
    for a in range(state.sensor_angle - state.angle):
        x, y = vector(structure, values, z, a)
        if vectors.length[a]:
            store(z, state.angle + a, sqrt(x * x + y * y))
        else:
            _update_angle(z, state.angle + a, x, y)
    for d in range((state.law - state.direction) // 2):
        x, y = vector(structure, values, z, vectors.direction + d)
        size = sqrt(x * x + y * y)
        store(z, state.direction + 2 * d, x / size)
        store(z, state.direction + 2 * d + 1, y / size)


@compiled
def update_sensor_angles(structure, values, z):
    """Set the angles that sensors alone read, as `update_angles` does."""
    vectors = structure.vectors
    state = structure.state
    for k in range(state.velocity - state.sensor_angle):
        x, y = vector(structure, values, z, vectors.sensor_angle + k)
        _update_angle(z, state.sensor_angle + k, x, y)


@compiled
def angle_rate(structure, values, z, a):
    """Return θ̇."""
    x, y = vector(structure, values, z, a)
    u, v = vector_rate(structure, values, z, z, structure.state.velocity, a)
    return (x * v - y * u) / _square(x, y)


@compiled
def turning_rate(structure, values, z, k):
    """Return the rate at which body or rod k turns, in the plane with its sign.

    It is |n × ṅ|/n² of one axis n, and √(½ Σ (|n × ṅ|/n²)²) = |ω| of three.
    """
    vectors = structure.vectors
    velocity = structure.state.velocity
    total = 0.0 * load(z, 0)
    turn = 0.0 * load(z, 0)
    for a in range(vectors.turning[k], vectors.turning[k + 1]):
        x, y = vector(structure, values, z, a)
        u, v = vector_rate(structure, values, z, z, velocity, a)
        h = third_component(structure, values, z, 0, a)
        w = third_component(structure, values, z, velocity, a)
        square = _square(x, y) + h * h
        turn = x * v - y * u
        cross = turn * turn + (y * w - h * v) * (y * w - h * v) + (h * u - x * w) * (h * u - x * w)
        total += cross / (square * square)
    rate = sqrt(total / max(vectors.turning[k + 1] - vectors.turning[k] - 1.0, 1.0))
    return where(less(turn, 0.0 * turn), -rate, rate) if vectors.spatial == 0 else rate


@compiled
def angle_gradient(vectors, values, z, p, x, y):
    """Return ∂θ/∂q for entry p of the vector (x, y)."""
    px, py = entry_gradient(vectors, values, z, p)
    return (x * py - y * px) / _square(x, y)


@compiled
def polar_rate(structure, values, z, rates, first, a):
    """Return θ̇, or the rate of a length, from the rates of q in `rates` from row `first` on."""
    x, y = vector(structure, values, z, a)
    u, v = vector_rate(structure, values, z, rates, first, a)
    square = _square(x, y)
    if structure.vectors.length[a]:
        return (x * u + y * v) / sqrt(square)
    return (x * v - y * u) / square


@compiled
def _gradient(vectors, values, z, a, p, x, y):
    """Return ∂θ/∂q, or ∂|n|/∂q if the variable is a length, for entry p of the vector (x, y)."""
    if vectors.length[a]:
        px, py = entry_gradient(vectors, values, z, p)
        return (x * px + y * py) / sqrt(_square(x, y))
    return angle_gradient(vectors, values, z, p, x, y)


@compiled
def pass_on_moments(structure, values, z, r):
    """Pass what acts on the angles on to the coordinates, and keep it in z for the tangent."""
    vectors = structure.vectors
    state = structure.state
    for a in range(state.sensor_angle - state.angle):
        moment = load(r, state.angle + a)
        store(z, state.moment + a, moment)
        x, y = vector(structure, values, z, a)
        for p in range(vectors.start[a], vectors.start[a + 1]):
            add_to(r, vectors.coordinate[p], moment * _gradient(vectors, values, z, a, p, x, y))


@compiled
def add_angle_gradients(structure, values, z, a, factor, matrix):
    """Add `factor` times ∂θ/∂q to the row of the constraint that variable `a` belongs to."""
    x, y = vector(structure, values, z, a)
    vectors = structure.vectors
    first = vectors.start[a]
    for p in range(first, vectors.start[a + 1]):
        entry = factor * _gradient(vectors, values, z, a, p, x, y)
        add_to(matrix, vectors.multiplier_slot[a, p - first], entry)


@compiled
def add_angle_tangent(structure, values, z, weight, matrix):
    """Add `weight` times moment × θ_qq of all angles and lengths."""
    vectors = structure.vectors
    state = structure.state
    numbers = values.vectors
    for a in range(state.sensor_angle - state.angle):
        x, y = vector(structure, values, z, a)
        square = _square(x, y)
        factor = weight * load(z, state.moment + a) / (square * square)
        # Second derivatives by the vector's components.
        xx = factor * 2.0 * x * y
        xy = factor * (y * y - x * x)
        first = vectors.start[a]
        same = 0.0 * factor
        if vectors.length[a]:  # (n × ∂n/∂q)²/|n|³
            factor = 0.5 * factor * sqrt(square)
            xx = factor * (y * y - x * x)
            xy = -2.0 * factor * x * y
            same = factor * square
        moment = weight * load(z, state.moment + a) / square
        # Multiply them by the gradients of the components.
        for p in range(first, vectors.start[a + 1]):
            px, py = entry_gradient(vectors, values, z, p)
            for q in range(p, vectors.start[a + 1]):
                qx, qy = entry_gradient(vectors, values, z, q)
                entry = xx * (px * qx - py * qy) + xy * (px * qy + py * qx)
                entry = entry + same * (px * qx + py * qy)
                if p != q and vectors.coordinate[p] == vectors.coordinate[q]:
                    entry = entry + entry
                add_to(matrix, vectors.slot[a, p - first, q - first], entry)
            if vectors.partner[p] > 0:
                turning = x * load(numbers.y, p) - y * load(numbers.x, p)
                add_curvature(vectors, p, moment * turning, matrix)


@compiled
def angle_drift(structure, values, z, a):
    """Return θ̈ without ∂θ/∂q q̈, or the same of a length.

    This is −2 (n · ṅ)(n × ṅ)/(n · n)² of a linear vector, and n × Σ c q̇_i q̇_j/(n · n) of products.
    """
    vectors = structure.vectors
    velocity = structure.state.velocity
    x, y = vector(structure, values, z, a)
    u, v = vector_rate(structure, values, z, z, velocity, a)
    square = _square(x, y)
    turning = x * v - y * u
    if vectors.length[a]:
        return turning * turning / (square * sqrt(square))
    drift = -2.0 * (x * u + y * v) * turning / (square * square)
    for p in range(vectors.start[a], vectors.start[a + 1]):
        if vectors.partner[p] > 0:
            rate_product = load(z, velocity + vectors.coordinate[p]) * load(
                z, velocity + vectors.partner[p]
            )
            cross_product = x * load(values.vectors.y, p) - y * load(values.vectors.x, p)
            drift += cross_product * rate_product / square
    return drift
