"""What sticks and what slides at an instant, on lanes, and how far it is from changing.

The margin of what sticks is µs N − |λ|, and that of what slides is u in its sense, so each is
positive until an event. At an event all that is at rest sticks at first. What asks for more than µs
N then slides in the sense in which it is pulled, and what would slide back sticks again, until
nothing changes; only then are the velocities of what sticks set to zero. Where that does not come
to an end no motion is consistent, as in the paradox of Painlevé.

What follows another has the mode of that one and no margin of its own, see
`kernels.friction.contacts_in_line`.
"""

from __future__ import annotations

import math

import numpy as np

from flexband.mechanics.engine.free_steps.impacts import strike_parts
from flexband.mechanics.engine.free_steps.rest import STICK, length_unit, rest_speed
from flexband.mechanics.engine.projection import (
    accelerate,
    add_rows,
    greatest,
    mass_matrix,
    refine,
)
from flexband.mechanics.kernels.constraints import add_constraints, subtract_acceleration_errors
from flexband.mechanics.kernels.equations import update_dependent
from flexband.mechanics.kernels.factorization import factorize, solve
from flexband.mechanics.kernels.friction.contacts_in_line import (
    follows,
    holds,
    is_closed,
    is_in_line,
    share_in_line,
    sums_of_line,
)
from flexband.mechanics.kernels.friction.modes import MODE, sticks
from flexband.mechanics.kernels.friction.rows import (
    begin_sticking,
    subtract_drift_of_circles,
    subtract_speed_errors,
    update_distances,
    update_friction,
)
from flexband.mechanics.kernels.lanes import (
    add_to,
    any_true,
    clear,
    compiled,
    less,
    load,
    magnitude,
    maximum,
    nearest_whole,
    splat,
    store,
    where,
)
from flexband.mechanics.kernels.state import friction_rows, rows_of_gaps

MOVES = 1e300
"""Looseness of what would stick, but moves in spite of that."""


@compiled
def excess(structure, values, z, k):
    """Return by how much friction k, if it sticks, asks for more than it can hold.

    What is one way holds any force against sliding back, and none against sliding on.
    """
    if structure.friction.switched[k]:
        return splat(-1.0)
    force, N, hold = sums_of_line(structure, values, z, k)
    if not structure.friction.one_way[k]:
        force = magnitude(force)
    return force - hold - STICK.force * N


@compiled
def sliding_rates(structure, values, now, work):
    """Set the rows of friction in `work.r` to −u̇."""
    clear(work.r, structure.state.velocity)
    clear(work.s, structure.state.velocity)
    update_distances(structure, values, work.z)
    subtract_acceleration_errors(
        structure, values, structure.friction.terms, values.friction.terms, now, work.z, work.a,
        work.r, work.s,
    )  # fmt: skip
    subtract_drift_of_circles(structure, values, work.z, work.r, work.s)


@compiled
def update_margins(structure, values, now, work, limits, step):
    """Set the margins and their rates; the contacts' forces are up to date."""
    state = structure.state
    z = work.z
    none = splat(0.0)
    rows = friction_rows(state)
    gaps = rows_of_gaps(state)
    first = gaps.number - rows.frictions
    if rows.frictions > 0:
        # Update the normal forces, sliding speeds and their rates.
        update_dependent(structure, values, now, z)
        clear(work.r, state.velocity)
        update_friction(structure, values, now, z, work.r)
        share_in_line(structure, values, z)
        sliding_rates(structure, values, now, work)
        for k in range(rows.frictions):
            _, N, _ = sums_of_line(structure, values, z, k)
            u = load(z, rows.speed + k)
            # Set the margin of friction k.
            stick_mask = sticks(state, z, k)
            idle = where(less(none, N), none, splat(1.0))  # it may slide in any sense
            sense = where(less(u, none), splat(-1.0), splat(1.0))
            sense = where(idle, sense, load(z, rows.mode + k))
            slid = sense * u + rest_speed(structure, values, limits, step, k)
            margin = where(stick_mask, -excess(structure, values, z, k), slid)
            rate = where(stick_mask, none, -sense * load(work.r, state.friction + k))
            if structure.friction.switched[k]:
                margin = where(stick_mask, N, -N)
                rate = none
            if structure.friction.earlier[k] >= 0:
                follower = follows(structure, z, k)
                margin = where(follower, splat(1.0), margin)
                rate = where(follower, none, rate)
            store(z, gaps.value + first + k, margin)
            store(z, gaps.rate + first + k, rate)
            store(z, gaps.mode + first + k, splat(1.0))
            store(z, gaps.force + first + k, N)


@compiled
def begin_to_stick(structure, values, now, work, limits, step, mask):
    """Let all that is at rest stick where it is, and slide what is not, in its sense."""
    state = structure.state
    z = work.z
    r = work.r
    none = splat(0.0)
    rows = friction_rows(state)
    # Update the normal forces and sliding speeds, and set r to the travels.
    update_dependent(structure, values, now, z)
    clear(r, state.velocity)
    update_friction(structure, values, now, z, r)
    add_constraints(structure.friction.terms, values.friction.terms, values.functions, now, z, r)
    for k in range(rows.frictions):
        stick_mask = sticks(state, z, k)
        u = load(z, rows.speed + k)
        _, N, _ = sums_of_line(structure, values, z, k)
        sense = where(less(u, none), splat(-1.0), splat(1.0))
        # Beyond the event at which it comes to rest, it slides back.
        reversal = less(u * load(z, rows.mode + k), none)
        if structure.friction.one_way[k]:
            sense = splat(1.0)
            reversal = less(u, none)
        slow_mask = less(magnitude(u), 2.0 * rest_speed(structure, values, limits, step, k))
        if not structure.friction.switched[k]:  # an impact moves what stuck before
            stick_mask = where(stick_mask, slow_mask, none)
        rest = where(less(none, N), maximum(slow_mask, where(stick_mask, none, reversal)), none)
        new = where(stick_mask, load(z, rows.mode + k), where(rest, splat(MODE.sticks), sense))
        stopped = where(stick_mask, none, rest)
        if is_in_line(structure, k):
            new = where(is_closed(structure, z, k), new, sense)
            stopped = splat(1.0)
        # Set the anchor of what begins to stick to its travel.
        travel = load(r, state.friction + k)
        if structure.friction.switched[k]:
            rest = less(none, N)
            new = where(rest, splat(MODE.sticks), splat(MODE.inactive))
            travel = allowed_place(structure, values, k, travel)
            force = load(z, state.friction + k)
            store(z, state.friction + k, where(rest, force, where(mask, none, force)))
            stopped = where(stick_mask, none, rest)
        stopped = where(mask, stopped, none)
        store(z, rows.anchor + k, where(stopped, travel, load(z, rows.anchor + k)))
        store(z, rows.mode + k, where(mask, new, load(z, rows.mode + k)))
        if not is_in_line(structure, k):
            store(z, state.friction + k, where(stopped, none, load(z, state.friction + k)))
    follow_first(structure, z, mask)


@compiled
def follow_first(structure, z, mask):
    """Let what follows another have the mode of that one."""
    first = friction_rows(structure.state).mode
    friction = structure.friction
    for k in range(structure.state.angle - structure.state.friction):
        if friction.earlier[k] >= 0:
            mode = load(z, first + k)
            n = friction.earlier[k]
            while n >= 0:  # the last that is found is the first of the line
                closed = where(follows(structure, z, k), is_closed(structure, z, n), splat(0.0))
                mode = where(where(mask, closed, splat(0.0)), load(z, first + n), mode)
                n = friction.earlier[n]
            store(z, first + k, mode)


@compiled
def allowed_place(structure, values, k, travel):
    """Return the travel of a row of a joint that switches, NaN where that is too far to begin."""
    off = travel
    if structure.friction.angular[k]:
        off = travel - math.tau * nearest_whole(travel / math.tau)
    out_of_range = less(load(values.friction.static, k), magnitude(off))
    return where(out_of_range, splat(np.nan), travel)


@compiled
def bring_to_rest(structure, values, now, work, mask):
    """Project the velocities of what sticks, and of what begins to slide against its speed."""
    state = structure.state
    z = work.z
    r = work.r
    none = splat(0.0)
    rows = friction_rows(state)
    switched = structure.friction.switched
    # Let stick for now what moves against the sense in which it begins to slide.
    for k in range(rows.frictions):
        sense = load(z, rows.mode + k)
        against = where(mask, less(sense * load(z, rows.speed + k), none), none)
        store(z, rows.speed + k, sense)
        store(z, rows.mode + k, where(against, splat(MODE.sticks), sense))
    # Project the velocities.
    mass_matrix(structure, values, values.regular_mass, now, z, work.matrix)
    factorize(structure.pattern, work.matrix, load(work.smallest, 0), r)
    clear(r, state.velocity)
    subtract_speed_errors(structure, values, now, z, r)
    for k in range(rows.frictions):
        if switched[k]:
            store(z, rows.turn + k, where(mask, -load(r, state.friction + k), none))
    solve(structure.pattern, structure.pattern.below, work.matrix, (r,))
    refine(structure, values, work, r)
    add_rows(z, state.velocity, r, 1, state.multiplier, mask)
    # Add up the losses of joints that become active, and restore the modes.
    for k in range(rows.frictions):
        if switched[k]:
            impulse = where(mask, load(r, state.friction + k), none)
            add_to(z, rows.distance + k, 0.5 * load(z, rows.turn + k) * impulse)
        store(z, rows.mode + k, load(z, rows.speed + k))


@compiled
def looseness(structure, values, z, k, change_of_speed, still):
    """Return how much friction k asks for over what it can hold, if it sticks; 0 if it holds.

    What would stick, but moves in spite of that, is looser than all: at a dead centre, no force of
    a guide can hold the crank.
    """
    if structure.friction.switched[k]:
        return splat(0.0)
    force, _, _ = sums_of_line(structure, values, z, k)
    over = excess(structure, values, z, k)
    hold = maximum(magnitude(force) - over, splat(STICK.weakest) * magnitude(force))
    ratio = magnitude(force) / maximum(hold, splat(1e-300))
    ratio = where(less(splat(0.0), over), ratio, splat(0.0))
    ratio = where(less(still, magnitude(change_of_speed)), splat(MOVES), ratio)
    return where(holds(structure, z, k), ratio, splat(0.0))


@compiled
def change_modes(structure, values, now, work, limits, step, mask):
    """Let slide what is loosest, and stick what slides back; return where any does.

    q̈ and λ are those of the present modes. One friction is released at a time: with others that
    stick only for the trial, one that holds may seem to ask for too much.
    """
    state = structure.state
    z = work.z
    none = splat(0.0)
    rows = friction_rows(state)
    sliding_rates(structure, values, now, work)
    changed = none
    loosest = none
    # Find what is loosest.
    largest = greatest(z, state.acceleration, values.inverse_scale, state.coordinates)
    rounding = STICK.still * step * largest
    for k in range(rows.frictions):
        still = rest_speed(structure, values, limits, step, k)
        still = still + rounding * length_unit(structure, values, k)
        change_of_speed = -load(work.r, state.friction + k) * step
        loose = looseness(structure, values, z, k, change_of_speed, still)
        loosest = maximum(loosest, loose)
    for k in range(rows.frictions):
        # Release the loosest one, and let stick what slides back.
        sense = load(z, rows.mode + k)
        stick_mask = sticks(state, z, k)
        force, N, _ = sums_of_line(structure, values, z, k)
        speed_limit = rest_speed(structure, values, limits, step, k)
        still = speed_limit + rounding * length_unit(structure, values, k)
        change_of_speed = -load(work.r, state.friction + k) * step
        loose = looseness(structure, values, z, k, change_of_speed, still)
        released = where(less(none, loose), where(less(loose, loosest), none, splat(1.0)), none)
        moves = less(splat(0.5 * MOVES), loose)
        pulled = where(less(where(moves, change_of_speed, force), none), splat(-1.0), splat(1.0))
        reversal = less(sense * change_of_speed, -still)
        at_rest = less(magnitude(load(z, rows.speed + k)), 4.0 * speed_limit)
        reversal = where(stick_mask, none, where(at_rest, reversal, none))
        reversal = where(less(none, N), reversal, none)
        if structure.friction.earlier[k] >= 0:
            reversal = where(follows(structure, z, k), none, reversal)
        new = where(released, pulled, where(reversal, splat(MODE.sticks), sense))
        change = where(mask, maximum(released, reversal), none)
        store(z, rows.mode + k, where(change, new, sense))
        changed = maximum(changed, change)
    follow_first(structure, z, changed)
    return changed


@compiled
def may_jam(structure):
    """Return whether friction is that of joints: the forces of contacts and brakes are given."""
    friction = structure.friction
    may = structure.friction.follows
    for k in range(friction_rows(structure.state).frictions):
        may = may or friction.switched[k]
    return may


@compiled
def is_struck(structure, values, work, limits, step, mask):
    """Return where a joint that becomes active, or a clutch that locks, stops a speed at once."""
    z = work.z
    rows = friction_rows(structure.state)
    struck = splat(0.0)
    for k in range(rows.frictions):
        if structure.friction.switched[k] or structure.friction.one_way[k]:
            rest = 2.0 * rest_speed(structure, values, limits, step, k)
            moves = less(rest, magnitude(load(z, rows.speed + k)))
            moves = where(sticks(structure.state, z, k), moves, splat(0.0))
            struck = maximum(struck, where(mask, moves, splat(0.0)))
    return struck


@compiled
def settle_modes(structure, method, values, now, work, limits, mask):
    """Set modes, q̈ and λ at an event; return how many multipliers are left out, and what jams.

    `method` is that of a step of the output. What becomes active or locks changes the velocities
    first. `work.before` has the state before the event.
    """
    step = method.step
    state = structure.state
    rows = friction_rows(structure.state)
    none = splat(0.0)
    pending = mask
    left_out = none
    if rows.frictions == 0:
        return accelerate(structure, values, now, work, mask), none
    # Begin with what is at rest, after the impact of what becomes active or locks.
    begin_to_stick(structure, values, now, work, limits, step, mask)
    struck = is_struck(structure, values, work, limits, step, mask)
    refused = none
    if any_true(struck):
        refused = strike_parts(structure, method, values, now, work, limits, struck, False)
        begin_to_stick(structure, values, now, work, limits, step, struck)
    # Change the modes until they agree with the accelerations.
    begin_sticking(structure, values, work.z)
    for _ in range(1 + STICK.changes * rows.frictions):
        omissions = accelerate(structure, values, now, work, pending)
        left_out = where(pending, omissions, left_out)
        pending = change_modes(structure, values, now, work, limits, step, pending)
        if not any_true(pending):
            break
    bring_to_rest(structure, values, now, work, mask)
    # Note where none agree, or the motion is not finite.
    if not may_jam(structure):
        pending = none
    jammed = where(mask, maximum(pending, refused), none)
    for k in range(1, state.coordinates + 1):
        finite = less(magnitude(load(work.z, state.acceleration + k)), splat(np.inf))
        jammed = where(finite, jammed, mask)
    for k in range(rows.frictions):
        finite = less(magnitude(load(work.z, rows.anchor + k)), splat(np.inf))
        jammed = where(finite, jammed, mask)
    return left_out, jammed
