"""The march through the times of a run in steps that are given, on lanes."""

from __future__ import annotations

from flexband.mechanics.engine.generalized_alpha import of_part
from flexband.mechanics.engine.newton import ROUNDING, attempt, begin_steps, predict
from flexband.mechanics.engine.rounds import (
    add_turns,
    break_off,
    finish_impulse,
    go_back,
    keep,
    keep_state,
    kept_at,
    restart,
    sense_start,
    share_forces,
    states_to_keep,
)
from flexband.mechanics.kernels.equations import (
    sense,
    watch,
)
from flexband.mechanics.kernels.lanes import (
    any_true,
    compiled,
    less,
    load,
    magnitude,
    maximum,
    splat,
    store,
    where,
)
from flexband.mechanics.kernels.laws.forces import update_law_states
from flexband.mechanics.kernels.laws.states import (
    begin_states,
    end_states,
    shift_states,
)


@compiled
def march(structure, method, tolerance, values, work, outputs, failure, stop):
    """Simulate one block of samples from the state that `start` has filled, see `entries`."""
    z, a, none = work.z, work.a, splat(0.0)
    code, start_redundancy = load(failure, 0), load(failure, 3)
    begin_steps(structure, work)
    sense_start(structure, values, work, outputs)
    alive, before = where(code, none, splat(1.0)), splat(1.0)
    rounds, k, snapshot_count = outputs.shape[0] - 1, 0, states_to_keep(structure)
    for n in range(1, rounds + 1):
        if any_true(load(stop, 0)) or not any_true(alive):
            break
        now, part = n * structure.functions, load(values.parts, n)
        stepping = where(less(none, part), alive, none)
        length = where(less(none, part), part, splat(1.0))
        other = where(less(length, before), splat(1.0), less(before, length))
        # Begin anew where the length of the step changes.
        if any_true(other):
            restart(structure, work, other)
            shift_states(structure.state, z, length / before, other)
        before, still = length, where(less(none, part), none, splat(1.0))
        divided = any_true(still)
        # Predict and solve the step.
        scaled = of_part(method, length)
        limit = maximum(tolerance * (length * length), splat(ROUNDING))
        if method.attempts > 1 or divided:
            keep_state(structure, work)
        predict(structure, scaled, values, z, a)
        begin_states(structure.state, z, length * method.step, splat(1.0))
        failed, redundant = attempt(
            structure, scaled, limit, values, now, work, start_redundancy, stepping, failure
        )
        store(failure, 1, where(failed, load(values.numbers, n), load(failure, 1)))
        alive = where(failed, none, alive)
        share_forces(
            structure,
            values,
            now,
            work,
            stepping,
            redundant,
            start_redundancy,
            load(values.numbers, n),
        )
        update_law_states(structure, values, now, z, work.blocks)
        # Perform the rounds that are no steps.
        struck = none
        if divided:
            go_back(structure, work, still)
            struck = break_off(structure, method, values, now, work, part, alive)
        # Write the results of the round.
        add_turns(structure, scaled, values, work, stepping)
        moment, earlier = load(values.moments, n), load(values.moments, n - 1)
        watched = where(less(magnitude(part), splat(0.5)), stepping, alive)
        watch(structure, values, now, work, earlier, moment, watched)
        sense(structure, values, now, z, outputs[n], work.blocks)
        end_states(structure.state, z, length * method.step, stepping)
        if any_true(struck):
            finish_impulse(structure, z, struck)
        while k < snapshot_count and kept_at(k, rounds) == n:
            keep(structure, z, work.snapshots, k, splat(1.0))
            k += 1
        store(work.reached, 0, splat(float(n)))
    store(work.steps, 1, before * method.step)
