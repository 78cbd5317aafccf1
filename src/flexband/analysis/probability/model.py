"""Runs of a model at standard normal variables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexband.analysis.requirements.scatter import ScatteringTolerances
from flexband.analysis.verification.expanded_runs import Runs, runs_as_expanded
from flexband.errors import check_function, check_integer
from flexband.progress import Progress, counted
from flexband.response import ResponseFunction
from flexband.uncertainty.inputs.sampling import of_normals
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.surrogates.surrogate import Surrogate

MIN_RUNS, MAX_RUNS = 16, 100_000
"""Of a probability."""


@dataclass(frozen=True)
class ResponseModel:
    """A response, of which runs can be made."""

    space: Space
    runs: int  # how many a probability may take
    evaluate: Runs
    tolerances: ScatteringTolerances | None = None  # how they scatter, if they do

    def __call__(self, u: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """Return the response at u of shape (points, n) and one η, shape (points, …).

        Where tolerances scatter, u has their variables after those of ξ, and η has no effect.
        """
        n = self.space.random_dimension
        places = np.broadcast_to(eta, (len(u), len(eta)))
        if self.tolerances is not None:
            places = self.tolerances.eta(u[:, n:])
        evaluated = self.evaluate((of_normals(u[:, :n], self.space.families), places))
        assert evaluated.values is not None
        return evaluated.values.values


@contextmanager
def models(
    surrogates: Mapping[str, Surrogate],
    response: ResponseFunction | None,
    runs: int,
    probabilities: int,
    progress: Progress | None,
    **options: Any,
) -> Iterator[dict[str, ResponseModel | None]]:
    """Give the model of every combination of options, None without a response.

    It makes so many `runs` for each of the `probabilities`; `options` are store and executor.
    """
    if response is None:
        yield dict.fromkeys(surrogates)
        return
    check_function("response", response)
    runs = check_integer("runs", runs, MIN_RUNS, MAX_RUNS)
    inputs = next(iter(surrogates.values())).space.given
    advance = counted(progress, runs * probabilities * len(surrogates))
    with runs_as_expanded(response, inputs, **options) as runs_of:
        yield {
            label: ResponseModel(surrogate.space, runs, runs_of(surrogate, label, advance))
            for label, surrogate in surrogates.items()
        }
