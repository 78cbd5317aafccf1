"""The rounds of a run: its steps, divided where a function of time has a kink or a jump.

Each sample has rounds of its own, so that none depends on the others. A step that holds a
breakpoint becomes two: one up to it, with the values just before, and one from it on. In between
the accelerations are those that the values just after it ask for. Where the speed of a prescribed
motion jumps, an impulse changes the velocities first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from flexband.mechanics.time_functions.breakpoints import Breakpoints

IMPULSE = 0.0
RESTART = -1.0
"""In place of the length of a step: new velocities, and new accelerations."""

SHORTEST_PART = 1e-4
"""Of a step; a breakpoint that is nearer to the end of a step is moved there."""


class Breaks(NamedTuple):
    """Breakpoints of a function's columns; kinks are impulsive where it prescribes a motion."""

    points: Breakpoints
    columns: int
    prescribes: bool

    @property
    def impulsive(self) -> np.ndarray:
        """Which breakpoints take an impulse."""
        return self.prescribes & self.points.impulsive


@dataclass(frozen=True)
class Schedule:
    """The rounds of a run, arrays of shape (rounds, n), or (rounds, 1) if samples share them."""

    # lengths relative to the step, or `IMPULSE` or `RESTART`. A sample with fewer rounds than
    # others restarts at the end until they have finished.
    parts: np.ndarray
    numbers: np.ndarray  # which time of the run each round belongs to or leads to
    times: np.ndarray  # of the rounds [s]
    limits: np.ndarray  # just before or just after a breakpoint, where functions may jump [s]
    sides: np.ndarray  # −1 or 1 where that is just before or after, 0 where there is no breakpoint
    last: np.ndarray  # the last round of each time of the run, shape (times, n or 1)

    @staticmethod
    def regular(times: np.ndarray) -> Schedule:
        """Return the rounds of a run without breakpoints: its times."""
        number = np.arange(len(times))[:, None]
        none = np.zeros((len(times), 1))
        return Schedule(none + 1.0, number, times[:, None], times[:, None], none, number)

    @property
    def is_regular(self) -> bool:
        """Whether the rounds are the times of the run."""
        return len(self.parts) == len(self.last)

    def lanes(self, rows: np.ndarray, samples: np.ndarray) -> np.ndarray:
        """Return some of these arrays' columns, one for each of these samples."""
        return rows[:, samples if rows.shape[1] > 1 else np.zeros(len(samples), dtype=int)]

    def halve_steps(self, step_mask: np.ndarray, times: np.ndarray) -> Schedule:
        """Halve the steps of a mask (rounds, n or 1) and return the rounds; times [s]."""
        runs = []
        columns = np.arange(step_mask.shape[1])
        arrays = [self.lanes(array, columns) for array in self._rows]
        for column in columns:
            rows = np.stack([array[:, column] for array in arrays], axis=1)
            places = np.flatnonzero(step_mask[:, column])
            rows[places, 0] *= 0.5
            first = rows[places].copy()
            first[:, 2] = 0.5 * (rows[places - 1, 2] + rows[places, 2])
            first[:, 3] = 0.5 * (rows[places - 1, 3] + rows[places, 3])
            first[:, 4] = 0.0
            runs.append(np.insert(rows, places, first, axis=0))
        return _pad_rounds(runs, times)

    @property
    def _rows(self) -> list[np.ndarray]:
        """The arrays of the rounds."""
        return [self.parts, self.numbers.astype(float), self.times, self.limits, self.sides]

    def select(self, samples: np.ndarray | None) -> Schedule:
        """Return the rounds of the samples with these numbers."""
        if samples is None or self.parts.shape[1] == 1:
            return self
        return Schedule(*(array[:, samples] for array in vars(self).values()))


def schedule_rounds(times: np.ndarray, samples: int, breaks: Sequence[Breaks]) -> Schedule:
    """Return the rounds of a run with the breakpoints of its functions, over equidistant times."""
    counts = [len(function_breaks.points.column) for function_breaks in breaks]
    if not sum(counts):
        return Schedule.regular(times)
    column, before, after, _ = map(
        np.concatenate, zip(*(function_breaks.points for function_breaks in breaks), strict=True)
    )
    impulsive = np.concatenate([function_breaks.impulsive for function_breaks in breaks])
    common = np.repeat([function_breaks.columns == 1 for function_breaks in breaks], counts)
    runs = []
    for sample in range(1 if common.all() else samples):
        mask = common | (column == sample)
        runs.append(_rounds(times, before[mask], after[mask], impulsive[mask]))
    return _pad_rounds(runs, times)


def _pad_rounds(runs: Sequence[np.ndarray], times: np.ndarray) -> Schedule:
    """Return the rounds of samples with different numbers of rounds, from those of each."""
    max_rounds = max(len(rows) for rows in runs)
    count = len(times) - 1
    end = (RESTART, len(times) - 1, times[-1], times[-1], 0.0)
    table = np.array(
        [np.concatenate([rows, np.tile(end, (max_rounds - len(rows), 1))]) for rows in runs]
    )
    part, number, at, limit, side = table.transpose(2, 1, 0)
    number = number.astype(int)
    ends = [np.searchsorted(rows[:, 1], np.arange(count + 1), side="right") - 1 for rows in runs]
    return Schedule(part, number, at, limit, side, np.array(ends).T)


def _rounds(
    times: np.ndarray, before: np.ndarray, after: np.ndarray, impulsive: np.ndarray
) -> np.ndarray:
    """Return the rounds of one sample: part, number, time, limit and side, shape (rounds, 5)."""
    h = times[1] - times[0]
    last = len(times) - 1
    # Without breakpoints the rounds are the times.
    number = np.arange(last + 1.0)
    rows = np.stack([np.ones(last + 1), number, times, times, np.zeros(last + 1)], axis=1)
    order = np.argsort(before)
    before = before[order]
    after = after[order]
    impulsive = impulsive[order]
    if not len(before):
        return rows
    # Breakpoints that are close together are one.
    group = np.cumsum(np.r_[0, np.diff(before) > SHORTEST_PART * h])
    places = []
    extra = []
    previous_end = times[0]
    for k in range(group[-1] + 1):
        low = before[group == k].min()
        high = after[group == k].max()
        number = min(int(np.rint((low - times[0]) / h)), last)
        on_time = abs(low - times[number]) < SHORTEST_PART * h
        if on_time and number == last:
            break
        # Within a step: a part up to it, and the remaining part after it.
        if not on_time:
            number = min(int(np.ceil((low - times[0]) / h)), last)
            previous_end = max(previous_end, times[number - 1])
            places.append(number)
            extra.append(((low - previous_end) / h, number, low, low, -1.0))
            rows[number, 0] = (times[number] - high) / h
            previous_end = high
        elif number:
            rows[number, 3:] = low, -1.0
        # At it: an impulse if need be, and new accelerations.
        moment = times[number] if on_time else low
        jump = [(RESTART, number, moment, high, 1.0)]
        if impulsive[group == k].any():
            jump.insert(0, (IMPULSE, number, moment, high, 1.0))
        places += [number + on_time] * len(jump)
        extra += jump
    return np.insert(rows, places, extra, axis=0)
