"""Functions of time in the rounds of a run, with the rates of prescribed motions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from flexband.basics.prescribed_motion import set_driven_part
from flexband.basics.user_functions import function_text
from flexband.basics.warning import warn
from flexband.errors import ResolutionWarning
from flexband.mechanics.kernels.forms import Composed, TimeFunction, during_impulse
from flexband.mechanics.time_functions.averages import Averaging, ChordMiss, divisions
from flexband.mechanics.time_functions.breakpoints import Breakpoints, BreakpointSearch
from flexband.mechanics.time_functions.derivatives import derivatives, derivatives_within
from flexband.mechanics.time_functions.evaluation import Evaluation, at_each, table
from flexband.mechanics.time_functions.jumps import refuse_jumps
from flexband.mechanics.time_functions.polynomials import PolynomialFit, pad_with_parabolas
from flexband.mechanics.time_functions.polynomials import rates as rates_of
from flexband.mechanics.time_functions.schedule import (
    IMPULSE,
    SHORTEST_PART,
    Breaks,
    Schedule,
    schedule_rounds,
)


class FunctionTables(NamedTuple):
    """The functions of time of a run: 1 and the functions."""

    schedule: Schedule  # the rounds of the run
    values: np.ndarray  # of the functions, shape (rounds, 1 + functions, n or 1)
    # f′ and f″ of functions in constraints, shape (rounds, 2, 1 + functions, n or 1). Those of all
    # other functions, which may jump, are not needed and zero.
    rates: np.ndarray
    polynomials: np.ndarray | None = None  # in each round, see `PolynomialFit`, or None


def tabulate(
    functions: Sequence[TimeFunction],
    driven: Mapping[int, str],
    samples: int,
    times: np.ndarray,
    tolerance: float | None = None,
) -> FunctionTables:
    """Return the rounds of a run over equidistant times [s], and functions of time in them.

    `driven` names what functions drive, by number. Functions are not looked at between two times of
    a run that only starts. With the `tolerance` of steps that are chosen freely they are
    polynomials, and loads are neither averaged nor divided.
    """
    # Look at each function on its own; drives of the same function share its table.
    series: list[_TabulatedFunction] = []
    motions: dict[TimeFunction, _Motion] = {}
    names: list[str] = []
    for f, function in enumerate(functions, start=1):
        if function is during_impulse:
            series.append(_Impulses())
        elif f not in driven:
            averaging = Averaging() if tolerance is None else None
            series.append(_Load.from_function(function, samples, times, averaging))
        else:
            user = function
            outer = None
            if isinstance(function, Composed):
                user = function.inner
                outer = function.outer
            with set_driven_part(driven[f]):
                if user not in motions:
                    motions[user] = _Motion.from_function(function, samples, times)
                    names.append(driven[f])
                drive = _Drive.from_motion(motions[user], outer, times)
                refuse_jumps(driven[f], function, _fine(times), drive.fine)
                series.append(drive)
    # Warn of impulses.
    for name, motion in zip(names, motions.values(), strict=True):
        if motion.breaks and motion.breaks.impulsive.any():
            first = motion.breaks.points.before[motion.breaks.impulsive].min()
            warn(
                f"{name} is prescribed by a function whose rate jumps at t = {first:.4g} s. That "
                "takes an impulse, which is in attrs['impulses'] of the result and in Work, and "
                "which reactions leave out",
                ResolutionWarning,
            )
    # Divide the run at all breakpoints.
    breaks = [function.breaks for function in series if function.breaks]
    schedule = schedule_rounds(times, samples, breaks)
    polynomials = None
    if tolerance is not None:
        schedule, polynomials = PolynomialFit().fit(series, schedule, times, tolerance)
    # Evaluate the functions in the rounds.
    rounds, _ = schedule.parts.shape
    values = [np.ones((rounds, 1))]
    rates = [np.zeros((rounds, 2, 1))]
    for function in series:
        value, rate = function.in_rounds(schedule, times)
        values.append(value)
        rates.append(rate)
    width = max(column.shape[-1] for column in values)
    rows = np.stack([np.broadcast_to(v, (rounds, width)) for v in values], axis=1)
    rate_rows = np.stack([np.broadcast_to(r, (rounds, 2, width)) for r in rates], axis=2)
    if polynomials is not None:
        step = times[1] - times[0]
        rate_rows = rates_of(polynomials, schedule, step)
        polynomials = pad_with_parabolas(polynomials, rows, rate_rows, schedule, step)
    return FunctionTables(schedule, rows, rate_rows, polynomials)


class _TabulatedFunction:
    """A function of time in the rounds of a run."""

    breaks: Breaks | None = None
    prescribes: bool = False

    @property
    def columns(self) -> int:
        """Number of columns."""
        return 1

    @property
    def name(self) -> str:
        """Name of the function, for messages."""
        return ""

    def in_rounds(self, schedule: Schedule, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the values, shape (rounds, n), and the rates, shape (rounds, 2, n)."""
        raise NotImplementedError

    def points(self, times: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Return the values of these columns, each at its time [s], shape (times,)."""
        return np.zeros(len(times))


class _Impulses(_TabulatedFunction):
    """Whether a round is an impulse."""

    def in_rounds(self, schedule: Schedule, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return 1.0 * (schedule.parts == IMPULSE), np.zeros((len(schedule.parts), 2, 1))


@dataclass(frozen=True, eq=False)
class _Load(_TabulatedFunction):
    """A function that enters forces; `at` is None in runs that only start."""

    at: Evaluation | None
    values: np.ndarray
    breaks: Breaks | None = None

    @property
    def columns(self) -> int:
        return self.values.shape[1]

    @property
    def name(self) -> str:
        return function_text(self.at.function) if self.at else ""

    def points(self, times: np.ndarray, columns: np.ndarray) -> np.ndarray:
        return self.at.points(times, columns) if self.at else np.zeros(len(times))

    @staticmethod
    def from_function(
        function: TimeFunction, samples: int, times: np.ndarray, averaging: Averaging | None
    ) -> _Load:
        if len(times) == 2 and averaging:
            return _Load(None, at_each(function, samples, times))
        (values, at), search = table(function, samples, times), BreakpointSearch()
        # Locate kinks and jumps.
        chord_miss = ChordMiss.from_values(at, times, values, search)
        step_mask = (averaging or Averaging()).kink_mask(chord_miss)
        points = Breakpoints.none()
        if step_mask.any() or at.breakpoint_times is not None:
            points = search.locate(at, times, step_mask, chord_miss.spread, chord_miss.largest)
        if averaging and (step_mask.any() or at.breakpoint_times is not None):
            # Average over steps that half the step would not resolve; breakpoints divide theirs.
            average_mask = averaging.unresolved_mask(chord_miss)
            step = (points.before - times[0]) / (times[1] - times[0])
            for neighbour in (step - SHORTEST_PART, step + SHORTEST_PART):
                average_mask[
                    np.clip(neighbour.astype(int), 0, len(average_mask) - 1), points.column
                ] = False
            division_points = divisions(at, times, chord_miss, points, averaging)
            step = ((division_points.before - times[0]) / (times[1] - times[0])).astype(int)
            step = np.minimum(step, len(average_mask) - 1)
            average_mask[step, division_points.column] = False
            exempt_mask = average_mask.copy()
            exempt_mask[step, division_points.column] = True
            averaging.warn_of_vibrations(at, times, chord_miss, exempt_mask)
            points = points.merge(division_points)
            values = averaging.average_steps(at, times, values, chord_miss, average_mask)
        return _Load(at, values, Breaks(points, at.columns, prescribes=False))

    def in_rounds(self, schedule: Schedule, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rates = np.zeros((len(schedule.parts), 2, 1))
        if self.at is None or schedule.is_regular:
            return self.values, rates
        values, (row, column) = _spread(self.values, schedule)
        at = schedule.limits[row, column % schedule.limits.shape[1]]
        values[row, column] = self.at.points(at, column % self.at.columns)
        return values, rates


@dataclass(frozen=True, eq=False)
class _Motion:
    """A user's function that prescribes a motion, on times twice as fine as those of a run."""

    at: Evaluation
    fine: np.ndarray
    breaks: Breaks | None

    @staticmethod
    def from_function(function: TimeFunction, samples: int, times: np.ndarray) -> _Motion:
        fine = _fine(times)
        search = BreakpointSearch()
        user = function
        text = ""
        # A motion is that of the user's function, before a sine or cosine is taken.
        if isinstance(function, Composed):
            user = function.inner
            text = function.name
        values, at = table(user, samples, fine, text)
        if len(times) == 2:
            return _Motion(at, values, None)
        # Locate kinks and jumps by their size relative to the motion's curvature.
        spacing = (times[1] - times[0]) / search.points_in_step(at, len(times) - 1)
        rate = np.abs(np.diff(values, axis=0)).max(axis=0) / (fine[1] - fine[0])
        everywhere = np.ones((len(times) - 1, at.columns), dtype=bool)
        curvature = np.abs(np.diff(values, 2, axis=0)).max(axis=0) / (fine[1] - fine[0]) ** 2
        change = np.minimum(rate, curvature * (times[1] - times[0]))
        scale = np.maximum(change * spacing, 1e-300)
        largest = np.abs(values).max(axis=0)
        points = search.locate(at, times, everywhere, scale, largest)
        if at.breakpoint_times is None:
            points = search.with_curvature_jumps(points, at, times, curvature, largest)
        return _Motion(at, values, Breaks(points, at.columns, prescribes=True))


@dataclass(frozen=True, eq=False)
class _Drive(_TabulatedFunction):
    """A function in constraints: a prescribed motion, or a function of it such as its sine."""

    motion: _Motion
    outer: Callable[[np.ndarray], np.ndarray] | None
    fine: np.ndarray
    values: np.ndarray
    rates: np.ndarray
    reach: np.ndarray  # how far from each time the values are that its rates are taken from [s]
    spacing: float  # distance of these values [s]
    breaks: Breaks | None

    @staticmethod
    def from_motion(
        motion: _Motion, outer: Callable[[np.ndarray], np.ndarray] | None, times: np.ndarray
    ) -> _Drive:
        fine = _fine(times)
        values = motion.fine if outer is None else outer(motion.fine)
        rates, reach, spacing = derivatives(values, fine[1] - fine[0])
        at = slice(len(times))
        tables = values, values[::2][at], rates[at], reach[at]
        return _Drive(motion, outer, *tables, spacing, motion.breaks)

    prescribes = True

    @property
    def columns(self) -> int:
        return self.motion.at.columns

    @property
    def name(self) -> str:
        return function_text(self.motion.at.function)

    def points(self, times: np.ndarray, columns: np.ndarray) -> np.ndarray:
        f = self.motion.at.points(times, columns)
        return f if self.outer is None else self.outer(f)

    def in_rounds(self, schedule: Schedule, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if schedule.is_regular:
            return self.values, self.rates
        h = times[1] - times[0]
        at = self.motion.at
        values, (row, column) = _spread(self.values, schedule)
        rates, _ = _spread(self.rates, schedule)
        width = schedule.times.shape[1]

        def points(moments: np.ndarray, columns: np.ndarray) -> np.ndarray:
            f = at.points(moments.ravel(), np.repeat(columns, moments.shape[1]) % at.columns)
            return (f if self.outer is None else self.outer(f)).reshape(moments.shape)

        values[row, column] = points(schedule.times[row, column % width][:, None], column)[:, 0]
        breaks = self.breaks.points if self.breaks else Breakpoints.none()
        # Select the rounds whose derivatives would be taken across a breakpoint.
        break_mask = np.zeros((len(values), values.shape[1]), dtype=bool)
        break_mask[row, column] = True
        for c in range(values.shape[1]):
            moment = schedule.times[:, c % width]
            reach = 1.001 * self.reach[schedule.numbers[:, c % width]]
            for time in breaks.before[breaks.column == c % at.columns]:
                break_mask[:, c] |= np.abs(moment - time) <= reach
        row, column = np.nonzero(break_mask)
        # Take theirs from values on their own side of it.
        moment, side = (rows[row, column % width] for rows in (schedule.times, schedule.sides))
        low, high = np.full((2, len(row)), times[[0, -1]][:, None])
        for c in np.unique(breaks.column):
            column_mask = column % at.columns == c
            ends = breaks.before[breaks.column == c]
            moments_inside = (
                moment[column_mask] + np.where(side[column_mask] > 0, 1, -1) * SHORTEST_PART * h
            )
            k = np.searchsorted(ends, moments_inside)
            bounds = np.r_[times[0], ends, times[-1]]
            low[column_mask] = bounds[k]
            high[column_mask] = bounds[k + 1]
        rates[row, :, column] = derivatives_within(
            lambda moments: points(moments, column), moment, low, high, self.spacing
        )
        return values, rates


def _fine(times: np.ndarray) -> np.ndarray:
    """Return times twice as fine, at least seven."""
    return times[0] + (times[1] - times[0]) / 2 * np.arange(max(2 * len(times) - 1, 7))


def _spread(
    rows: np.ndarray, schedule: Schedule
) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Return rows of times as rows of rounds, and where functions are evaluated apart."""
    width = max(rows.shape[-1], schedule.parts.shape[1])
    number = np.broadcast_to(schedule.numbers, (len(schedule.numbers), width))
    full = np.broadcast_to(rows, (*rows.shape[:-1], width))
    columns = np.arange(width)
    spread = full[number, ..., columns]  # (rounds, width, …)
    spread = np.moveaxis(spread, 1, -1).copy() if rows.ndim > 2 else spread
    row, column = np.nonzero(np.broadcast_to(schedule.sides != 0, number.shape))
    return spread, (row, column)
