"""Scripts of Exudyn, rebuilt from the public interface of flexband.

A function builds one of Exudyn's planar scripts and returns its number for an array of values of
one parameter. It is called with the script's value and with one that is 1 % larger: the first
result must agree with Exudyn's number, the second must not.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

import flexband as fb

Solve = Callable[[np.ndarray], np.ndarray]
REBUILT: list[RebuiltScript] = []


@dataclass(frozen=True)
class RebuiltScript:
    """A script, its number by Exudyn, and how far flexband's may be from it.

    Exudyn's number is that of steps and meshes so fine that it has converged. The `value` is that
    of the parameter of `solve`.
    """

    script: str
    quantity: str
    exudyn: float
    tolerance: float
    value: float
    solve: Solve

    @cached_property
    def numbers(self) -> tuple[float, float]:
        """Flexband's number, and the one with the parameter 1 % larger."""
        right, wrong = np.ravel(self.solve(self.value * np.array([1.0, 1.01])))
        return float(right), float(wrong)

    @property
    def differences(self) -> tuple[float, float]:
        """How far both are from Exudyn's number."""
        right, wrong = (abs(number - self.exudyn) for number in self.numbers)
        return right, wrong

    @property
    def digits(self) -> int:
        """How many digits agree, at most 12."""
        return int(-math.log10(max(self.differences[0] / abs(self.exudyn), 1e-12)))

    @property
    def holds(self) -> bool:
        """Whether the number agrees, and the one with a wrong parameter does not."""
        right, wrong = self.differences
        return right <= self.tolerance < wrong


def register_script(script: str, quantity: str, **numbers: float) -> Callable[[Solve], Solve]:
    """Register a function as that of a script; the numbers are fields of `RebuiltScript`."""

    def register(solve: Solve) -> Solve:
        REBUILT.append(RebuiltScript(script, quantity, solve=solve, **numbers))
        return solve

    return register


def at_end(model: fb.Mechanism, duration: float, step: float, **options) -> np.ndarray:
    """Return the model's only output at the end of a motion."""
    integrator = fb.GeneralizedAlpha(spectral_radius=0.9)
    motion = fb.simulate(
        model, duration=duration, step=step, **{"integrator": integrator} | options
    )
    return motion.values[..., -1]
