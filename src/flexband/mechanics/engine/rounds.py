"""What a march does in a round besides a step: impulses, shared forces, turns, snapshots."""

from __future__ import annotations

import numpy as np

from flexband.mechanics.assembly.structure import KEPT
from flexband.mechanics.engine.projection import (
    PROJECTION,
    accelerate,
    acceleration_change_mask,
    share,
    strike,
)
from flexband.mechanics.kernels.angles import turning_rate
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
from flexband.mechanics.kernels.laws.states import (
    hold_states,
)
from flexband.mechanics.kernels.running_extremes import begin_extremes


@compiled
def add_turns(structure, method, values, work, stepping):
    """Add a step to `work.turn_statistics`, in which φ is the angle that a body or a rod turns."""
    vectors = structure.vectors
    turn_statistics = work.turn_statistics
    for k in range(len(vectors.turning) - 1):
        rate = turning_rate(structure, values, work.z, k)
        turn = where(stepping, method.step * rate, splat(0.0))
        angle = load(turn_statistics, 4 * k + 1) + turn
        square = turn * turn
        store(turn_statistics, 4 * k, load(turn_statistics, 4 * k) + square * square)
        store(turn_statistics, 4 * k + 1, angle)
        store(turn_statistics, 4 * k + 2, maximum(load(turn_statistics, 4 * k + 2), angle))
        store(turn_statistics, 4 * k + 3, maximum(load(turn_statistics, 4 * k + 3), -angle))


@compiled
def kept_at(k, steps):
    """Return the step at which the k-th state is kept: scattered, so that no motion keeps pace."""
    golden = (5**0.5 - 1) / 2
    return 1 + int((k + (k * golden) % 1.0) * steps / KEPT)


@compiled
def states_to_keep(structure):
    """Return how many states a run keeps: none without flexible members."""
    elements = len(structure.beams.first) + len(structure.continua.first)
    return KEPT if elements + len(structure.cables.first) > 0 else 0


@compiled
def keep(structure, z, snapshots, k, mask):
    """Keep [1, q] for the k-th time where `mask` is true."""
    rows = structure.state.coordinates + 1
    for i in range(rows):
        store(snapshots, k * rows + i, where(mask, load(z, i), load(snapshots, k * rows + i)))


@compiled
def keep_state(structure, work):
    """Keep z and a, for a second attempt at a step."""
    for row in range(structure.state.rows):
        store(work.before, row, load(work.z, row))
    for i in range(1, structure.state.coordinates + 1):
        store(work.before, structure.state.rows + i, load(work.a, i))


@compiled
def go_back(structure, work, mask):
    """Set z and a to those before the step where `mask` is true."""
    rows = structure.state.rows
    for row in range(rows):
        store(work.z, row, where(mask, load(work.before, row), load(work.z, row)))
    for i in range(1, structure.state.coordinates + 1):
        store(work.a, i, where(mask, load(work.before, rows + i), load(work.a, i)))


@compiled
def restart(structure, work, mask):
    """Set the method's variable a to q̈ where `mask` is true."""
    for i in range(1, structure.state.coordinates + 1):
        second_derivative = load(work.z, structure.state.acceleration + i)
        store(work.a, i, where(mask, second_derivative, load(work.a, i)))


@compiled
def sense_start(structure, values, work, outputs):
    """Begin the extremes, and set the first of the sensors' rows."""
    now = np.int64(0)
    moment = load(values.moments, 0)
    begin_extremes(structure.extremes, structure.state, work.z)
    watch(structure, values, now, work, moment, moment, splat(1.0))
    sense(structure, values, now, work.z, outputs[0], work.blocks)


@compiled
def finish_impulse(structure, z, struck):
    """Complete the change of v that `strike` has begun."""
    state = structure.state
    for i in range(1, state.coordinates + 1):
        rest = where(struck, 0.5 * load(z, state.acceleration + i), splat(0.0))
        store(z, state.velocity + i, load(z, state.velocity + i) + rest)


@compiled
def is_impulse(part, alive):
    """Return where a round is an impulse, see `schedule`."""
    struck = where(less(magnitude(part), splat(0.5)), alive, splat(0.0))
    return where(less(splat(0.0), part), splat(0.0), struck)


@compiled
def break_off(structure, method, values, now, work, part, alive):
    """Perform the rounds that are no steps: impulses, and new accelerations; see `schedule`.

    With friction, impulses are those of `free_steps.impacts`, which come before.
    """
    none = splat(0.0)
    struck = is_impulse(part, alive)
    restarted = where(less(part, splat(-0.5)), alive, none)
    hold_states(structure.state, work.z, maximum(struck, restarted))
    if any_true(struck) and structure.state.angle == structure.state.friction:
        strike(structure, method, values, now, work, struck)
    if any_true(restarted):
        left_out = accelerate(structure, values, now, work, restarted)
        if any_true(left_out):
            share(structure, values, now, work, left_out)
        restart(structure, work, restarted)
    return struck


@compiled
def share_forces(structure, values, now, work, stepping, redundant, start_redundancy, number):
    """Share the forces of redundant constraints, and note from when on they are not resolved.

    `redundant` constraints were left out of a round that belongs to the time with this number, and
    `start_redundancy` at the start.
    """
    none = splat(0.0)
    shared = where(stepping, where(redundant, redundant, start_redundancy), none)
    unresolved = none
    excess_mask = where(stepping, less(start_redundancy, redundant), none)
    if any_true(shared):
        unresolved = share(structure, values, now, work, shared)
    excess_mask = where(
        less(splat(PROJECTION.zero_pivot), load(work.smallest, 0)), excess_mask, none
    )  # not light ones
    if any_true(excess_mask):
        unresolved += acceleration_change_mask(structure, values, now, work, excess_mask)
    if any_true(unresolved):
        since = where(unresolved, number, none)
        since = where(load(work.unresolved, 0), load(work.unresolved, 0), since)
        store(work.unresolved, 0, since)
