"""Events of force laws within a step, on lanes: zeros of the cubic of a gap over the step.

A law holds the mode m of each of its gaps g, whose sign is that of g, until m g becomes negative.
Over a step, g is the cubic with the values and rates at both ends.
"""

from __future__ import annotations

from flexband.mechanics.engine.free_steps.contact_scale import is_contact_gap, scale_of_contact
from flexband.mechanics.engine.free_steps.control import CONTROL
from flexband.mechanics.kernels.friction.modes import sticks
from flexband.mechanics.kernels.lanes import (
    any_true,
    compiled,
    less,
    load,
    magnitude,
    maximum,
    minimum,
    splat,
    sqrt,
    store,
    where,
)
from flexband.mechanics.kernels.laws.forces import GAP
from flexband.mechanics.kernels.laws.states import MARK
from flexband.mechanics.kernels.state import rows_of_gaps


@compiled
def _cubic(start, slope, c2, c3, u):
    return start + u * (slope + u * (c2 + u * c3))


@compiled
def _tolerance(structure, values, limits, z, k):
    """Return by how much a step may pass the zero of a gap, infinity where its unit is unknown."""
    if structure.laws.gap_kind[k] in (GAP.event, GAP.margin):
        return splat(1e300)
    return limits.tolerance * scale_of_contact(structure, values, z, k)


@compiled
def first_crossing(structure, values, limits, before, z, step):
    """Find the first gap that changes its sign in a step, where it does not so just at its end.

    Returns the mask of the lanes that have one, and to which part of the step they should go.
    """
    state, late, part = structure.state, splat(0.0), splat(1.0)
    rows = rows_of_gaps(state)
    for k in range(rows.number):
        tolerance = _tolerance(structure, values, limits, before, k)
        positive = less(splat(0.0), load(z, rows.mode + k))
        sign = where(positive, splat(1.0), splat(-1.0))
        # Set the cubic of the gap over the step, positive while its mode holds.
        start, end = sign * load(before, rows.value + k), sign * load(z, rows.value + k)
        slope = sign * step * load(before, rows.rate + k)
        last = sign * step * load(z, rows.rate + k)
        if structure.laws.gap_kind[k] == GAP.margin:
            friction = k - (rows.number - (state.angle - state.friction))
            stick_mask = sticks(state, z, friction)  # the rate of a margin of forces is not known
            stick_mask = splat(1.0) if structure.friction.switched[friction] else stick_mask
            slope, last = (
                where(stick_mask, end - start, slope),
                where(stick_mask, end - start, last),
            )
        if is_contact_gap(structure.laws, k):
            settling = is_pressed_again(before, z, rows, k)
            turn = slope / where(settling, slope - last, splat(1.0))
            early = where(settling, less(turn, splat(1.0 - CONTROL.event_interval)), splat(0.0))
            late = maximum(late, early)
            part = where(early, minimum(part, turn + CONTROL.overshoot), part)
        c2, c3 = 3.0 * (end - start) - 2.0 * slope - last, 2.0 * (start - end) + slope + last
        # Find the minimum of the cubic within the step.
        square = c2 * c2 - 3.0 * c3 * slope
        lowest = -slope / (c2 + sqrt(where(less(square, splat(0.0)), splat(0.0), square)))
        inside = where(less(splat(0.0), lowest), less(lowest, splat(1.0)), splat(0.0))
        inside = where(less(splat(0.0), square), inside, splat(0.0))
        lowest = where(inside, lowest, splat(1.0))
        below = where(less(end, splat(0.0)), splat(1.0), lowest)
        # `below` is 1 where the gap has closed at the end, or where it is nearest to closing
        depth = -_cubic(start, slope, c2, c3, below)
        closed = where(less(splat(0.0), start), less(splat(0.0), depth), splat(0.0))
        if not any_true(closed):
            continue
        # Find its zero by bisection.
        low, high = splat(0.0), below
        for _ in range(40):
            middle = 0.5 * (low + high)
            open_ = less(splat(0.0), _cubic(start, slope, c2, c3, middle))
            low, high = where(open_, middle, low), where(open_, high, middle)
        # Go a bit beyond the zero, unless it is at the end anyway.
        deep, event_interval, overshoot = (
            less(tolerance, depth),
            CONTROL.event_interval,
            CONTROL.overshoot,
        )
        if structure.laws.gap_kind[k] == GAP.margin:
            event_interval, overshoot = CONTROL.stuck, CONTROL.stuck
        early = where(less(high, splat(1.0 - event_interval)), splat(1.0), deep)
        early = where(closed, early, splat(0.0))
        speed = magnitude(slope + high * (2.0 * c2 + 3.0 * high * c3))
        beyond = overshoot * high
        beyond = where(less(tolerance, 2.0 * beyond * speed), 0.5 * tolerance / speed, beyond)
        target = where(early, high + beyond, splat(1.0))
        late = maximum(late, early)
        part = minimum(part, target)
    return late, part


@compiled
def longest_in_contact(structure, values, limits, z):
    """Return the longest step in which depths of contacts change by a ratio, 1e300 if all are open.

    It is the same on the way in as on the way out, which begins where the other ends.
    """
    rows = rows_of_gaps(structure.state)
    longest = splat(1e300)
    for k in range(rows.number):
        if is_contact_gap(structure.laws, k):
            rate = load(z, rows.rate + k)
            part = where(
                less(rate, splat(0.0)), splat(CONTROL.depths - 1.0),
                splat(1.0 - 1.0 / CONTROL.depths),
            )  # fmt: skip
            change = CONTROL.least_depth * _tolerance(structure, values, limits, z, k)
            change = maximum(-part * load(z, rows.value + k), change)
            step = change / maximum(magnitude(rate), splat(CONTROL.least_speed))
            closed = less(load(z, rows.mode + k), splat(0.0))
            longest = where(closed, where(less(step, longest), step, longest), longest)
    return longest


@compiled
def size_modes(state, z):
    """Set the size of modes that have changed at no time so far to the speed of their gaps."""
    rows = rows_of_gaps(state)
    for k in range(rows.number):
        mode = load(z, rows.mode + k)
        rate = load(z, rows.rate + k)
        speed = maximum(magnitude(rate), splat(CONTROL.least_speed))
        sized = where(less(splat(0.0), mode), speed, -speed)
        new = less(splat(0.5 * MARK.at_rest), magnitude(mode))
        store(z, rows.mode + k, where(new, sized, mode))


@compiled
def switch_modes(structure, z, mask):
    """Set the modes to those of the gaps; return where the sign of one changes.

    A gap that is zero has the sign that it is about to have. Margins of friction remain positive.
    """
    rows = rows_of_gaps(structure.state)
    changed = splat(0.0)
    for k in range(rows.number):
        row = rows.mode + k
        gap = load(z, rows.value + k)
        rate = load(z, rows.rate + k)
        heading = where(less(splat(0.0), magnitude(gap)), gap, rate)
        opposite = where(mask, less(load(z, row) * heading, splat(0.0)), splat(0.0))
        changed = where(opposite, splat(1.0), changed)
        speed = maximum(magnitude(rate), splat(CONTROL.least_speed))
        if is_contact_gap(structure.laws, k):  # an impact begins
            mass = load(z, rows.mass + k)
            store(z, rows.mass + k, where(opposite, magnitude(mass), mass))
        if structure.laws.gap_kind[k] != GAP.margin:
            mode = where(less(splat(0.0), load(z, row)), -speed, speed)
            store(z, row, where(opposite, mode, load(z, row)))
    return changed


@compiled
def is_pressed_again(before, z, rows, gap):
    """Return where a contact in an impact, which left in the state `before`, is pressed in in z."""
    none = splat(0.0)
    rate = load(before, rows.rate + gap)
    impact = where(less(load(before, rows.mode + gap), none), splat(1.0), none)
    impact = where(less(load(before, rows.mass + gap), none), none, impact)
    leaves = where(less(none, rate), impact, none)
    return where(less(load(z, rows.rate + gap), none), leaves, none)


@compiled
def settle_contacts(structure, before, z, mask):
    """End the impacts of contacts that are pressed in again.

    At this moment the gap does not move, so that the force does not jump.
    """
    rows = rows_of_gaps(structure.state)
    for k in range(rows.number):
        if is_contact_gap(structure.laws, k):
            pressed = where(mask, is_pressed_again(before, z, rows, k), splat(0.0))
            mass = load(z, rows.mass + k)
            store(z, rows.mass + k, where(pressed, -mass, mass))
