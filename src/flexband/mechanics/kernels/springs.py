"""Forces and tangent of translational springs, dampers and actuators, on lanes."""

from __future__ import annotations

from flexband.mechanics.kernels.lanes import add_to, compiled, filled, load, maximum, sqrt

SHORTEST = 1e-300  # lets a spring of rest length 0 pass through length 0


@compiled
def add_spring_forces(springs, values, functions, now, z, velocity, r):
    """Add the forces k x + k₃ x³ + d ℓ̇ + f with x = ℓ − ℓ₀; [0, v] starts in row `velocity`."""
    for s in range(len(springs.start) - 1):
        x, y, length = spring_vector(springs, values, z, s)
        vector = x, y, length
        tension = _tension(springs, values, functions, now, z, velocity, s, vector) / length
        for p in range(springs.start[s], springs.start[s + 1]):
            force = x * load(values.x, p) + y * load(values.y, p)
            add_to(r, springs.coordinate[p], tension * force)


@compiled
def add_spring_tangent(springs, values, functions, now, z, velocity, weight, rate, matrix):
    """Add `weight` times the tangent, (T′ + rate d) n nᵀ + T/ℓ (I − n nᵀ), T being the tension.

    How the damper's ℓ̇ changes with the direction is left out.
    """
    for s in range(len(springs.start) - 1):
        begin, end = springs.start[s], springs.start[s + 1]
        x, y, length = spring_vector(springs, values, z, s)
        stretch = length - load(values.rest_length, s)
        slope = load(values.stiffness, s) + 3.0 * load(values.cubic, s) * stretch * stretch
        slope = weight * (slope + rate * load(values.damping, s))
        vector = x, y, length
        tension = _tension(springs, values, functions, now, z, velocity, s, vector)
        across = weight * tension / length
        nx, ny = x / length, y / length
        for p in range(begin, end):
            px, py = load(values.x, p), load(values.y, p)
            for q in range(p, end):
                qx, qy = load(values.x, q), load(values.y, q)
                along = (nx * px + ny * py) * (nx * qx + ny * qy)
                entry = across * (px * qx + py * qy) + (slope - across) * along
                add_to(matrix, springs.slot[s, p - begin, q - begin], entry)


@compiled
def spring_energy(springs, values, z):
    """Return ½ k x² + ¼ k₃ x⁴ of the springs; what actuators pull with has no part in it."""
    total = 0.0 * load(z, 0)
    for s in range(len(springs.start) - 1):
        _, _, length = spring_vector(springs, values, z, s)
        stretch = length - load(values.rest_length, s)
        square = stretch * stretch
        total += (
            0.5 * load(values.stiffness, s) * square
            + 0.25 * load(values.cubic, s) * square * square
        )
    return total


@compiled
def _tension(springs, values, functions, now, z, velocity, s, vector):
    """Return k x + k₃ x³ + d ℓ̇ + f, with the `spring_vector`."""
    x, y, length = vector
    vx, vy = 0.0 * x, 0.0 * x
    for p in range(springs.start[s], springs.start[s + 1]):
        rate = load(z, velocity + springs.coordinate[p])
        vx += load(values.x, p) * rate
        vy += load(values.y, p) * rate
    stretch = length - load(values.rest_length, s)
    elastic = load(values.stiffness, s) + load(values.cubic, s) * stretch * stretch
    pull = load(values.pull, s) * load(functions, now + springs.f[s])
    return elastic * stretch + load(values.damping, s) * (x * vx + y * vy) / length + pull


@compiled
def spring_vector(springs, values, z, s):
    """Return the components and the length of a spring's vector, a length that is never 0."""
    x, y = 0.0 * load(z, 0), 0.0 * load(z, 0)
    for p in range(springs.start[s], springs.start[s + 1]):
        coordinate = load(z, springs.coordinate[p])
        x += load(values.x, p) * coordinate
        y += load(values.y, p) * coordinate
    return x, y, maximum(sqrt(x * x + y * y), filled(SHORTEST))
