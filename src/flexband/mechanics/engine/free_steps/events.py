"""What happens at events and at the start, on lanes: modes change, and so may velocities."""

from __future__ import annotations

import numpy as np

from flexband.mechanics.engine.free_steps.contact_scale import follow_depths, settle_at_start
from flexband.mechanics.engine.free_steps.control import CONTROL
from flexband.mechanics.engine.free_steps.crossings import (
    settle_contacts,
    size_modes,
    switch_modes,
)
from flexband.mechanics.engine.free_steps.effective_mass import update_masses
from flexband.mechanics.engine.free_steps.stick_slip import settle_modes, update_margins
from flexband.mechanics.engine.projection import share
from flexband.mechanics.engine.rounds import go_back, keep_state, restart
from flexband.mechanics.kernels.equations import watch
from flexband.mechanics.kernels.failure_codes import FAILURE, note_failure
from flexband.mechanics.kernels.lanes import (
    any_true,
    compiled,
    less,
    load,
    magnitude,
    maximum,
    splat,
    where,
)
from flexband.mechanics.kernels.laws.gaps import update_gap_rates
from flexband.mechanics.kernels.laws.states import hold_states


@compiled
def switch(structure, method, values, work, step, time, limits, mask):
    """Change the modes of force laws whose gaps have changed their sign, where `mask` is true.

    Where the forces jump by that, the accelerations start anew. Returns where a mode has changed,
    and where friction jams.
    """
    state = structure.state
    now = np.int64(0)
    jammed = splat(0.0)
    changed = switch_modes(structure, work.z, mask)
    if any_true(changed):
        keep_state(structure, work)
        hold_states(state, work.z, changed)
        left_out, jammed = settle_modes(structure, method, values, now, work, limits, changed)
        if any_true(left_out):
            share(structure, values, now, work, left_out)
        largest = splat(0.0)
        for i in range(1, state.coordinates + 1):
            row = state.acceleration + i
            jump = magnitude(load(work.z, row) - load(work.before, row))
            largest = maximum(largest, jump * load(values.inverse_scale, i))
        smooth = less(step * step * largest, splat(1e-3 * limits.tolerance))
        smooth = splat(0.0) if state.angle > state.friction else smooth
        restart(structure, work, where(smooth, splat(0.0), changed))
        update_gap_rates(structure, values, now, work.z, CONTROL.difference * step, work.blocks)
        update_margins(structure, values, now, work, limits, method.step)
        go_back(structure, work, where(changed, smooth, splat(1.0)))
        update_masses(structure, values, now, work, changed)
        watch(structure, values, now, work, time, time, changed)
    return changed, jammed


@compiled
def begin_friction(structure, method, values, work, limits, failure, fresh):
    """Find what sticks and what slides at the start, which is `fresh` or the end of a motion."""
    step = method.step
    everywhere = splat(1.0)
    now = np.int64(0)
    keep_state(structure, work)
    left_out, jammed = settle_modes(structure, method, values, now, work, limits, everywhere)
    if any_true(left_out):
        share(structure, values, now, work, left_out)
    restart(structure, work, fresh)
    update_margins(structure, values, now, work, limits, step)
    note_failure(failure, FAILURE.jammed, jammed)


@compiled
def begin_modes(structure, method, values, work, limits, failure, fresh):
    """Set the modes of laws and friction at the start, which is `fresh` or the end of a motion."""
    now = np.int64(0)
    size_modes(structure.state, work.z)
    if structure.state.angle > structure.state.friction:
        begin_friction(structure, method, values, work, limits, failure, fresh)
    update_masses(structure, values, now, work, fresh)
    settle_at_start(structure, values, work.z, fresh)
    follow_depths(structure, values, work.z, fresh)


@compiled
def end_impacts(structure, values, now, work, closed, accepted):
    """End the impacts of contacts that are pressed in again after an `accepted` step.

    The effective masses of contacts that stay closed follow the motion.
    """
    settle_contacts(structure, work.before, work.z, accepted)
    still_closed = where(accepted, closed, splat(0.0))
    if any_true(still_closed):
        update_masses(structure, values, now, work, still_closed)
