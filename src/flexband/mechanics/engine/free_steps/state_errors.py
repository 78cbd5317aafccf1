"""Errors of the first-order states of force laws in a step, on lanes.

The rule of `kernels.laws.states` with c = 1/3 is wrong by 2/9 h³ y⃛, which is 8/5 of its difference
from the trapezoidal rule, y₁ − y₀ − h (ẏ₀ + ẏ₁)/2; Euler's method is wrong by that difference. What
the error of the motion adds is what the state becomes at wrong places and velocities.

The size of a state is its largest so far. One that begins at 0 has no size yet: it is that to which
its rate takes it in a time ẏ/ÿ, if not within an output step.
"""

from __future__ import annotations

from flexband.mechanics.kernels.angles import polar_rate, vector_rate
from flexband.mechanics.kernels.lanes import (
    add_to,
    call_at,
    compiled,
    less,
    load,
    magnitude,
    maximum,
    minimum,
    splat,
    store,
    where,
)
from flexband.mechanics.kernels.laws.forces import AXES, fill, layout
from flexband.mechanics.kernels.laws.states import FIRST_SHARE, rows_of_states

LEAST_SIZE = 1e-9
"""Of a state that is judged by its own size, in its unit: less may be rounding alone."""

OF_RULE = 1.6
"""Error of the rule over its difference from the trapezoidal rule."""


@compiled
def _move(structure, values, z, wrong, s, step, memory):
    """Move what a law reads by errors of the coordinates, with rows as [0, q], made in a step."""
    laws = structure.laws
    rows = layout(structure.laws, s)
    for p in range(rows.first, rows.end):
        row = AXES * (p - rows.first)
        a = laws.angle + p
        x, y = vector_rate(structure, values, z, wrong, 0, laws.position + p)
        moves = x, y, polar_rate(structure, values, z, wrong, 0, a)
        for axis in range(AXES):
            add_to(memory, rows.x + row + axis, moves[axis])
            add_to(memory, rows.v + row + axis, moves[axis] / step)


@compiled
def _size(places, work, k, step, longest):
    """Return the size of state k after a step, the first of which is one of Euler's method."""
    z = work.z
    size = maximum(load(z, places.size + k), magnitude(load(z, places.y + k)))
    rate = magnitude(load(z, places.rate + k))
    change = magnitude(load(z, places.rate + k) - load(work.before, places.rate + k))
    time = minimum(step * rate / maximum(change, splat(1e-300)), splat(longest))
    first = less(load(z, places.rule + 2), splat(0.5 * FIRST_SHARE))
    return where(first, maximum(size, rate * time), size)


@compiled
def update_sizes(structure, work, step, longest, mask):
    """Set the sizes of states after a step where `mask` is true."""
    places = rows_of_states(structure.state)
    for k in range(places.states):
        size = _size(places, work, k, step, longest)
        store(work.z, places.size + k, where(mask, size, load(work.z, places.size + k)))


@compiled
def error_of_states(structure, values, now, work, step, longest):
    """Return the largest error of a state since `work.before`, over its size.

    `work.s` has the errors of the coordinates, and `longest` is an output step [s].
    """
    laws = structure.laws
    z = work.z
    memory = work.blocks
    largest = splat(0.0)
    places = rows_of_states(structure.state)
    for s in range(len(laws.address)):
        rows = layout(laws, s)
        if rows.states > 0:
            fill(structure, values, now, z, s, memory)
            _move(structure, values, z, work.s, s, step, memory)
            call_at(laws.address[s], memory, 0)
        for k in range(rows.states):
            n = rows.state + k
            y = load(z, places.y + n)
            rate = load(z, places.rate + n)
            trapezoid = 0.5 * step * (load(work.before, places.rate + n) + rate)
            error = OF_RULE * magnitude(y - load(work.before, places.y + n) - trapezoid)
            error += magnitude(load(memory, rows.y + k) - y)
            size = maximum(_size(places, work, n, step, longest), splat(LEAST_SIZE))
            largest = maximum(largest, error / size)
    return largest
