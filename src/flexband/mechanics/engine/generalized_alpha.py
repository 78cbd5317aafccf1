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

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_numbers, check_positive
from flexband.basics.warning import warn
from flexband.errors import InputError
from flexband.mechanics.kernels.lanes import (
    compiled,
)
from flexband.mechanics.kernels.state import State


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
