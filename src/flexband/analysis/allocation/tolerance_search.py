"""The cheapest tolerances that keep margins: an exchange of the points where they are watched.

Margins are required at a few points only. The cheapest tolerances for these are found, and the
points come in where margins then are negative somewhere in the box, until there are none
(Blankenship and Falk, 1976). Each problem leaves requirements out, so its solution costs no more
than the tolerances that are sought.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy

from flexband.analysis.allocation.sizes import starts
from flexband.analysis.allocation.tolerances import STEP
from flexband.analysis.allocation.worst_case import WatchedPlaces, WorstCaseBounds
from flexband.errors import InputError


@dataclass(frozen=True)
class AllocationOptions:
    """How the cheapest tolerances are searched."""

    max_rounds: int = 60
    """Most exchanges."""
    slack: float = 1e-7
    """Part of the scale by which limits are tightened, so that they are kept."""
    watched_share: float = 0.05
    """Part of the least tolerances' least margin below which margins are watched."""
    random_starts: int = 4
    """Random starts of a search, besides the best tolerances so far."""
    retries: int = 2
    """Times that random starts are tried."""
    min_saving: float = 1e-6
    """Part of the cost that is worth going on for."""
    tried_ratios: int = 33
    """Ratios that are tried to make tolerances tighter."""
    binding: float = 1e-4
    """Part of the scale below which margins bind."""


@dataclass(frozen=True, eq=False)
class Allocated:
    """Tolerances, and where they are limited."""

    x: np.ndarray  # the search's variables, (names,)
    margins: np.ndarray  # least margins in the box, (2, series)
    points: WatchedPlaces  # the binding ones; those of the least margins if none is
    gradients: np.ndarray  # derivatives of the margins at these by x, (points, names)
    multipliers: np.ndarray  # fall of cost per unit of these margins, (points,); NaN for grades
    watched: WatchedPlaces  # all points of the search, for another one that is similar
    binding: bool  # whether any margin binds


Solution = tuple[np.ndarray, WatchedPlaces]
"""Tolerances, and the points with the best compensators."""


@dataclass(frozen=True, eq=False)
class Problem:
    """Margins that have to be kept at some points, as functions of tolerances and sizes.

    Its variables are those of the search, x, and then the compensators of one place after the
    other, which all margins there share.
    """

    worst: WorstCaseBounds
    points: WatchedPlaces

    @cached_property
    def columns(self) -> list[int]:
        """The numbers of the compensators among η."""
        return list(self.worst.tolerances.compensators.values())

    @cached_property
    def owner(self) -> np.ndarray:
        """The number of each point's place, (points,)."""
        keys = self.points.keys(self.columns)[:, 2:]
        return np.unique(keys, axis=0, return_inverse=True)[1].ravel()

    @property
    def compensator_values(self) -> np.ndarray:
        """The latest values of the compensators at all places, (places × compensators,)."""
        if not self.columns or not len(self.points):
            return np.zeros(0)
        compensators = np.zeros((self.owner.max() + 1, len(self.columns)))
        compensators[self.owner] = self.points.places[:, self.columns]
        return compensators.ravel()

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """The least and the largest values of all variables."""
        low, high = self.worst.tolerances.bounds
        reach = np.ones(len(self.compensator_values))
        return np.concatenate([low, -reach]), np.concatenate([high, reach])

    def split(self, v: np.ndarray) -> tuple[np.ndarray, WatchedPlaces]:
        """Return the variables of the search, and the points with the compensators of v."""
        count = len(self.worst.tolerances.bounds[0])
        if not self.columns:
            return v, self.points
        places = self.points.places.copy()
        places[:, self.columns] = v[count:].reshape(-1, len(self.columns))[self.owner]
        return v[:count], replace(self.points, places=places)

    def margins(self, v: np.ndarray) -> np.ndarray:
        """Return the margins, (points,)."""
        x, points = self.split(v)
        return self.worst.values(x[None], points)[0]

    def derivatives(self, v: np.ndarray) -> np.ndarray:
        """Return the derivatives of the margins by all variables, (points, variables)."""
        x, points = self.split(v)
        steps = STEP * np.eye(len(x))
        up = np.minimum(x + steps, self.worst.tolerances.bounds[1])
        down = x - steps
        after, before = np.split(self.worst.values(np.concatenate([up, down]), points), 2)
        by_x = ((after - before) / np.diag(up - down)[:, None]).T
        by_adjusted = np.zeros((len(points), len(v) - len(x)))
        rows = np.arange(len(points))
        for k, column in enumerate(self.columns):
            ends = []
            for sign in (1.0, -1.0):
                places = points.places.copy()
                places[:, column] += sign * STEP
                ends.append(self.worst.values(x[None], replace(points, places=places))[0])
            slope = (ends[0] - ends[1]) / (2 * STEP)
            by_adjusted[rows, self.owner * len(self.columns) + k] = slope
        return np.concatenate([by_x, by_adjusted], axis=1)


def cheapest(
    worst: WorstCaseBounds,
    points: WatchedPlaces,
    x: np.ndarray | None = None,
    *,
    options: AllocationOptions = AllocationOptions(),
) -> Allocated:
    """Return the cheapest tolerances that keep all margins of a box.

    When no margin is negative any more, a search without a start is tried again from random ones,
    with the points that were found; it goes on if one of them leads to less. Margins are required
    at `points` from the beginning. Without a start x, tolerances are in the ratio of the largest.
    """
    slack = options.slack
    tolerances = worst.tolerances
    strict = worst.tighten_limits(slack * worst.scale)
    search = _Search(strict, options)
    first, other_starts = (x, []) if x is not None else search.starts()
    room = strict.least_margins(tolerances.tighter(first, np.inf))[0] / worst.scale
    watch_margin = options.watched_share * float(room.min())
    x, points = (first, points) if x is None else search.solve(points, first)
    best = x
    lowest_cost = np.inf
    step = STEP
    for _ in range(options.max_rounds):
        margins, places = strict.least_margins(x)
        violated = np.any(margins < -0.5 * slack * worst.scale)
        before = len(points)
        if violated or not before:
            threshold = watch_margin + max(0.0, float((margins / worst.scale).min()))
            new_points = strict.lowest(margins, places, threshold)
            if tolerances.compensators:
                new_points = strict.at_places(x, new_points, threshold)
            points = points.with_new(new_points, list(tolerances.compensators.values()))
        if len(points) > before:
            solution = search.solve(points, x)
            # there may be sizes at which nothing keeps the margins
            if tolerances.sizes and search.rank(solution)[0]:
                solution = search.best_of(points, [first, *other_starts])
            (x, points), step = solution, STEP
            continue
        if violated:  # by hardly anything, at points that are watched
            x = tolerances.tighter(x, step)
            step = 2 * step
            continue
        if (cost := tolerances.cost(x).sum()) < lowest_cost:
            best = x
            lowest_cost = cost
        if not len(points) or not other_starts:
            break
        count = len(other_starts) if tolerances.sizes else options.random_starts
        trial_starts = other_starts[:count]
        other_starts = other_starts[count:]
        x, points = search.best_of(points, trial_starts)
        if tolerances.cost(x).sum() > lowest_cost - options.min_saving * abs(lowest_cost):
            break
    if np.isinf(lowest_cost):
        raise InputError(
            f"requirements: no tolerances that meet them were found in {options.max_rounds} rounds"
        )
    return with_binding_places(worst, best, points, options=options)


@dataclass(frozen=True, eq=False)
class _Search:
    """A search for the cheapest tolerances that keep margins."""

    worst: WorstCaseBounds
    options: AllocationOptions

    def starts(self) -> tuple[np.ndarray, list[np.ndarray]]:
        """Return where a search starts, and where it is tried again.

        The first are tolerances in the ratio of the largest that about keep all margins.
        """
        worst = self.worst
        tolerances = self.worst.tolerances
        low, high = tolerances.bounds
        first, *other_starts = starts(worst) if tolerances.sizes else [high]
        if not tolerances.sizes:
            rng = np.random.default_rng(0)
            count = self.options.retries * self.options.random_starts
            other_starts = list(rng.uniform(np.maximum(low, -3.0), high, (count, len(high))))
        loosest = tolerances.looser(first)
        room, margins = (
            worst.least_margins(at)[0] for at in (tolerances.tighter(first, np.inf), loosest)
        )
        with np.errstate(invalid="ignore", divide="ignore"):
            part = np.where(margins < 0, room / (room - margins), 1.0).min()
        start = tolerances.tighter(loosest, -np.log(max(part, 1e-300)))
        return start, [start, *other_starts] if tolerances.sizes else other_starts

    def solve(self, points: WatchedPlaces, x: np.ndarray) -> Solution:
        """Return the cheapest tolerances that keep the margins at some points, and these adjusted.

        The search starts at tolerances that keep them, and so does what it returns, in any case.
        """
        worst, problem, count = self.worst, Problem(self.worst, points), len(x)
        low, high = problem.bounds
        scale, reference = worst.scale[points.series], abs(worst.tolerances.cost(x)).sum() or 1.0
        still = np.zeros(len(low) - count)

        def cost(v: np.ndarray) -> float:
            return worst.tolerances.cost(v[:count]).sum()

        start = np.concatenate([x, problem.compensator_values])
        first = np.concatenate(
            [self.tighten_to_margins(problem.split(start)[1], x), problem.compensator_values]
        )
        solution: Any = scipy.optimize.minimize(
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
        return min(
            (self.tighten_to_margins(adjusted, last), adjusted), problem.split(first), key=self.rank
        )

    def best_of(self, points: WatchedPlaces, starts: Sequence[np.ndarray]) -> Solution:
        """Return the best solution from several starts."""
        return min((self.solve(points, start) for start in starts), key=self.rank)

    def rank(self, solution: Solution) -> tuple[bool, float]:
        """Return whether tolerances violate margins, which the least may do, and their cost."""
        x, points = solution
        margins = self.worst.values(x[None], points)[0]
        negative = -2 * self.options.slack * self.worst.scale[points.series]
        return bool(np.any(margins < negative)), float(self.worst.tolerances.cost(x).sum())

    def tighten_to_margins(self, points: WatchedPlaces, x: np.ndarray) -> np.ndarray:
        """Tighten tolerances x, in their ratio and no more than needed, until margins are kept."""
        worst = self.worst
        tolerances = self.worst.tolerances
        count = self.options.tried_ratios
        tighter = 0.0
        looser = 0.0
        for k in range(2):  # the second time between the best two of the first
            max_shift = (x - tolerances.tighter(x, np.inf)).max() if k == 0 else tighter
            shifts = np.linspace(looser, max_shift, count)
            trials = tolerances.tighter(x, shifts[:, None])
            first = count - 1
            for start in 2 ** np.arange(count.bit_length()) - 1:  # more at once, the more fail
                rows = trials[start : 2 * start + 1]
                margins = (worst.values(rows, points) / worst.scale[points.series]).min(axis=1)
                feasible_rows = np.flatnonzero(margins > -self.options.slack)
                if len(feasible_rows):
                    first = start + int(feasible_rows[0])
                    break
            if first == 0:
                return trials[0]
            looser = shifts[first - 1]
            tighter = shifts[first]
        return tolerances.tighter(x, tighter)


def with_binding_places(
    worst: WorstCaseBounds,
    x: np.ndarray,
    watched: WatchedPlaces,
    *,
    with_multipliers: bool = True,
    options: AllocationOptions = AllocationOptions(),
) -> Allocated:
    """Return tolerances with what limits them."""
    margins, places = worst.least_margins(x)
    smallest_margin = (margins / worst.scale).min()
    binding = options.binding
    points = worst.lowest(margins, places, max(binding, smallest_margin + binding))
    problem = Problem(worst, points)
    v = np.concatenate([x, problem.compensator_values])
    gradients = problem.derivatives(v)
    multipliers = np.full(len(points), 0.0 if with_multipliers else np.nan)
    if with_multipliers and smallest_margin < binding:
        cost = np.append(worst.tolerances.cost_gradient(x), np.zeros(len(v) - len(x)))
        multipliers = _multipliers(problem.bounds, v, cost, gradients)
    slopes = gradients[:, : len(x)]
    binds = bool(np.any(margins < binding * worst.scale))
    return Allocated(x, margins, points, slopes, multipliers, watched, binds)


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
    multipliers, _ = scipy.optimize.nnls(columns / size, cost)
    return (multipliers / size)[: len(gradients)]
