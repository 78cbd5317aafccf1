"""Plane curves given by the curvature κ(s) over arc length: r′ = (cos θ, sin θ), θ′ = κ."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike

from flexband.basics.checks import check_finite
from flexband.basics.user_functions import evaluate_function
from flexband.errors import InputError

Path = Callable[[np.ndarray], ArrayLike] | Sequence[tuple[float, float]] | np.ndarray
"""A curve: a function that maps u, shape (m,), from 0 to 1 to points (X, Y) [m], shape (m, 2), or
an array of points, shape (m, 2), which a cubic spline interpolates."""


class Curve(NamedTuple):
    """A curve: length [m], start [m], angle at the start [rad] and curvature κ(s) [1/m]."""

    length: float
    start: tuple[float, float]
    angle: float
    curvature: Callable[[np.ndarray], np.ndarray]


def measure_path(path: Path) -> Curve:
    """Return the length, the start and the curvature of a path."""
    count = 2001
    u = np.linspace(0.0, 1.0, count)
    # Points of the path, by arguments from 0 to 1.
    if callable(path):
        points = check_finite("path", evaluate_function(path, u, "path"), rank=None)
    else:
        knots = check_finite("path", path, rank=None)
        if knots.ndim != 2 or knots.shape[1] != 2 or len(knots) < 3:
            raise InputError(f"path must have shape (m, 2), m ≥ 3; got shape {knots.shape}")
        chord = np.append(0.0, np.cumsum(np.hypot(*np.diff(knots, axis=0).T)))
        if np.any(np.diff(chord) == 0):
            k = int(np.argmin(np.diff(chord)))
            raise InputError(f"path must not repeat a point; points {k} and {k + 1} are {knots[k]}")
        points = scipy.interpolate.CubicSpline(chord / chord[-1], knots)(u)
    if points.shape != (count, 2):
        raise InputError(
            f"path must map u of shape ({count},) to points of shape ({count}, 2); "
            f"got shape {points.shape}"
        )
    # Its tangents, which must not vanish.
    spline = scipy.interpolate.CubicSpline(u, points)
    x1, y1 = spline(u, 1).T
    speed = np.hypot(x1, y1)
    if speed.min() < 1e-9 * speed.max() or speed.max() == 0:
        where = f"u = {u[speed.argmin()]:g}"
        raise InputError(f"path must have a tangent everywhere; got a zero derivative at {where}")
    # The angle as a function of the length.
    s = scipy.integrate.cumulative_simpson(speed, x=u, initial=0)
    angle = np.unwrap(np.arctan2(y1, x1))
    start = (float(points[0, 0]), float(points[0, 1]))
    return Curve(
        float(s[-1]), start, float(angle[0]), scipy.interpolate.CubicSpline(s, angle).derivative()
    )


def drawn(
    curvature: np.ndarray, step: np.ndarray, places: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Integrate a curvature [1/m], at `places` in units of a step [m], to x, y [m] and θ [rad]."""
    angle = step * scipy.integrate.cumulative_simpson(curvature, x=places, axis=-1, initial=0)
    x, y = (
        step * scipy.integrate.cumulative_simpson(f(angle), x=places, axis=-1, initial=0)
        for f in (np.cos, np.sin)
    )
    return x, y, angle


def arc(curvature: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return x [m], y [m] and θ [rad] at places s [m] along an arc of curvature (n or 1, 1)."""
    half = curvature * s / 2
    chord = s * np.sinc(half / np.pi)
    return chord * np.cos(half), chord * np.sin(half), 2 * half
