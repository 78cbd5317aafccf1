"""How a function of time is evaluated: at many times at once if it takes arrays."""

from __future__ import annotations

from contextlib import suppress
from functools import partial

import numpy as np

from flexband.basics.user_functions import evaluate_function_each, function_text
from flexband.basics.words import number_of
from flexband.errors import InputError
from flexband.mechanics.kernels.forms import TimeFunction


class Evaluation:
    """A function of time with one column per sample, or one that all samples share.

    `at_once` tells whether it takes many times, in rows, or in columns as fields do;
    `breakpoint_times` are those of kinks and jumps that it states itself [s], or None.
    """

    def __init__(
        self, function: TimeFunction, columns: int, times: np.ndarray, *, rounding: float = 1e-12
    ):
        self.function = function
        self.columns = columns
        breakpoint_times = getattr(function, "breakpoints", None)
        self.breakpoint_times = (
            None if breakpoint_times is None else np.asarray(breakpoint_times, dtype=float)
        )
        # Try which layout of many times gives the values of single ones.
        probes = times[0] + (times[-1] - times[0]) * np.array([0.0, 0.11, 0.37, 0.83, 1.0])
        probe_values = self._one_by_one(probes)
        tolerance = rounding * np.abs(probe_values).max()
        agreeing = [
            layout
            for layout in (self._in_rows, self._in_columns)
            if self._agrees(partial(layout, probes), probe_values, tolerance)
        ]
        self._many = agreeing[0] if agreeing else None
        self.at_once = self._many is not None
        row = np.full(columns, probes[2])
        self._by_sample = self._many == self._in_rows and self._agrees(
            lambda: np.asarray(function(row)),  # pyright: ignore
            probe_values[2],
            tolerance,
        )

    def __call__(self, times: np.ndarray) -> np.ndarray:
        """Return the values at many times [s], shape (times, columns)."""
        return (self._many or self._one_by_one)(times.copy())  # which a function may change

    def points(self, times: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Return the values of these columns, each at its time [s], shape (times,)."""
        if not len(times):
            return np.zeros(0)
        if self.columns == 1:
            return self(times)[:, 0]
        if not self._by_sample:
            distinct, inverse = np.unique(times, return_inverse=True)
            return self._one_by_one(distinct)[inverse, columns]
        # Call it with one time per column: first points of all columns, second ones, …
        values = np.empty(len(times))
        order = np.argsort(columns, kind="stable")
        rank = np.empty(len(times), dtype=int)  # of a point among those of its column
        _, first, counts = np.unique(columns[order], return_index=True, return_counts=True)
        rank[order] = np.arange(len(times)) - np.repeat(first, counts)
        by_rank = np.argsort(rank, kind="stable")
        for group in np.split(by_rank, np.cumsum(np.bincount(rank))[:-1]):
            row = np.full(self.columns, times[group][0])
            row[columns[group]] = times[group]
            result = np.asarray(self.function(row), dtype=float)  # pyright: ignore
            values[group] = np.broadcast_to(result, self.columns)[columns[group]]
        return values

    def _in_rows(self, times: np.ndarray) -> np.ndarray:
        f = np.asarray(self.function(times[:, None]), dtype=float)  # pyright: ignore
        return np.broadcast_to(f, (len(times), self.columns))

    def _in_columns(self, times: np.ndarray) -> np.ndarray:
        f = np.asarray(self.function(times[None, :]), dtype=float)  # pyright: ignore
        return np.broadcast_to(f, (self.columns, len(times))).T

    def _one_by_one(self, times: np.ndarray) -> np.ndarray:
        rows = map(np.ravel, evaluate_function_each(self.function, times.tolist()))
        return np.array([np.broadcast_to(row, self.columns) for row in rows])

    @staticmethod
    def _agrees(evaluate, expected: np.ndarray, tolerance: float) -> bool:
        try:
            return bool(np.abs(evaluate() - expected).max() <= tolerance)
        except Exception:  # whatever a function of one time raises when it is given many
            return False


def table(
    function: TimeFunction,
    samples: int,
    times: np.ndarray,
    name: str = "",
    *,
    check_interval: int = 8,
) -> tuple[np.ndarray, Evaluation]:
    """Return a function of time at the times, (times, n) or (times, 1), and how it is evaluated.

    It is called with all times at once if it takes arrays, and if these values are those of single
    times at every `check_interval`-th of them, and at the last one.
    """
    check_rows = np.unique([*range(0, len(times), check_interval), len(times) - 1])
    with suppress(Exception):  # many times are not taken, or it is raised below, too
        at = Evaluation(function, at_each(function, samples, times[:1], name).shape[1], times)
        if at.at_once:
            single_values = at_each(function, samples, times[check_rows], name)
            values = np.array(at(times))
            agrees = (
                np.abs(values[check_rows] - single_values).max()
                <= 1e-12 * np.abs(single_values).max()
            )
            if agrees and np.isfinite(values).all():
                return values, at
    values = at_each(function, samples, times, name)
    return values, Evaluation(function, values.shape[1], times)


def at_each(function: TimeFunction, samples: int, times: np.ndarray, name: str = "") -> np.ndarray:
    """Return a function of time, called with one time after the other, (times, n) or (times, 1)."""
    values = evaluate_function_each(function, times.tolist(), name)
    counts = {np.size(v) for v in values if type(v) is not float} - {1}
    if counts - {samples}:
        raise InputError(
            f"{function_text(function)} returned {number_of(max(counts), 'value')}; the mechanism "
            "has "
            f"{number_of(samples, 'sample')}"
        )
    if counts:
        values = [np.broadcast_to(v, samples) for v in values]
    rows = np.array(values, dtype=float).reshape(len(times), -1)
    if not np.all(np.isfinite(rows)):
        bad = times[np.flatnonzero(~np.isfinite(rows).all(axis=1))[0]]
        raise InputError(f"{function_text(function)} must be finite; it is not at t = {bad:g} s")
    return rows
