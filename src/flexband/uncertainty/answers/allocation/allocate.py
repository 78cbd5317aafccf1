"""The cheapest tolerances with which limits are kept at every instant."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import xarray as xr

from flexband.errors import function, instance
from flexband.uncertainty.answers.allocation.confirmation import Confirmed, confirmed
from flexband.uncertainty.answers.allocation.costs import checked_costs
from flexband.uncertainty.answers.allocation.grade_search import cheapest_grades
from flexband.uncertainty.answers.allocation.grades import Grades
from flexband.uncertainty.answers.allocation.infeasible import check_feasible
from flexband.uncertainty.answers.allocation.results import result_of
from flexband.uncertainty.answers.allocation.search import cheapest
from flexband.uncertainty.answers.allocation.tolerances import Tolerances
from flexband.uncertainty.answers.allocation.worst_case import Points, WorstCase
from flexband.uncertainty.answers.limits import corridors, joint
from flexband.uncertainty.evaluations.evaluations import BATCH, evaluations
from flexband.uncertainty.inputs.space import check_names
from flexband.uncertainty.surrogates.sigmas import checked_sigmas
from flexband.uncertainty.surrogates.surrogate import Surrogate


def allocate(
    surrogate: Surrogate,
    limits: Any,
    costs: Mapping[str, Any],
    *,
    response: Any = None,
    sigmas: float = 3.0,
    store: Any = None,
    executor: Any = None,
) -> xr.Dataset:
    """Return the cheapest tolerances with which limits are kept at every instant.

    Tolerances are half the widths of interval inputs around their midpoints, and standard
    deviations of random inputs; those of the surrogate are the largest that are considered. Limits
    are kept for all values of the interval inputs, by μ ± kσ over the random inputs, and, without
    these, by the response itself.

    The surrogate is narrowed to find the tolerances. With a `response`, runs are made at the worst
    places of the instants that bind; where they differ from the surrogate, the limits are shifted
    there by the difference, and the search goes on.

    Sizes that are free (`Sizing`) are chosen together with the tolerances around them: those that
    allow the cheapest. The best of 1024 are improved, so that another valley may be missed. A
    `Compensator` is adjusted for each value of the other interval inputs, as in `check_limits`.

    Parameters
    ----------
    surrogate : what `expand` returns, without choices.
    limits : a `Limit`, or several.
    costs : name of an input -> cost of its tolerance: a function of it, such as `ReciprocalCost`,
        or a number B, for B/tolerance; or, for all of them, `Grades`, if no input is a `Sizing`
        or `Compensator`. Inputs without a cost keep their tolerances.
    response : makes runs that confirm the tolerances; none are made without.
    sigmas : k of μ ± kσ.
    store, executor : as in `propagate`.

    Returns
    -------
    Dataset with the dim "limit":

    - `margin` at every instant, NaN where nothing is limited, and `expected_error`, that of the
      surrogate;
    - `slack`, the least margin, `slack_at` where it is, and `grid_error`, by how much the margin
      may be less between the times;
    - `saving`, by how much the cost falls per unit by which the limit is relaxed;
    - `shift`, by how much the limit was made tighter because of what runs showed, at most.

    With the dim "name" for the inputs, and "binding" for the instants that bind, or, if none
    does, where the margin is least:

    - `size`, dim "sizing", of every input that is a `Sizing`;
    - `tolerance`, `largest` (that of the surrogate), `cost`, and `grade` if there are grades;
    - `contribution`, the part of the margin that a tolerance takes at an instant that binds:
      −t ∂margin/∂t;
    - `binding_limit`, `binding_at`, `binding_side` and `binding_inputs`, the values of the interval
      inputs there, dim "input"; `run_margin`, that of a fresh run there;
    - `saving_at`, by how much the cost falls per unit by which the limit is relaxed at this
      instant alone; NaN for grades, where it is not defined.

    ``attrs["cost"]`` is the sum of all costs, ``attrs["confirmed"]`` "yes", "no" or "no runs were
    made", ``attrs["runs"]`` the number of runs, ``attrs["verdict"]`` a text.

    Raises
    ------
    InputError
        If the limits cannot be kept: the message names the instant and the inputs to blame; if
        `surrogate` is none or has choices, a limit does not fit its outputs, a name in `costs` has
        no tolerance, or a cost is no finite number.
    """
    instance("surrogate", surrogate, Surrogate, "one that `expand` returns, without choices")
    k = checked_sigmas(sigmas)
    wanted = corridors(limits, surrogate.labels)
    tolerances = Tolerances.of(surrogate.space, checked_costs(costs))
    tolerances.cost(tolerances.bounds[1])
    corridor = joint(wanted)
    worst = WorstCase.of(surrogate, tolerances, corridor.lower, corridor.upper, k)
    check_feasible(surrogate, worst, wanted)
    m = surrogate.space.interval_dimension
    graded = isinstance(next(iter(tolerances.costs.values())), Grades)
    search = cheapest_grades if graded else cheapest
    if response is None:
        found = Confirmed.without_runs(worst, search(worst, Points.none(m)))
    else:
        function("response", response)
        check_names(response, surrogate.space.given)
        options: dict[str, Any] = {"batch": BATCH, "store": store, "executor": executor}
        with evaluations(response, surrogate.space.given, **options) as evaluate:
            first = search(worst, Points.none(m))
            found = confirmed(surrogate, worst, first, response, evaluate, search)
    return result_of(surrogate, wanted, worst, found)
