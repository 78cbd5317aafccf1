"""Forces and tangent of force laws, on lanes: the engine fills a law's memory and calls the law.

The rows of the memory of a law with m parameters and P points are t, p (m rows), then x, v and
force (3P rows each). The tangent needs three matrices behind them: B = ∂x/∂q (3P × C, where C is
the number of coordinates that the law depends on), K = −∂force/∂x (3P × 3P) and K B.
"""

from __future__ import annotations

from flexband.mechanics.kernels.angles import angle_gradient, angle_rate, direction
from flexband.mechanics.kernels.lanes import add_to, call_at, compiled, filled, load, store

AXES = 3
"""Of a point: X, Y and θ."""

DIFFERENCE = 1e-6
"""Step of the central differences: an angle [rad], or a displacement relative to the size."""


@compiled
def _layout(laws, s):
    """Return the numbers of points and coordinates of a law, and the rows of x, v, force and B."""
    points = laws.point_start[s + 1] - laws.point_start[s]
    coordinates = laws.coordinate_start[s + 1] - laws.coordinate_start[s]
    x = 1 + laws.parameter_start[s + 1] - laws.parameter_start[s]
    return points, coordinates, x, x + AXES * points, x + 2 * AXES * points, x + 3 * AXES * points


@compiled
def _fill(laws, values, angles, angle_values, state, functions, now, z, s, memory):
    """Write time, parameters, positions and velocities."""
    store(memory, 0, load(functions, now + laws.time))
    first = laws.parameter_start[s]
    for k in range(first, laws.parameter_start[s + 1]):
        value = load(values.parameter, k) * load(functions, now + laws.f[k])
        store(memory, 1 + k - first, value)
    points, count, x, v, _, _ = _layout(laws, s)
    for k in range(points):
        entry = laws.entry_start[s] + k * count
        px, py, vx, vy = filled(0.0), filled(0.0), filled(0.0), filled(0.0)
        for c in range(count):
            coordinate = laws.coordinate[laws.coordinate_start[s] + c]
            cx, cy = load(values.x, entry + c), load(values.y, entry + c)
            position, rate = load(z, coordinate), load(z, state.velocity + coordinate)
            px, py, vx, vy = px + cx * position, py + cy * position, vx + cx * rate, vy + cy * rate
        a = laws.angle[laws.point_start[s] + k]
        store(memory, x + AXES * k, px)
        store(memory, x + AXES * k + 1, py)
        store(memory, x + AXES * k + 2, load(z, state.angle + a))
        store(memory, v + AXES * k, vx)
        store(memory, v + AXES * k + 1, vy)
        store(memory, v + AXES * k + 2, angle_rate(angles, angle_values, state, z, a))


@compiled
def add_law_forces(laws, values, angles, angle_values, state, functions, now, z, r, memory):
    """Subtract the laws' forces from the coordinates' rows and their moments from the angles'."""
    for s in range(len(laws.address)):
        _fill(laws, values, angles, angle_values, state, functions, now, z, s, memory)
        call_at(laws.address[s], memory, 0)
        points, count, _, _, force, _ = _layout(laws, s)
        for k in range(points):
            entry, row = laws.entry_start[s] + k * count, force + AXES * k
            fx, fy = load(memory, row), load(memory, row + 1)
            for c in range(count):
                coordinate = laws.coordinate[laws.coordinate_start[s] + c]
                part = load(values.x, entry + c) * fx + load(values.y, entry + c) * fy
                add_to(r, coordinate, -part)
            a = laws.angle[laws.point_start[s] + k]
            add_to(r, state.angle + a, -load(memory, row + 2))


@compiled
def add_law_tangent(
    laws, values, angles, angle_values, state, functions, now, z, weight, rate, size, matrix, memory
):  # fmt: skip
    """Add `weight` times Bᵀ (K + Kᵀ)/2 B; the matrix is symmetric, so K's other part is left out.

    K comes from central differences of positions and, `rate` times as large, of velocities; `size`
    is the size of the mechanism [m].
    """
    for s in range(len(laws.address)):
        _fill(laws, values, angles, angle_values, state, functions, now, z, s, memory)
        points, count, x, v, force, B = _layout(laws, s)
        axes = AXES * points
        K, KB = B + axes * count, B + axes * count + axes * axes
        for j in range(axes):
            nudge = filled(DIFFERENCE)
            if j % AXES < 2:
                nudge = nudge * size
            place, speed = load(memory, x + j), load(memory, v + j)
            for sign in (1.0, -1.0):
                store(memory, x + j, place + sign * nudge)
                store(memory, v + j, speed + sign * rate * nudge)
                call_at(laws.address[s], memory, 0)
                for i in range(axes):
                    part = (0.5 * sign) * load(memory, force + i) / nudge
                    row = K + i * axes + j
                    store(memory, row, -part if sign > 0.0 else load(memory, row) - part)
            store(memory, x + j, place)
            store(memory, v + j, speed)
        _fill_directions(laws, values, angles, angle_values, z, s, memory, B)
        for i in range(axes):
            for c in range(count):
                total = filled(0.0)
                for j in range(axes):
                    symmetric = load(memory, K + i * axes + j) + load(memory, K + j * axes + i)
                    total += 0.5 * symmetric * load(memory, B + j * count + c)
                store(memory, KB + i * count + c, total)
        for c in range(count):
            for d in range(c, count):
                total = filled(0.0)
                for i in range(axes):
                    total += load(memory, B + i * count + c) * load(memory, KB + i * count + d)
                add_to(matrix, laws.slot[s, c, d], weight * total)


@compiled
def _fill_directions(laws, values, angles, angle_values, z, s, memory, B):
    """Write B, the derivatives of the points' positions and angles by the coordinates."""
    points, count, _, _, _, _ = _layout(laws, s)
    for k in range(points):
        entry, row = laws.entry_start[s] + k * count, B + AXES * k * count
        for c in range(count):
            store(memory, row + c, load(values.x, entry + c))
            store(memory, row + count + c, load(values.y, entry + c))
            store(memory, row + 2 * count + c, filled(0.0))
        a = laws.angle[laws.point_start[s] + k]
        nx, ny = direction(angles, angle_values, z, 0, a)
        for p in range(angles.start[a], angles.start[a + 1]):
            gradient = angle_gradient(angles, angle_values, p, nx, ny)
            store(memory, row + 2 * count + laws.place[p], gradient)
