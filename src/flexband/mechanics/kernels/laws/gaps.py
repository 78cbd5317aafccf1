"""Gaps of force laws, whose zeros are events, on lanes.

A law with events fills its gaps g, each of which has a mode m. Its sign is that of g, held while a
step is taken, and its size is the speed |ġ| at the last event.
"""

from __future__ import annotations

from flexband.mechanics.kernels.angles import angle_drift, polar_rate, vector_rate
from flexband.mechanics.kernels.lanes import add_to, call_at, compiled, load, splat, store
from flexband.mechanics.kernels.laws.forces import AXES, GAP, fill, layout
from flexband.mechanics.kernels.laws.states import rows_of_states
from flexband.mechanics.kernels.state import rows_of_gaps


@compiled
def _move(structure, values, z, s, time, memory):
    """Move what a law reads by a time, with its velocities and accelerations; states are held."""
    laws = structure.laws
    state = structure.state
    rows = layout(structure.laws, s)
    add_to(memory, 0, time)
    # Move the parameters and the positions.
    begin = laws.parameter_start[s]
    for k in range(begin, laws.parameter_start[s + 1]):
        change = load(values.laws, k) * load(values.rates, laws.f[k])
        add_to(memory, 1 + k - begin, time * change)
    for row in range(AXES * (rows.end - rows.first)):
        add_to(memory, rows.x + row, time * load(memory, rows.v + row))
    # Move the velocities.
    for p in range(rows.first, rows.end):
        row = rows.v + AXES * (p - rows.first)
        a = laws.angle + p
        ax, ay = vector_rate(structure, values, z, z, state.acceleration, laws.position + p)
        turning = polar_rate(structure, values, z, z, state.acceleration, a)
        turning += angle_drift(structure, values, z, a)
        add_to(memory, row, time * ax)
        add_to(memory, row + 1, time * ay)
        add_to(memory, row + 2, time * turning)
    # Move the states, which are held then.
    places = rows_of_states(state)
    for k in range(rows.states):
        row = rows.state + k
        moved = load(z, places.y + row) + time * load(z, places.rate + row)
        store(memory, rows.y + k, moved)
        store(memory, rows.y + rows.states + k, moved)
        store(memory, rows.y + 2 * rows.states + k, splat(0.0))


@compiled
def update_gap_rates(structure, values, now, z, time, memory):
    """Set ġ of events, by central differences over twice a time [s]; contacts have set theirs.

    Gaps and states are up to date. The functions of time in `values` are those of one moment.
    """
    laws = structure.laws
    state = structure.state
    for s in range(len(laws.address)):
        rows = layout(laws, s)
        if rows.gaps > 0 and laws.gap_kind[rows.gap] == GAP.event:
            for sign in (1.0, -1.0):
                fill(structure, values, now, z, s, memory)
                _move(structure, values, z, s, sign * time, memory)
                call_at(laws.address[s], memory, 0)
                for k in range(rows.gaps):
                    part = (0.5 * sign) * load(memory, rows.mode + rows.gaps + k) / time
                    place = rows_of_gaps(state).rate + rows.gap + k
                    store(z, place, part if sign > 0.0 else load(z, place) + part)
