"""Forces and tangent of force laws, on lanes: the engine fills a law's memory and calls the law.

The rows of the memory of a law with m parameters, P points and n states are t, p (m rows), then x,
v and force (3P rows each), then n rows each for the states y, what is known of them, b, a time τ,
and their rates ẏ, then a row each for the modes of its gaps, their values, and, if they are
contacts, the forces along them, their rates, what they lose and effective masses. The law solves
y = b + τ ẏ(y), or ẏ(y) = 0 where τ is `MARK.solved`.

Behind them are a row that is 1 where a law, which is no contact, is to give its stiffness instead
of its forces, 3P rows each of the displacements and velocities of its differences, and matrices:
K = −∂force/∂x (3P × 3P), in which y follows x, B = ∂x/∂q (3P × C, where C is the number of
coordinates that the law depends on), and K B.
"""

from __future__ import annotations

from typing import NamedTuple

from flexband.mechanics.kernels.angles import (
    angle_gradient,
    angle_rate,
    update_angles,
    vector,
    vector_rate,
)
from flexband.mechanics.kernels.lanes import (
    add_to,
    any_true,
    call_at,
    compiled,
    less,
    load,
    magnitude,
    maximum,
    splat,
    store,
    store_rows,
    where,
)
from flexband.mechanics.kernels.laws.states import FIRST_SHARE, MARK, rows_of_states
from flexband.mechanics.kernels.state import rows_of_gaps

AXES = 3
"""Of a point: X, Y and θ."""

GAP_MEMORY = 6
"""Rows of a gap in the memory of its law."""

DIFFERENCE = 1e-6
"""Step of the central differences: an angle [rad], or a displacement relative to the size."""

DEPTH_DIFFERENCE = 1e-2
"""The same for contacts, relative to their depth, if that is less."""


class GapKinds(NamedTuple):
    """What a gap is of."""

    event: int  # of a user's law
    length: int  # [m] of a contact
    angle: int  # [rad] of a contact
    margin: int  # of a friction, see `engine.free_steps.stick_slip`; these are the last gaps


GAP = GapKinds(*range(4))


class LawRows(NamedTuple):
    """What a law has of all points, states and gaps, and the rows of its memory."""

    first: int  # its first point, and the one after its last
    end: int
    state: int  # its first state
    states: int  # how many
    gap: int  # its first gap
    gaps: int  # how many
    x: int
    v: int
    force: int
    y: int
    mode: int
    differentiated: int
    nudge: int
    K: int
    B: int


@compiled
def layout(laws, s):
    """Return the `LawRows` of law s."""
    first = laws.point_start[s]
    end = laws.point_start[s + 1]
    state = laws.state_start[s]
    gap = laws.gap_start[s]
    states = laws.state_start[s + 1] - state
    gaps = laws.gap_start[s + 1] - gap
    x = 1 + laws.parameter_start[s + 1] - laws.parameter_start[s]
    size = AXES * (end - first)
    y = x + 3 * size
    mode = y + 4 * states
    differentiated = mode + GAP_MEMORY * gaps
    nudge = differentiated + 1
    K = nudge + 2 * size
    return LawRows(
        first, end, state, states, gap, gaps, x, x + size, x + 2 * size, y, mode, differentiated,
        nudge, K, K + size * size,
    )  # fmt: skip


@compiled
def fill(structure, values, now, z, s, memory):
    """Write time, parameters, positions and velocities, and what is known of the states."""
    laws = structure.laws
    state = structure.state
    # Time and parameters.
    store(memory, 0, load(values.functions, now + laws.time))
    begin = laws.parameter_start[s]
    for k in range(begin, laws.parameter_start[s + 1]):
        value = load(values.laws, k) * load(values.functions, now + laws.f[k])
        store(memory, 1 + k - begin, value)
    rows = layout(laws, s)
    # Positions and velocities.
    for p in range(rows.first, rows.end):
        row = AXES * (p - rows.first)
        a = laws.angle + p
        px, py = vector(structure, values, z, laws.position + p)
        vx, vy = vector_rate(structure, values, z, z, state.velocity, laws.position + p)
        rate = angle_rate(structure, values, z, a)
        store_rows(memory, rows.x + row, (px, py, load(z, state.angle + a)))
        store_rows(memory, rows.v + row, (vx, vy, rate))
    # What is known of the states, and modes of gaps.
    places = rows_of_states(state)
    for k in range(rows.states):
        before = load(z, places.y0 + rows.state + k)
        w = load(z, places.w + rows.state + k)
        explicit_part = before + load(z, places.rule) * w
        store(memory, rows.y + k, before + (explicit_part - before) / FIRST_SHARE)
        store(memory, rows.y + rows.states + k, explicit_part)
        store(memory, rows.y + 2 * rows.states + k, load(z, places.rule + 1))
    gaps = rows_of_gaps(state)
    for k in range(rows.gaps):
        store(memory, rows.mode + k, load(z, gaps.mode + rows.gap + k))
        store(memory, rows.mode + 5 * rows.gaps + k, load(z, gaps.mass + rows.gap + k))
    store(memory, rows.differentiated, splat(0.0))


@compiled
def _call(laws, state, z, s, memory):
    """Call a law, and take over its states and their rates, and its gaps."""
    call_at(laws.address[s], memory, 0)
    rows = layout(laws, s)
    places = rows_of_states(state)
    gaps = rows_of_gaps(state)
    for k in range(rows.states):
        store(z, places.y + rows.state + k, load(memory, rows.y + k))
        store(z, places.rate + rows.state + k, load(memory, rows.y + 3 * rows.states + k))
    for k in range(rows.gaps):
        gap = rows.gap + k
        store(z, gaps.value + gap, load(memory, rows.mode + rows.gaps + k))
        store(z, gaps.force + gap, load(memory, rows.mode + 2 * rows.gaps + k))
        if laws.gap_kind[gap] != GAP.event:
            store(z, gaps.rate + gap, load(memory, rows.mode + 3 * rows.gaps + k))
            store(z, gaps.loss + gap, load(memory, rows.mode + 4 * rows.gaps + k))


@compiled
def start_states(structure, values, z, memory):
    """Set the states at the start, those given or without a rate; modes that are set are kept."""
    laws = structure.laws
    state = structure.state
    gaps = rows_of_gaps(structure.state)
    for s in range(len(laws.address)):
        fill(structure, values, 0, z, s, memory)
        rows = layout(laws, s)
        # Set the states, and all gaps as open.
        for k in range(rows.states):
            start_value = load(values.law_states, rows.state + k)
            steady = less(splat(0.5 * MARK.steady), start_value)
            value = where(steady, splat(0.0), start_value)
            store(memory, rows.y + k, value)
            store(memory, rows.y + rows.states + k, value)
            tau = where(steady, splat(MARK.solved), splat(0.0))
            store(memory, rows.y + 2 * rows.states + k, tau)
        for k in range(rows.gaps):
            store(memory, rows.mode + k, splat(1.0))
        if rows.states + rows.gaps > 0:
            _call(laws, state, z, s, memory)
        # Set the modes of the gaps that the law has computed.
        for k in range(rows.gaps):
            open_ = less(splat(0.0), load(z, gaps.value + rows.gap + k))
            mode = where(open_, splat(MARK.at_rest), splat(-MARK.at_rest))
            place = gaps.mode + rows.gap + k
            old_mode = load(z, place)
            mode = where(old_mode, old_mode, mode)
            store(memory, rows.mode + k, mode)
            store(z, place, mode)
        if rows.gaps > 0:
            _call(laws, state, z, s, memory)


@compiled
def update_law_states(structure, values, now, z, memory):
    """Solve for the states at the present positions and velocities, and set the gaps."""
    laws = structure.laws
    state = structure.state
    if state.rule < state.extreme:  # there are states or gaps
        update_angles(structure, values, z)
        for s in range(len(laws.address)):
            rows = layout(laws, s)
            if rows.states + rows.gaps > 0:
                fill(structure, values, now, z, s, memory)
                _call(laws, state, z, s, memory)


@compiled
def add_law_forces(structure, values, now, z, r, memory):
    """Subtract the laws' forces from the coordinates' rows and their moments from the angles'."""
    laws = structure.laws
    state = structure.state
    for s in range(len(laws.address)):
        fill(structure, values, now, z, s, memory)
        _call(laws, state, z, s, memory)
        _subtract_forces(structure, values, s, r, memory)


@compiled
def _subtract_forces(structure, values, s, r, memory):
    """Subtract the forces in the memory of law s from the rows of r that they act on."""
    laws = structure.laws
    vectors = structure.vectors
    rows = layout(structure.laws, s)
    for p in range(rows.first, rows.end):
        row = rows.force + AXES * (p - rows.first)
        position = laws.position + p
        fx = load(memory, row)
        fy = load(memory, row + 1)
        for e in range(vectors.start[position], vectors.start[position + 1]):
            part = load(values.vectors.x, e) * fx + load(values.vectors.y, e) * fy
            add_to(r, vectors.coordinate[e], -part)
        add_to(r, structure.state.angle + laws.angle + p, -load(memory, row + 2))


@compiled
def add_unit_force(structure, values, now, z, s, r, memory):
    """Subtract the forces of contact s from r, as `add_law_forces` does, as if its force were 1."""
    row = rows_of_gaps(structure.state).mode + structure.laws.gap_start[s]
    mode = load(z, row)
    store(z, row, splat(-MARK.unit))
    fill(structure, values, now, z, s, memory)
    store(z, row, mode)
    call_at(structure.laws.address[s], memory, 0)
    _subtract_forces(structure, values, s, r, memory)


@compiled
def read_laws(structure, values, now, z, memory):
    """Set the laws' forces and moments in z."""
    laws = structure.laws
    state = structure.state
    for s in range(len(laws.address)):
        fill(structure, values, now, z, s, memory)
        _call(laws, state, z, s, memory)
        rows = layout(laws, s)
        for k in range(AXES * (rows.end - rows.first)):
            store(z, state.law + AXES * rows.first + k, load(memory, rows.force + k))


@compiled
def is_contact(laws, s):
    """Return whether law s is that of a contact, which has one gap."""
    gap = laws.gap_start[s]
    return laws.gap_start[s + 1] > gap and laws.gap_kind[gap] in (GAP.length, GAP.angle)


@compiled
def is_open(laws, state, z, s):
    """Return whether a law is that of a contact that is open in all lanes: it has no tangent."""
    if not is_contact(laws, s):
        return False
    mode = load(z, rows_of_gaps(state).mode + laws.gap_start[s])
    return not any_true(less(mode, splat(0.0)))


@compiled
def difference(laws, state, z, s, size):
    """Return the step of the differences of a law, which is a small part of a contact's depth."""
    rows = layout(laws, s)
    if not is_contact(laws, s):
        return splat(DIFFERENCE)
    depth = magnitude(load(z, state.gap + rows.gap))
    if laws.gap_kind[rows.gap] == GAP.length:
        depth = depth / size
    step = maximum(DEPTH_DIFFERENCE * depth, splat(DEPTH_DIFFERENCE * DIFFERENCE**1.5))
    return where(less(step, splat(DIFFERENCE)), step, splat(DIFFERENCE))


@compiled
def _moves(structure, rows, j):
    """Return whether axis j of the points of a law depends on a coordinate."""
    start = structure.vectors.start
    laws = structure.laws
    p = rows.first + j // AXES
    vector = laws.position + p if j % AXES < 2 else laws.angle + p
    return start[vector + 1] > start[vector]


@compiled
def _fill_contact_stiffness(laws, rows, s, rate, memory):
    """Write K of a contact, by the differences in its memory."""
    axes = AXES * (rows.end - rows.first)
    for j in range(axes):
        nudge = load(memory, rows.nudge + j)
        place = load(memory, rows.x + j)
        speed = load(memory, rows.v + j)
        for i in range(axes):
            store(memory, rows.K + i * axes + j, splat(0.0))
        if not any_true(nudge):
            continue
        for sign in (1.0, -1.0):
            store(memory, rows.x + j, place + sign * nudge)
            store(memory, rows.v + j, speed + sign * rate * nudge)
            call_at(laws.address[s], memory, 0)
            for i in range(axes):
                part = (0.5 * sign) * load(memory, rows.force + i) / nudge
                row = rows.K + i * axes + j
                store(memory, row, -part if sign > 0.0 else load(memory, row) - part)
        store(memory, rows.x + j, place)
        store(memory, rows.v + j, speed)


@compiled
def add_law_tangent(  # noqa: PLR0912
    structure, values, now, z, weight, rate, matrix, memory
):
    """Add `weight` times Bᵀ (K + Kᵀ)/2 B; the matrix is symmetric, so K's other part is left out.

    K comes from central differences of positions and, `rate` times as large, of velocities.
    """
    laws = structure.laws
    state = structure.state
    size = 1.0 / load(values.inverse_scale, 1)
    for s in range(len(laws.address)):
        if is_open(laws, state, z, s):
            continue
        fill(structure, values, now, z, s, memory)
        rows = layout(laws, s)
        axes = AXES * (rows.end - rows.first)
        count = laws.coordinates[s]
        K = rows.K
        B = rows.B
        KB = B + axes * count
        step = difference(laws, state, z, s, size)
        # Set the steps of differences, and let the law find its derivatives K.
        for j in range(axes):
            nudge = step if _moves(structure, rows, j) else splat(0.0)
            if j % AXES < 2:
                nudge = nudge * size
            store(memory, rows.nudge + j, nudge)
            store(memory, rows.nudge + axes + j, rate * nudge)
        for k in range(rows.states):
            store(memory, rows.y + k, load(z, state.law_state + rows.state + k))
        if is_contact(laws, s):
            _fill_contact_stiffness(laws, rows, s, rate, memory)
        else:
            store(memory, rows.differentiated, splat(1.0))
            call_at(laws.address[s], memory, 0)
        # Multiply the symmetric part of K by B.
        _fill_derivatives(structure, values, z, s, memory, B)
        for i in range(axes):
            for c in range(count if _moves(structure, rows, i) else 0):
                total = splat(0.0)
                for j in range(axes):
                    if _moves(structure, rows, j):
                        symmetric = load(memory, K + i * axes + j) + load(memory, K + j * axes + i)
                        total += 0.5 * symmetric * load(memory, B + j * count + c)
                store(memory, KB + i * count + c, total)
        # Add Bᵀ times that.
        for c in range(count):
            for d in range(c, count):
                total = splat(0.0)
                for i in range(axes):
                    if _moves(structure, rows, i):
                        total += load(memory, B + i * count + c) * load(memory, KB + i * count + d)
                add_to(matrix, laws.slot[s, c, d], weight * total)


@compiled
def _fill_derivatives(structure, values, z, s, memory, B):
    """Write B, the derivatives of the points' positions and angles by the coordinates."""
    laws = structure.laws
    vectors = structure.vectors
    rows = layout(laws, s)
    count = laws.coordinates[s]
    for row in range(B, B + AXES * (rows.end - rows.first) * count):
        store(memory, row, splat(0.0))
    for p in range(rows.first, rows.end):
        row = B + AXES * (p - rows.first) * count
        position = laws.position + p
        a = laws.angle + p
        for e in range(vectors.start[position], vectors.start[position + 1]):
            store(memory, row + laws.place[e], load(values.vectors.x, e))
            store(memory, row + count + laws.place[e], load(values.vectors.y, e))
        nx, ny = vector(structure, values, z, a)
        for e in range(vectors.start[a], vectors.start[a + 1]):
            gradient = angle_gradient(vectors, values, z, e, nx, ny)
            store(memory, row + 2 * count + laws.place[e], gradient)
