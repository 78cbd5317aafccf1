"""The cheapest tolerances that keep margins: an exchange of the points where they are watched.

Margins are required at a few points only. The cheapest tolerances for these are found, and the
points come in where margins then are negative somewhere in the box, until there are none
(Blankenship and Falk, 1976). Each problem leaves requirements out, so its solution costs no more
than the tolerances that are sought.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize, nnls

from flexband.analysis.allocation.problem import Problem
from flexband.analysis.allocation.sizes import starts
from flexband.analysis.allocation.tolerances import STEP
from flexband.analysis.allocation.worst_case import WatchedPlaces, WorstCase
from flexband.errors import InputError

ROUNDS = 60
"""Most exchanges."""

SLACK = 1e-7
"""Part of the scale by which limits are tightened in the search, so that they are kept."""

WATCHED = 0.05
"""Part of the least margin of the least tolerances below which margins are watched."""

RETRIES = 2
"""Times that random starts are tried."""

SHIFTS = 33
"""Ratios that are tried to make tolerances tighter."""

STARTS = 4
"""Random starts of a search, besides the best tolerances so far."""

MIN_SAVING = 1e-6
"""Part of the cost that is worth going on for."""

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
    watched : all points of the search, for another one that is similar.
    """

    x: np.ndarray
    margins: np.ndarray
    points: WatchedPlaces
    gradients: np.ndarray
    multipliers: np.ndarray
    watched: WatchedPlaces


def cheapest(worst: WorstCase, points: WatchedPlaces, x: np.ndarray | None = None) -> Allocated:
    """Return the cheapest tolerances that keep all margins of a box.

    When no margin is negative any more, a search without a start is tried again from random ones,
    with the points that were found; it goes on if one of them leads to less.

    Parameters
    ----------
    points : where margins are required from the beginning.
    x : where the search starts; if it is not given, at tolerances in the ratio of the largest.
    """
    strict, tolerances = worst.tightened(SLACK * worst.scale), worst.tolerances
    first, others = (x, []) if x is not None else _starts(strict)
    watched = WATCHED * float(
        (strict.least(tolerances.tighter(first, np.inf))[0] / worst.scale).min()
    )
    x, points = (first, points) if x is None else _solved(strict, points, first)
    best, least, step = x, np.inf, STEP
    for _ in range(ROUNDS):
        margins, places = strict.least(x)
        violated = np.any(margins < -0.5 * SLACK * worst.scale)
        before = len(points)
        if violated or not before:
            most = watched + max(0.0, float((margins / worst.scale).min()))
            new = strict.lowest(margins, places, most)
            if tolerances.compensators:
                new = strict.at_places(x, new, most)
            points = points.with_new(new, list(tolerances.compensators.values()))
        if len(points) > before:
            solution = _solved(strict, points, x)
            if (
                tolerances.sizes and _rank(strict, *solution)[0]
            ):  # sizes at which nothing keeps the margins
                solution = _best_of(strict, points, [first, *others])
            (x, points), step = solution, STEP
            continue
        if violated:  # by hardly anything, at points that are watched
            x, step = tolerances.tighter(x, step), 2 * step
            continue
        if (cost := tolerances.cost(x).sum()) < least:
            best, least = x, cost
        if not len(points) or not others:
            break
        count = len(others) if tolerances.sizes else STARTS
        tried, others = others[:count], others[count:]
        x, points = _best_of(strict, points, tried)
        if tolerances.cost(x).sum() > least - MIN_SAVING * abs(least):
            break
    if np.isinf(least):
        raise InputError(f"limits: no tolerances that keep them were found in {ROUNDS} rounds")
    return allocated(worst, best, points)


def _starts(worst: WorstCase) -> tuple[np.ndarray, list[np.ndarray]]:
    """Return where a search starts, and where it is tried again.

    The first are tolerances in the ratio of the largest that about keep all margins.
    """
    tolerances, (low, high) = worst.tolerances, worst.tolerances.bounds
    first, *others = starts(worst) if tolerances.sizes else [high]
    rng = np.random.default_rng(0)
    if not tolerances.sizes:
        others = list(rng.uniform(np.maximum(low, -3.0), high, (RETRIES * STARTS, len(high))))
    loosest = tolerances.looser(first)
    room, margins = (worst.least(at)[0] for at in (tolerances.tighter(first, np.inf), loosest))
    with np.errstate(invalid="ignore", divide="ignore"):
        part = np.where(margins < 0, room / (room - margins), 1.0).min()
    start = tolerances.tighter(loosest, -np.log(max(part, 1e-300)))
    return start, [start, *others] if tolerances.sizes else others


def _solved(
    worst: WorstCase, points: WatchedPlaces, x: np.ndarray
) -> tuple[np.ndarray, WatchedPlaces]:
    """Return the cheapest tolerances that keep the margins at some points, and these adjusted.

    The search starts at tolerances that keep them, and so does what it returns, in any case.
    """
    problem, count = Problem(worst, points), len(x)
    low, high = problem.bounds
    scale, reference = worst.scale[points.series], abs(worst.tolerances.cost(x)).sum() or 1.0
    still = np.zeros(len(low) - count)

    def cost(v: np.ndarray) -> float:
        return worst.tolerances.cost(v[:count]).sum()

    start = np.concatenate([x, problem.adjusted])
    first = np.concatenate([_kept(worst, problem.split(start)[1], x), problem.adjusted])
    solution: Any = minimize(
        lambda v: cost(v) / reference,
        start if len(still) else first,
        jac=lambda v: np.append(worst.tolerances.cost_gradient(v[:count]), still) / reference,
        bounds=list(zip(low, high, strict=True)),
        constraints={
            "type": "ineq",
            "fun": lambda v: problem.margins(v) / scale,
            "jac": lambda v: problem.derivatives(v) / scale[:, None],
        },
        method="SLSQP",
        options={"maxiter": 200, "ftol": 1e-12},
    )
    last, adjusted = problem.split(np.clip(solution.x, low, high))
    last = _kept(worst, adjusted, last)
    return min((last, adjusted), problem.split(first), key=lambda pair: _rank(worst, *pair))


def _best_of(
    worst: WorstCase, points: WatchedPlaces, starts: Sequence[np.ndarray]
) -> tuple[np.ndarray, WatchedPlaces]:
    """Return the best of what searches from several starts find."""
    solutions = (_solved(worst, points, start) for start in starts)
    return min(solutions, key=lambda pair: _rank(worst, *pair))


def _rank(worst: WorstCase, x: np.ndarray, points: WatchedPlaces) -> tuple[bool, float]:
    """Return whether tolerances violate margins, which the least may do, and their cost."""
    margins = worst.values(x[None], points)[0]
    violated = bool(np.any(margins < -2 * SLACK * worst.scale[points.series]))
    return violated, float(worst.tolerances.cost(x).sum())


def _kept(worst: WorstCase, points: WatchedPlaces, x: np.ndarray) -> np.ndarray:
    """Return tolerances in the ratio of x, and hardly tighter than need be, that keep margins."""
    tolerances = worst.tolerances
    tighter, looser = 0.0, 0.0
    for k in range(2):  # the second time between the best two of the first
        most = (x - tolerances.tighter(x, np.inf)).max() if k == 0 else tighter
        shifts = np.linspace(looser, most, SHIFTS)
        tried = tolerances.tighter(x, shifts[:, None])
        margins = (worst.values(tried, points) / worst.scale[points.series]).min(axis=1)
        enough = np.flatnonzero(margins > -SLACK)
        first = int(enough[0]) if len(enough) else SHIFTS - 1
        if first == 0:
            return tried[0]
        looser, tighter = shifts[first - 1], shifts[first]
    return tolerances.tighter(x, tighter)


def allocated(
    worst: WorstCase, x: np.ndarray, watched: WatchedPlaces, *, with_multipliers: bool = True
) -> Allocated:
    """Return tolerances with what limits them."""
    margins, places = worst.least(x)
    least = (margins / worst.scale).min()
    points = worst.lowest(margins, places, max(BINDING, least + BINDING))
    problem = Problem(worst, points)
    v = np.concatenate([x, problem.adjusted])
    gradients = problem.derivatives(v)
    multipliers = np.full(len(points), 0.0 if with_multipliers else np.nan)
    if with_multipliers and least < BINDING:
        cost = np.append(worst.tolerances.cost_gradient(x), np.zeros(len(v) - len(x)))
        multipliers = _multipliers(problem.bounds, v, cost, gradients)
    return Allocated(x, margins, points, gradients[:, : len(x)], multipliers, watched)


def _multipliers(
    bounds: tuple[np.ndarray, np.ndarray], v: np.ndarray, cost: np.ndarray, gradients: np.ndarray
) -> np.ndarray:
    """Return the multipliers of margins: λ ≥ 0 with ∇cost = Σ λ ∇margin, but for bounds of v."""
    low, high = bounds
    at_bounds = np.eye(len(v))[v < low + STEP], -np.eye(len(v))[v > high - STEP]
    columns = np.concatenate([gradients, *at_bounds]).T
    if not columns.size:  # which `nnls` does not survive
        return np.zeros(0)
    size = np.maximum(np.abs(columns).max(axis=0, initial=0), 1e-300)
    multipliers, _ = nnls(columns / size, cost)
    return (multipliers / size)[: len(gradients)]
