"""Functions of time whose time itself starts softly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flexband.mechanics.kernels.forms import Composed, TimeFunction, during_impulse
from flexband.mechanics.time_functions.ramps import Ramp, ramp


class Slowed:
    """The function f(τ(t)) of time, where τ̇ is a ramp from 0 to 1."""

    def __init__(self, function: TimeFunction, pace: Ramp):
        self.function, self.pace = function, pace

    def __call__(self, time: float) -> np.ndarray:
        return np.asarray(self.function(self.pace.integral(time)))  # pyright: ignore


def slowed(functions: Sequence[TimeFunction], duration: float) -> list[TimeFunction]:
    """Return functions that start at rest and lag by half the duration [s] in the end."""
    pace = ramp(1.0, duration)

    def of(function: TimeFunction) -> TimeFunction:
        if isinstance(function, Composed):
            return replace(function, inner=Slowed(function.inner, pace))
        return function if function is during_impulse else Slowed(function, pace)

    motions: dict[TimeFunction, TimeFunction] = {}
    return [motions.setdefault(function, of(function)) for function in functions]
