"""Loads that change within the steps of a run: which steps are divided, and which averaged.

A load that differs between the times of a run from the chords between its values, and that half
the step would not resolve either, is replaced at the ends of such steps by its average with a hat
of two steps, ∫ f(t) (1 − |t − tₙ|/h) dt / h. The sum of these averages is the impulse of the load,
and their first moment is its own, so that the motion is right to second order. Steps of a load that
changes as fast in few steps only, as in short pulses, are divided.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from flexband.basics.user_functions import function_text
from flexband.basics.warning import warn
from flexband.errors import ResolutionWarning
from flexband.mechanics.time_functions.breakpoints import Breakpoints, BreakpointSearch, few
from flexband.mechanics.time_functions.evaluation import Evaluation


class ChordMiss(NamedTuple):
    """What a function does between its values, each column judged alone, shape (steps, n)."""

    chord: np.ndarray  # largest distance from the chord of a step
    half_chord: np.ndarray  # the same for half the step
    beyond: np.ndarray  # how far the function exceeds both values
    spread: np.ndarray  # range of the function, shape (n,)
    largest: np.ndarray  # of the absolute values, shape (n,)

    @staticmethod
    def from_values(
        at: Evaluation, times: np.ndarray, values: np.ndarray, search: BreakpointSearch
    ) -> ChordMiss:
        """Look at a function with these values at equidistant times [s]."""
        steps = len(times) - 1
        h = times[1] - times[0]
        per = search.points_in_step(at, steps)
        count = max(1, search.points_at_once // (per * values.shape[1]))
        low = values.min(axis=0)
        high = values.max(axis=0)
        chord, half_chord, beyond = np.zeros((3, steps, values.shape[1]))
        part = np.arange(per)[:, None] / per
        # Look at blocks of steps, so that a call takes no more points than allowed.
        for first in range(0, steps, count):
            block = slice(first, min(first + count, steps))
            number = block.stop - block.start
            inner = (times[block, None] + h * part[:, 0]).ravel()
            f = at(inner).reshape(number, per, -1)
            low = np.minimum(low, f.min(axis=(0, 1)))
            high = np.maximum(high, f.max(axis=(0, 1)))
            starts = values[:-1][block, None]
            ends = values[1:][block, None]
            beyond[block] = np.maximum(
                f.max(axis=1) - np.maximum(starts, ends)[:, 0],
                np.minimum(starts, ends)[:, 0] - f.min(axis=1),
            )
            # Compare with the chords of the step and of its halves.
            middle = f[:, per // 2, None]
            half = 2 * part[: per // 2]
            chord[block] = np.abs(f - (starts + part * (ends - starts))).max(axis=1)
            half_chord[block] = np.maximum(
                np.abs(f[:, : per // 2] - (starts + half * (middle - starts))).max(axis=1),
                np.abs(f[:, per // 2 :] - (middle + half * (ends - middle))).max(axis=1),
            )
        spread = np.maximum(high - low, 1e-300)
        largest = np.maximum(high, -low)
        return ChordMiss(chord, half_chord, beyond, spread, largest)


@dataclass(frozen=True)
class Averaging:
    """Which steps a load is averaged over; what is missed is relative to the range of the load."""

    noticed_miss: float = 2e-3
    """What kinks and jumps are looked for in."""
    min_miss: float = 0.03
    """What may be averaged."""
    max_miss: float = 0.25
    """What no step resolves."""
    resolved_fall: float = 0.6
    """What is missed at half the step over what is missed at the step, where the step resolves it.
    It is 1/4 for smooth functions, 1/2 at a kink amid a step, about 1 at a jump or above half the
    frequency of the steps."""
    vibrating: float = 0.2
    """Part of the steps of a run in which a function misses `min_miss` where it vibrates."""
    points: int = 2048
    """Points per step of averages, with one call for many of them."""
    calls: int = 256
    """The same, with a call for each."""
    frequency_points: int = 64
    """Points per step from which a frequency is taken."""

    def kink_mask(self, chord_miss: ChordMiss) -> np.ndarray:
        """Return in which steps there may be a kink or a jump."""
        return chord_miss.chord > self.noticed_miss * chord_miss.spread

    def unresolved_mask(self, chord_miss: ChordMiss) -> np.ndarray:
        """Return which steps half the step would not resolve: it would miss about as much."""
        lasting = chord_miss.half_chord > self.resolved_fall * chord_miss.chord
        return (lasting & (chord_miss.chord > self.min_miss * chord_miss.spread)) | (
            chord_miss.chord > self.max_miss * chord_miss.spread
        )

    def average_steps(
        self,
        at: Evaluation,
        times: np.ndarray,
        values: np.ndarray,
        chord_miss: ChordMiss,
        average_mask: np.ndarray,
    ) -> np.ndarray:
        """Average the values at both ends of the steps in `average_mask`, and warn."""
        if not average_mask.any():
            return values
        peaks = np.where(average_mask, chord_miss.beyond / chord_miss.spread, 0.0)
        if peaks.max() > self.min_miss:
            self._warn(at, times, peaks)
        steps = len(times) - 1
        h = times[1] - times[0]
        # Mark the ends of these steps, and the steps under their hats.
        ends = np.zeros(values.shape, dtype=bool)
        ends[:-1] |= average_mask
        ends[1:] |= average_mask
        hat_steps = np.flatnonzero((ends[:-1] | ends[1:]).any(axis=1))
        # Integrate step by step, weighted with the hats of both ends.
        count = self.points if at.at_once else self.calls
        part = (np.arange(count) + 0.5) / count
        total = np.zeros(values.shape)
        for k in hat_steps:
            f = at(times[k] + h * part)
            for end, weight in ((k, 1 - part), (k + 1, part)):
                total[end] += np.add.accumulate(weight[:, None] * f, axis=0)[-1] / count
        total[[0, steps]] *= 2  # half a hat
        return np.where(ends, total, values)

    def warn_of_vibrations(
        self, at: Evaluation, times: np.ndarray, chord_miss: ChordMiss, exempt_mask: np.ndarray
    ) -> None:
        """Warn if the chords of many steps outside `exempt_mask` are far from a function."""
        coarse = np.where(exempt_mask, 0.0, chord_miss.chord / chord_miss.spread)
        column = int((coarse > self.min_miss).sum(axis=0).argmax())
        coarse_mask = coarse[:, column] > self.min_miss
        if coarse_mask.mean() <= self.vibrating:
            return
        frequency = self._frequency(at, times, int(coarse[:, column].argmax()), column)
        h = times[1] - times[0]
        warn(
            f"{function_text(at.function)} has about {frequency:.3g} Hz, which steps of {h:.3g} s "
            "do not "
            f"resolve: with {1 / (frequency * h):.2g} steps per period the motion may be off by "
            "several per cent, with 30 by less than one",
            ResolutionWarning,
        )

    def _frequency(self, at: Evaluation, times: np.ndarray, step: int, column: int) -> float:
        """Return the frequency that a function has most of around a step [Hz]."""
        h = times[1] - times[0]
        count = self.frequency_points
        window = np.arange(max(0, step - 32), min(len(times) - 1, step + 32))
        inner = (times[window, None] + h * np.arange(count) / count).ravel()
        f = at(inner)[:, column]
        energy = np.abs(np.fft.rfft((f - f.mean()) * np.hanning(len(f)))) ** 2
        return float((1 + np.argmax(energy[1:])) / (len(f) * h / count))

    def _warn(self, at: Evaluation, times: np.ndarray, peaks: np.ndarray) -> None:
        step, column = np.unravel_index(np.argmax(peaks), peaks.shape)
        h = times[1] - times[0]
        name = function_text(at.function)
        text = f"{name} changes within the step at t = {times[step]:.4g} s"
        if (peaks[:, column] > 0).mean() > 0.5:
            text = f"{name} has about {self._frequency(at, times, int(step), int(column)):.3g} Hz"
        warn(
            f"{text}, which steps of {h:.3g} s do not resolve: averages over steps are used, which "
            "keep its impulse; take a shorter step to see more of it",
            ResolutionWarning,
        )


def divisions(
    at: Evaluation,
    times: np.ndarray,
    chord_miss: ChordMiss,
    breakpoints: Breakpoints,
    averaging: Averaging,
    *,
    points: int = 17,
    remaining_miss: float = 1e-3,
    max_parts: int = 32,
    max_divided: float = 0.25,
) -> Breakpoints:
    """Return times that divide steps so that a function is nearly linear between them.

    `points` on each part of a step tell how far it is from its chord, relative to its range;
    `max_divided` is the part of the steps up to which those that miss little are divided.
    """
    h = times[1] - times[0]
    last = len(times) - 2
    # Select steps with something between their values, and those with a breakpoint.
    at_break = np.clip(((breakpoints.after - times[0]) / h).astype(int), 0, last)
    looked_at = averaging.kink_mask(chord_miss)
    looked_at[at_break, breakpoints.column] = True
    steps, columns = np.nonzero(looked_at)
    step = np.r_[steps, at_break]
    column = np.r_[columns, breakpoints.column]
    before = np.r_[times[steps], breakpoints.before]
    low = np.r_[times[steps], breakpoints.after]
    # Split them at their breakpoints into smooth intervals.
    order = np.lexsort((low, step, column))
    step, column, before, low = (array[order] for array in (step, column, before, low))
    high = times[step + 1]
    same = (np.diff(column) == 0) & (np.diff(step) == 0)
    high[:-1] = np.where(same, before[1:], high[:-1])
    # Measure how far the function is from the chord of each interval.
    grid = np.linspace(low, np.maximum(low, high), points, axis=1)
    f = at.points(grid.ravel(), np.repeat(column, points)).reshape(grid.shape)
    chords = np.linspace(f[:, 0], f[:, -1], points, axis=1)
    miss = np.abs(f - chords).max(axis=1, initial=0.0) / chord_miss.spread[column]
    # Divide those that miss too much, the more the further.
    brief = few(column[miss > averaging.noticed_miss], at.columns, max_divided * (last + 1))
    divide_mask = miss > np.where(brief, averaging.noticed_miss, averaging.min_miss)[column]
    parts = np.ceil(np.sqrt(miss / remaining_miss)).clip(1, max_parts)
    parts = np.where(divide_mask, parts, 1).astype(int)
    part = np.repeat(np.arange(len(parts)), parts - 1)
    place = np.arange(len(part)) - np.searchsorted(part, part) + 1
    moments = low[part] + (high - low)[part] * place / parts[part]
    division_points = Breakpoints(column[part], moments, moments, np.full(len(part), np.inf))
    return division_points.those(
        few(division_points.column, at.columns, last + 1)[division_points.column]
    )
