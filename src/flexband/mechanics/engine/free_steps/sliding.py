"""Which contacts stick and which slide in an impact, on lanes."""

from __future__ import annotations

from typing import NamedTuple

from flexband.mechanics.engine.free_steps.rest import rest_speed
from flexband.mechanics.kernels.constraints import (
    subtract_velocity_errors,
)
from flexband.mechanics.kernels.friction.modes import MODE, sticks
from flexband.mechanics.kernels.friction.rows import (
    update_distances,
)
from flexband.mechanics.kernels.lanes import (
    clear,
    compiled,
    less,
    load,
    magnitude,
    maximum,
    splat,
    store,
    where,
)
from flexband.mechanics.kernels.state import friction_rows


class ImpactOptions(NamedTuple):
    """How impulses are found."""

    solutions: int = 200
    """The most, in which impulses of friction follow those of joints."""
    settled: float = 1e-11
    """Change of an impulse, relative to the largest one, that nothing follows."""
    unsettled: float = 1e-8
    """The same from which on they do not settle: the impact has no solution, or several."""
    changes: int = 4
    """The most changes of what sticks for each friction."""
    rounding: float = 1e-9
    """Impulse by which µ p_n must be exceeded, relative to it and to the largest one."""


IMPACT = ImpactOptions()


@compiled
def set_sliding_speeds(structure, values, now, work):
    """Set the sliding speeds of all frictions in z."""
    z = work.z
    r = work.r
    state = structure.state
    rows = friction_rows(structure.state)
    clear(r, state.velocity)
    update_distances(structure, values, z)
    subtract_velocity_errors(
        structure, values, structure.friction.terms, values.friction.terms, now, z, r
    )
    for k in range(rows.frictions):
        store(z, rows.speed + k, -load(r, state.friction + k))


@compiled
def begin_sliding(structure, values, work, limits, step, mask):
    """Let friction with an impulse slide as it does without one, or stick where it is at rest."""
    z = work.z
    friction = structure.friction
    rows = friction_rows(structure.state)
    for k in range(rows.frictions):
        if friction.reacts[k]:
            u = load(z, rows.speed + k)
            mode = load(z, rows.mode + k)
            rest_mask = less(magnitude(u), rest_speed(structure, values, limits, step, k))
            sense = where(less(u, splat(0.0)), splat(-1.0), splat(1.0))
            new = where(rest_mask, splat(MODE.sticks), sense)
            store(z, rows.mode + k, where(mask, new, mode))


@compiled
def stick_instead(structure, z, mask):
    """Let stick what slides without a solution, as where it jams; return the lanes with any."""
    rows = friction_rows(structure.state)
    changed = splat(0.0)
    for k in range(rows.frictions):
        if structure.friction.reacts[k]:
            slides = where(sticks(structure.state, z, k), splat(0.0), mask)
            mode = load(z, rows.mode + k)
            store(z, rows.mode + k, where(slides, splat(MODE.sticks), mode))
            store(
                z, structure.state.friction + k,
                where(slides, splat(0.0), load(z, structure.state.friction + k)),
            )  # fmt: skip
            changed = maximum(changed, slides)
    return changed


@compiled
def change_sticking(structure, values, work, limits, step, mask):
    """Let slide what asks for most, and stick what would slide back; return where any does."""
    state = structure.state
    z = work.z
    none = splat(0.0)
    true = splat(1.0)
    rows = friction_rows(state)
    friction = structure.friction
    largest = none
    loosest = none
    changed = none
    # Find the largest impulse, and what asks for most.
    for k in range(state.multiplier, state.angle):
        largest = maximum(largest, magnitude(load(z, k)))
    for k in range(rows.frictions):
        loosest = maximum(loosest, excess_ratio(structure, values, z, k, largest))
    # Release what asks for most, and let stick what slides back.
    for k in range(rows.frictions):
        mode = load(z, rows.mode + k)
        u = load(z, rows.speed + k)
        excess = excess_ratio(structure, values, z, k, largest)
        released = where(less(none, excess), where(less(excess, loosest), none, true), none)
        sense = where(less(load(z, state.friction + k), none), splat(-1.0), true)
        rest = rest_speed(structure, values, limits, step, k)
        reversal = less(mode * u, -rest)
        if friction.one_way[k]:
            sense = splat(MODE.inactive)
            reversal = less(u, -rest)
        reversal = where(sticks(state, z, k), none, reversal)
        if not (friction.one_way[k] or friction.reacts[k]):
            reversal = none
        new = where(released, sense, where(reversal, splat(MODE.sticks), mode))
        change = where(mask, maximum(released, reversal), none)
        store(z, rows.mode + k, where(change, new, mode))
        changed = maximum(changed, change)
    return changed


@compiled
def excess_ratio(structure, values, z, k, largest):
    """Return |p_t| over what friction k can hold if that is less, or 0."""
    state = structure.state
    none = splat(0.0)
    friction = structure.friction
    impulse = load(z, state.friction + k)
    allowed = IMPACT.rounding * largest
    if friction.switched[k]:
        return none
    if not friction.one_way[k]:
        impulse = magnitude(impulse)
        hold = load(values.friction.static, k) * load(z, friction_rows(state).normal + k)
        allowed = allowed + (1.0 + IMPACT.rounding) * hold
    ratio = where(less(allowed, impulse), impulse / allowed, none)
    return where(sticks(state, z, k), ratio, none)
