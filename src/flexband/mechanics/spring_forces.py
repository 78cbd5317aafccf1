"""Forces and tangent of translational springs, on lanes."""

from __future__ import annotations

from flexband.lanes import add_to, compiled, filled, load, maximum, sqrt

SHORTEST = 1e-300  # lets a spring of rest length 0 pass through length 0


@compiled
def add_spring_forces(springs, values, z, r):
    """Add the forces k (ℓ − ℓ₀) of the springs."""
    for s in range(len(springs.start) - 1):
        begin, end = springs.start[s], springs.start[s + 1]
        x, y, length = spring_vector(springs, values, z, s)
        stiffness = load(values.stiffness, s)
        tension = stiffness * (1.0 - load(values.rest_length, s) / length)  # over the length
        for p in range(begin, end):
            force = x * load(values.x, p) + y * load(values.y, p)
            add_to(r, springs.coordinate[p], tension * force)


@compiled
def add_spring_tangent(springs, values, z, weight, matrix):
    """Add `weight` times the tangent of the springs, k n nᵀ + k (1 − ℓ₀/ℓ) (I − n nᵀ)."""
    for s in range(len(springs.start) - 1):
        begin, end = springs.start[s], springs.start[s + 1]
        x, y, length = spring_vector(springs, values, z, s)
        stiffness = weight * load(values.stiffness, s)
        ratio = load(values.rest_length, s) / length
        nx, ny = x / length, y / length
        for p in range(begin, end):
            px, py = load(values.x, p), load(values.y, p)
            for q in range(p, end):
                qx, qy = load(values.x, q), load(values.y, q)
                along = (nx * px + ny * py) * (nx * qx + ny * qy)
                entry = stiffness * ((1.0 - ratio) * (px * qx + py * qy) + ratio * along)
                add_to(matrix, springs.slot[s, p - begin, q - begin], entry)


@compiled
def spring_vector(springs, values, z, s):
    """Return the components and the length of a spring's vector, a length that is never 0."""
    x, y = 0.0 * load(z, 0), 0.0 * load(z, 0)
    for p in range(springs.start[s], springs.start[s + 1]):
        coordinate = load(z, springs.coordinate[p])
        x += load(values.x, p) * coordinate
        y += load(values.y, p) * coordinate
    return x, y, maximum(sqrt(x * x + y * y), filled(SHORTEST))
