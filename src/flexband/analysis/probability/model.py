"""Runs of a model at standard normal variables."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from flexband.analysis.verification.verify import as_expanded
from flexband.errors import (
    ResolutionWarning,
    StrainWarning,
    check_function,
    check_integer,
    without_warnings,
)
from flexband.progress import counted
from flexband.response import ResponseFunction
from flexband.uncertainty.inputs.sampling import of_normals
from flexband.uncertainty.inputs.space import Space, check_names
from flexband.uncertainty.runs.evaluations import EvaluationOptions, evaluations, setting
from flexband.uncertainty.surrogates.surrogate import Surrogate

MIN_RUNS, MAX_RUNS = 16, 100_000
"""Of a probability."""


@dataclass(frozen=True)
class ResponseModel:
    """A response, of which runs can be made.

    Attributes
    ----------
    space : its inputs.
    runs : how many runs a probability may take.
    evaluate : returns the response at (ξ, η).
    """

    space: Space
    runs: int
    evaluate: Callable[[tuple[np.ndarray, np.ndarray]], xr.DataArray]

    def __call__(self, u: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """Return the response at u of shape (points, n) and one η, shape (points, …)."""
        xi = of_normals(u, self.space.families)
        return self.evaluate((xi, np.broadcast_to(eta, (len(u), len(eta))))).values


@contextmanager
def models(
    surrogates: Mapping[str, Surrogate],
    response: ResponseFunction | None,
    runs: int,
    probabilities: int,
    progress: Callable[[int, int], object] | None,
    **options: Any,
) -> Iterator[dict[str, ResponseModel | None]]:
    """Give the model of every combination of options, None without a response.

    Parameters
    ----------
    runs : of a probability, of which there are so many for every combination.
    options : store and executor.
    """
    if response is None:
        yield dict.fromkeys(surrogates)
        return
    check_function("response", response)
    runs = check_integer("runs", runs, MIN_RUNS, MAX_RUNS)
    first = next(iter(surrogates.values()))
    given = first.space.given
    check_names(response, given)
    advance = counted(progress, runs * probabilities * len(surrogates))
    with evaluations(response, given, EvaluationOptions(**options)) as evaluate:

        def model(label: str, surrogate: Surrogate) -> ResponseModel:
            expanded_response, finer = as_expanded(surrogate, response)

            def run(points: tuple[np.ndarray, np.ndarray]) -> xr.DataArray:
                with without_warnings(ResolutionWarning, StrainWarning):
                    made = evaluate(
                        expanded_response,
                        surrogate.space,
                        setting(label, finer),
                        points,
                        surrogate.labels,
                        advance,
                    )
                assert made.values is not None
                return made.values

            return ResponseModel(surrogate.space, runs, run)

        yield {label: model(label, surrogate) for label, surrogate in surrogates.items()}
