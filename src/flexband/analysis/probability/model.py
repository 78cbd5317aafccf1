"""Runs of a model that correct probabilities."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexband.analysis.verification.expanded_runs import Runs, runs_as_expanded
from flexband.basics.checks import check_integer
from flexband.basics.progress import Progress, run_counter
from flexband.basics.response import ResponseFunction
from flexband.uncertainty.surrogates.surrogate import Surrogate

MIN_RUNS = 16
MAX_RUNS = 100_000
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
        evaluation = self.evaluate((xi, np.broadcast_to(eta, (len(xi), eta.shape[-1]))))
        assert evaluation.values is not None
        return evaluation.values.values


@contextmanager
def models(
    surrogates: Mapping[str, Surrogate],
    response: ResponseFunction | None,
    counts: Sequence[int],
    bounds: int,
    progress: Progress | None,
    **options: Any,
) -> Iterator[dict[str, Callable[[int | None], ResponseModel | None]]]:
    """Give what returns the model of every combination of options by its number of runs.

    It is None without a response or runs. The `counts` are numbers of runs of each limit for each
    of its `bounds`; `options` are store and executor.
    """
    if response is None:
        yield dict.fromkeys(surrogates, lambda runs: None)
        return
    counts = [check_integer("runs", runs, MIN_RUNS, MAX_RUNS) for runs in counts]
    inputs = next(iter(surrogates.values())).space.user_inputs
    total = sum(runs * bounds + runs // FIRST_PART for runs in counts)
    advance = run_counter(progress, total * len(surrogates))
    with runs_as_expanded(response, inputs, **options) as runs_of:
        runs_by_label = {k: runs_of(surrogate, k, advance) for k, surrogate in surrogates.items()}

        def model_of(label: str) -> Callable[[int | None], ResponseModel | None]:
            return lambda runs: None if runs is None else ResponseModel(runs, runs_by_label[label])

        yield {label: model_of(label) for label in surrogates}
