"""Steps that are chosen freely: every lane has a time and a step of its own, see `entries`.

Between two rounds of a run each lane takes the steps that its error asks for, from the round's
start to its end, and waits there for the others. What a lane computes depends on none of them: all
that decides on its steps is a lane, and a lane that waits, or whose step is repeated, is set back
to the state that it had.
"""

from __future__ import annotations

import numpy as np

from flexband.mechanics.assembly.structure import KEPT
from flexband.mechanics.engine.free_steps.control import (
    CONTROL,
    error_of_step,
    extrapolated,
    length_ratio,
    shift_accelerations,
)
from flexband.mechanics.engine.free_steps.crossings import (
    crossing,
    in_contact,
    longest_in_contact,
    size_modes,
    switch_modes,
)
from flexband.mechanics.engine.generalized_alpha import (
    ROUNDING,
    SHORTEST_STEP,
    add_turns,
    attempt,
    begin_steps,
    break_off,
    finish_impulse,
    go_back,
    keep,
    keep_state,
    kept_at,
    of_part,
    predict,
    restart,
    share_forces,
)
from flexband.mechanics.engine.projection import accelerate, share
from flexband.mechanics.kernels.equations import (
    clear,
    sense,
    update_law_gaps,
    update_law_states,
    watch,
)
from flexband.mechanics.kernels.extremes import begin_extremes
from flexband.mechanics.kernels.failure_codes import FAILURE
from flexband.mechanics.kernels.forms import COEFFICIENTS
from flexband.mechanics.kernels.lanes import (
    any_true,
    compiled,
    filled,
    less,
    load,
    magnitude,
    maximum,
    store,
    where,
)
from flexband.mechanics.kernels.laws.states import (
    begin_states,
    end_states,
    hold_states,
    shift_states,
)


@compiled
def set_functions(count, values, n, place, length, chosen):
    """Set the functions of time to those at a place of round n, from −1 to 1, and their rates.

    Where `chosen` is false they are those of the round itself. `length` is that of the round [s].
    """
    for f in range(count):
        value, rate, half = filled(0.0), filled(0.0), filled(0.0)
        first = (n * count + f) * COEFFICIENTS
        for k in range(COEFFICIENTS - 1, -1, -1):
            half = half * place + rate
            rate = rate * place + value
            value = value * place + load(values.polynomials, first + k)
        scale, row = 2.0 / length, 2 * n * count + f
        store(values.functions, f, where(chosen, value, load(values.table, n * count + f)))
        store(values.rates, f, where(chosen, scale * rate, load(values.table_rates, row)))
        second = 2.0 * scale * scale * half
        row, second_row = row + count, f + count
        store(values.rates, second_row, where(chosen, second, load(values.table_rates, row)))


@compiled
def jumped(structure, values, work, step):
    """Return the largest change of an acceleration since `keep_state`, as a length over a step."""
    state, largest = structure.state, filled(0.0)
    for i in range(1, state.coordinates + 1):
        row = state.acceleration + i
        change = magnitude(load(work.z, row) - load(work.before, row))
        largest = maximum(largest, change * load(values.inverse_scale, i))
    return step * step * largest


@compiled
def switch(structure, values, work, step, time, limits, chosen):
    """Change the modes of force laws whose gaps have changed their sign, where `chosen` is true.

    Where the forces jump by that, the accelerations start anew. Returns where a mode has changed.
    """
    state, now = structure.state, np.int64(0)
    changed = switch_modes(state, work.z, chosen)
    if any_true(changed):
        keep_state(structure, work)
        hold_states(state, work.z, changed)
        left_out = accelerate(structure, values, now, work, changed)
        if any_true(left_out):
            share(structure, values, now, work, left_out)
        smooth = less(jumped(structure, values, work, step), filled(1e-3 * limits.tolerance))
        restart(structure, work, where(smooth, filled(0.0), changed))
        update_law_gaps(structure, values, now, work.z, CONTROL.difference * step, work.blocks)
        go_back(structure, work, where(changed, smooth, filled(1.0)))
        watch(structure, values, now, work, time, time, changed)
    return changed


@compiled
def next_length(error, closed, failed, early, event, step):
    """Return the length of the next step: that after an accepted one, or that of a repeated one.

    Where a contact is `closed` every change of the length is made.
    """
    ratio = where(failed, filled(CONTROL.repeated), length_ratio(error))
    ratio = where(less(error, filled(1e300)), ratio, filled(CONTROL.repeated))  # also if it is NaN
    same = where(less(filled(1.0), ratio), less(ratio, filled(CONTROL.unchanged)), filled(0.0))
    ratio = where(closed, ratio, where(same, filled(1.0), ratio))
    return step * where(early, event, ratio)


@compiled
def blame(values, n, trial, failed, failure, lost):
    """Note why lanes are `lost`: what their last step failed of, or that it was the shortest."""
    code = where(failed, load(trial, 0), filled(FAILURE.too_small))
    store(failure, 0, where(lost, code, load(failure, 0)))
    store(failure, 1, where(lost, load(values.numbers, n), load(failure, 1)))
    row = where(failed, load(trial, 2), filled(-1.0))
    store(failure, 2, where(lost, row, load(failure, 2)))


@compiled
def cover(  # noqa: PLR0915 (a step is one story)
    structure, method, limits, tolerance, values, n, length, work, known, stepping, failure, stop
):
    """Take the lanes that are `stepping` from the start of round n to its end.

    `work.steps` has the length of the next step of each lane [s], that of the one before, how many
    events there were since the last long one, and the error of the last step over its third power,
    or 0 if it ended with an event. Returns the mask of those that failed on the way.
    """
    z, a, none, now, state = work.z, work.a, filled(0.0), np.int64(0), structure.state
    elapsed, remaining, lost = none, stepping, none
    while any_true(remaining) and not any_true(load(stop, 0)):
        planned, ahead = load(work.steps, 0), length - elapsed
        most = maximum(longest_in_contact(structure, values, limits, z), filled(limits.smallest))
        planned = where(less(most, planned), most, planned)
        step = where(less(planned, ahead), 0.5 * ahead, ahead)
        step = where(less(planned, 0.5 * ahead), planned, step)
        step = where(remaining, step, filled(1.0) * method.step)
        ratio = step / load(work.steps, 1)
        keep_state(structure, work)
        shift_accelerations(structure, z, a, ratio, remaining)
        shift_states(state, z, ratio, remaining)
        place = 2.0 * (elapsed + step) / length - 1.0
        set_functions(structure.functions, values, n, place, length, remaining)
        scaled = of_part(method, step / method.step)
        part = step / method.step
        newton = maximum(tolerance * (part * part), filled(ROUNDING))
        predict(structure, scaled, values, z, a)
        begin_states(state, z, step, remaining)
        clear(work.trial, 4)
        failed, redundant = attempt(
            structure, scaled, newton, values, now, work, known, remaining, work.trial
        )
        update_law_states(structure, values, now, z, work.blocks)
        update_law_gaps(structure, values, now, z, CONTROL.difference * step, work.blocks)
        error = error_of_step(structure, scaled, values, work, ratio, limits)
        closed = in_contact(structure, z)
        error = error / where(closed, filled(CONTROL.in_contact), filled(1.0))
        good = where(failed, none, less(error, filled(1.0)))
        early, event = crossing(structure, values, limits, work.before, z, step)
        short = less((1.0 - event) * step, filled(limits.smallest))
        early = where(good, where(short, none, early), none)
        accepted = where(remaining, where(early, none, good), none)
        end_states(state, z, step, accepted)
        time = load(values.moments, n - 1) + elapsed
        watch(structure, values, now, work, time, time + step, accepted)
        share_forces(structure, values, now, work, accepted, redundant, known, n)

        planned = load(work.steps, 0)
        cubed, before = error / (step * step * step), load(work.steps, 3)
        expected = extrapolated(error, cubed, before, where(closed, accepted, none))
        next_step = next_length(expected, closed, failed, early, event, step)
        limited = where(closed, less(next_step, 0.99 * CONTROL.longest * step), none)
        cut = where(accepted, less(step, planned), none)  # by the round's end or a contact's depth
        cut = where(limited, none, cut)
        next_step = where(cut, maximum(planned, next_step), next_step)
        store(work.steps, 3, where(accepted, cubed, before))
        next_step = maximum(next_step, filled(limits.smallest))
        store(work.steps, 0, where(remaining, next_step, planned))
        store(work.steps, 1, where(accepted, step, load(work.steps, 1)))
        go_back(structure, work, where(accepted, none, filled(1.0)))
        elapsed = where(accepted, elapsed + step, elapsed)
        changed = switch(structure, values, work, step, time + step, limits, accepted)
        store(work.steps, 3, where(changed, none, load(work.steps, 3)))
        long = less(filled(CONTROL.long_step * limits.smallest), step)
        events = where(where(long, accepted, none), none, load(work.steps, 2) + changed)
        store(work.steps, 2, events)
        endless = less(filled(CONTROL.events_in_a_row), events)
        shortest = less(step, filled(1.0001 * limits.smallest))
        shortest = where(remaining, where(accepted, endless, shortest), none)
        blame(values, n, work.trial, failed, failure, shortest)
        lost = where(shortest, filled(1.0), lost)
        remaining = where(shortest, none, remaining)
        at_end = where(less(step, ahead), none, accepted)
        store(work.taken, 0, load(work.taken, 0) + accepted)
        remaining = where(at_end, none, remaining)
    return lost


@compiled
def march_freely(structure, method, limits, tolerance, values, work, outputs, failure, stop):
    """Simulate one block of samples from the state that `start` has filled, see `entries`."""
    z, none, now = work.z, filled(0.0), np.int64(0)
    begin_steps(structure, work)
    for row in range(2):
        first = filled(CONTROL.first) * method.step
        fresh = less(load(work.steps, row), filled(SHORTEST_STEP))
        store(work.steps, row, where(fresh, first, load(work.steps, row)))
    known = load(failure, 3)
    span = CONTROL.difference * load(work.steps, 0)
    update_law_gaps(structure, values, now, z, span, work.blocks)
    size_modes(structure.state, z)
    begin_extremes(structure.extremes, structure.state, z)
    moment = load(values.moments, 0)
    watch(structure, values, now, work, moment, moment, filled(1.0))
    sense(structure, values, now, z, outputs[0], work.blocks)
    alive = where(load(failure, 0), none, filled(1.0))
    elements = len(structure.beams.first) + len(structure.continua.first)
    rounds, k = outputs.shape[0] - 1, 0 if elements + len(structure.cables.first) else KEPT
    for n in range(1, rounds + 1):
        if any_true(load(stop, 0)) or not any_true(alive):
            break
        part = load(values.parts, n)
        stepping = where(less(none, part), alive, none)
        length = where(less(none, part), part, filled(1.0)) * method.step
        lost = cover(
            structure, method, limits, tolerance, values, n, length, work, known, stepping, failure,
            stop,
        )  # fmt: skip
        alive = where(lost, none, alive)
        add_turns(structure, method, values, work, where(stepping, alive, none))
        still = where(less(none, part), none, alive)
        set_functions(structure.functions, values, n, filled(1.0), length, stepping)
        struck, moment = none, load(values.moments, n)
        if any_true(still):
            keep_state(structure, work)
            struck = break_off(structure, method, values, now, work, part, alive)
            update_law_states(structure, values, now, z, work.blocks)
            span = CONTROL.difference * load(work.steps, 0)
            update_law_gaps(structure, values, now, z, span, work.blocks)
            restarted = where(less(part, filled(-0.5)), still, none)
            watch(structure, values, now, work, moment, moment, restarted)
            go_back(structure, work, where(still, none, filled(1.0)))
            switch(structure, values, work, load(work.steps, 0), moment, limits, still)
        sense(structure, values, now, z, outputs[n], work.blocks)
        if any_true(struck):
            finish_impulse(structure, z, struck)
        while k < KEPT and kept_at(k, rounds) == n:
            keep(structure, z, work.kept, k)
            k += 1
        store(work.reached, 0, filled(float(n)))
