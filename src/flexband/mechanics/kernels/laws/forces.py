"""Forces and tangent of force laws, on lanes: the engine fills a law's memory and calls the law.

The rows of the memory of a law with m parameters, P points and n states are t, p (m rows), then x,
v and force (3P rows each), then n rows each for the states y, what is known of them, b, a time τ,
and their rates ẏ, then a row each for the modes of its gaps, their values, and, if they are
contacts, the forces along them and their rates. The law solves y = b + τ ẏ(y), or ẏ(y) = 0 where τ
is `MARK.solved`. The tangent needs three matrices behind them: B = ∂x/∂q (3P × C, where C is the
number of coordinates that the law depends on), K = −∂force/∂x (3P × 3P), in which y follows x, and
K B.
"""

from __future__ import annotations

from typing import NamedTuple

from flexband.mechanics.kernels.angles import angle_gradient, angle_rate, update_angles, vector
from flexband.mechanics.kernels.lanes import (
    add_to,
    any_true,
    call_at,
    compiled,
    filled,
    less,
    load,
    magnitude,
    maximum,
    store,
    where,
)
from flexband.mechanics.kernels.laws.states import MARK, rows_of_states
from flexband.mechanics.kernels.state import GAP_ROWS

AXES = 3
"""Of a point: X, Y and θ."""

DIFFERENCE = 1e-6
"""Step of the central differences: an angle [rad], or a displacement relative to the size."""

DEPTH_DIFFERENCE = 1e-2
"""The same for contacts, relative to their depth, if that is less."""


class GapKinds(NamedTuple):
    """What a gap is of."""

    event: int = 0  # of a user's law
    length: int = 1  # [m] of a contact
    angle: int = 2  # [rad] of a contact
    margin: int = 3  # of a friction, see `engine.free_steps.stick_slip`; these are the last gaps


GAP = GapKinds()


@compiled
def layout(laws, s):
    """Return the first and the last point of a law, and the rows of x, v, force, y and B."""
    first, last = laws.point_start[s], laws.point_start[s + 1]
    x, size = 1 + laws.parameter_start[s + 1] - laws.parameter_start[s], AXES * (last - first)
    y, count = x + 3 * size, laws.state_start[s + 1] - laws.state_start[s]
    gaps = laws.gap_start[s + 1] - laws.gap_start[s]
    return first, last, x, x + size, x + 2 * size, y, y + 4 * count + GAP_ROWS * gaps


@compiled
def fill(laws, values, vectors, vector_values, state, functions, now, z, s, memory):
    """Write time, parameters, positions and velocities, and what is known of the states."""
    store(memory, 0, load(functions, now + laws.time))
    begin = laws.parameter_start[s]
    for k in range(begin, laws.parameter_start[s + 1]):
        value = load(values, k) * load(functions, now + laws.f[k])
        store(memory, 1 + k - begin, value)
    first, last, x, v, _, y, _ = layout(laws, s)
    for p in range(first, last):
        row, a = AXES * (p - first), laws.angle + p
        px, py = vector(vectors, vector_values, z, 0, laws.position + p)
        vx, vy = vector(vectors, vector_values, z, state.velocity, laws.position + p)
        store(memory, x + row, px)
        store(memory, x + row + 1, py)
        store(memory, x + row + 2, load(z, state.angle + a))
        store(memory, v + row, vx)
        store(memory, v + row + 1, vy)
        store(memory, v + row + 2, angle_rate(vectors, vector_values, state, z, a))
    start, slope, _, rule, _ = rows_of_states(state)
    begin, count = laws.state_start[s], laws.state_start[s + 1] - laws.state_start[s]
    for k in range(count):
        before = load(z, start + begin + k)
        store(memory, y + k, before)
        store(memory, y + count + k, before + load(z, rule) * load(z, slope + begin + k))
        store(memory, y + 2 * count + k, load(z, rule + 1))
    all_gaps, gap, gaps, row = gaps_of(laws, state, s, y)
    for k in range(gaps):
        store(memory, row + k, load(z, state.gap + 2 * all_gaps + gap + k))


@compiled
def gaps_of(laws, state, s, y):
    """Return the number of all gaps, the first one of law s, their number and row in its memory.

    `y` is the row of the law's states.
    """
    count = laws.state_start[s + 1] - laws.state_start[s]
    gap, end = laws.gap_start[s], laws.gap_start[s + 1]
    return (state.extreme - state.gap) // GAP_ROWS, gap, end - gap, y + 4 * count


@compiled
def _call(laws, state, z, s, memory):
    """Call a law, and take over its states and their rates."""
    call_at(laws.address[s], memory, 0)
    _, _, _, _, _, y, _ = layout(laws, s)
    _, _, rate, _, _ = rows_of_states(state)
    begin, count = laws.state_start[s], laws.state_start[s + 1] - laws.state_start[s]
    for k in range(count):
        store(z, state.law_state + begin + k, load(memory, y + k))
        store(z, rate + begin + k, load(memory, y + 3 * count + k))
    all_gaps, gap, gaps, row = gaps_of(laws, state, s, y)
    for k in range(gaps):
        store(z, state.gap + gap + k, load(memory, row + gaps + k))
        force = load(memory, row + 2 * gaps + k)
        store(z, state.gap + 3 * all_gaps + gap + k, force)
        if laws.gap_kind[gap + k] != GAP.event:
            store(z, state.gap + all_gaps + gap + k, load(memory, row + 3 * gaps + k))


@compiled
def start_states(laws, values, starting, vectors, vector_values, state, functions, now, z, memory):
    """Set the states at the start: those given, `starting`, or those without a rate.

    Modes of gaps that are not zero are kept.
    """
    for s in range(len(laws.address)):
        fill(laws, values, vectors, vector_values, state, functions, now, z, s, memory)
        _, _, _, _, _, y, _ = layout(laws, s)
        begin, count = laws.state_start[s], laws.state_start[s + 1] - laws.state_start[s]
        for k in range(count):
            given = load(starting, begin + k)
            steady = less(filled(0.5 * MARK.steady), given)
            known = where(steady, filled(0.0), given)
            store(memory, y + k, known)
            store(memory, y + count + k, known)
            store(memory, y + 2 * count + k, where(steady, filled(MARK.solved), filled(0.0)))
        all_gaps, gap, gaps, row = gaps_of(laws, state, s, y)
        for k in range(gaps):
            store(memory, row + k, filled(1.0))
        if count + gaps > 0:
            _call(laws, state, z, s, memory)
        for k in range(gaps):
            open_ = less(filled(0.0), load(z, state.gap + gap + k))
            mode = where(open_, filled(MARK.at_rest), filled(-MARK.at_rest))
            known = load(z, state.gap + 2 * all_gaps + gap + k)
            mode = where(known, known, mode)
            store(memory, row + k, mode)
            store(z, state.gap + 2 * all_gaps + gap + k, mode)
        if gaps > 0:
            _call(laws, state, z, s, memory)


@compiled
def update_law_states(structure, values, now, z, memory):
    """Solve for the states at the present positions and velocities, and set the gaps."""
    laws, vectors, state = structure.laws, structure.vectors, structure.state
    if state.rule < state.extreme:  # there are states or gaps
        update_angles(vectors, values.vectors, state, z)
        for s in range(len(laws.address)):
            count = laws.state_start[s + 1] - laws.state_start[s]
            if count + laws.gap_start[s + 1] - laws.gap_start[s] > 0:
                fill(
                    laws, values.laws, vectors, values.vectors, state, values.functions, now, z, s,
                    memory,
                )  # fmt: skip
                _call(laws, state, z, s, memory)


@compiled
def add_law_forces(laws, values, vectors, vector_values, state, functions, now, z, r, memory):
    """Subtract the laws' forces from the coordinates' rows and their moments from the angles'."""
    for s in range(len(laws.address)):
        fill(laws, values, vectors, vector_values, state, functions, now, z, s, memory)
        _call(laws, state, z, s, memory)
        first, last, _, _, force, _, _ = layout(laws, s)
        for p in range(first, last):
            row, position = force + AXES * (p - first), laws.position + p
            fx, fy = load(memory, row), load(memory, row + 1)
            for e in range(vectors.start[position], vectors.start[position + 1]):
                part = load(vector_values.x, e) * fx + load(vector_values.y, e) * fy
                add_to(r, vectors.coordinate[e], -part)
            add_to(r, state.angle + laws.angle + p, -load(memory, row + 2))


@compiled
def read_laws(laws, values, vectors, vector_values, state, functions, now, z, memory):
    """Set the laws' forces and moments in z."""
    for s in range(len(laws.address)):
        fill(laws, values, vectors, vector_values, state, functions, now, z, s, memory)
        _call(laws, state, z, s, memory)
        first, last, _, _, force, _, _ = layout(laws, s)
        for k in range(AXES * (last - first)):
            store(z, state.law + AXES * first + k, load(memory, force + k))


@compiled
def is_open(laws, state, z, s):
    """Return whether a law is that of a contact that is open in all lanes: it has no tangent."""
    begin, end = laws.gap_start[s], laws.gap_start[s + 1]
    closed, count = filled(0.0), (state.extreme - state.gap) // GAP_ROWS
    if begin == end or laws.gap_kind[begin] == GAP.event:
        return False
    for k in range(begin, end):
        closed = maximum(closed, less(load(z, state.gap + 2 * count + k), filled(0.0)))
    return not any_true(closed)


@compiled
def difference(laws, state, z, s, size):
    """Return the step of the differences of a law, which is a small part of a contact's depth."""
    begin, end = laws.gap_start[s], laws.gap_start[s + 1]
    if begin == end or laws.gap_kind[begin] == GAP.event:
        return filled(DIFFERENCE)
    depth = magnitude(load(z, state.gap + begin))
    if laws.gap_kind[begin] == GAP.length:
        depth = depth / size
    step = maximum(DEPTH_DIFFERENCE * depth, filled(DEPTH_DIFFERENCE * DIFFERENCE**1.5))
    return where(less(step, filled(DIFFERENCE)), step, filled(DIFFERENCE))


@compiled
def add_law_tangent(  # noqa: PLR0912
    laws, values, vectors, vector_values, state, functions, now, z, weight, rate, size, matrix,
    memory,
):  # fmt: skip
    """Add `weight` times Bᵀ (K + Kᵀ)/2 B; the matrix is symmetric, so K's other part is left out.

    K comes from central differences of positions and, `rate` times as large, of velocities; `size`
    is the size of the mechanism [m].
    """
    for s in range(len(laws.address)):
        if is_open(laws, state, z, s):
            continue
        fill(laws, values, vectors, vector_values, state, functions, now, z, s, memory)
        first, last, x, v, force, y, B = layout(laws, s)
        axes, count = AXES * (last - first), laws.coordinates[s]
        begin, states = laws.state_start[s], laws.state_start[s + 1] - laws.state_start[s]
        K, KB = B + axes * count, B + axes * count + axes * axes
        step = difference(laws, state, z, s, size)
        for j in range(axes):
            nudge = step
            if j % AXES < 2:
                nudge = nudge * size
            place, speed = load(memory, x + j), load(memory, v + j)
            for sign in (1.0, -1.0):
                store(memory, x + j, place + sign * nudge)
                store(memory, v + j, speed + sign * rate * nudge)
                for k in range(states):
                    store(memory, y + k, load(z, state.law_state + begin + k))
                call_at(laws.address[s], memory, 0)
                for i in range(axes):
                    part = (0.5 * sign) * load(memory, force + i) / nudge
                    row = K + i * axes + j
                    store(memory, row, -part if sign > 0.0 else load(memory, row) - part)
            store(memory, x + j, place)
            store(memory, v + j, speed)
        _fill_derivatives(laws, vectors, vector_values, z, s, memory, B)
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
def _fill_derivatives(laws, vectors, vector_values, z, s, memory, B):
    """Write B, the derivatives of the points' positions and angles by the coordinates."""
    first, last, _, _, _, _, _ = layout(laws, s)
    count = laws.coordinates[s]
    for row in range(B, B + AXES * (last - first) * count):
        store(memory, row, filled(0.0))
    for p in range(first, last):
        row, position, a = B + AXES * (p - first) * count, laws.position + p, laws.angle + p
        for e in range(vectors.start[position], vectors.start[position + 1]):
            store(memory, row + laws.place[e], load(vector_values.x, e))
            store(memory, row + count + laws.place[e], load(vector_values.y, e))
        nx, ny = vector(vectors, vector_values, z, 0, a)
        for e in range(vectors.start[a], vectors.start[a + 1]):
            gradient = angle_gradient(vector_values, e, nx, ny)
            store(memory, row + 2 * count + laws.place[e], gradient)
