"""A step of the generalized-α method by prediction and Newton's corrections, on lanes."""

from __future__ import annotations

from typing import NamedTuple

from flexband.mechanics.engine.projection import (
    PROJECTION,
    greatest,
    light,
    project,
    refine,
)
from flexband.mechanics.engine.rounds import (
    go_back,
    restart,
)
from flexband.mechanics.kernels.equations import (
    residual,
    tangent,
    to_right_side,
    violated_constraint,
)
from flexband.mechanics.kernels.factorization import backward, factorize, forward
from flexband.mechanics.kernels.failure_codes import FAILURE
from flexband.mechanics.kernels.friction.rows import carry_reactions
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
from flexband.mechanics.kernels.laws.states import (
    begin_states,
)

ROUNDING = 1e-14
"""The smallest tolerance that Newton's method can reach."""


SHORTEST_STEP = 1e-300
"""Shorter lengths [s] are those of no step."""


class NewtonOptions(NamedTuple):
    """How Newton's method solves a step. Lengths are relative to the size of the mechanism."""

    factorizations: int = 6
    """The most per step without friction."""
    rough_matrices: int = 40
    """The same with friction."""
    iterations: int = 5
    """The most with each factorization without friction."""
    rough_iterations: int = 40
    """The same with friction."""
    settled: float = 1e-9
    """Change of reactions, relative to the largest one, that friction does not follow."""
    nearly_settled: float = 1e-4
    """The same after `followed` changes: in short steps rounding errors are larger."""
    followed: int = 8
    """How many changes of reactions friction follows before that."""
    damped_iterations: int = 100
    """The most of a second attempt at a step."""
    max_correction: float = 0.1
    """The largest correction of each of these."""
    initial_rate: float = 0.1
    """Rate of convergence that is assumed before it has been observed."""
    redundant_tolerance: float = 1e-8
    """Of redundant constraints during the motion."""
    max_fall: float = 0.05
    """Largest part of a predicted motion that is due to accelerations."""


NEWTON = NewtonOptions()


@compiled
def predict(structure, method, values, z, a):
    """Move to the next time with q̈ unchanged; `a` becomes that of the new time.

    Where the accelerations would move a coordinate by more than `NEWTON.max_fall` they are those of
    vibrations that the step does not resolve. The coordinate then moves with its velocity alone.
    """
    h, alpha_m, alpha_f, beta, gamma, _, _, _, _ = method
    state = structure.state
    velocity = state.velocity
    acceleration = state.acceleration
    for i in range(1, state.coordinates + 1):
        old = load(a, i)
        second_derivative = load(z, acceleration + i)
        new = (second_derivative - alpha_m * old) / (1.0 - alpha_m)
        v = load(z, velocity + i)
        fall = h * h * ((0.5 - beta) * old + beta * new)
        small = less(magnitude(fall) * load(values.inverse_scale, i), splat(NEWTON.max_fall))
        new = where(small, new, (1.0 - 0.5 / beta) * old)
        changed = ((1.0 - alpha_m) * new + alpha_m * old - alpha_f * second_derivative) / (
            1.0 - alpha_f
        )
        store(z, i, load(z, i) + h * v + where(small, fall, splat(0.0)))
        store(z, velocity + i, v + h * ((1.0 - gamma) * old + gamma * new))
        store(z, acceleration + i, where(small, second_derivative, changed))
        store(a, i, new)


@compiled
def correct(structure, method, values, z, a, x, active):
    """Apply Newton's correction where `active` is true; return the largest scaled change of q."""
    state = structure.state
    velocity = state.velocity
    acceleration = state.acceleration
    da_da = (1.0 - method.alpha_f) / (1.0 - method.alpha_m)
    largest = splat(0.0)
    for i in range(1, state.coordinates + 1):
        change = load(x, i)
        largest = maximum(largest, magnitude(change) * load(values.inverse_scale, i))
        change = where(active, change, splat(0.0))
        store(z, i, load(z, i) + method.dq_da * change)
        store(z, velocity + i, load(z, velocity + i) + method.dv_da * change)
        store(z, acceleration + i, load(z, acceleration + i) + change)
        store(a, i, load(a, i) + da_da * change)
    for k in range(state.multiplier, state.angle):
        store(z, k, load(z, k) + where(active, load(x, k), splat(0.0)))
    return method.dq_da * largest


@compiled
def shorten_corrections(structure, method, values, x):
    """Shorten Newton's corrections to `NEWTON.max_correction`."""
    largest = greatest(x, 0, values.inverse_scale, structure.state.coordinates)
    largest = method.dq_da * largest
    short = less(largest, splat(NEWTON.max_correction))
    part = where(short, splat(1.0), NEWTON.max_correction / largest)
    for i in range(1, structure.state.angle):
        store(x, i, part * load(x, i))


@compiled
def turn_of_jacobian(structure, method, values, x):
    """Return the largest scaled change of the coordinates that Φ_q depends on."""
    curved = structure.terms.curved
    largest = splat(0.0)
    for n in range(len(curved)):
        i = curved[n]
        largest = maximum(largest, magnitude(load(x, i)) * load(values.inverse_scale, i))
    return method.dq_da * largest


@compiled
def solve_step(structure, method, tolerance, values, now, work, alive, damped):
    """Solve Eq. (27) at one time and its hidden constraints where `alive` is true.

    Returns three lanes: the mask of those that diverged, the number of multipliers left out, and
    the mask of those in which masses do not determine the motion, see `refine`.

    A lane that has converged is frozen, so that no sample depends on its neighbours. The error
    that remains after a correction is estimated from the rate of convergence, stored in `rate`.
    If `damped`, each iteration has its own factorization and a correction of limited length.
    """
    z, a, r, rate = work.z, work.a, work.r, work.rate
    matrix, none = work.matrix, splat(0.0)
    weight, velocity_part = method.dq_da, method.dv_da / method.dq_da
    active, pending, solved, redundant, previous, moved = alive, alive, none, none, none, none
    lost = none
    matrices, age, first = 0, 0, True  # age: iterations since the last factorization
    has_friction = structure.state.angle > structure.state.friction
    iterations = NEWTON.rough_iterations if has_friction else NEWTON.iterations
    max_iterations = 1 if damped else iterations
    allowed = NEWTON.rough_matrices if has_friction else NEWTON.factorizations
    for _ in range(NEWTON.damped_iterations if damped else allowed * max_iterations):
        residual(structure, values, now, z, r, work.blocks)
        to_right_side(structure, r, method.dq_da)
        store(work.counts, 1, load(work.counts, 1) + 1.0)
        # Factor a new matrix, or use the last one.
        if age == 0:
            store(work.counts, 2, load(work.counts, 2) + 1.0)
            tangent(structure, values, now, z, weight, velocity_part, matrix, work.blocks)
            left_out = factorize(structure.pattern, matrix, load(work.smallest, 0), r)
            redundant = where(pending, where(left_out, left_out, redundant), redundant)
            moved = none
        else:
            forward(structure.pattern.below, matrix, (r,))
        backward(structure.pattern, matrix, (r,))
        lost = where(active, where(refine(structure, values, work, r), alive, lost), lost)
        age += 1
        if damped:
            shorten_corrections(structure, method, values, r)
        # Correct the state, and estimate the error that remains.
        moved = where(active, moved + turn_of_jacobian(structure, method, values, r), moved)
        change = correct(structure, method, values, z, a, r, active)
        if not first:
            store(rate, 0, where(active, change / previous, load(rate, 0)))
        previous, first = (change if first else where(active, change, previous)), False
        q = maximum(load(rate, 0), splat(1e-3))
        error = where(less(q, splat(0.9)), q / (1.0 - q) * change, 1e3 * change)
        if has_friction:  # after reactions have changed, what is left is soon due to rounding alone
            error = where(less(change, splat(0.1 * ROUNDING)), none, error)
        active = where(less(error, tolerance), none, where(solved, none, active))
        if any_true(active) and age < max_iterations:
            continue
        # Project what has converged, and let friction follow its reactions.
        solved = where(active, none, pending)
        done = project(structure, method, values, now, work, solved, moved)
        settled = NEWTON.settled if matrices < NEWTON.followed else NEWTON.nearly_settled
        change = carry_reactions(structure, values, z, done, matrices == 0)
        unsettled = less(splat(settled), change)
        done, solved = where(unsettled, none, done), where(unsettled, none, solved)
        pending, solved = where(done, none, pending), where(done, none, solved)
        matrices += 1
        if not any_true(pending) or matrices == method.matrices:
            break
        active, age = pending, 0  # where a new Jacobian is needed, it serves one more iteration
    return pending, redundant, lost


@compiled
def stand_still(structure, method, work, failed):
    """Set what has `failed` to the state before the step with accelerations that undo its motion.

    A prediction from velocities may be far off where a fine mesh vibrates faster than the step.
    """
    h, alpha_m, alpha_f, beta, gamma, _, _, _, _ = method
    state = structure.state
    z = work.z
    a = work.a
    before = work.before
    go_back(structure, work, failed)
    for i in range(1, state.coordinates + 1):
        old = load(before, state.rows + i)
        v = load(before, state.velocity + i)
        new = (0.5 - beta) * old + v / h
        new = -new / beta
        rate = v + h * ((1.0 - gamma) * old + gamma * new)
        second = (1.0 - alpha_m) * new + alpha_m * old
        second = (second - alpha_f * load(before, state.acceleration + i)) / (1.0 - alpha_f)
        store(z, state.velocity + i, where(failed, rate, load(z, state.velocity + i)))
        store(z, state.acceleration + i, where(failed, second, load(z, state.acceleration + i)))
        store(a, i, where(failed, new, load(a, i)))
    store(work.rate, 0, where(failed, splat(NEWTON.initial_rate), load(work.rate, 0)))
    begin_states(state, z, h, failed)
    clear(work.r, state.velocity + 1)  # and of what is not finite
    clear(work.s, state.velocity + 1)


@compiled
def examine(structure, values, now, work, start_redundancy, left_out):
    """Return the code of lanes that violate a constraint that is left out, and its multiplier.

    Constraints that are left out only because bodies are light count from the next attempt on.
    `start_redundancy` is the number of redundant constraints at the start.
    """
    none = splat(0.0)
    violated = violated_constraint(
        structure, values, now, work.z, work.r, NEWTON.redundant_tolerance
    )
    violated = where(left_out, violated, none)
    code = where(violated, splat(FAILURE.contradicted), none)
    excess_mask = less(start_redundancy, left_out)
    if any_true(excess_mask):
        excess_mask = where(excess_mask, light(structure, values, now, work, left_out), none)
        store(
            work.smallest,
            0,
            where(excess_mask, splat(PROJECTION.zero_pivot), load(work.smallest, 0)),
        )
        code = where(excess_mask, where(violated, splat(FAILURE.diverged), none), code)
    return code, violated


@compiled
def begin_steps(structure, work):
    """Set the rate of convergence that is assumed, and a unless there is a step before."""
    store(work.rate, 0, splat(NEWTON.initial_rate))
    restart(structure, work, less(load(work.steps, 1), splat(SHORTEST_STEP)))


@compiled
def attempt(structure, method, tolerance, values, now, work, start_redundancy, stepping, failure):
    """Solve a step that has been predicted, once more with damped corrections where that fails.

    Returns the mask of lanes that failed, with the reasons in `failure`, and the number of
    multipliers left out.
    """
    none = splat(0.0)
    failed = stepping
    worst = none
    redundant = none
    for number in range(method.attempts):
        if number > 0:
            stand_still(structure, method, work, failed)
        diverged, left_out, lost = solve_step(
            structure, method, tolerance, values, now, work, failed, number > 0
        )
        left_out = where(diverged, none, where(failed, left_out, none))
        code = where(diverged, splat(FAILURE.diverged), none)
        code = where(lost, splat(FAILURE.undetermined), code)
        redundant = where(failed, left_out, redundant)
        if any_true(left_out):
            contradicted, violated = examine(
                structure, values, now, work, start_redundancy, left_out
            )
            code = code + contradicted
            worst = where(worst, worst, violated)
        first = code if number == 0 else failed
        failed = where(code, first, none)
        if not any_true(failed):
            break
    store(failure, 0, load(failure, 0) + failed)
    blame = worst - float(structure.state.multiplier)
    store(failure, 2, where(failed, blame, load(failure, 2)))
    return failed, redundant
