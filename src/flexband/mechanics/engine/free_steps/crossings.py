"""Events of force laws within a step, on lanes: zeros of the cubic of a gap over the step.

A law holds the mode m of each of its gaps g, whose sign is that of g, until m g becomes negative.
Over a step, g is the cubic with the values and rates at both ends.
"""

from __future__ import annotations

from flexband.mechanics.engine.free_steps.control import CONTROL
from flexband.mechanics.kernels.friction import sticks
from flexband.mechanics.kernels.lanes import (
    any_true,
    compiled,
    filled,
    less,
    load,
    magnitude,
    maximum,
    sqrt,
    store,
    where,
)
from flexband.mechanics.kernels.laws.forces import GAP, gap_count
from flexband.mechanics.kernels.laws.states import MARK


@compiled
def _cubic(start, slope, c2, c3, u):
    return start + u * (slope + u * (c2 + u * c3))


@compiled
def _tolerance(structure, values, limits, k):
    """Return by how much a step may pass the zero of a gap, infinity where its unit is unknown."""
    kind = structure.laws.gap_kind[k]
    if kind in (GAP.event, GAP.margin):
        return filled(1e300)
    size = 1.0 / load(values.inverse_scale, 1)
    return limits.tolerance * (size if kind == GAP.length else filled(1.0))


@compiled
def crossing(structure, values, limits, before, z, step):
    """Find the first gap that changes its sign in a step, where it does not so just at its end.

    Returns the mask of the lanes that have one, and to which part of the step they should go.
    """
    state, late, part = structure.state, filled(0.0), filled(1.0)
    count = gap_count(state)
    for k in range(count):
        tolerance = _tolerance(structure, values, limits, k)
        positive = less(filled(0.0), load(z, state.gap + 2 * count + k))
        sign = where(positive, filled(1.0), filled(-1.0))
        start, end = sign * load(before, state.gap + k), sign * load(z, state.gap + k)
        slope = sign * step * load(before, state.gap + count + k)
        last = sign * step * load(z, state.gap + count + k)
        if structure.laws.gap_kind[k] == GAP.margin:
            friction = k - (count - (state.angle - state.friction))
            held = sticks(state, z, friction)  # the rate of a margin of forces is not known
            held = filled(1.0) if structure.friction.switched[friction] else held
            slope, last = where(held, end - start, slope), where(held, end - start, last)
        c2, c3 = 3.0 * (end - start) - 2.0 * slope - last, 2.0 * (start - end) + slope + last
        square = c2 * c2 - 3.0 * c3 * slope
        lowest = -slope / (c2 + sqrt(where(less(square, filled(0.0)), filled(0.0), square)))
        inside = where(less(filled(0.0), lowest), less(lowest, filled(1.0)), filled(0.0))
        inside = where(less(filled(0.0), square), inside, filled(0.0))
        lowest = where(inside, lowest, filled(1.0))
        below = where(less(end, filled(0.0)), filled(1.0), lowest)
        # `below` is 1 where the gap has closed at the end, or where it is nearest to closing
        depth = -_cubic(start, slope, c2, c3, below)
        closed = where(less(filled(0.0), start), less(filled(0.0), depth), filled(0.0))
        if not any_true(closed):
            continue
        low, high = filled(0.0), below
        for _ in range(40):
            middle = 0.5 * (low + high)
            open_ = less(filled(0.0), _cubic(start, slope, c2, c3, middle))
            low, high = where(open_, middle, low), where(open_, high, middle)
        deep, located, overshoot = less(tolerance, depth), CONTROL.located, CONTROL.overshoot
        if structure.laws.gap_kind[k] == GAP.margin:
            located, overshoot = CONTROL.stuck, CONTROL.stuck
        early = where(less(high, filled(1.0 - located)), filled(1.0), deep)
        early = where(closed, early, filled(0.0))
        speed = magnitude(slope + high * (2.0 * c2 + 3.0 * high * c3))
        beyond = overshoot * high
        beyond = where(less(tolerance, 2.0 * beyond * speed), 0.5 * tolerance / speed, beyond)
        target = where(early, high + beyond, filled(1.0))
        late = maximum(late, early)
        part = where(less(target, part), target, part)
    return late, part


@compiled
def longest_in_contact(structure, values, limits, z):
    """Return the longest step in which depths of contacts change by a ratio, 1e300 if all are open.

    It is the same on the way in as on the way out, which begins where the other ends.
    """
    state, longest = structure.state, filled(1e300)
    count = gap_count(state)
    for k in range(count):
        if structure.laws.gap_kind[k] in (GAP.length, GAP.angle):
            rate = load(z, state.gap + count + k)
            part = where(
                less(rate, filled(0.0)), filled(CONTROL.depths - 1.0),
                filled(1.0 - 1.0 / CONTROL.depths),
            )  # fmt: skip
            change = CONTROL.least_depth * _tolerance(structure, values, limits, k)
            change = maximum(-part * load(z, state.gap + k), change)
            step = change / maximum(magnitude(rate), filled(CONTROL.least_speed))
            closed = less(load(z, state.gap + 2 * count + k), filled(0.0))
            longest = where(closed, where(less(step, longest), step, longest), longest)
    return longest


@compiled
def size_modes(state, z):
    """Set the size of modes that have changed at no time so far to the speed of their gaps."""
    count = gap_count(state)
    for k in range(count):
        row = state.gap + 2 * count + k
        speed = maximum(magnitude(load(z, state.gap + count + k)), filled(CONTROL.least_speed))
        sized = where(less(filled(0.0), load(z, row)), speed, -speed)
        new = less(filled(0.5 * MARK.at_rest), magnitude(load(z, row)))
        store(z, row, where(new, sized, load(z, row)))


@compiled
def switch_modes(structure, z, chosen):
    """Set the modes to those of the gaps; return where the sign of one changes.

    A gap that is zero has the sign that it is about to have. Margins of friction remain positive.
    """
    state = structure.state
    count = gap_count(state)
    changed = filled(0.0)
    for k in range(count):
        row = state.gap + 2 * count + k
        gap, rate = load(z, state.gap + k), load(z, state.gap + count + k)
        heading = where(less(filled(0.0), magnitude(gap)), gap, rate)
        opposite = where(chosen, less(load(z, row) * heading, filled(0.0)), filled(0.0))
        changed = where(opposite, filled(1.0), changed)
        speed = maximum(magnitude(rate), filled(CONTROL.least_speed))
        if structure.laws.gap_kind[k] != GAP.margin:
            mode = where(less(filled(0.0), load(z, row)), -speed, speed)
            store(z, row, where(opposite, mode, load(z, row)))
    return changed
