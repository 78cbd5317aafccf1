"""Runs of a response as its surrogate was expanded: on the discretization that the method chose."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from flexband.basics.checks import check_function
from flexband.basics.progress import Advance
from flexband.basics.response import Response, ResponseFunction, as_response
from flexband.basics.warning import without_warnings
from flexband.errors import ResolutionWarning, StrainWarning
from flexband.uncertainty.inputs.space import check_names
from flexband.uncertainty.inputs.unfolding import GivenInputs
from flexband.uncertainty.runs.evaluated import Evaluated
from flexband.uncertainty.runs.evaluations import EvaluationOptions, evaluations, setting
from flexband.uncertainty.surrogates.bands import BandRecord
from flexband.uncertainty.surrogates.surrogate import Surrogate

Points = tuple[np.ndarray, np.ndarray]
"""ξ of shape (runs, n) and η of shape (runs, m)."""

Runs = Callable[[Points], Evaluated]
RunsOf = Callable[[Surrogate, str, Advance], Runs]
"""Given a surrogate, the combination of options, and what is called when runs are finished."""


@contextmanager
def runs_as_expanded(
    response: ResponseFunction, inputs: GivenInputs, *, more_times: bool = False, **options: Any
) -> Iterator[RunsOf]:
    """Give what makes runs of a response, with the discretization and settings of its surrogates.

    Where a surrogate corrects the error of step and elements, its runs are corrected likewise
    (`Surrogate.apply_correction`): what it misses of them is what its expansion misses. With
    `more_times` they are at those of `Response.at_more_times`, as far as there are such, and not
    corrected.

    Inputs are as they were given for the surrogates, options those of `EvaluationOptions`. Raise
    `InputError` if the response is no function, or its arguments are not the inputs.
    """
    check_function("response", response)
    check_names(response, inputs)
    with evaluations(response, inputs, EvaluationOptions(**options)) as evaluate:

        def runs_of(surrogate: Surrogate, case: str, advance: Advance) -> Runs:
            with without_warnings(ResolutionWarning, StrainWarning):
                expanded_response, refined_names = as_expanded(surrogate, response)
            space = surrogate.space
            labels = surrogate.labels
            run_setting = setting(case, refined_names, expanded_response.branch)
            if more_times:
                arguments = space.arguments_at(*space.nominal())
                expanded_response = (
                    expanded_response.at_more_times(**arguments) or expanded_response
                )
                labels = None

            def run(points: Points) -> Evaluated:
                nonlocal labels
                with without_warnings(ResolutionWarning, StrainWarning):
                    evaluation = evaluate(
                        expanded_response, space, run_setting, points, labels, advance
                    )
                labels = evaluation.labels
                if evaluation.values is not None and not more_times:
                    corrected = surrogate.apply_correction(evaluation.values.values, *points)
                    evaluation.values = evaluation.values.copy(data=corrected)
                return evaluation

            return run

        yield runs_of


def as_expanded(surrogate: Surrogate, function: ResponseFunction) -> tuple[Response, list[str]]:
    """Return the response on the discretization that the method chose, and what is finer in it."""
    halved = list(BandRecord.read(surrogate.diagnostics).halved or [])
    space = surrogate.space
    response = space.on_branch(as_response(function))
    values = space.arguments_at(*space.nominal())
    description = response.description(**values)
    if not halved or not (description.left_out or description.by_default):
        return response, []
    for name in halved:
        response = response.refinements(**values)[name]
    return response, halved
