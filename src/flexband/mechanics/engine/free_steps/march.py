"""Steps that are chosen freely: every lane has a time and a step of its own, see `entries`.

Each lane goes through the rounds of a run on its own, with the steps that its error asks for. What
it computes depends on none of the others: all that decides on its steps is a lane, and a lane that
has finished, or whose step is repeated, is set back to the state that it had.
"""

from __future__ import annotations

import numpy as np

from flexband.mechanics.engine.free_steps.contact_scale import (
    follow_depths,
    is_contact_gap,
    limits_of_contacts,
)
from flexband.mechanics.engine.free_steps.control import (
    CONTROL,
    error_of_step,
    extrapolate_error,
    length_ratio,
    shift_accelerations,
)
from flexband.mechanics.engine.free_steps.crossings import first_crossing, longest_in_contact
from flexband.mechanics.engine.free_steps.events import begin_modes, end_impacts, switch
from flexband.mechanics.engine.free_steps.impacts import strike_by_drive
from flexband.mechanics.engine.free_steps.jamming import find_jams
from flexband.mechanics.engine.free_steps.state_errors import error_of_states, update_sizes
from flexband.mechanics.engine.free_steps.stick_slip import update_margins
from flexband.mechanics.engine.generalized_alpha import of_part
from flexband.mechanics.engine.newton import SHORTEST_STEP, attempt, begin_steps, predict
from flexband.mechanics.engine.rounds import (
    add_turns,
    break_off,
    finish_impulse,
    go_back,
    is_impulse,
    keep,
    keep_state,
    kept_at,
    sense_start,
    share_forces,
    states_to_keep,
)
from flexband.mechanics.kernels.equations import sense, watch
from flexband.mechanics.kernels.failure_codes import FAILURE, note_failure
from flexband.mechanics.kernels.forms import COEFFICIENTS
from flexband.mechanics.kernels.friction.rows import begin_sticking
from flexband.mechanics.kernels.lanes import (
    any_true,
    clear,
    compiled,
    first_true,
    less,
    load,
    magnitude,
    maximum,
    minimum,
    splat,
    store,
    where,
)
from flexband.mechanics.kernels.laws.forces import update_law_states
from flexband.mechanics.kernels.laws.gaps import update_gap_rates
from flexband.mechanics.kernels.laws.states import (
    begin_states,
    end_states,
    shift_states,
)


@compiled
def set_functions(count, values, polynomials, place, length):
    """Set the functions of time and rates at a place, −1 to 1, of a round of this length [s]."""
    scale = 2.0 / length
    for f in range(count):
        value = splat(0.0)
        rate = splat(0.0)
        half = splat(0.0)
        for k in range(COEFFICIENTS - 1, -1, -1):
            half = half * place + rate
            rate = rate * place + value
            value = value * place + load(polynomials, f * COEFFICIENTS + k)
        store(values.functions, f, value)
        store(values.rates, f, scale * rate)
        store(values.rates, f + count, 2.0 * scale * scale * half)


@compiled
def next_length(error, closed, failed, early, event, step):
    """Return the length of the next step: that after an accepted one, or that of a repeated one.

    Where a contact is `closed` every change of the length is made.
    """
    ratio = where(failed, splat(CONTROL.repeated), length_ratio(error))
    ratio = where(less(error, splat(1e300)), ratio, splat(CONTROL.repeated))  # also if it is NaN
    same = where(less(splat(1.0), ratio), less(ratio, splat(CONTROL.unchanged)), splat(0.0))
    ratio = where(closed, ratio, where(same, splat(1.0), ratio))
    return step * where(early, event, ratio)


@compiled
def blame(trial, number, failed, failure, lost):
    """Note why lanes are `lost`: what their last step failed of, or that it was the shortest.

    What has been noted before remains.
    """
    lost = where(load(failure, 0), splat(0.0), lost)
    code = where(failed, load(trial, 0), splat(FAILURE.too_small))
    store(failure, 0, where(lost, code, load(failure, 0)))
    store(failure, 1, where(lost, number, load(failure, 1)))
    row = where(failed, load(trial, 2), splat(-1.0))
    store(failure, 2, where(lost, row, load(failure, 2)))


@compiled
def enter(structure, values, work, n, mask):
    """Begin round n where `mask` is true; return the mask of those in which it is a step.

    `work.round` has its number, its length in steps of the output, the time at its start, that of
    the result which it leads to, how much of it has passed, and the functions of time in it.
    """
    none = splat(0.0)
    part = load(values.parts, n)
    stepping = less(none, part)
    rows = structure.functions * COEFFICIENTS
    length = where(stepping, part, splat(1.0))
    start = load(values.moments, n - 1)
    round_rows = splat(float(n)), length, start, load(values.numbers, n), none
    for row in range(5):
        store(work.round, row, where(mask, round_rows[row], load(work.round, row)))
    for k in range(rows):
        coefficient = load(work.polynomials, k)
        store(work.polynomials, k, where(mask, load(values.polynomials, n * rows + k), coefficient))
    return where(stepping, mask, none)


@compiled
def take_step(  # noqa: PLR0915 (a step is one story)
    structure, method, limits, tolerance, values, work, start_redundancy, stepping, failure
):
    """Attempt a step of the lanes that are `stepping`.

    `work.steps` has the length of the next step of each lane [s], that of the one before, how many
    events there were since the last long one, and the error of the last step over its third power,
    or 0 if it ended with an event. Returns the masks of those that have come to the end of their
    round, and of those that failed.
    """
    z = work.z
    a = work.a
    none = splat(0.0)
    now = np.int64(0)
    state = structure.state
    # Choose the step: as planned, but no step is left that is much shorter than this.
    length = load(work.round, 1) * method.step
    elapsed = load(work.round, 4)
    time = load(work.round, 2) + elapsed
    number = load(work.round, 3)
    planned = load(work.steps, 0)
    ahead = length - elapsed
    longest = longest_in_contact(structure, values, limits, z)
    closed = less(longest, splat(1e300))
    contact_part, smallest = limits_of_contacts(structure, values, limits, z)
    planned = minimum(planned, maximum(longest, smallest))
    step = where(less(planned, ahead), 0.5 * ahead, ahead)
    step = where(less(planned, 0.5 * ahead), planned, step)
    step = where(stepping, step, splat(1.0) * method.step)
    ratio = step / load(work.steps, 1)
    # Predict the motion.
    keep_state(structure, work)
    shift_accelerations(structure, z, a, ratio, stepping)
    shift_states(state, z, ratio, stepping)
    place = 2.0 * (elapsed + step) / length - 1.0
    set_functions(structure.functions, values, work.polynomials, place, length)
    scaled = of_part(method, step / method.step)
    in_flight = 1.0
    for k in range(len(structure.laws.gap_kind)):
        in_flight = CONTROL.in_flight if is_contact_gap(structure.laws, k) else in_flight
    in_contact = CONTROL.in_contact * contact_part
    allowed = limits.tolerance * where(closed, in_contact, splat(in_flight))
    has_states = state.rule > state.law_state
    newton_part = CONTROL.newton_of_states if has_states else CONTROL.newton
    newton = minimum(newton_part * allowed, splat(tolerance))
    begin_sticking(structure, values, z)
    predict(structure, scaled, values, z, a)
    begin_states(state, z, step, stepping)
    clear(work.trial, 4)
    # Solve the step, and estimate its error.
    failed, redundant = attempt(
        structure, scaled, newton, values, now, work, start_redundancy, stepping, work.trial
    )
    update_law_states(structure, values, now, z, work.blocks)
    update_gap_rates(structure, values, now, z, CONTROL.difference * step, work.blocks)
    update_margins(structure, values, now, work, limits, method.step)
    error = error_of_step(structure, scaled, values, work, ratio) / allowed
    if has_states:
        of_states = error_of_states(structure, values, now, work, step, method.step)
        of_states = where(less(step, 1.0001 * smallest), none, of_states)
        error = maximum(error, of_states / limits.tolerance)
    precise_mask = where(failed, none, less(error, splat(1.0)))
    # Accept the step if it is precise and does not pass an event.
    early, event = first_crossing(structure, values, limits, work.before, z, step)
    short = less((1.0 - event) * step, smallest)
    early = where(precise_mask, where(short, none, early), none)
    accepted = where(stepping, where(early, none, precise_mask), none)
    by_depth = where(closed, less(error, splat(0.5)), none)  # a contact asks for a shorter step
    store(work.counts, 3, where(by_depth, none, load(work.counts, 3)))
    update_sizes(structure, work, step, method.step, accepted)
    end_states(state, z, step, accepted)
    watch(structure, values, now, work, time, time + step, accepted)
    share_forces(structure, values, now, work, accepted, redundant, start_redundancy, number)

    planned = load(work.steps, 0)
    cubed = error / (step * step * step)
    before = load(work.steps, 3)
    expected = extrapolate_error(error, cubed, before, where(closed, accepted, none))
    next_step = next_length(expected, closed, failed, early, event, step)
    limited = where(closed, less(next_step, 0.99 * CONTROL.longest * step), none)
    cut = where(accepted, less(step, planned), none)  # by the round's end or a contact's depth
    cut = where(limited, none, cut)
    next_step = where(cut, maximum(planned, next_step), next_step)
    store(work.steps, 3, where(accepted, cubed, before))
    next_step = maximum(next_step, smallest)
    store(work.steps, 0, where(stepping, next_step, planned))
    store(work.steps, 1, where(accepted, step, load(work.steps, 1)))
    go_back(structure, work, where(accepted, none, splat(1.0)))
    store(work.round, 4, where(accepted, elapsed + step, elapsed))
    # Change the modes at an event.
    end_impacts(structure, values, now, work, closed, accepted)
    changed, jammed = switch(structure, method, values, work, step, time + step, limits, accepted)
    follow_depths(structure, values, z, accepted)
    store(work.steps, 3, where(changed, none, load(work.steps, 3)))
    # Give up where events follow each other without end, or no step is short enough.
    long = less(CONTROL.long_step * smallest, step)
    events = load(work.steps, 2)
    events = where(where(long, accepted, none), CONTROL.remembered * events, events) + changed
    store(work.steps, 2, events)
    endless = less(splat(CONTROL.events_in_a_row), events)
    shortest = less(step, 1.0001 * smallest)
    lost = where(stepping, where(shortest, where(accepted, endless, shortest), none), none)
    lost = maximum(lost, jammed)
    blame(work.trial, number, failed, failure, lost)
    store(failure, 0, where(jammed, splat(FAILURE.jammed), load(failure, 0)))
    store(work.counts, 0, load(work.counts, 0) + accepted)
    arrived = where(less(step, ahead), none, accepted)
    return where(lost, none, arrived), lost


@compiled
def leave(structure, method, limits, values, work, n, mask, outputs, failure):
    """End round n where `mask` is true: impulses, new accelerations, and the sensors."""
    state = structure.state
    z = work.z
    none = splat(0.0)
    now = np.int64(0)
    rounds = outputs.shape[0] - 2
    part = load(values.parts, n)
    moment = load(values.moments, n)
    add_turns(structure, method, values, work, where(less(none, part), mask, none))
    still = where(less(none, part), none, mask)
    struck = none
    jammed = none
    place = where(still, none, splat(1.0))
    length = load(work.round, 1) * method.step
    set_functions(structure.functions, values, work.polynomials, place, length)
    # Perform a round that is no step: an impulse, or new accelerations.
    if any_true(still):
        keep_state(structure, work)
        begin_sticking(structure, values, z)
        struck = is_impulse(part, mask)
        if any_true(struck) and state.angle > state.friction:
            jammed = strike_by_drive(structure, method, values, now, work, limits, struck)
        break_off(structure, method, values, now, work, part, mask)
        update_law_states(structure, values, now, z, work.blocks)
        span = CONTROL.difference * load(work.steps, 0)
        update_gap_rates(structure, values, now, z, span, work.blocks)
        update_margins(structure, values, now, work, limits, method.step)
        restarted = where(less(part, splat(-0.5)), still, none)
        watch(structure, values, now, work, moment, moment, restarted)
        go_back(structure, work, where(still, none, splat(1.0)))
        step = load(work.steps, 0)
        _, switch_jams = switch(structure, method, values, work, step, moment, limits, still)
        jammed = note_failure(failure, FAILURE.jammed, maximum(jammed, switch_jams))
        store(failure, 1, where(jammed, load(values.numbers, n), load(failure, 1)))
        follow_depths(structure, values, z, still)
    # Write the sensors' rows of the lanes that end this round.
    sensed = outputs[rounds + 1]
    rows = outputs[n]
    sense(structure, values, now, z, sensed, work.blocks)
    for row in range(outputs.shape[1]):
        store(rows, row, where(mask, load(sensed, row), load(rows, row)))
    if any_true(struck):
        finish_impulse(structure, z, struck)
    for k in range(states_to_keep(structure)):
        if kept_at(k, rounds) == n:
            keep(structure, z, work.snapshots, k, mask)
    store(work.reached, 0, where(mask, splat(float(n)), load(work.reached, 0)))


@compiled
def march_freely(structure, method, limits, tolerance, values, work, outputs, failure, stop):
    """Simulate one block of samples from the state that `start` has filled, see `entries`."""
    z = work.z
    none = splat(0.0)
    now = np.int64(0)
    begin_steps(structure, work)
    # Set the first steps and the modes of lanes that do not go on from another motion.
    anew = less(load(work.steps, 1), splat(SHORTEST_STEP))
    for row in range(2):
        first = splat(CONTROL.first) * method.step
        fresh = less(load(work.steps, row), splat(SHORTEST_STEP))
        store(work.steps, row, where(fresh, first, load(work.steps, row)))
    start_redundancy = load(failure, 3)
    span = CONTROL.difference * load(work.steps, 0)
    update_gap_rates(structure, values, now, z, span, work.blocks)
    begin_modes(structure, method, values, work, limits, failure, anew)
    sense_start(structure, values, work, outputs)
    alive = where(load(failure, 0), none, splat(1.0))
    rounds = outputs.shape[0] - 2
    arrived = alive
    store(work.round, 0, none)
    # Let each lane end its round and enter the next one, then step all of them.
    while True:
        while any_true(arrived):
            n = np.int64(first_true(load(work.round, 0), arrived))
            same = less(magnitude(load(work.round, 0) - float(n)), splat(0.5))
            same = where(arrived, same, none)
            if n > 0:
                leave(structure, method, limits, values, work, n, same, outputs, failure)
            if n < rounds:
                stepping = enter(structure, values, work, n + 1, same)
                arrived = where(stepping, none, arrived)
            else:
                alive = where(same, none, alive)
                arrived = where(same, none, arrived)
        if not any_true(alive) or any_true(load(stop, 0)):
            break
        arrived, lost = take_step(
            structure, method, limits, tolerance, values, work, start_redundancy, alive, failure
        )
        alive = where(lost, none, alive)
    if structure.state.angle > structure.state.friction:
        find_jams(structure, values, work, failure)
