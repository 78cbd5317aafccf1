"""Oscillating formulas and traps, functions of a normal x, an e in [−1, 1] and time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr

import flexband as fb
from benchmarks.accuracy.references import Case, bands, moments, normal_rule

TAU = 2 * np.pi
TIMES = np.arange(1001) * 0.02  # twenty periods of 1 Hz
FORMULA_INPUTS = {"x": fb.Normal(0.0, 1.0), "e": fb.Interval(-1.0, 1.0)}
SMOOTH = (64, 201)
BROKEN = (700, 51)
"""Numbers of points x and e in the reference. For every e, jumps and kinks in x lie halfway between
points x, because the steps are 0.02 in x and 0.04 in e."""


def formula(f: Callable[..., np.ndarray], highest: int = 2, *, every: int = 1) -> Case:
    """Return the case of f(x, e, t) over twenty periods.

    With `every` = 2 the reference has every other e only, which changes it by 10⁻⁵ of its size at
    most.
    """
    x_count, e_count = BROKEN if f in (bifurcation, kink, slow_kink) else SMOOTH
    points = x_count, (e_count - 1) // every + 1

    def response(x, e):
        values = f(x[:, None], e[:, None], TIMES)
        return xr.DataArray(values, dims=("sample", "time"), coords={"time": TIMES})

    def reference() -> xr.Dataset:
        x, weights = normal_rule(points[0])
        moment_pairs = [
            moments(weights, f(x[:, None], np.full((1, 1), e), TIMES))
            for e in np.linspace(-1, 1, points[1])
        ]
        mean, variance = (np.stack(v) for v in zip(*moment_pairs, strict=True))
        return bands(mean, variance, points[1:], ("bound", "time"), {})

    orders = [({"x": k}, {"e": 1}) for k in range(1, highest + 1)]
    return Case(response, FORMULA_INPUTS, orders, reference)


def wave(x, e, t):
    return np.cos(TAU * (1 + 0.05 * e + 0.02 * x) * t)


def damped_oscillation(x, e, t):
    w = TAU * (1 + 0.05 * x)
    zeta = 0.03 + 0.02 * e
    return np.exp(-zeta * w * t) * np.cos(w * np.sqrt(1 - zeta**2) * t)


def two_carriers(x, e, t):
    second = np.cos(TAU * (4 + 0.06 * e + 0.04 * x) * t)
    return 0.2 * t + np.cos(TAU * (1 + 0.02 * x) * t) + 0.5 * second


def fading_carrier(x, e, t):
    return np.cos(TAU * t / 10) * np.cos(TAU * (1 + 0.02 * x + 0.02 * e) * t)


def slow_decay(x, e, t):
    """Decay without oscillation."""
    return (1 + 0.1 * x + 0.2 * e) * np.exp(-0.1 * (1 + 0.1 * x - 0.2 * e) * t)


def chirp(x, e, t):
    return np.cos(TAU * (1 + 0.02 * x + 0.02 * e) * (t + 0.05 * t * t))


def bifurcation(x, e, t):
    side = np.where(x > 0.5 * e + 0.3, 1.0, -1.0)
    return side * (1 - np.exp(-0.5 * t)) + 0.5 * np.cos(TAU * (1 + 0.02 * x) * t)


def beating(x, e, t):
    return np.cos(TAU * (1 + 0.02 * x) * t) + 0.8 * np.cos(TAU * (1.1 + 0.02 * e) * t)


def interior(x, e, t):
    return (1 - (e - 0.3) ** 2) * (0.5 + np.cos(TAU * (1 + 0.02 * x + 0.03 * e**2) * t))


def kink(x, e, t):
    """Oscillate next to a stop that is touched for some inputs only."""
    touch = np.abs(x + e - 0.2) * (1 - np.exp(-0.5 * t))
    return touch + 0.5 * np.cos(TAU * (1 + 0.02 * x) * t)


def slow_kink(x, e, t):
    """Touch a stop for some inputs only, without oscillation."""
    return np.abs(x + e - 0.2) * (1 - np.exp(-0.5 * t))


def pulse(x, e, t):
    """Pulse whose time of arrival depends on the inputs."""
    return np.exp(-(((t - 10 - 0.6 * x - 0.8 * e) / 0.4) ** 2))


def onset(x, e, t):
    """Step whose time of arrival depends on the inputs."""
    return (1 + np.tanh((t - 8 - 0.6 * x - 0.8 * e) / 0.3)) / 2
