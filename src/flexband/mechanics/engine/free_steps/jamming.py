"""Whether friction jams, as in the paradox of Painlevé, on lanes.

Friction changes the reactions that it follows. Where it slides, a change δN of normal forces comes
back as κ δN, with κ = µ |n M⁻¹ tᵀ|/(n M⁻¹ nᵀ) of one friction with the directions n and t, and with
the spectral radius of the same matrix of several. From κ = 1 on no motion is consistent, or several
are.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexband.mechanics.engine.free_steps.effective_mass import factorize_frictionless
from flexband.mechanics.engine.projection import refine
from flexband.mechanics.engine.rounds import go_back, keep_state
from flexband.mechanics.kernels.angles import pass_on_moments
from flexband.mechanics.kernels.constraints import add_constraints
from flexband.mechanics.kernels.equations import update_dependent
from flexband.mechanics.kernels.factorization import solve
from flexband.mechanics.kernels.failure_codes import FAILURE
from flexband.mechanics.kernels.friction.modes import sticks
from flexband.mechanics.kernels.friction.rows import (
    first_component,
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
    power,
    splat,
    sqrt,
    store,
    where,
)
from flexband.mechanics.kernels.state import friction_rows, reaction_rows


class JammingOptions(NamedTuple):
    """How the gain of friction is found."""

    turns: int = 40
    """Of a change through all frictions, the growth over the last half of which is the gain."""
    jams: float = 0.99
    """The gain from which on friction jams; next to 1 nothing settles."""


JAMMING = JammingOptions()


@compiled
def pass_through(structure, values, now, work):
    """Replace changes of what slides, in `work.s`, by those that they cause through reactions."""
    z = work.z
    r = work.r
    x = work.s
    state = structure.state
    friction = structure.friction
    rows = friction_rows(state)
    joints = reaction_rows(state)
    none = splat(0.0)
    components = first_component(structure)
    # Find the reactions to the changes of friction.
    clear(r, state.velocity + 1)  # the last row may not be finite
    for k in range(rows.frictions):
        store(z, state.friction + k, load(x, k))
    add_constraints(friction.terms, values.friction.terms, values.functions, now, z, r)
    pass_on_moments(structure, values, z, r)
    for i in range(1, state.velocity):
        store(r, i, -load(r, i) if i <= state.coordinates else none)
    solve(structure.pattern, structure.pattern.below, work.matrix, (r,))
    refine(structure, values, work, r)
    for k in range(joints.number):
        store(z, joints.reaction + k, load(r, state.multiplier + k))
    # Replace the changes of friction by those that the reactions cause.
    update_components(structure, values, now, z)
    for k in range(rows.frictions):
        store(x, k, none)
    for n in range(len(friction.of_components)):
        k = friction.of_components[n]
        row = components + 2 * n
        if friction.reacts[k]:
            dx = load(z, row)
            dy = load(z, row + 1)
            nx = load(work.before, row)
            ny = load(work.before, row + 1)
            N = sqrt(nx * nx + ny * ny)
            finite_mask = where(less(none, N), less(N, splat(1e300)), none)
            along = (nx * dx + ny * dy) / where(finite_mask, N, splat(1.0))
            change = where(finite_mask, along, sqrt(dx * dx + dy * dy))
            mode = load(z, rows.mode + k)
            force = load(work.before, state.friction + k)
            pulled = where(less(force, none), splat(-1.0), splat(1.0))
            sense = where(sticks(state, z, k), pulled, mode)
            add_to(x, k, sense * load(values.friction.static, k) * change)


@compiled
def gain_of_friction(structure, values, now, work):
    """Return κ at the state z, which `work.before` has in the end."""
    z = work.z
    x = work.s
    friction = structure.friction
    gain = splat(1.0)
    frictions = friction_rows(structure.state).frictions
    half = JAMMING.turns // 2
    # Factor the matrix at the state, which is kept.
    keep_state(structure, work)
    update_dependent(structure, values, now, z)
    update_distances(structure, values, z)
    update_components(structure, values, now, z)
    for row in range(first_component(structure), structure.state.gap):
        store(work.before, row, load(z, row))
    for row in range(structure.state.multiplier, structure.state.angle):
        store(z, row, splat(0.0))  # they may not be finite
    factorize_frictionless(structure, values, now, work)
    # Find the spectral radius by power iteration.
    for k in range(frictions):
        store(x, k, splat(1.0 + 0.1 * k if friction.reacts[k] else 0.0))
    for turn in range(JAMMING.turns):
        pass_through(structure, values, now, work)
        size = splat(0.0)
        for k in range(frictions):
            size = maximum(size, magnitude(load(x, k)))
        for k in range(frictions):
            store(x, k, load(x, k) / maximum(size, splat(1e-300)))
        if turn >= half:
            gain = gain * power(size, splat(1.0 / half))
    return gain


@compiled
def find_jams(structure, values, work, failure):
    """Let what failed since friction jams say so, with κ, and what does not say that it does not.

    Newton's method diverges where friction jams within a step.
    """
    now = np.int64(0)
    none = splat(0.0)
    code = load(failure, 0)
    suspects = none
    for reason in (FAILURE.jammed, FAILURE.diverged, FAILURE.too_small):
        same = less(magnitude(code - reason), splat(0.5))
        suspects = maximum(suspects, same)
    if structure.friction.follows and any_true(suspects):
        gain = gain_of_friction(structure, values, now, work)
        go_back(structure, work, splat(1.0))
        jams = where(less(splat(JAMMING.jams), gain), suspects, none)
        store(failure, 0, where(jams, splat(FAILURE.jammed), code))
        store(failure, 3, where(jams, gain, load(failure, 3)))
        suspects = where(jams, none, suspects)
        code = load(failure, 0)
    jammed = less(magnitude(code - FAILURE.jammed), splat(0.5))
    unsettled = where(suspects, jammed, none)
    store(failure, 0, where(unsettled, splat(FAILURE.unsettled), code))
