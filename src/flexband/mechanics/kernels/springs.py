"""Forces and tangent of springs, dampers and actuators, on lanes.

A spring acts along its elongation s with the tension

    T = k x + k₃ x³ + d ṡ + f(t) g(x, ṡ),   x = s − s₀.

g is 1, or a table that is linear between its values: Σ c_ij B_i(x) B_j(ṡ) with B₀ = 1, B₁ = x − x₀
and B_i = max(x − x_{i−1}, 0), where x_i are the places of the table.

The elongation of a translational spring is the length ℓ = |d| of a vector d; these springs come
first. That of all others is c θ + …, a sum of angles, and a form that is at most quadratic in the
coordinates, the first component of a vector.
"""

from __future__ import annotations

from flexband.mechanics.kernels.angles import (
    add_curvature,
    angle_gradient,
    angle_rate,
    entry_gradient,
    third_component,
    vector,
    vector_rate,
)
from flexband.mechanics.kernels.lanes import (
    add_to,
    compiled,
    less,
    load,
    maximum,
    splat,
    sqrt,
    store,
    where,
)

SHORTEST = 1e-300
"""Lets a spring of rest length 0 pass through length 0."""

RELAXED = 1e300
"""In place of the rest elongation s₀ of a spring that is relaxed at the start."""


@compiled
def _length(x, y, h):
    """Return the length of a vector, which is never 0."""
    return maximum(sqrt(x * x + y * y + h * h), splat(SHORTEST))


@compiled
def elongation(structure, values, z, s):
    """Return s."""
    springs = structure.springs
    a = structure.springs.vector[s]
    x, y = vector(structure, values, z, a)
    if s < springs.translational:
        return _length(x, y, third_component(structure, values, z, 0, a))
    for k in range(springs.angle_start[s], springs.angle_start[s + 1]):
        angle = load(z, structure.state.angle + springs.angle[k])
        x += load(values.springs.weight, k) * angle
    return x


@compiled
def _rate(structure, values, z, s):
    """Return ṡ."""
    springs = structure.springs
    a = structure.springs.vector[s]
    first = structure.state.velocity
    u, v = vector_rate(structure, values, z, z, first, a)
    if s < springs.translational:
        x, y = vector(structure, values, z, a)
        h = third_component(structure, values, z, 0, a)
        w = third_component(structure, values, z, first, a)
        return (x * u + y * v + h * w) / _length(x, y, h)
    for k in range(springs.angle_start[s], springs.angle_start[s + 1]):
        rate = angle_rate(structure, values, z, springs.angle[k])
        u += load(values.springs.weight, k) * rate
    return u


@compiled
def _ramp(table, first, k, x):
    """Return B_k and its derivative; the places of the table start in row `first`."""
    if k == 0:
        return splat(1.0), splat(0.0)
    x = x - load(table, first + k - 1)
    if k == 1:
        return x, splat(1.0)
    after = less(splat(0.0), x)
    return where(after, x, splat(0.0)), where(after, splat(1.0), splat(0.0))


@compiled
def _table(springs, table, s, x, rate):
    """Return g and its derivatives by x and by ṡ."""
    value = splat(0.0)
    slope = splat(0.0)
    damping = splat(0.0)
    first = springs.table[s]
    rows = springs.places[s]
    columns = springs.rates[s]
    if rows == 0:
        return splat(1.0), slope, damping
    for i in range(rows):
        bx, dx = _ramp(table, first, i, x)
        for j in range(columns):
            bv, dv = _ramp(table, first + rows, j, rate)
            c = load(table, first + rows + columns + i * columns + j)
            value += c * bx * bv
            slope += c * dx * bv
            damping += c * bx * dv
    return value, slope, damping


@compiled
def update_springs(structure, values, now, z):
    """Set the tension T and the elongation s of every spring."""
    springs = structure.springs
    numbers = values.springs
    state = structure.state
    for s in range(len(springs.f)):
        length = elongation(structure, values, z, s)
        stretch = length - load(numbers.rest, s)
        elastic = load(numbers.stiffness, s) + load(numbers.cubic, s) * stretch * stretch
        rate = _rate(structure, values, z, s)
        pull = load(numbers.pull, s) * load(values.functions, now + springs.f[s])
        if springs.places[s] > 0:
            pull = pull * _table(springs, numbers.table, s, stretch, rate)[0]
        store(z, state.tension + s, elastic * stretch + load(numbers.damping, s) * rate + pull)
        store(z, state.elongation + s, length)


@compiled
def add_spring_forces(structure, values, z, r):
    """Add T ∂s/∂q, that of angles to their rows; the springs are up to date."""
    springs = structure.springs
    vectors = structure.vectors
    state = structure.state
    for s in range(springs.translational):
        a = springs.vector[s]
        x, y = vector(structure, values, z, a)
        h = third_component(structure, values, z, 0, a)
        tension = load(z, state.tension + s) / load(z, state.elongation + s)
        for p in range(vectors.start[a], vectors.start[a + 1]):
            force = x * load(values.vectors.x, p) + y * load(values.vectors.y, p)
            if vectors.spatial:
                force += h * load(values.vectors.z, p)
            add_to(r, vectors.coordinate[p], tension * force)
    for s in range(springs.translational, len(springs.f)):
        a = springs.vector[s]
        tension = load(z, state.tension + s)
        for p in range(vectors.start[a], vectors.start[a + 1]):
            gradient, _ = entry_gradient(vectors, values, z, p)
            add_to(r, vectors.coordinate[p], tension * gradient)
        for k in range(springs.angle_start[s], springs.angle_start[s + 1]):
            add_to(r, state.angle + springs.angle[k], load(values.springs.weight, k) * tension)


@compiled
def _slope(structure, values, now, z, rate, s):
    """Return ∂T/∂s + rate ∂T/∂ṡ."""
    springs = structure.springs
    numbers = values.springs
    stretch = load(z, structure.state.elongation + s) - load(numbers.rest, s)
    slope = load(numbers.stiffness, s) + 3.0 * load(numbers.cubic, s) * stretch * stretch
    slope = slope + rate * load(numbers.damping, s)
    if springs.places[s] > 0:
        speed = _rate(structure, values, z, s)
        _, by_place, by_rate = _table(springs, numbers.table, s, stretch, speed)
        factor = load(numbers.pull, s) * load(values.functions, now + springs.f[s])
        slope = slope + factor * (by_place + rate * by_rate)
    return slope


@compiled
def _entry(structure, values, z, s, e):
    """Return the coordinate of entry `e` of a sum of angles and a form, and ∂s/∂q there."""
    springs = structure.springs
    vectors = structure.vectors
    a = springs.vector[s]
    k = springs.angle_start[s]
    count = vectors.start[a + 1] - vectors.start[a]
    if e < count:
        p = vectors.start[a] + e
        gradient, _ = entry_gradient(vectors, values, z, p)
        return vectors.coordinate[p], gradient
    while e >= count:
        e = e - count
        a = springs.angle[k]
        count = vectors.start[a + 1] - vectors.start[a]
        k = k + 1
    x, y = vector(structure, values, z, a)
    p = vectors.start[a] + e
    gradient = angle_gradient(vectors, values, z, p, x, y)
    return vectors.coordinate[p], load(values.springs.weight, k - 1) * gradient


@compiled
def add_spring_tangent(structure, values, now, z, weight, rate, matrix):
    """Add `weight` times the tangent of all springs.

    It is (T′ + rate d) n nᵀ + T/ℓ (I − n nᵀ) of translational ones; the change of the damper's ṡ
    with the direction is left out. It is (T′ + rate d) ∂s/∂q ∂s/∂qᵀ + T ∂²s/∂q² of the others;
    `angles.add_angle_tangent` adds T times the second derivatives of the angles.
    """
    springs = structure.springs
    vectors = structure.vectors
    numbers = values.vectors
    # Translational springs.
    for s in range(springs.translational):
        a = springs.vector[s]
        begin = vectors.start[a]
        end = vectors.start[a + 1]
        x, y = vector(structure, values, z, a)
        length = load(z, structure.state.elongation + s)
        slope = weight * _slope(structure, values, now, z, rate, s)
        across = weight * load(z, structure.state.tension + s) / length
        nx = x / length
        ny = y / length
        none = 0.0 * x
        nh = third_component(structure, values, z, 0, a) / length
        for p in range(begin, end):
            px = load(numbers.x, p)
            py = load(numbers.y, p)
            ph = load(numbers.z, p) if vectors.spatial else none
            for q in range(p, end):
                qx = load(numbers.x, q)
                qy = load(numbers.y, q)
                qh = load(numbers.z, q) if vectors.spatial else none
                along = (nx * px + ny * py + nh * ph) * (nx * qx + ny * qy + nh * qh)
                entry = across * (px * qx + py * qy + ph * qh) + (slope - across) * along
                add_to(matrix, springs.slot[s, p - begin, q - begin], entry)
    # Springs of angles and lengths, with several entries.
    for s in range(springs.translational, len(springs.f)):
        slope = weight * _slope(structure, values, now, z, rate, s)
        a = springs.vector[s]
        tension = weight * load(z, structure.state.tension + s)
        count = vectors.start[a + 1] - vectors.start[a]
        for p in range(vectors.start[a], vectors.start[a + 1]):
            if vectors.partner[p] > 0:
                add_curvature(vectors, p, tension * load(numbers.x, p), matrix)
        for k in range(springs.angle_start[s], springs.angle_start[s + 1]):
            angle = springs.angle[k]
            count += vectors.start[angle + 1] - vectors.start[angle]
        for e in range(count):
            i, gradient = _entry(structure, values, z, s, e)
            for f in range(e, count):
                j, other = _entry(structure, values, z, s, f)
                entry = slope * gradient * other
                if i == j and e != f:  # several entries depend on this coordinate
                    entry = entry + entry
                add_to(matrix, springs.slot[s, e, f], entry)


@compiled
def spring_energy(structure, values, z):
    """Return ½ k x² + ¼ k₃ x⁴ of all springs; actuators have no part in it."""
    total = 0.0 * load(z, 0)
    numbers = values.springs
    for s in range(len(structure.springs.f)):
        stretch = load(z, structure.state.elongation + s) - load(numbers.rest, s)
        square = stretch * stretch
        total += 0.5 * load(numbers.stiffness, s) * square
        total += 0.25 * load(numbers.cubic, s) * square * square
    return total


@compiled
def set_rest(structure, values, z):
    """Set s₀ of springs that are relaxed at the start."""
    rest = values.springs.rest
    for s in range(len(structure.springs.f)):
        rest_elongation = load(rest, s)
        relaxed = less(splat(0.5 * RELAXED), rest_elongation)
        store(rest, s, where(relaxed, elongation(structure, values, z, s), rest_elongation))
