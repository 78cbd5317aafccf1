"""Runs of a model that correct probabilities."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexband.analysis.verification.expanded_runs import Runs, runs_as_expanded
from flexband.errors import check_integer
from flexband.progress import Progress, counted
from flexband.response import ResponseFunction
from flexband.uncertainty.surrogates.surrogate import Surrogate

MIN_RUNS, MAX_RUNS = 16, 100_000
"""Of a probability."""

FIRST_PART = 4
"""Runs of a probability per run that learns before the search for its place."""


@dataclass(frozen=True)
class ResponseModel:
    """A response, of which runs can be made."""

    runs: int  # how many a probability may take
    evaluate: Runs

    @property
    def first_runs(self) -> int:
        """How many further runs learn before that what a surrogate misses."""
        return self.runs // FIRST_PART

    def __call__(self, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """Return the response, (points, …), at ξ (points, n) and at η (points, m) or (m,)."""
        evaluated = self.evaluate((xi, np.broadcast_to(eta, (len(xi), eta.shape[-1]))))
        assert evaluated.values is not None
        return evaluated.values.values


@contextmanager
def models(
    surrogates: Mapping[str, Surrogate],
    response: ResponseFunction | None,
    runs: int,
    counts: tuple[int, int],
    progress: Progress | None,
    **options: Any,
) -> Iterator[dict[str, ResponseModel | None]]:
    """Give the model of every combination of options, None without a response.

    It makes so many `runs` for each bound of each limit, whose `counts` are those of limits and
    bounds; `options` are store and executor.
    """
    if response is None:
        yield dict.fromkeys(surrogates)
        return
    runs = check_integer("runs", runs, MIN_RUNS, MAX_RUNS)
    inputs = next(iter(surrogates.values())).space.given
    limits, bounds = counts
    of_limit = runs * bounds + runs // FIRST_PART
    advance = counted(progress, of_limit * limits * len(surrogates))
    with runs_as_expanded(response, inputs, **options) as runs_of:
        yield {
            label: ResponseModel(runs, runs_of(surrogate, label, advance))
            for label, surrogate in surrogates.items()
        }
