"""The cheapest tolerances that meet requirements at every instant."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from flexband.analysis.allocation.allocation_table import result_of
from flexband.analysis.allocation.chance import Chance
from flexband.analysis.allocation.confirmation import Confirmed, confirm_tolerances
from flexband.analysis.allocation.costs import Cost, checked_costs
from flexband.analysis.allocation.grade_search import cheapest_grades
from flexband.analysis.allocation.infeasible import check_feasible
from flexband.analysis.allocation.stated_probability import allocated_by_chance, checked_probability
from flexband.analysis.allocation.tolerance_search import cheapest
from flexband.analysis.allocation.tolerances import Tolerances
from flexband.analysis.allocation.worst_case import WatchedPlaces, WorstCaseBounds
from flexband.analysis.labelled_answers import AnswerRecord
from flexband.analysis.verification.expanded_runs import runs_as_expanded
from flexband.basics.checks import check_instance
from flexband.basics.former_names import former_arguments
from flexband.requirements.corridors import (
    check_instantaneous,
    joint,
    offsets_in_words,
)
from flexband.requirements.requirement import Requirements, corridors
from flexband.uncertainty.inputs.space import check_no_play
from flexband.uncertainty.surrogates.sigmas import checked_sigmas
from flexband.uncertainty.surrogates.surrogate import Surrogate

if TYPE_CHECKING:
    from flexband.basics.response import ResponseFunction
    from flexband.execution.executors import ExecutorLike
    from flexband.execution.store import StoreLike


@former_arguments(limits="requirements")
def allocate(
    surrogate: Surrogate,
    requirements: Requirements,
    costs: Mapping[str, Cost | float],
    *,
    response: ResponseFunction | None = None,
    sigmas: float = 3.0,
    probability: float | None = None,
    store: StoreLike = None,
    executor: ExecutorLike = None,
) -> xr.Dataset:
    """Return the cheapest tolerances that meet requirements at every instant.

    Tolerances are half the widths of interval inputs around their midpoints, radii of plays, and
    standard deviations of random inputs; those of the surrogate are the largest that are
    considered. Requirements are met for all values of the interval inputs, by μ ± kσ over the
    random inputs, and, without these, by the response itself.

    The surrogate is narrowed to find the tolerances. With a `response`, runs are made at the worst
    places of the instants that bind; where they differ from the surrogate, the limits are shifted
    there by the difference, and the search continues.

    Sizes that are free (`Sizing`) are chosen together with the tolerances around them: those that
    allow the cheapest. The best of 1024 are improved, so that another valley may be missed. A
    `Compensator` is adjusted for each value of the other interval inputs, as in
    `check_requirements`.

    Parameters
    ----------
    surrogate : what `expand` returns, without choices.
    requirements : a `Requirement`, or several.
    costs : name of an input -> cost of its tolerance: a function of it, such as `ReciprocalCost`,
        or a number B, for B/tolerance; or, for all of them, `Grades`, if no input is a `Sizing`
        or `Compensator`. Inputs without a cost keep their tolerances.
    response : makes runs that confirm the tolerances; none are made without.
    sigmas : k of μ ± kσ.
    probability : largest probability of violating any limit at any time, for all values of the
        interval inputs, from 1e-8 to 0.3. It takes the place of μ ± kσ.
    store, executor : as in `propagate`.

    Returns
    -------
    Dataset with the dim "limit":

    - `margin` at every instant, NaN where nothing is limited, and `expected_error`, that of the
      surrogate;
    - `slack`, the least margin, `slack_at` where it is, and `grid_error`, by how much the margin
      may be less between the times;
    - `saving`, the reduction of the cost per unit by which the limit is relaxed;
    - `shift`, by how much runs tightened the limit, at most.

    With the dim "name" for the inputs, and "binding" for the instants that bind, or, if none
    does, where the margin is least:

    - `size`, dim "sizing", of every input that is a `Sizing`;
    - `tolerance`, `largest` (that of the surrogate), `cost`, and `grade` if there are grades;
    - `contribution`, the part of the margin that a tolerance uses up at an instant that binds:
      −t ∂margin/∂t;
    - `binding_limit`, `binding_at`, `binding_side` and `binding_inputs`, the values of the interval
      inputs there, dim "input"; `run_margin`, that of a fresh run there;
    - `saving_at`, the reduction of the cost per unit by which the limit is relaxed at this
      instant alone; NaN for grades, where it is not defined.

    With a stated `probability`, there are no margins, but `probability`, that of violating any
    limit at any time where it is the largest over the interval inputs, `probability_at`; its
    confidence interval, `confidence_low` and `confidence_high`; `at_each_time`, that of being
    outside; and `elasticity`, ∂ ln P / ∂ ln t of every tolerance. As in `failure_probability`, the
    interval allows for the expected error of the surrogate, probabilities below 1e-4 are only
    bounded unless this is negligible (`at_each_time` is NaN there), and all are NaN if the
    surrogate missed its tolerance; `surrogate_probability` is what the surrogate alone finds. With
    a `response`, 80 runs or more correct it: `run_probability`, `run_confidence_low` and
    `run_confidence_high`. Where it is larger than stated, or less than 0.7 of that, the search
    continues, with five such corrections at most. "Confirmed" means that it is not larger.

    ``attrs["cost"]`` is the sum of all costs, ``attrs["confirmed"]`` "yes", "no", "inferred" (no
    run violates a limit, but some are so far inside μ ± kσ that they do not confirm it) or "no
    runs were made", ``attrs["runs"]`` the number of runs, ``attrs["verdict"]`` a text.

    Raises
    ------
    InputError
        If the requirements cannot be met: the message names the instant and the inputs to blame; if
        `surrogate` is not a surrogate or has choices, a requirement does not fit its outputs, a
        name in `costs` has no tolerance, or a cost is no finite number; if a probability is stated,
        and no input is random, or there are `Grades` or a `Compensator`.

    Examples
    --------
    >>> inputs = {"a": fb.Interval(9.0, 11.0), "b": fb.Interval(9.0, 11.0)}
    >>> surrogate = fb.expand(lambda a, b: a + b, inputs, fb.PCCI(0, 1))
    >>> requirement = fb.Requirement("response", below=20.6)
    >>> plan = fb.analysis.allocate(surrogate, requirement, costs={"a": 1.0, "b": 4.0})
    >>> plan["name"].values.tolist(), plan["tolerance"].values.round(2)
    (['a', 'b'], array([0.2, 0.4]))
    """
    check_instance("surrogate", surrogate, Surrogate, "one that `expand` returns, without choices")
    k = checked_sigmas(sigmas)
    limit_corridors = corridors(requirements, surrogate.labels)
    check_instantaneous(limit_corridors, surrogate.diagnostics.attrs)
    tolerances = Tolerances.from_costs(surrogate.space, checked_costs(costs))
    tolerances.cost(tolerances.bounds[1])
    corridor = joint(limit_corridors)
    m = surrogate.space.interval_dimension
    options = {"store": store, "executor": executor}
    if probability is not None:
        check_no_play(surrogate.space, "allocate with a probability")
        max_probability = checked_probability(probability, tolerances)
        chance = Chance(surrogate, tolerances, list(limit_corridors.values()), max_probability)
        return allocated_by_chance(chance, response, options)
    # Without a probability: search at the worst places, and confirm with runs if there are any.
    worst = WorstCaseBounds.from_surrogate(surrogate, tolerances, corridor, k)
    check_feasible(surrogate, worst, limit_corridors)
    search = cheapest_grades if tolerances.grades else cheapest
    if response is None:
        allocation = search(worst, WatchedPlaces.none(m))
        no_runs = np.full(len(allocation.points), np.nan)
        confirmation = Confirmed(allocation, np.zeros(worst.bounds.shape), no_runs)
    else:
        with runs_as_expanded(response, surrogate.space.user_inputs, **options) as runs_of:
            first = search(worst, WatchedPlaces.none(m))
            confirmation = confirm_tolerances(surrogate, worst, first, runs_of, search)
    result = result_of(surrogate, limit_corridors, worst, confirmation)
    words = offsets_in_words(limit_corridors, surrogate.diagnostics.attrs)
    return result.assign_attrs(verdict=". ".join([AnswerRecord.read(result).verdict, *words]))
