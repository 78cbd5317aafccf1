"""What keeps a motion on its constraints after each step, on lanes.

Newton's method holds Φ = 0 alone. Velocities, accelerations and the method's variable a are moved
onto the derivatives of the constraints by the least change in the metric of the integrator's
matrix [M + K/β', Φ_qᵀ; Φ_q, 0], whose factors are at hand. In this metric a stiff member moves as
a rigid one; it differs from M by O(h²). The multipliers are those of the projected accelerations.

The derivatives of Φ(q, t) = 0 are those of `kernels.constraints`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexband.mechanics.kernels.angles import pass_on_moments
from flexband.mechanics.kernels.constraints import add_constraints
from flexband.mechanics.kernels.equations import add_mass, clear_matrix, residual, tangent
from flexband.mechanics.kernels.factorization import factorize, soften_multipliers, solve
from flexband.mechanics.kernels.friction.contacts_in_line import holds
from flexband.mechanics.kernels.friction.rows import (
    add_friction,
    add_jacobian,
    carry_reactions,
    subtract_rate_errors,
    subtract_speed_errors,
)
from flexband.mechanics.kernels.lanes import (
    any_true,
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


class ProjectionOptions(NamedTuple):
    """How velocities and accelerations are moved onto the constraints.

    The pivot of a multiplier is the squared sine of the angle between the gradient of its
    constraint and those of all others. Below a least pivot the constraint is left out of a step:
    in a mechanism that passes a position where constraints depend on each other, reactions next to
    it would be rounding errors divided by this sine.

    Passes with which constraints share forces do not settle next to such a position, and where
    masses differ much.
    """

    max_error: float = 1e-12
    """Error of a projected velocity, times the step over the size, that calls for a new matrix."""
    max_change: float = 3e-5
    """The same change since the last matrix: about φ³/6 for a body that turns by φ in a step."""
    min_pivot: float = 1e-7
    """Relative size of a pivot below which a constraint is left out of a step."""
    zero_pivot: float = 1e-13
    """The same where the start is nearly locked, or bodies are massless without redundancy."""
    massless_pivot: float = 1e-10
    """The same where bodies are massless: what matrices have for zeros is small as well."""
    softening: float = 1e-7
    """Compliance of constraints that share forces, relative to that of the masses they move."""
    small_softening: float = 1e-10
    """The one after it where the passes do not settle."""
    min_passes: int = 4
    """The least with each of them, which is enough where masses differ by less than 1e4."""
    max_passes: int = 40
    """The most with each of them."""
    min_refinements: int = 2
    """The least where bodies are massless, each of which leaves about 1e-4 of the error."""
    max_refinements: int = 20
    """The most, where masses hardly determine the motion."""
    settled: float = 1e-8
    """Size of a correction, relative to the solution, below which no other follows."""
    unsettled: float = 1e-2
    """Size of the last correction from which on they do not converge."""
    unshared: float = 1e-3
    """What the last pass adds to shared forces, relative to them, beyond which some are missed."""
    released: float = 1e-3
    """Relative change of q̈ by a constraint that is left out from which on its force is missed."""
    solutions: int = 6
    """The most for q̈ at the start: rounding errors matter where bodies are light."""
    rough_solutions: int = 100
    """The same with friction."""
    jammed: float = 1e-6
    """Last relative change of a reaction that friction follows from which on it jams."""


PROJECTION = ProjectionOptions()


@compiled
def greatest(x, first, scale, count):
    """Return the greatest magnitude of `count` rows of x after `first`, each times its scale."""
    largest = splat(0.0)
    for i in range(1, count + 1):
        largest = maximum(largest, magnitude(load(x, first + i)) * load(scale, i))
    return largest


@compiled
def add_rows(z, first, x, begin, end, mask):
    """Add rows `begin` to `end` of x to those of z after `first`, where `mask` is true."""
    for i in range(begin, end):
        store(z, first + i, load(z, first + i) + where(mask, load(x, i), splat(0.0)))


@compiled
def refine(structure, values, work, x):
    """Turn a solution x of a system with `work.matrix` into that with the masses of the bodies.

    Where bodies are massless the matrix has N in place of zeros. Then the solution with N x on the
    right-hand side corrects x, and so on. Returns the mask of samples in which the corrections do
    not become smaller: a massless body can move there while all that has mass is at rest.
    """
    unsettled = splat(0.0)
    if len(structure.mass.massless) > 0:
        unsettled = refine_massless(
            structure.mass, structure.pattern, structure.state, values.mass, values.regular_mass,
            values.inverse_scale, work.matrix, work.t, x,
        )  # fmt: skip
    return unsettled


@compiled
def refine_massless(mass, pattern, state, entries, regular, inverse_scale, matrix, t, x):
    """Perform `refine`, with `t` as work space."""
    none = splat(0.0)
    pending = splat(1.0)
    largest = none
    last = none
    for i in range(state.angle):
        store(t, i, load(x, i))
    for count in range(PROJECTION.max_refinements):
        n = 0
        for i in range(state.angle):
            p = mass.massless[n]
            massless = mass.i[p] == i
            added = load(regular, p) - load(entries, p)
            store(t, i, added * load(t, i) if massless else none)
            n = min(n + massless, len(mass.massless) - 1)
        solve(pattern, pattern.below, matrix, (t,))
        add_rows(x, 0, t, 1, state.angle, pending)
        largest = greatest(x, 0, inverse_scale, state.coordinates)
        last = where(pending, greatest(t, 0, inverse_scale, state.coordinates), last)
        if count >= PROJECTION.min_refinements - 1:
            pending = where(less(PROJECTION.settled * largest, last), pending, none)
            if not any_true(pending):
                break
    return less(PROJECTION.unsettled * largest, last)


@compiled
def project(structure, method, values, now, work, solved, moved):
    """Move v, q̈, a and λ of lanes that are `solved` to those that agree with the constraints.

    `moved` is how far Newton's method has moved, since the factorization, those coordinates that
    the Jacobian depends on. Lanes whose Jacobian is not accurate enough stay as they are. Returns
    the mask of those that were projected.
    """
    state = structure.state
    z = work.z
    a = work.a
    r = work.r
    s = work.s
    pattern = structure.pattern
    matrix = work.matrix
    velocity = state.velocity
    end = state.multiplier
    none = splat(0.0)
    # Project the velocities, unless the Jacobian is too old for them.
    clear(r, velocity)
    subtract_speed_errors(structure, values, now, z, r)
    solve(pattern, pattern.reached, matrix, (r,))
    refine(structure, values, work, r)
    largest = greatest(r, 0, values.inverse_scale, state.coordinates)
    inexact = less(splat(PROJECTION.max_error), method.step * largest * moved)
    inexact = where(less(moved, splat(PROJECTION.max_change)), inexact, splat(1.0))
    mask = where(inexact, none, solved)
    add_rows(z, velocity, r, 1, end, mask)
    # Project the accelerations and the method's variable a, with the multipliers.
    clear(r, velocity)
    clear(s, velocity)
    subtract_rate_errors(structure, values, now, z, a, r, s)
    solve(pattern, pattern.reached, matrix, (r, s))
    refine(structure, values, work, r)
    refine(structure, values, work, s)
    add_rows(z, state.acceleration, r, 1, end, mask)
    add_rows(a, 0, s, 1, end, mask)
    add_rows(z, 0, r, end, state.angle, mask)
    return mask


@compiled
def mass_matrix(structure, values, mass, now, z, matrix):
    """Set the matrix to [M, Φ_qᵀ; Φ_q, 0] with the entries `mass` of M."""
    none = splat(0.0)
    clear_matrix(structure.pattern, matrix)
    add_mass(structure.mass, mass, matrix)
    add_jacobian(structure, values, now, z, none, matrix)


@compiled
def solve_accelerations(structure, values, now, work):
    """Set `work.r` to what q̈ and λ miss, with the factors of `mass_matrix` in `work.matrix`."""
    state = structure.state
    z = work.z
    r = work.r
    residual(structure, values, now, z, r, work.blocks)
    for i in range(1, state.angle):
        store(r, i, -load(r, i) if i <= state.coordinates else splat(0.0))
    subtract_rate_errors(structure, values, now, z, work.a, r, work.s)
    solve(structure.pattern, structure.pattern.below, work.matrix, (r,))


@compiled
def accelerate(structure, values, now, work, mask):
    """Set q̈ and λ of the lanes in `mask` from M q̈ + Φ_qᵀλ = Q − F and Φ_q q̈ + γ = 0.

    Returns how many multipliers were left out. The forces of friction depend on λ, which takes more
    solutions. Where they do not settle, q̈ and λ are not finite: friction jams.
    """
    state = structure.state
    z = work.z
    r = work.r
    none = splat(0.0)
    mass_matrix(structure, values, values.regular_mass, now, z, work.matrix)
    left_out = factorize(structure.pattern, work.matrix, load(work.smallest, 0), r)
    pending = mask
    followed = none
    has_friction = state.angle > state.friction
    for count in range(PROJECTION.rough_solutions if has_friction else PROJECTION.solutions):
        solve_accelerations(structure, values, now, work)
        refine(structure, values, work, r)
        # Compare the change of the multipliers with the largest one.
        change = none
        largest = none
        for k in range(state.multiplier, state.angle):
            change = maximum(change, magnitude(load(r, k)))
            largest = maximum(largest, magnitude(load(z, k)))
        if count > 0:
            retry_mask = maximum(
                less(PROJECTION.settled * largest, change),
                less(splat(PROJECTION.settled), followed),
            )
            pending = where(retry_mask, pending, none)
            if not any_true(pending):
                break
        # Correct q̈ and λ, and let friction follow its reactions.
        add_rows(z, state.acceleration, r, 1, state.multiplier, pending)
        add_rows(z, 0, r, state.multiplier, state.angle, pending)
        followed = carry_reactions(structure, values, z, pending, count == 0)
    if has_friction:
        jammed = where(less(splat(PROJECTION.jammed), followed), pending, none)
        for i in range(1, state.coordinates + 1):
            row = state.acceleration + i
            store(z, row, where(jammed, splat(np.nan), load(z, row)))
    return where(mask, left_out, none)


@compiled
def strike(structure, method, values, now, work, struck):
    """Set q̈ to the change of v by which Φ_q v + Φ_t = 0 is met, and λ to the impulses for it.

    They are those of the metric of the integrator's matrix, where `struck` is true. The velocities
    move halfway, to the mean of those before and after, with which the impulses do their work.
    """
    state = structure.state
    z = work.z
    r = work.r
    none = splat(0.0)
    residual(structure, values, now, z, r, work.blocks)
    tangent(
        structure, values, now, z, splat(method.dq_da), splat(method.dv_da / method.dq_da),
        work.matrix, work.blocks,
    )  # fmt: skip
    factorize(structure.pattern, work.matrix, splat(PROJECTION.zero_pivot), r)
    clear(r, state.velocity)
    subtract_speed_errors(structure, values, now, z, r)
    solve(structure.pattern, structure.pattern.below, work.matrix, (r,))
    refine(structure, values, work, r)
    for i in range(1, state.coordinates + 1):
        change = where(struck, load(r, i), none)
        row = state.acceleration + i
        store(z, row, where(struck, change, load(z, row)))
        store(z, state.velocity + i, load(z, state.velocity + i) + 0.5 * change)
    for k in range(state.multiplier, state.angle):
        store(z, k, where(struck, load(r, k), load(z, k)))


@compiled
def light(structure, values, now, work, left_out):
    """Return where fewer constraints are left out in the metric M than `left_out`.

    In that of the integrator a constraint of a body that is much lighter than what stiffness and
    damping add to its neighbour looks as if it were redundant.
    """
    mass_matrix(structure, values, values.regular_mass, now, work.z, work.matrix)
    redundant = factorize(structure.pattern, work.matrix, load(work.smallest, 0), work.r)
    return less(redundant, left_out)


@compiled
def acceleration_change_mask(structure, values, now, work, mask):
    """Return in which lanes of `mask` accelerations change if only redundant rows are left out."""
    state = structure.state
    z = work.z
    r = work.r
    mass_matrix(structure, values, values.regular_mass, now, z, work.matrix)
    factorize(structure.pattern, work.matrix, splat(PROJECTION.zero_pivot), r)
    solve_accelerations(structure, values, now, work)
    change = greatest(r, 0, values.inverse_scale, state.coordinates)
    largest = greatest(z, state.acceleration, values.inverse_scale, state.coordinates)
    return where(less(PROJECTION.released * largest, change), mask, splat(0.0))


@compiled
def share(structure, values, now, work, shared):
    """Replace the multipliers of the lanes in `shared` by the least ones with the same forces.

    They minimize Σ λ_k²/m_k with 1/m_k = Σ_i Φ_ki²/M_ii: each constraint carries in proportion to
    the mass that it moves, whatever its unit. Light bodies count with a part of the whole mass.
    Returns the mask of lanes where they do not settle: they may miss a part of the forces.
    """
    state = structure.state
    z = work.z
    r = work.r
    shares = work.s
    matrix = work.matrix
    none = splat(0.0)
    pending = shared
    change = none
    largest = none
    # Set aside the friction of what slides.
    for k in range(state.multiplier, state.angle):
        store(shares, k, none)
    for k in range(state.angle - state.friction):  # what slides is not shared
        row = state.friction + k
        sliding_force = where(holds(structure, z, k), none, where(shared, load(z, row), none))
        store(shares, row, sliding_force)
        store(z, row, load(z, row) - sliding_force)
    # Carry in passes with softened constraints what is left to carry.
    for part in (PROJECTION.softening, PROJECTION.small_softening):
        mass_matrix(structure, values, values.sharing_mass, now, z, matrix)
        soften_multipliers(structure.pattern, matrix, part)
        factorize(structure.pattern, matrix, none, r)
        for count in range(PROJECTION.max_passes):  # z holds what is left to carry
            clear(r, state.velocity)
            add_constraints(structure.terms, values.terms, values.functions, now, z, r)
            add_friction(structure, values, now, z, r)
            pass_on_moments(structure, values, z, r)
            for k in range(state.multiplier, state.angle):
                store(r, k, none)
            solve(structure.pattern, structure.pattern.below, matrix, (r,))
            change = none
            largest = none
            for k in range(state.multiplier, state.angle):
                passed = where(pending, load(r, k), none)
                store(shares, k, load(shares, k) + passed)
                store(z, k, load(z, k) - passed)
                change = maximum(change, magnitude(passed))
                largest = maximum(largest, magnitude(load(shares, k)))
            if count >= PROJECTION.min_passes - 1:
                pending = where(less(PROJECTION.settled * largest, change), pending, none)
                if not any_true(pending):
                    break
        if not any_true(pending):
            break
    # Take over what the passes have carried.
    for k in range(state.multiplier, state.angle):
        store(z, k, load(shares, k) + where(shared, none, load(z, k)))
    return where(pending, less(PROJECTION.unshared * largest, change), none)
