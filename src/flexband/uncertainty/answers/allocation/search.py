"""The cheapest tolerances that keep margins: an exchange of the points where they are watched.

Margins are required at a few points only. The cheapest tolerances for these are found, and the
points come in where margins then are negative somewhere in the box, until there are none
(Blankenship and Falk, 1976). Each problem leaves requirements out, so its solution costs no more
than the tolerances that are sought.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize, nnls

from flexband.errors import InputError
from flexband.uncertainty.answers.allocation.tolerances import STEP
from flexband.uncertainty.answers.allocation.worst_case import Points, WorstCase

ROUNDS = 60
"""Most exchanges."""

SLACK = 1e-7
"""Part of the scale by which limits are tightened in the search, so that they are kept."""

STARTS = 4
"""Random starts of a search, besides the best tolerances so far."""

BINDING = 1e-4
"""Margins below this part of their scale are binding."""


@dataclass(frozen=True, eq=False)
class Allocated:
    """Tolerances, and where they are limited.

    Attributes
    ----------
    x : the search's variables, (names,).
    margins : least margins in the box, (2, series).
    points : the binding ones; those of the least margins if none is.
    gradients : derivatives of the margins at these by x, (points, names).
    multipliers : by how much cost falls per unit of each of these margins, (points,); NaN for
        grades.
    """

    x: np.ndarray
    margins: np.ndarray
    points: Points
    gradients: np.ndarray
    multipliers: np.ndarray


def cheapest(worst: WorstCase, points: Points, x: np.ndarray | None = None) -> Allocated:
    """Return the cheapest tolerances that keep all margins of a box.

    Parameters
    ----------
    points : where margins are required from the beginning.
    x : where the search starts; at the largest tolerances if it is not given.
    """
    strict = worst.tightened(SLACK * worst.scale)
    rng = np.random.default_rng(0)
    x = worst.tolerances.bounds[1] if x is None else x
    for _ in range(ROUNDS):
        if len(points):
            x = _solved(strict, points, x, rng)
        margins, places = strict.least(x)
        violated = strict.lowest(margins, places, -0.5 * SLACK)
        before, points = len(points), points.with_new(violated)
        if len(points) == before:
            return allocated(worst, x)
    raise InputError(f"limits: no tolerances that keep them were found in {ROUNDS} rounds")


def _solved(
    worst: WorstCase, points: Points, x: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """Return the cheapest tolerances that keep the margins at some points."""
    low, high = worst.tolerances.bounds
    scale, reference = worst.scale[points.series], abs(worst.tolerances.cost(x)).sum() or 1.0
    starts = [x, *rng.uniform(np.maximum(low, -3.0), high, (STARTS, len(x)))]

    def margins(at: np.ndarray) -> np.ndarray:
        return worst.values(at[None], points)[0] / scale

    best, least = x, np.inf
    for start in starts:
        found: Any = minimize(
            lambda at: worst.tolerances.cost(at).sum() / reference,
            start,
            jac=lambda at: worst.tolerances.cost_gradient(at) / reference,
            bounds=list(zip(low, high, strict=True)),
            constraints={
                "type": "ineq",
                "fun": margins,
                "jac": lambda at: derivatives(worst, at, points) / scale[:, None],
            },
            method="SLSQP",
            options={"maxiter": 200, "ftol": 1e-12},
        )
        at = np.clip(found.x, low, high)
        if np.all(margins(at) > -1e-7) and found.fun < least:
            best, least = at, found.fun
    return best


def derivatives(worst: WorstCase, x: np.ndarray, points: Points) -> np.ndarray:
    """Return the derivatives of margins at points by x, (points, names)."""
    up = np.minimum(x + STEP * np.eye(len(x)), worst.tolerances.bounds[1])
    down = x - STEP * np.eye(len(x))
    after, before = np.split(worst.values(np.concatenate([up, down]), points), 2)
    return ((after - before) / np.diag(up - down)[:, None]).T


def allocated(worst: WorstCase, x: np.ndarray, *, with_multipliers: bool = True) -> Allocated:
    """Return tolerances with what limits them."""
    margins, places = worst.least(x)
    least = (margins / worst.scale).min()
    points = worst.lowest(margins, places, max(BINDING, least + BINDING))
    gradients = derivatives(worst, x, points)
    multipliers = np.full(len(points), 0.0 if with_multipliers else np.nan)
    if with_multipliers and least < BINDING:
        multipliers = _multipliers(worst, x, gradients)
    return Allocated(x, margins, points, gradients, multipliers)


def _multipliers(worst: WorstCase, x: np.ndarray, gradients: np.ndarray) -> np.ndarray:
    """Return the multipliers of margins: λ ≥ 0 with ∇cost = Σ λ ∇margin, but for bounds of x."""
    low, high = worst.tolerances.bounds
    at_bounds = np.eye(len(x))[x < low + STEP], -np.eye(len(x))[x > high - STEP]
    columns = np.concatenate([gradients, *at_bounds]).T
    if not columns.size:  # which `nnls` does not survive
        return np.zeros(0)
    size = np.maximum(np.abs(columns).max(axis=0, initial=0), 1e-300)
    found, _ = nnls(columns / size, worst.tolerances.cost_gradient(x))
    return (found / size)[: len(gradients)]
