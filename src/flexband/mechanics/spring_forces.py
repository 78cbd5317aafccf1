"""Forces and tangent of translational springs, on lanes."""

from __future__ import annotations

from flexband.lanes import add_to, compiled, filled, load, maximum, sqrt

SHORTEST = 1e-300  # lets a spring of rest length 0 pass through length 0


@compiled
def add_spring_forces(structure, values, z, r):
    """Add the forces k (ℓ − ℓ₀) of the springs."""
    for s in range(len(structure.spring_start) - 1):
        begin, end = structure.spring_start[s], structure.spring_start[s + 1]
        x, y, length = spring_vector(structure, values, z, s)
        stiffness = load(values.spring_stiffness, s)
        tension = stiffness * (1.0 - load(values.rest_length, s) / length)  # over the length
        for p in range(begin, end):
            force = x * load(values.spring_x, p) + y * load(values.spring_y, p)
            add_to(r, structure.spring_coordinate[p], tension * force)


@compiled
def add_spring_tangent(structure, values, z, weight, matrix):
    """Add `weight` times the tangent of the springs, k n nᵀ + k (1 − ℓ₀/ℓ) (I − n nᵀ)."""
    for s in range(len(structure.spring_start) - 1):
        begin, end = structure.spring_start[s], structure.spring_start[s + 1]
        x, y, length = spring_vector(structure, values, z, s)
        stiffness = weight * load(values.spring_stiffness, s)
        ratio = load(values.rest_length, s) / length
        nx, ny = x / length, y / length
        for p in range(begin, end):
            px, py = load(values.spring_x, p), load(values.spring_y, p)
            for q in range(p, end):
                qx, qy = load(values.spring_x, q), load(values.spring_y, q)
                along = (nx * px + ny * py) * (nx * qx + ny * qy)
                entry = stiffness * ((1.0 - ratio) * (px * qx + py * qy) + ratio * along)
                add_to(matrix, structure.spring_slot[s, p - begin, q - begin], entry)


@compiled
def spring_vector(structure, values, z, s):
    """Return the components and the length of a spring's vector, a length that is never 0."""
    x, y = 0.0 * load(z, 0), 0.0 * load(z, 0)
    for p in range(structure.spring_start[s], structure.spring_start[s + 1]):
        coordinate = load(z, structure.spring_coordinate[p])
        x += load(values.spring_x, p) * coordinate
        y += load(values.spring_y, p) * coordinate
    return x, y, maximum(sqrt(x * x + y * y), filled(SHORTEST))
