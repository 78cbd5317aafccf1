"""The index-3 generalized-α method of Arnold and Brüls (2007) for Eq. (26), on lanes.

    (1−α_m) a_{n+1} + α_m a_n = (1−α_f) q̈_{n+1} + α_f q̈_n
    q_{n+1} = q_n + h q̇_n + h² (½−β) a_n + h² β a_{n+1}
    q̇_{n+1} = q̇_n + h (1−γ) a_n + h γ a_{n+1}

with Eq. (27) at t_{n+1}. Newton's unknowns are the corrections of q̈ and λ. With β' = ∂q̈/∂q the
matrix is [M + K/β', Φ_qᵀ; Φ_q, 0] and the constraints' residual is β'Φ, so that the condition
number does not grow as h → 0.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_numbers, check_positive
from flexband.basics.warning import warn
from flexband.errors import InputError
from flexband.mechanics.assembly.structure import KEPT
from flexband.mechanics.engine.projection import (
    PROJECTION,
    accelerate,
    acceleration_change_mask,
    greatest,
    light,
    project,
    refine,
    share,
    strike,
)
from flexband.mechanics.kernels.angles import turning_rate
from flexband.mechanics.kernels.equations import (
    residual,
    sense,
    tangent,
    to_right_side,
    violated_constraint,
    watch,
)
from flexband.mechanics.kernels.extremes import begin_extremes
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
from flexband.mechanics.kernels.laws.forces import update_law_states
from flexband.mechanics.kernels.laws.states import (
    begin_states,
    end_states,
    hold_states,
    shift_states,
)
from flexband.mechanics.kernels.state import State

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


class StepLimits(NamedTuple):
    """What a run asks of its steps."""

    tolerance: float  # error of a coordinate in a step, relative to the size of the mechanism
    smallest: float  # shortest step [s]
    is_given: float  # 1 if a user has given the shortest step, which contacts then do not change


@frozen(kw_only=True)
class GeneralizedAlpha:
    """Numerical parameters of the integrator.

    Parameters
    ----------
    spectral_radius : ρ∞ in [0, 1], which sets the damping of vibrations that the step does not
        resolve: none for 1, the most for 0.
    tolerance : of Newton's method, for the coordinates relative to the size of the mechanism.
    step_tolerance : error of a coordinate in a step, relative to the size of the mechanism, with
        which every sample chooses its steps between two times of the result; or None for steps that
        are given. Where force laws have `events`, steps are always chosen, and None is 1e-7, or
        less in a study whose bands it would change by a tenth of its tolerance.
    smallest_step : shortest step [s] that may be chosen, or None for 1e-7 of the given one, and
        1e-4 of the duration of an impact if that is less. A sample that needs shorter ones fails.

    Raises
    ------
    InputError
        If a number is out of its range.
    """

    spectral_radius: float = 0.7
    tolerance: float = 1e-10
    step_tolerance: float | None = None
    smallest_step: float | None = None

    def __post_init__(self) -> None:
        if self.step_tolerance is not None:
            check_positive("step_tolerance", check_numbers("step_tolerance", self.step_tolerance))
            if not 1e-13 < self.step_tolerance < 1e-2:
                raise InputError(
                    "step_tolerance must be between 1e-13 and 0.01 of the mechanism's size; got "
                    f"{self.step_tolerance:g}"
                )
        if self.smallest_step is not None:
            name = "smallest_step [s]"
            check_positive(name, check_numbers(name, self.smallest_step))
        rho = check_numbers("spectral_radius", self.spectral_radius)
        if not 0 <= rho <= 1:
            raise InputError(f"spectral_radius must be from 0 to 1; got {rho:g}")
        check_positive("tolerance", check_numbers("tolerance", self.tolerance))
        if not 1e-15 < self.tolerance < 1e-4:  # rounding, or the tolerance itself, is all there is
            warn(
                f"GeneralizedAlpha tolerance is {self.tolerance:g} of the mechanism's size; "
                f"it is usually 1e-12 to 1e-8"
            )

    def step_limits(self, state: State, step: float) -> StepLimits | None:
        """Return the limits of steps that samples choose between times `step` [s] apart or None."""
        if self.step_tolerance is None and state.gap == state.extreme:
            return None
        tolerance = 1e-7 if self.step_tolerance is None else self.step_tolerance
        smallest = self.smallest_step or 1e-7 * float(step)
        is_given = 0.0 if self.smallest_step is None else 1.0
        return StepLimits(float(tolerance), float(min(smallest, step)), is_given)

    def coefficients(self, step: float) -> Coefficients:
        """Return the coefficients of the method for a step [s] (Chung and Hulbert 1993)."""
        rho = float(self.spectral_radius)
        alpha_m = (2 * rho - 1) / (rho + 1)
        alpha_f = rho / (rho + 1)
        gamma = 0.5 + alpha_f - alpha_m
        beta = 0.25 * (gamma + 0.5) ** 2
        dq_da = step**2 * beta * (1 - alpha_f) / (1 - alpha_m)
        return Coefficients(
            step, alpha_m, alpha_f, beta, gamma, dq_da, step * gamma * (1 - alpha_f) / (1 - alpha_m)
        )


class Coefficients(NamedTuple):
    """Coefficients of the method for one step size."""

    step: float
    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float
    dq_da: float  # 1/β', ∂q/∂q̈ [s²]
    dv_da: float  # γ'/β', ∂q̇/∂q̈ [s]
    attempts: int = 1
    """At a step, from the second one on with damped corrections."""
    matrices: int = 1000
    """The most of an attempt, with as many iterations each as Newton allows."""


@compiled
def of_part(method, part):
    """Return the coefficients of a part of the step, a lane."""
    return Coefficients(
        method.step * part,
        method.alpha_m,
        method.alpha_f,
        method.beta,
        method.gamma,
        method.dq_da * (part * part),
        method.dv_da * part,
        method.attempts,
        method.matrices,
    )


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
def restart(structure, work, mask):
    """Set the method's variable a to q̈ where `mask` is true."""
    for i in range(1, structure.state.coordinates + 1):
        second_derivative = load(work.z, structure.state.acceleration + i)
        store(work.a, i, where(mask, second_derivative, load(work.a, i)))


@compiled
def begin_steps(structure, work):
    """Set the rate of convergence that is assumed, and a unless there is a step before."""
    store(work.rate, 0, splat(NEWTON.initial_rate))
    restart(structure, work, less(load(work.steps, 1), splat(SHORTEST_STEP)))


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
