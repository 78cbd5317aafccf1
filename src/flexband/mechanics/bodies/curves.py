"""Plane curves by their curvature κ of the length s along them: r′ = (cos θ, sin θ), θ′ = κ."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import cumulative_simpson
from scipy.interpolate import CubicSpline

from flexband.errors import InputError, finite

Path = Callable[[np.ndarray], ArrayLike] | Sequence[tuple[float, float]] | np.ndarray
"""A curve: a function that takes u, shape (m,), from 0 to 1 to points, shape (m, 2), or points
(m, 2) that a cubic spline is laid through."""

SAMPLES = 2001  # of a path
PANELS = 64  # of Simpson's rule between two nodes


class Curve(NamedTuple):
    """A curve by length, start, angle there [rad] and curvature [1/m] as a function of s [m]."""

    length: float
    start: tuple[float, float]
    angle: float
    curvature: Callable[[np.ndarray], np.ndarray]


def measured(path: Path) -> Curve:
    """Return a path by its curvature.

    Raises
    ------
    InputError
        Where it has no tangent somewhere, or is not made of points of the plane.
    """
    u = np.linspace(0.0, 1.0, SAMPLES)
    if callable(path):
        points = finite("path", path(u))
    else:
        knots = finite("path", path)
        if knots.ndim != 2 or knots.shape[1] != 2 or len(knots) < 3:
            raise InputError(f"path must be 3 points (X, Y) or more; got shape {knots.shape}")
        chord = np.append(0.0, np.cumsum(np.hypot(*np.diff(knots, axis=0).T)))
        if np.any(np.diff(chord) == 0):
            raise InputError("path must not hold a point twice in a row")
        points = CubicSpline(chord / chord[-1], knots)(u)
    if points.shape != (SAMPLES, 2):
        raise InputError(
            f"path must take u of shape ({SAMPLES},) to points of shape ({SAMPLES}, 2); "
            f"got shape {points.shape}"
        )
    spline = CubicSpline(u, points)
    x1, y1 = spline(u, 1).T
    speed = np.hypot(x1, y1)
    if speed.min() < 1e-9 * speed.max() or speed.max() == 0:
        raise InputError(f"path must go on everywhere; it stops at u = {u[speed.argmin()]:g}")
    s = cumulative_simpson(speed, x=u, initial=0)
    angle = np.unwrap(np.arctan2(y1, x1))
    return Curve(
        length=float(s[-1]),
        start=(float(points[0, 0]), float(points[0, 1])),
        angle=float(angle[0]),
        curvature=CubicSpline(s, angle).derivative(),
    )


def drawn(curvature: np.ndarray, step: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return x, y and θ, from 0, of a curve of these curvatures.

    Parameters
    ----------
    curvature : at equidistant s, shape (n, PANELS × nodes + 1).
    step : between them [m], shape (n, 1).

    Returns
    -------
    At the nodes, every `PANELS` steps, each of shape (n, nodes + 1).
    """
    angle = step * cumulative_simpson(curvature, axis=-1, initial=0)
    x, y = (step * cumulative_simpson(f(angle), axis=-1, initial=0) for f in (np.cos, np.sin))
    return x[:, ::PANELS], y[:, ::PANELS], angle[:, ::PANELS]
