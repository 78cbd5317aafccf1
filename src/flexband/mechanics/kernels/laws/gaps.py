"""Gaps of force laws, whose zeros are events, on lanes.

A law with events fills its gaps g, each of which has a mode m. Its sign is that of g, held while a
step is taken, and its size is the speed |ġ| at the last event. The rows of z are g, then ġ, then m
of all laws, then the forces along those gaps that are contacts.
"""

from __future__ import annotations

from flexband.mechanics.kernels.angles import angle_drift, polar_rate, vector
from flexband.mechanics.kernels.lanes import call_at, compiled, filled, load, store
from flexband.mechanics.kernels.laws.forces import AXES, GAP, fill, gaps_of, layout
from flexband.mechanics.kernels.laws.states import rows_of_states


@compiled
def _move(structure, values, z, s, time, memory):
    """Move what a law reads by a time, with its velocities and accelerations; states are held."""
    laws, vectors, state = structure.laws, structure.vectors, structure.state
    store(memory, 0, load(memory, 0) + time)
    begin = laws.parameter_start[s]
    for k in range(begin, laws.parameter_start[s + 1]):
        change = load(values.laws, k) * load(values.rates, laws.f[k])
        store(memory, 1 + k - begin, load(memory, 1 + k - begin) + time * change)
    first, last, x, v, _, y, _ = layout(laws, s)
    for row in range(AXES * (last - first)):
        store(memory, x + row, load(memory, x + row) + time * load(memory, v + row))
    for p in range(first, last):
        row, a = v + AXES * (p - first), laws.angle + p
        ax, ay = vector(vectors, values.vectors, z, state.acceleration, laws.position + p)
        turning = polar_rate(vectors, values.vectors, z, z, state.acceleration, a)
        turning += angle_drift(vectors, values.vectors, state, z, a)
        store(memory, row, load(memory, row) + time * ax)
        store(memory, row + 1, load(memory, row + 1) + time * ay)
        store(memory, row + 2, load(memory, row + 2) + time * turning)
    _, _, rate, _, _ = rows_of_states(state)
    begin, count = laws.state_start[s], laws.state_start[s + 1] - laws.state_start[s]
    for k in range(count):
        row = state.law_state + begin + k
        moved = load(z, row) + time * load(z, rate + begin + k)
        store(memory, y + k, moved)
        store(memory, y + count + k, moved)
        store(memory, y + 2 * count + k, filled(0.0))


@compiled
def update_gap_rates(structure, values, now, z, time, memory):
    """Set ġ of events, by central differences over twice a time [s]; contacts have set theirs.

    Gaps and states are up to date. The functions of time in `values` are those of one moment.
    """
    laws, vectors, state, functions = (
        structure.laws, structure.vectors, structure.state, values.functions
    )  # fmt: skip
    for s in range(len(laws.address)):
        _, _, _, _, _, y, _ = layout(laws, s)
        count, gap, gaps, row = gaps_of(laws, state, s, y)
        if gaps > 0 and laws.gap_kind[gap] == GAP.event:
            for sign in (1.0, -1.0):
                fill(
                    laws, values.laws, vectors, values.vectors, state, functions, now, z, s, memory
                )
                _move(structure, values, z, s, sign * time, memory)
                call_at(laws.address[s], memory, 0)
                for k in range(gaps):
                    part = (0.5 * sign) * load(memory, row + gaps + k) / time
                    place = state.gap + count + gap + k
                    store(z, place, part if sign > 0.0 else load(z, place) + part)
