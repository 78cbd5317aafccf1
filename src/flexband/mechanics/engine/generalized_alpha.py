"""The index-3 generalized-α method of Arnold and Brüls (2007) for Eq. (26), on lanes.

    (1−α_m) a_{n+1} + α_m a_n = (1−α_f) q̈_{n+1} + α_f q̈_n
    q_{n+1} = q_n + h q̇_n + h² (½−β) a_n + h² β a_{n+1}
    q̇_{n+1} = q̇_n + h (1−γ) a_n + h γ a_{n+1}

with Eq. (27) at t_{n+1}. Newton's unknowns are the corrections of q̈ and λ. With β' = ∂q̈/∂q the
matrix is [M + K/β', Φ_qᵀ; Φ_q, 0] and the constraints' residual is β'Φ, so that the condition
number does not grow as h → 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from flexband.errors import InputError, numbers, positive
from flexband.mechanics.kernels.equations import (
    residual,
    sense,
    tangent,
    to_right_side,
    violated_constraint,
)
from flexband.mechanics.kernels.factorization import factorize, solve
from flexband.mechanics.kernels.lanes import (
    any_true,
    filled,
    inlined,
    less,
    load,
    magnitude,
    maximum,
    store,
    where,
)

ITERATIONS = 30
ITERATIONS_PER_FACTORIZATION = 5
INITIAL_RATE = 0.1
"""Rate of convergence of Newton's method that is assumed before it has been observed."""

REDUNDANT_TOLERANCE = 1e-6
"""Of redundant constraints during the motion, relative to the size of the mechanism."""

DIVERGED, CONTRADICTED = 3.0, 4.0


@dataclass(frozen=True, kw_only=True)
class GeneralizedAlpha:
    """Numerical parameters of the integrator.

    Parameters
    ----------
    spectral_radius : ρ∞ in [0, 1], which sets the damping of vibrations that the step does not
        resolve: none for 1, the most for 0.
    tolerance : of Newton's method, for the coordinates relative to the size of the mechanism.

    Raises
    ------
    InputError
        If a number is out of its range.
    """

    spectral_radius: float = 0.7
    tolerance: float = 1e-10

    def __post_init__(self) -> None:
        rho = numbers("spectral_radius", self.spectral_radius)
        if not 0 <= rho <= 1:
            raise InputError(f"spectral_radius must be between 0 and 1; got {rho:g}")
        positive("tolerance", numbers("tolerance", self.tolerance))

    def coefficients(self, step: float) -> Coefficients:
        """Return the coefficients of the method for a step [s] (Chung and Hulbert 1993)."""
        rho = float(self.spectral_radius)
        alpha_m, alpha_f = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
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


@inlined
def predict(structure, method, z, a):
    """Move to the next time with q̈ unchanged; `a` becomes that of the new time."""
    h, alpha_m, _, beta, gamma, _, _ = method
    state = structure.state
    velocity, acceleration = state.velocity, state.acceleration
    for i in range(1, state.coordinates + 1):
        old, kept = load(a, i), load(z, acceleration + i)
        new = (kept - alpha_m * old) / (1.0 - alpha_m)
        v = load(z, velocity + i)
        store(z, i, load(z, i) + h * v + h * h * ((0.5 - beta) * old + beta * new))
        store(z, velocity + i, v + h * ((1.0 - gamma) * old + gamma * new))
        store(a, i, new)


@inlined
def correct(structure, method, values, z, a, x, active):
    """Apply Newton's correction where `active` is true; return the largest scaled change of q."""
    state = structure.state
    velocity, acceleration = state.velocity, state.acceleration
    da_da = (1.0 - method.alpha_f) / (1.0 - method.alpha_m)
    largest = filled(0.0)
    for i in range(1, state.coordinates + 1):
        change = load(x, i)
        largest = maximum(largest, magnitude(change) * load(values.inverse_scale, i))
        change = where(active, change, filled(0.0))
        store(z, i, load(z, i) + method.dq_da * change)
        store(z, velocity + i, load(z, velocity + i) + method.dv_da * change)
        store(z, acceleration + i, load(z, acceleration + i) + change)
        store(a, i, load(a, i) + da_da * change)
    for k in range(state.multiplier, state.angle):
        store(z, k, load(z, k) + where(active, load(x, k), filled(0.0)))
    return method.dq_da * largest


@inlined
def newton(structure, method, tolerance, values, now, work, alive):
    """Solve Eq. (27) at one time where `alive` is true; return two lanes, diverged and redundant.

    `diverged` is a mask; `redundant` holds a multiplier that was left out, or 0.

    A lane that has converged is frozen, so that no sample depends on its neighbours. The error
    that remains after a correction is estimated from the rate of convergence, stored in `rate`.
    """
    z, a, r, matrix, inverse_pivots, row, blocks, rate = work
    active, redundant, previous = alive, filled(0.0), filled(0.0)
    for iteration in range(ITERATIONS):
        residual(structure, values, now, z, r, blocks)
        if iteration % ITERATIONS_PER_FACTORIZATION == 0:
            weight, velocity_part = filled(method.dq_da), method.dv_da / method.dq_da
            tangent(structure, values, now, z, weight, velocity_part, matrix, blocks)
            left_out = factorize(structure.pattern, matrix, inverse_pivots, row)
            redundant = where(left_out, left_out, redundant)
        to_right_side(structure, r, method.dq_da)
        solve(structure.pattern, matrix, inverse_pivots, r)
        change = correct(structure, method, values, z, a, r, active)
        if iteration > 0:
            store(rate, 0, where(active, change / previous, load(rate, 0)))
        previous = change
        q = maximum(load(rate, 0), filled(1e-3))
        left = where(less(q, filled(0.9)), q / (1.0 - q) * change, 1e3 * change)
        active = where(less(left, filled(tolerance)), filled(0.0), active)
        if not any_true(active):
            break
    return active, redundant


@inlined
def march(structure, method, tolerance, values, work, outputs, failure, stop):
    """Simulate one block of samples from the state that `start` has filled, see `entries`."""
    state, z, a = structure.state, work.z, work.a
    store(work.rate, 0, filled(INITIAL_RATE))
    code = load(failure, 0)
    for i in range(1, state.coordinates + 1):
        store(a, i, load(z, state.acceleration + i))
    sense(structure, values, np.int64(0), z, outputs[0], work.blocks)
    alive = where(code, filled(0.0), filled(1.0))
    for n in range(1, outputs.shape[0]):
        if any_true(load(stop, 0)) or not any_true(alive):
            break
        now = n * structure.functions
        predict(structure, method, z, a)
        diverged, redundant = newton(structure, method, tolerance, values, now, work, alive)
        code, worst = diverged * DIVERGED, filled(0.0)
        if any_true(redundant):
            violated = violated_constraint(structure, values, now, z, work.r, REDUNDANT_TOLERANCE)
            worst = where(redundant, violated, filled(0.0))
            code = where(diverged, code, where(worst, filled(CONTRADICTED), filled(0.0)))
        new = where(alive, code, filled(0.0))
        store(failure, 0, load(failure, 0) + new)
        store(failure, 1, where(new, filled(float(n)), load(failure, 1)))
        blame = worst - float(state.multiplier)
        store(failure, 2, where(new, blame, load(failure, 2)))
        alive = where(new, filled(0.0), alive)
        sense(structure, values, now, z, outputs[n], work.blocks)
