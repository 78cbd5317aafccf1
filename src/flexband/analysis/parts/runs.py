"""Runs of a response as it is given, without a method that counts and checks them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import xarray as xr

from flexband.analysis.verification.expanded_runs import Points, Runs
from flexband.errors import InputError, check_function
from flexband.execution.store import as_store
from flexband.progress import Advance
from flexband.response import ResponseFunction
from flexband.uncertainty.inputs.space import Space, check_names
from flexband.uncertainty.inputs.unfolding import GivenInputs, choices_of
from flexband.uncertainty.runs.evaluated import Evaluated
from flexband.uncertainty.runs.evaluations import EvaluationOptions, Evaluations, evaluations
from flexband.uncertainty.runs.reuse import located


@dataclass(frozen=True)
class PlainRuns:
    """What makes runs of a response.

    Attributes
    ----------
    response : what is run.
    space : of its inputs.
    evaluate : looks runs up in a store, or makes them.
    explored : number of runs that found the domains of fields.
    """

    response: ResponseFunction
    space: Space
    evaluate: Evaluations
    explored: int

    def run(self, advance: Advance) -> Runs:
        """Return what makes runs at points; `advance` is called when some are finished."""
        labels: xr.DataArray | None = None

        def run(points: Points) -> Evaluated:
            nonlocal labels
            made = self.evaluate(self.response, self.space, "", points, labels, advance)
            labels = made.labels
            return made

        return run


@contextmanager
def plain_runs(
    response: ResponseFunction, inputs: GivenInputs, options: EvaluationOptions
) -> Iterator[PlainRuns]:
    """Give what makes runs of a response whose inputs have no choices.

    Raise `InputError` if they have, or the response's arguments are not the inputs.
    """
    check_function("response", response)
    check_names(response, inputs)
    if choices := choices_of(inputs):
        raise InputError(f"inputs must have no Choice; got {', '.join(choices)}")
    placed, explored = located(response, inputs, as_store(options.store))
    with evaluations(response, placed, options) as evaluate:
        yield PlainRuns(response, Space(placed), evaluate, explored)
