"""The values of a response at some points: what a call returned, checked run by run."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from flexband.basics.response import Response
from flexband.basics.rounding import largest_of
from flexband.basics.words import number_of
from flexband.errors import InputError, RunError
from flexband.execution.calls import Outcome
from flexband.execution.journal import Finished
from flexband.execution.record import RunRecorder
from flexband.remarks.collection import CollectedRemark, as_text
from flexband.remarks.remark import Remark
from flexband.uncertainty.inputs.evaluation import (
    align_batch,
    check_labels,
    coordinates,
    explain_error,
    extremes_in_words,
    label_result,
    not_finite,
)
from flexband.uncertainty.inputs.one_sample import of_one_sample
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.surrogates.axes import names_of_outputs, series, units_of


class CallVerdict(NamedTuple):
    """Which runs of a call are good, and which failed."""

    good_runs: np.ndarray  # their numbers
    values: np.ndarray | None = None  # of the good runs
    failures: Mapping[int, str] = MappingProxyType(
        {}
    )  # number of each failed run -> reason; empty if not known
    error: Exception | None = None  # why the call failed


class Evaluated:
    """The values of a response at some points, as far as they are known."""

    def __init__(
        self,
        response: Response,
        space: Space,
        setting: str,
        points: tuple[np.ndarray, np.ndarray],
        labels: xr.DataArray | None,
        record: RunRecorder | None,
        *,
        probed: bool,
    ):
        """Begin without values, which are written to the `record`, if there is one.

        `probed` is whether the response has been called to tell whether it takes one sample only.
        """
        self.response = response
        self.space = space
        self.setting = setting
        self.points = points
        self.labels = labels
        self.record = record
        self.probed = probed
        # dims (sample, …), NaN where runs failed; None before the first success
        self.values: xr.DataArray | None = None
        self.failed: dict[int, str] = {}  # number of each run that failed -> reason
        self.stored = np.zeros(0, int)  # numbers of the runs that were recorded before
        self.remarks: dict[int, list[Remark]] = {}  # number of a run -> what it warned of
        self._done_mask = np.zeros(len(points[0]), bool)

    @cached_property
    def numbers(self) -> np.ndarray:
        """The numbers that a run is recorded with, shape (runs, inputs)."""
        return np.stack(list(self.space.recorded_at(*self.points).values()), axis=1)

    @property
    def pending_runs(self) -> np.ndarray:
        """Numbers of the runs that have no values yet."""
        return np.flatnonzero(~self._done_mask)

    def arguments(self, runs: np.ndarray) -> dict[str, Any]:
        """Return what the response is called with."""
        xi, eta = self.points
        return self.space.arguments_at(xi[runs], eta[runs])

    def take(self, runs: np.ndarray, values: np.ndarray) -> None:
        labels = self.labels
        assert labels is not None
        if self.values is None:
            empty = np.full((len(self._done_mask), *labels.shape[1:]), np.nan)
            coords = coordinates(labels)
            self.values = xr.DataArray(empty, coords, labels.dims, labels.name, labels.attrs)
        self.values.values[runs] = values
        self._done_mask[runs] = True

    def leave_out(self, failed: Mapping[int, str]) -> None:
        """Take runs as failed, for these reasons."""
        self.failed |= failed
        self._done_mask[list(failed)] = True

    def write(
        self, runs: np.ndarray, values: np.ndarray | None, reason: str, seconds: float
    ) -> None:
        """Record runs with their values, or None for failed ones, in so many seconds each."""
        if self.record is None:
            return
        if self.labels is not None:
            self.record.begin(self.labels)
        remarks = [as_text(self.remarks.get(int(run), ())) for run in runs]
        self.record.add(
            Finished(
                setting=self.setting,
                inputs=self.numbers[runs],
                values=values,
                reason=reason,
                seconds=seconds,
                time=time.time(),
                remarks=tuple(remarks) if any(remarks) else (),
            )
        )

    def remark(self, runs: np.ndarray, remarks: Iterable[Remark]) -> None:
        """Keep what a call of these runs has warned of."""
        for remark in remarks:
            for run in runs if remark.sample is None else runs[[remark.sample]]:
                self.remarks.setdefault(int(run), []).append(replace(remark, sample=None))

    @property
    def collected_remarks(self) -> list[CollectedRemark]:
        """The worst remark of each topic on the runs that have not failed."""
        of_good = {run: remarks for run, remarks in self.remarks.items() if run not in self.failed}
        return collected_remarks(self.space, self.points, of_good)

    def judge_call(self, runs: np.ndarray, outcome: Outcome) -> CallVerdict:
        """Judge the runs of a call: which are good, with their values, and which failed, and why.

        No run is named where an error does not tell which of several failed.
        """

        def without_values(reason: str, error: Exception) -> CallVerdict:
            failures = {int(runs[0]): reason} if len(runs) == 1 else {}
            return CallVerdict(runs[:0], failures=failures, error=error)

        points = tuple(v[runs] for v in self.points)
        error = outcome.error
        value = outcome.value
        failures = {}
        if isinstance(error, RunError) and error.results is not None:
            value = error.results
            failures = {
                int(runs[k]): f"at {t:g} s: {why}" for k, (t, why) in error.failures.items()
            }
        elif error is not None:
            scalar = None  # once it has returned values for arrays, it is none
            if self.labels is None:
                scalar = self._of_one_sample(runs, error)
            reason = _in_words(scalar or error)
            return without_values(reason, scalar or explain_error(error, self.space, *points))
        # Check labels and shape, and then that values are finite, run by run.
        try:
            values = self._align_labels(value, len(runs)).values
        except InputError as wrong:
            error = self._of_one_sample(runs, wrong) or wrong
            return without_values(str(error), error)
        reason, text, wrong = not_finite(values, self.space, *points)
        if failures:
            assert error is not None
            error = explain_error(error, self.space, *points)
        elif reason:
            failures = dict.fromkeys(map(int, runs[wrong]), reason)
            error = InputError(text)
        if not failures:
            return CallVerdict(runs, values, error=error)
        good_mask = ~np.isin(runs, list(failures))
        return CallVerdict(runs[good_mask], values[good_mask], failures, error)

    def _of_one_sample(self, runs: np.ndarray, error: Exception) -> InputError | None:
        """Return what `of_one_sample` does, once: it calls the response."""
        if self.probed:
            return None
        self.probed = True
        return of_one_sample(self.response, self.arguments(runs), error)

    def _align_labels(self, value: Any, count: int) -> xr.DataArray:
        part = label_result(value, count)
        if self.labels is None:
            check_labels(part)
            self.labels = part[:0].copy()
            return part
        return align_batch(part, self.labels)

    def check_size(self, smallest: float = 1e-120) -> None:
        """Raise `InputError` if an output is not zero, but smaller than `smallest` in all runs.

        Its square would vanish, as those of large values overflow. Beside larger outputs of the
        same unit it is a rounding error.
        """
        assert self.values is not None
        signal = series(self.values)
        size = np.maximum(
            np.nanmax(signal, axis=(0, 2), initial=0.0),
            -np.nanmin(signal, axis=(0, 2), initial=0.0),
        )
        sizes = np.where(size > 0, largest_of(size, units_of(self.values).of), 0.0)
        for name, magnitude in zip(names_of_outputs(self.values), sizes.tolist(), strict=True):
            if 0 < magnitude < smallest:
                raise InputError(
                    f"{name} is at most {magnitude:.3g} in size in "
                    f"{number_of(len(self.values), 'run')}, and its square vanishes; it must be "
                    f"zero, or reach {smallest:g}: choose another unit"
                )


def collected_remarks(
    space: Space,
    points: tuple[np.ndarray, np.ndarray],
    remarks: Mapping[int, Sequence[Remark]],
) -> list[CollectedRemark]:
    """Return the worst remark of each topic, of remarks by the number of the run at points (ξ, η).

    It has the inputs of its run, unless all runs have the same.
    """
    of_topics = dict[tuple[str, ...], list[tuple[int, Remark]]]()
    for run, of_run in remarks.items():
        for remark in of_run:
            of_topics.setdefault(remark.topic, []).append((run, remark))
    results = []
    for topic in of_topics.values():
        run, worst = max(topic, key=lambda pair: np.nan_to_num(pair[1].size, nan=-np.inf))
        values = space.numbers_at(*(v[[run]] for v in points))
        inputs = (
            extremes_in_words(values, 0, 6)
            if len(np.unique([r.size for _, r in topic])) > 1
            else ""
        )
        results.append(CollectedRemark(worst, len({run for run, _ in topic}), inputs))
    return results


def _in_words(error: Exception) -> str:
    text = str(error) if isinstance(error, RunError | InputError) else ""
    return text or f"{type(error).__name__}: {error}"
