"""A study whose step or elements are left out, on those that the adaptive method chooses."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from flexband.analysis.verification.expanded_runs import as_expanded
from flexband.basics.response import Description, ResponseFunction, WrappingResponse, as_response
from flexband.basics.warning import warn, without_warnings
from flexband.errors import ResolutionWarning
from flexband.study.study import Study
from flexband.uncertainty.adaptive.method import AdaptivePCCI
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.inputs.unfolding import first_case
from flexband.uncertainty.propagate import expand
from flexband.uncertainty.surrogates.bands import BandRecord
from flexband.uncertainty.surrogates.surrogate import Surrogate


@dataclass(frozen=True)
class Discretized(WrappingResponse):
    """A response, `function`, whose discretization is taken as given."""

    function: ResponseFunction

    refines = True

    def __call__(self, **values: Any) -> Any:
        with without_warnings(ResolutionWarning):
            return self.function(**values)

    @property
    def __wrapped__(self) -> ResponseFunction:
        """What has the arguments."""
        return self.function

    def description(self, **values: Any) -> Description:
        """Return that of the response, of which nothing is left out."""
        return super().description(**values)._replace(left_out=())


def with_discretization(study: Study) -> Study:
    """Return a study that any method can be used for.

    If the response leaves out its step or elements, these are chosen as the study's own method
    would, if it can, or else by `AdaptivePCCI`, and a warning tells what they are. Their error is
    not corrected, since other methods do not correct it. With choices, they are those of the first
    option.
    """
    response = as_response(study.response)
    inputs = first_case(study.inputs)
    space = Space(inputs)
    if not response.refines:
        return study
    missing = response.description(**space.arguments_at(*space.nominal())).left_out
    if not missing:
        return study
    method = study.method if isinstance(study.method, AdaptivePCCI) else AdaptivePCCI()
    method = replace(method, correct=False)
    surrogate = expand(study.response, inputs, method)
    assert isinstance(surrogate, Surrogate)
    response, _ = as_expanded(surrogate, response)
    discretization = BandRecord.read(surrogate.diagnostics).discretization
    warn(f"left out: {' and '.join(missing)}; {method.label} chooses {discretization}")
    return replace(study, response=Discretized(response.original))
