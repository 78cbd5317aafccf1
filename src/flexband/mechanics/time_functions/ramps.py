"""Smooth ramps of time, with exact integrals, and functions whose time starts along one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.checks import check_finite, check_positive
from flexband.mechanics.kernels.forms import Composed, TimeFunction, during_impulse


@dataclass(frozen=True, eq=False)
class Ramp:
    """A function of time that rises smoothly from zero, see `ramp`."""

    to: np.ndarray
    duration: np.ndarray

    def __call__(self, time: ArrayLike) -> np.ndarray:
        """Return 10 s³ − 15 s⁴ + 6 s⁵ of the final value, with s = t / duration from 0 to 1."""
        s = np.clip(time / self.duration, 0.0, 1.0)
        return self.to * s**3 * (10.0 + s * (6.0 * s - 15.0))

    def integral(self, time: ArrayLike) -> np.ndarray:
        """Return the integral from time zero on, such as the angle of a drive of this speed."""
        s = np.clip(time / self.duration, 0.0, 1.0)
        after = np.maximum(time - self.duration, 0.0)
        return self.to * (self.duration * s**4 * (2.5 + s * (s - 3.0)) + after)


def ramp(to: ArrayLike, duration: ArrayLike) -> Ramp:
    """Return a function of time that rises smoothly from 0 to a value, and stays there.

    Its first two derivatives are continuous. Its method `integral` is the function ∫₀ᵗ, with three:
    a drive whose speed rises so starts without a jolt, and vibrations are hardly excited if the
    ramp takes more than two of their periods.

    Parameters
    ----------
    to : final value, a number or an array of shape (n,).
    duration : time of the rise from t = 0 on [s], positive, a number or an array of shape (n,).

    Raises
    ------
    InputError
        If a number is not finite, or a duration is not positive.

    Examples
    --------
    >>> speed = fb.ramp(to=2 * np.pi, duration=0.5)  # one turn per second
    >>> [round(float(speed(t)) / (2 * np.pi), 3) for t in (0.0, 0.25, 0.5, 2.0)]
    [0.0, 0.5, 1.0, 1.0]
    >>> motor = fb.PrescribedRotation("crank", speed.integral)
    >>> round(float(motor.angle(1.25)) / (2 * np.pi), 3)  # half the duration later than without
    1.0
    """
    length = check_positive("ramp duration [s]", check_finite("ramp duration [s]", duration))
    return Ramp(check_finite("ramp to", to), np.asarray(length, dtype=float))


class Slowed:
    """The function f(τ(t)) of time, where τ̇ is a ramp from 0 to 1."""

    def __init__(self, function: TimeFunction, pace: Ramp):
        self.function = function
        self.pace = pace

    def __call__(self, time: float) -> np.ndarray:
        return np.asarray(self.function(self.pace.integral(time)))  # pyright: ignore


def slow_functions(functions: Sequence[TimeFunction], duration: float) -> list[TimeFunction]:
    """Return functions that start at rest and lag by half the duration [s] in the end."""
    pace = ramp(1.0, duration)

    def slow_down(function: TimeFunction) -> TimeFunction:
        if isinstance(function, Composed):
            return replace(function, inner=Slowed(function.inner, pace))
        return function if function is during_impulse else Slowed(function, pace)

    motions: dict[TimeFunction, TimeFunction] = {}
    return [motions.setdefault(function, slow_down(function)) for function in functions]
