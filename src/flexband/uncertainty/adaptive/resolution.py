"""The discretization that a tolerance asks for, where step or elements are left out.

The first runs of a coarse discretization, and a few of them on a finer one, tell its error in parts
of the error bar's width. What is too coarse is halved until this error is half of the tolerance;
the expansion has the other half.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from flexband.errors import RunError
from flexband.uncertainty.adaptive.adaptation import Adaptation, refinements
from flexband.uncertainty.methods import Evaluate

OF_DISCRETIZATION = 0.5
"""Part of the tolerance that is for the discretization."""

ORDER = 2
"""Order of convergence, by which several halvings at once are chosen."""

RESOLVED = 0.3
"""Below this error the order is taken for granted."""

MOST_AT_ONCE = 3
MOST_HALVINGS = 9


def solved(
    begin: Callable[[Evaluate], Adaptation], evaluate: Evaluate, tolerance: float
) -> tuple[Adaptation, dict[str, object]]:
    """Return the runs on the discretization that is fine enough, or on the one that is given.

    Parameters
    ----------
    begin : makes the first runs of a response.
    evaluate : the response on the coarsest discretization.
    """
    left_out: list[str] = getattr(evaluate, "left_out", [])
    if not left_out:
        course = begin(evaluate)
        return course, {"stopped": course.run(tolerance), "runs_coarser": 0}
    halved, coarser, names = 0, 0, []
    while True:
        course, last = None, halved >= MOST_HALVINGS
        try:
            course = begin(evaluate)
            wanted = _halvings(course, left_out, tolerance)
            if last or not wanted:
                stopped = course.run((1 - OF_DISCRETIZATION) * tolerance)
                wanted = _halvings(course, left_out, tolerance)
                if last or not wanted:
                    return course, {"stopped": stopped, "runs_coarser": coarser, "halved": names}
        except RunError:  # the step may be too long
            if last:
                raise
            wanted = {"step" if "step" in left_out else left_out[0]: 1}
        coarser += course.runs if course else 0
        for name, times in wanted.items():
            for _ in range(times):
                evaluate = refinements(evaluate)[name]
            names += [name] * times
        halved += max(wanted.values())


def _halvings(course: Adaptation, left_out: list[str], tolerance: float) -> dict[str, int]:
    """Return how often what was left out must be halved; nothing if it is fine enough."""
    errors = {name: course.error.relative(e) for name, e in course.discretization().items()}
    allowed = OF_DISCRETIZATION * tolerance
    if sum(errors.values()) <= allowed:
        return {}
    given = sum(error for name, error in errors.items() if name not in left_out)
    each, times = max(allowed - given, allowed / 2) / len(left_out), {}
    for name in left_out:
        ratio = errors.get(name, 0.0) / each
        if ratio > 1:
            most = MOST_AT_ONCE if errors[name] < RESOLVED else 1
            times[name] = min(most, math.ceil(math.log(ratio, 2**ORDER)))
    return times
