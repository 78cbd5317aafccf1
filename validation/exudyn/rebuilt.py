"""Scripts of Exudyn, rebuilt from the public interface of flexband.

Each function builds one of Exudyn's planar scripts and returns its number for an array of values of one of its
parameters. It is called with the script's value and with one that is 1 % larger: the first result must agree with
Exudyn's number, the second must not.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

import flexband as fb

Solve = Callable[[np.ndarray], np.ndarray]
REBUILT: list[Rebuilt] = []


class Rebuilt(NamedTuple):
    """A script, its number by Exudyn with steps and meshes so fine that it has converged, and how far
    flexband's may be from it; `value` is that of the only parameter of `solve`."""

    script: str
    quantity: str
    exudyn: float
    tolerance: float
    value: float
    solve: Solve

    def numbers(self) -> tuple[float, float]:
        """Return flexband's number, and the one with the parameter 1 % larger."""
        right, wrong = np.ravel(self.solve(self.value * np.array([1.0, 1.01])))
        return float(right), float(wrong)

    def digits(self, number: float) -> float:
        """Return the number of digits that agree, at most 12."""
        relative = abs(number - self.exudyn) / abs(self.exudyn)
        return -math.log10(max(relative, 1e-12))


def rebuilt(script: str, quantity: str, **numbers: float) -> Callable[[Solve], Solve]:
    """Register a function as that of a script; the numbers are fields of `Rebuilt`."""

    def register(solve: Solve) -> Solve:
        REBUILT.append(Rebuilt(script, quantity, solve=solve, **numbers))
        return solve

    return register


def at_end(model: fb.Mechanism, duration: float, step: float, **options) -> np.ndarray:
    """Return the model's only output at the end of a motion."""
    integrator = fb.GeneralizedAlpha(spectral_radius=0.9)
    motion = fb.simulate(model, duration=duration, step=step, **{"integrator": integrator} | options)
    return motion.values[..., -1]
