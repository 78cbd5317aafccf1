"""Runs of a response at points of ξ and η, in memory that they can grow in."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexband.basics.words import number_of
from flexband.errors import RunError
from flexband.uncertainty.methods.method import Evaluate
from flexband.uncertainty.surrogates.axes import series

MIN_HELD = 2
"""Fewest runs that are held out."""


class ResponseRuns(NamedTuple):
    """Runs of a response at ξ, (runs, n), and η, (runs, m): values (runs, outputs, times)."""

    xi: np.ndarray
    eta: np.ndarray
    values: np.ndarray

    def at(self, times: slice) -> ResponseRuns:
        return self._replace(values=self.values[..., times])

    def which(self, rows: slice) -> ResponseRuns:
        """Return some of the runs, which are not copied."""
        return ResponseRuns(*(v[rows] for v in self))

    def copy(self) -> ResponseRuns:
        """Return a copy, which keeps no other runs in memory."""
        return ResponseRuns(*(v.copy() for v in self))

    @staticmethod
    def concatenate(*parts: ResponseRuns) -> ResponseRuns:
        return ResponseRuns(*map(np.concatenate, zip(*parts, strict=True)))


class RareRuns(NamedTuple):
    """Runs at rare values of random variables, and their weights in an expectation, (points,)."""

    runs: ResponseRuns
    weight: np.ndarray

    @staticmethod
    def none(like: ResponseRuns) -> RareRuns:
        """Return no runs, of the shapes of others."""
        return RareRuns(ResponseRuns(*(array[:0].copy() for array in like)), np.zeros(0))


def evaluate_runs(
    evaluate: Evaluate, xi: np.ndarray, eta: np.ndarray, essential_count: int = 0
) -> ResponseRuns:
    """Return the runs at ξ and η that succeed, as `successful_runs` does."""
    return successful_runs(ResponseRuns(xi, eta, series(evaluate(xi, eta))), essential_count)


def successful_runs(runs: ResponseRuns, essential_count: int) -> ResponseRuns:
    """Return runs that did not fail; raise `RunError` if one of the first, essential ones did."""
    finite_mask = np.asarray(np.isfinite(runs.values).all(axis=(1, 2)))
    failed = np.flatnonzero(~finite_mask[:essential_count])
    holdout_mask = finite_mask[essential_count:]
    few = essential_count and holdout_mask.sum() < min(MIN_HELD, len(holdout_mask))
    if len(failed) or few:
        fitted = f"{len(failed)} of {number_of(essential_count, 'run')} that are fitted"
        which = fitted if len(failed) else "most of the runs that check the fit"
        raise RunError(
            f"AdaptivePCCI needs every run of its design; {which} failed. RegressionPCCI and the "
            "scanning methods can do without them",
            dict.fromkeys(failed.tolist(), (0.0, "failed")),
        )
    return runs if finite_mask.all() else ResponseRuns(*(v[finite_mask] for v in runs))


class RunBuffer:
    """Runs that are fitted, and those held out after them.

    More of either are added without a copy of all. Fitted runs stay in their place, so fits may
    refer to them.
    """

    def __init__(self, runs: ResponseRuns, fitted: int, budget: int, reserved: int = 2**31):
        """Copy runs, of which the first are fitted; `budget` is the number there may be.

        At most so many bytes are `reserved` for all of the budget; they are used once there are
        runs.
        """
        self.fit_count = fitted
        size = max(1, runs.values[0].nbytes)
        capacity = max(len(runs.values), min(budget, reserved // size))
        self.memory = _larger(runs, capacity)
        self.count = len(runs.values)

    @property
    def all(self) -> ResponseRuns:
        return self.memory.which(slice(self.count))

    @property
    def design_runs(self) -> ResponseRuns:
        """The first runs, to which expansions are fitted."""
        return self.memory.which(slice(self.fit_count))

    @property
    def holdout(self) -> ResponseRuns:
        """The check runs, which come after those of the design."""
        return self.memory.which(slice(self.fit_count, self.count))

    def fit(self, new: ResponseRuns) -> None:
        first = self.fit_count
        end = self.fit_count + len(new.values)
        self._make_room(len(new.values))
        for array, holdout, added in zip(self.memory, self.holdout, new, strict=True):
            for k in reversed(range(len(holdout))):  # one by one: a copy of all takes memory
                array[end + k] = holdout[k]
            array[first:end] = added
        self.fit_count = end
        self.count = self.count + len(new.values)

    def hold(self, new: ResponseRuns) -> None:
        self._make_room(len(new.values))
        for array, added in zip(self.memory, new, strict=True):
            array[self.count : self.count + len(added)] = added
        self.count += len(new.values)

    def _make_room(self, extra_count: int) -> None:
        if self.count + extra_count > len(self.memory.values):
            self.memory = _larger(self.all, 2 * (self.count + extra_count))


def _larger(runs: ResponseRuns, capacity: int) -> ResponseRuns:
    """Return a copy of runs in memory for more."""
    memory = ResponseRuns(*(np.empty((capacity, *array.shape[1:])) for array in runs))
    for array, values in zip(memory, runs, strict=True):
        array[: len(values)] = values
    return memory
