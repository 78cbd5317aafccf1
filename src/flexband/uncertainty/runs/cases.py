"""The runs of a study for every combination of the options of its choices."""

from __future__ import annotations

from collections.abc import Generator

from flexband.basics.checks import check_function
from flexband.basics.progress import Budget
from flexband.basics.response import ResponseFunction, as_response
from flexband.basics.warning import without_warnings
from flexband.errors import ResolutionWarning
from flexband.execution.store import as_store
from flexband.uncertainty.inputs.space import check_names
from flexband.uncertainty.inputs.unfolding import GivenInputs, cases
from flexband.uncertainty.methods.method import (
    Method,
)
from flexband.uncertainty.runs.counted_runs import CountedRuns
from flexband.uncertainty.runs.evaluations import (
    EvaluationOptions,
    evaluations,
)
from flexband.uncertainty.runs.fine_enough import start_fine_enough
from flexband.uncertainty.runs.reuse import keep_domains, locate_domains


def runs_of_cases(
    function: ResponseFunction, inputs: GivenInputs, method: Method, options: EvaluationOptions
) -> Generator[CountedRuns, None, None]:
    """Yield the runs of every combination of options; those of one are made before the next.

    The store is closed with the generator. Errors are those of `propagate`.
    """
    check_function("response", function)
    check_names(function, inputs)
    response = as_response(function)
    with without_warnings(ResolutionWarning):
        new_inputs, exploration_runs = locate_domains(function, inputs, as_store(options.store))
    all_inputs = cases(new_inputs)
    remaining = len(all_inputs)
    finished_runs = 0
    labels = None
    budget = None

    def advance(done: int, total: int) -> None:
        nonlocal budget
        overall_total = finished_runs + total * remaining
        if isinstance(total, Budget):
            budget = total
        if budget and (total is budget or remaining > 1):
            overall_total = Budget.from_levels(overall_total, budget.per_level)
        if options.progress is not None:
            options.progress(finished_runs + done, overall_total)

    with evaluations(function, new_inputs, options) as evaluate:
        if exploration_runs:
            keep_domains(function, new_inputs, evaluate.record)
        for label, case_inputs in all_inputs.items():
            runs = CountedRuns(
                response,
                case_inputs,
                method,
                evaluate,
                options,
                len(all_inputs),
                advance,
                case=label,
                labels=labels,
                exploration_runs=exploration_runs,
            )
            runs.check_left_out()
            if runs.base_level.description.by_default:
                start_fine_enough(runs)
            yield runs
            labels = runs.labels
            finished_runs += runs.done
            remaining -= 1
