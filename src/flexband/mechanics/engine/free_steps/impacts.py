"""Impacts of joints, of what locks and of what becomes active, on lanes.

    M (v⁺ − v⁻) + Φ_qᵀ p + Wᵀ p_t = 0,   Φ_q v⁺ + Φ_t = 0

Joints hold, and so do joints that switch and one-way clutches that lock. Friction is finite: it has
an impulse only where its normal force has one, that of a joint, and follows Moreau's law,

    |p_t| ≤ µ p_n,   p_t = ±µ p_n with the sign of the sliding speed after the impact.

At first nothing of that has an impulse; then all slides as it does without, what would slide back
sticks, and what asks for too much slides, one at a time. An impact for which that does not end has
no solution, or several, and is refused.
"""

from __future__ import annotations

import numpy as np

from flexband.mechanics.engine.free_steps.rest import rest_speed
from flexband.mechanics.engine.free_steps.sliding import (
    IMPACT,
    begin_sliding,
    change_sticking,
    set_sliding_speeds,
    stick_instead,
)
from flexband.mechanics.engine.projection import mass_matrix, refine
from flexband.mechanics.engine.rounds import keep_state
from flexband.mechanics.kernels.angles import pass_on_moments
from flexband.mechanics.kernels.constraints import (
    add_constraints,
    subtract_velocity_errors,
)
from flexband.mechanics.kernels.equations import residual, tangent, update_dependent
from flexband.mechanics.kernels.factorization import factorize, solve
from flexband.mechanics.kernels.failure_codes import FAILURE, note_failure
from flexband.mechanics.kernels.friction.modes import MODE, sticks
from flexband.mechanics.kernels.friction.rows import (
    FOLLOW,
    coefficient,
    first_component,
    subtract_speed_errors,
    update_components,
    update_distances,
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
    splat,
    sqrt,
    store,
    where,
)
from flexband.mechanics.kernels.state import friction_rows, reaction_rows


@compiled
def begin_impact(structure, values, work, limits, step, mask):
    """Let hold what switches or locks, and be free all else; keep the sliding speeds before."""
    z = work.z
    friction = structure.friction
    rows = friction_rows(structure.state)
    for k in range(rows.frictions):
        mode = load(z, rows.mode + k)
        u = load(z, rows.speed + k)
        new = splat(MODE.inactive)
        if friction.switched[k]:
            new = mode
        elif friction.one_way[k]:
            rest = rest_speed(structure, values, limits, step, k)
            new = where(less(u, rest), splat(MODE.sticks), new)
        store(z, rows.mode + k, where(mask, new, mode))
        store(z, rows.turn + k, where(mask, u, load(z, rows.turn + k)))
        force = load(z, structure.state.friction + k)
        store(z, structure.state.friction + k, where(mask, splat(0.0), force))


@compiled
def set_normal_impulses(structure, values, now, z):
    """Set the normal forces of frictions from what is in the place of the reactions of joints."""
    friction = structure.friction
    rows = friction_rows(structure.state)
    components = first_component(structure)
    update_components(structure, values, now, z)
    for k in range(rows.frictions):
        store(z, rows.normal + k, splat(0.0))
    for n in range(len(friction.of_components)):
        k = friction.of_components[n]
        row = components + 2 * n
        x = load(z, row)
        y = load(z, row + 1)
        if friction.reacts[k]:
            add_to(z, rows.normal + k, sqrt(x * x + y * y))


@compiled
def sliding_impulse(structure, values, z, k):
    """Return ±µ(u) p_n of friction k; 0 of what is free."""
    rows = friction_rows(structure.state)
    mu = coefficient(values, k, load(z, rows.speed + k))
    return load(z, rows.mode + k) * mu * load(z, rows.normal + k)


@compiled
def solve_impulses(structure, values, now, work, pending):
    """Set v⁺ from v⁻, which is in `work.s`, and impulses in the place of multipliers.

    `work.matrix` has the factors for the present modes. Returns where they do not settle.
    """
    state = structure.state
    z = work.z
    r = work.r
    before = work.s
    none = splat(0.0)
    friction = structure.friction
    rows = friction_rows(state)
    joints = reaction_rows(state)
    active = pending
    followed = none
    for count in range(IMPACT.solutions):
        # Begin with the velocities before, and without impulses of what sticks.
        for i in range(1, state.coordinates + 1):
            v = load(z, state.velocity + i)
            store(z, state.velocity + i, where(active, load(before, i), v))
        for k in range(rows.frictions):
            impulse = load(z, state.friction + k)
            freed = where(active, sticks(state, z, k), none)
            store(z, state.friction + k, where(freed, none, impulse))
        # Set the right-hand side to the impulses of what slides and the errors of speeds.
        clear(r, state.velocity)
        update_distances(structure, values, z)
        add_constraints(friction.terms, values.friction.terms, values.functions, now, z, r)
        pass_on_moments(structure, values, z, r)
        for i in range(1, state.velocity):
            store(r, i, -load(r, i) if i <= state.coordinates else none)
        subtract_speed_errors(structure, values, now, z, r)
        for k in range(rows.frictions):
            row = state.friction + k
            store(r, row, where(sticks(state, z, k), load(r, row), load(z, row)))
        # Solve for the change of v and the impulses, and take them over.
        solve(structure.pattern, structure.pattern.below, work.matrix, (r,))
        refine(structure, values, work, r)
        largest = none
        for i in range(1, state.coordinates + 1):
            v = load(z, state.velocity + i)
            store(z, state.velocity + i, where(active, v + load(r, i), v))
        for k in range(state.multiplier, state.angle):
            if k < state.friction:
                place = joints.reaction + k - state.multiplier
                store(z, place, where(active, load(r, k), load(z, place)))
            store(z, k, where(active, load(r, k), load(z, k)))
            largest = maximum(largest, magnitude(load(r, k)))
        # Let friction follow the normal impulses, until it does not change.
        set_normal_impulses(structure, values, now, z)
        set_sliding_speeds(structure, values, now, work)
        followed = follow_impulses(structure, values, z, active, count) / maximum(
            largest, splat(1e-300)
        )
        active = where(less(splat(IMPACT.settled), followed), active, none)
        if not any_true(active):
            break
    return where(active, less(splat(IMPACT.unsettled), followed), none)


@compiled
def follow_impulses(structure, values, z, active, count):
    """Let impulses of what slides follow the normal ones; return the largest change.

    Where changes after each other are parallel, the sum of all further ones is added at once.
    """
    state = structure.state
    none = splat(0.0)
    largest = splat(0.0)
    rows = friction_rows(state)
    # Compare the changes with those before.
    squares = none
    products = none
    others = none
    for k in range(rows.frictions):
        old = load(z, state.friction + k)
        step = where(sticks(state, z, k), none, sliding_impulse(structure, values, z, k) - old)
        last = none if count == 0 else load(z, rows.change + k)
        squares = squares + last * last
        products = products + last * step
        others = others + step * step
        largest = maximum(largest, magnitude(step))
    # Sum up the geometric series where they are parallel.
    ratio = products / where(less(none, squares), squares, splat(1.0))
    parallel = less(others - ratio * products, FOLLOW.skew * others)
    parallel = where(parallel, less(none, squares), none)
    parallel = where(less(magnitude(ratio), splat(FOLLOW.ratio)), parallel, none)
    factor = where(parallel, 1.0 / (1.0 - ratio), splat(1.0))
    for k in range(rows.frictions):
        old = load(z, state.friction + k)
        step = where(sticks(state, z, k), none, sliding_impulse(structure, values, z, k) - old)
        change = where(active, step, none)
        store(z, state.friction + k, old + factor * change)
        store(z, rows.change + k, where(parallel, none, change))
    return largest


@compiled
def add_works(structure, values, now, work, mask, jumps):
    """Add up what the impulses do, with the means of the speeds before and after.

    A joint that becomes active takes half of its impulse times the speed that it stops, and does
    that of its drive. Where the speed of a drive `jumps`, all of it is its work. The velocities are
    those after the impact, and those before are in `work.s`.
    """
    state = structure.state
    z = work.z
    none = splat(0.0)
    rows = friction_rows(state)
    joints = reaction_rows(state)
    friction = structure.friction
    for i in range(1, state.coordinates + 1):
        store(work.t, i, load(z, state.velocity + i))
    for sign in (1.0, 0.0):  # Φ_q v + Φ_t of the mean velocities, less Φ_t
        for i in range(1, state.coordinates + 1):
            mean = 0.5 * sign * (load(work.s, i) + load(work.t, i))
            store(z, state.velocity + i, mean)
        clear(work.r, state.velocity)
        subtract_velocity_errors(structure, values, structure.terms, values.terms, now, z, work.r)
        subtract_velocity_errors(
            structure, values, friction.terms, values.friction.terms, now, z, work.r
        )
        for k in range(state.multiplier, state.angle):
            part = where(mask, (2.0 * sign - 1.0) * load(z, k) * load(work.r, k), none)
            if k < state.friction:
                add_to(z, joints.work + k - state.multiplier, part)
            else:
                add_to(z, rows.work + k - state.friction, part)
    for i in range(1, state.coordinates + 1):
        store(z, state.velocity + i, load(work.t, i))
    for k in range(rows.frictions):
        if friction.switched[k] and not jumps:
            impulse = where(mask, load(z, state.friction + k), none)
            loss = 0.5 * load(z, rows.turn + k) * impulse
            add_to(z, rows.distance + k, loss)
            add_to(z, rows.work + k, loss)


@compiled
def impact_matrix(structure, method, values, now, work, pending, jumps):
    """Set the matrix to that of the masses, or of the integrator where a drive's speed `jumps`."""
    state = structure.state
    z = work.z
    if not jumps:
        mass_matrix(structure, values, values.regular_mass, now, z, work.matrix)
        return
    for k in range(state.multiplier, state.friction):  # they may be impulses
        store(z, k, where(pending, splat(0.0), load(z, k)))
    residual(structure, values, now, z, work.r, work.blocks)
    tangent(
        structure, values, now, z, splat(method.dq_da), splat(method.dv_da / method.dq_da),
        work.matrix, work.blocks,
    )  # fmt: skip


@compiled
def strike_parts(structure, method, values, now, work, limits, mask, jumps):
    """Change the velocities by an impact where `mask` is true; return where it is refused.

    `method` is that of a step of the output. Where the speed of a drive `jumps`, stiff members move
    as rigid ones.

    In the end `work.s` has the velocities before, and the multipliers in z are impulses. All
    friction is left sliding; the reactions that it follows are those of `work.before`.
    """
    state = structure.state
    z = work.z
    none = splat(0.0)
    step = method.step
    rows = friction_rows(state)
    joints = reaction_rows(state)
    # Keep the velocities before the impact.
    for i in range(1, state.coordinates + 1):
        store(work.s, i, load(z, state.velocity + i))
    set_sliding_speeds(structure, values, now, work)
    begin_impact(structure, values, work, limits, step, mask)
    pending = mask
    diverged = none
    refused = none
    # Solve for the impulses, and change what sticks until it agrees with them.
    for count in range(2 + IMPACT.changes * rows.frictions):
        impact_matrix(structure, method, values, now, work, pending, jumps)
        factorize(structure.pattern, work.matrix, load(work.smallest, 0), work.r)
        retry_mask = solve_impulses(structure, values, now, work, pending)
        refused = maximum(refused, where(diverged, retry_mask, none))
        diverged = maximum(diverged, retry_mask)
        if count == 0 and structure.friction.follows:
            begin_sliding(structure, values, work, limits, step, pending)
            continue
        stuck = stick_instead(structure, z, retry_mask)
        settled = where(retry_mask, none, pending)
        pending = change_sticking(structure, values, work, limits, step, settled)
        pending = maximum(pending, stuck)
        if not any_true(pending):
            break
    # Set the works, and what friction is after the impact.
    add_works(structure, values, now, work, mask, jumps)
    for k in range(joints.number):
        row = joints.reaction + k
        store(z, row, where(mask, load(work.before, row), load(z, row)))
    for k in range(rows.frictions):
        sense = where(less(load(z, rows.speed + k), none), splat(-1.0), splat(1.0))
        if structure.friction.one_way[k]:
            sense = splat(1.0)
        if not structure.friction.switched[k]:
            mode = load(z, rows.mode + k)
            store(z, rows.mode + k, where(mask, sense, mode))
    return maximum(refused, pending)


@compiled
def strike_by_drive(structure, method, values, now, work, limits, mask):
    """Perform `projection.strike` with friction that slides; return where it is refused.

    q̈ is the change of v, and v halfway. Multipliers are impulses, until accelerations start anew.
    """
    state = structure.state
    z = work.z
    refused = strike_parts(structure, method, values, now, work, limits, mask, True)
    for i in range(1, state.coordinates + 1):
        before = load(work.s, i)
        v = load(z, state.velocity + i)
        row = state.acceleration + i
        store(z, row, where(mask, v - before, load(z, row)))
        store(z, state.velocity + i, where(mask, 0.5 * (before + v), v))
    return refused


@compiled
def strike_at_start(structure, method, values, work, limits, failure):
    """Perform `strike_parts` in all lanes at the start, and note where it is refused."""
    everywhere = splat(1.0)
    now = np.int64(0)
    update_dependent(structure, values, now, work.z)
    keep_state(structure, work)
    refused = strike_parts(structure, method, values, now, work, limits, everywhere, False)
    note_failure(failure, FAILURE.jammed, refused)
