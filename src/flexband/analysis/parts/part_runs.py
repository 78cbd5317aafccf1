"""Runs of a response as it is given, without a method that counts and checks them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import xarray as xr

from flexband.analysis.verification.expanded_runs import Points, Runs
from flexband.basics.checks import check_function
from flexband.basics.progress import Advance
from flexband.basics.response import ResponseFunction, as_response
from flexband.errors import InputError
from flexband.execution.store import as_store
from flexband.uncertainty.inputs.space import Space, check_names
from flexband.uncertainty.inputs.unfolding import GivenInputs, choices_of
from flexband.uncertainty.runs.evaluated import Evaluated
from flexband.uncertainty.runs.evaluations import EvaluationOptions, evaluations
from flexband.uncertainty.runs.reuse import locate_domains


@contextmanager
def plain_runs(
    response: ResponseFunction, inputs: GivenInputs, options: EvaluationOptions
) -> Iterator[tuple[Space, int, Callable[[Advance], Runs]]]:
    """Give the space of inputs without choices, how many runs found it, and what makes runs.

    Raise `InputError` if there are choices, or the response's arguments are not the inputs.
    """
    check_function("response", response)
    check_names(response, inputs)
    if choices := choices_of(inputs):
        raise InputError(
            f"inputs must have no Choice; got {', '.join(choices)}. A study samples every option; "
            "here the response must choose one"
        )
    domain_inputs, explored = locate_domains(response, inputs, as_store(options.store))
    space = Space(domain_inputs)
    branch_response = space.on_branch(as_response(response))
    with evaluations(response, domain_inputs, options) as evaluate:

        def runs_of(advance: Advance) -> Runs:
            labels: xr.DataArray | None = None

            def run(points: Points) -> Evaluated:
                nonlocal labels
                evaluation = evaluate(
                    branch_response, space, branch_response.branch, points, labels, advance
                )
                labels = evaluation.labels
                return evaluation

            return run

        yield space, explored, runs_of
