"""The cheapest grades with which margins are kept.

A tighter box lies in a looser one. So where margins are negative in a box, they are in all that are
looser in every input, and one of its inputs must be tighter. The cheapest grades that fulfil all
such conditions known so far are found by integer programming, until their box has no negative
margin: these are the cheapest of all.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from flexband.analysis.allocation.grades import Grades
from flexband.analysis.allocation.tolerance_search import Allocated, with_binding_places
from flexband.analysis.allocation.worst_case import WatchedPlaces, WorstCaseBounds
from flexband.errors import InputError


def cheapest_grades(
    worst: WorstCaseBounds,
    points: WatchedPlaces,
    x: np.ndarray | None = None,
    *,
    max_rounds: int = 2000,
    negative: float = -1e-9,
) -> Allocated:
    """Return the cheapest grades that keep all margins, watched at `points`; no start x is used.

    At most `max_rounds` choices are tried. A margin below `negative`, relative to the scale, is
    violated.
    """
    grades = worst.tolerances.grades
    pairs = zip(grades, worst.tolerances.largest, strict=True)
    logs = [np.log(input_grades.tolerances / largest) for input_grades, largest in pairs]
    cuts: list[np.ndarray] = []
    for _ in range(max_rounds):
        x = _choose_cheapest(grades, logs, cuts)
        scale = worst.scale[points.series]
        violated = points.select(worst.values(x[None], points)[0] < negative * scale)
        if not len(violated):
            margins, places = worst.least_margins(x)
            violated = worst.lowest(margins, places, negative)
            points = points.with_new(violated)
        if not len(violated):
            return with_binding_places(worst, x, points, with_multipliers=False)
        single_points = (violated.select(np.array([k])) for k in range(len(violated)))
        cuts += [_cut(worst, point, x, logs, negative) for point in single_points]
    raise InputError(f"requirements: no grades that meet them were found in {max_rounds} rounds")


def _choose_cheapest(
    grades: Sequence[Grades], logs: Sequence[np.ndarray], cuts: Sequence[np.ndarray]
) -> np.ndarray:
    """Return the logarithms of the cheapest tolerances that fulfil all conditions, (names,)."""
    costs = np.concatenate([input_grades.costs for input_grades in grades])
    owner = np.repeat(np.arange(len(grades)), [len(input_grades.costs) for input_grades in grades])
    one_each = (owner == np.arange(len(grades))[:, None]).astype(float)
    optimize = scipy.optimize
    conditions = [optimize.LinearConstraint(one_each, 1, 1)]
    if cuts:
        conditions.append(optimize.LinearConstraint(np.array(cuts, dtype=float), 1, np.inf))
    solution = optimize.milp(
        costs, constraints=conditions, integrality=np.ones(len(costs)),
        bounds=optimize.Bounds(0, 1), options={"mip_rel_gap": 0.0},
    )  # fmt: skip
    return np.concatenate(logs)[np.flatnonzero(solution.x > 0.5)]


def _cut(
    worst: WorstCaseBounds,
    point: WatchedPlaces,
    x: np.ndarray,
    logs: Sequence[np.ndarray],
    negative: float,
) -> np.ndarray:
    """Return which grades are tighter than some that violate a margin, (all grades,).

    These are made as tight as they still violate it at this point.
    """
    x = x.copy()
    for k, input_logs in enumerate(logs):
        for tighter in np.sort(input_logs[input_logs < x[k]]):
            trial = x.copy()
            trial[k] = tighter
            if worst.values(trial[None], point)[0, 0] < negative * worst.scale[point.series[0]]:
                x = trial
                break
    return np.concatenate([input_logs < at for input_logs, at in zip(logs, x, strict=True)])
