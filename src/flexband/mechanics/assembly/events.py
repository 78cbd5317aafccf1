"""What functions of time do between the times of a run: pulses, jumps, kinks, fast vibrations.

A function is evaluated at `POINTS` points per step. A load that differs there from the chords
between its values, and that half the step would not resolve either, is replaced at the ends of
such steps by its average with a hat of two steps, ∫ f(t) (1 − |t − tₙ|/h) dt / h. The sum of these
averages is the impulse of the load, and their first moment is its own, so that the motion after a
pulse is right to second order, wherever in a step the pulse is.
"""

from __future__ import annotations

import numpy as np

from flexband.errors import ResolutionWarning, named, returned, warn
from flexband.mechanics.forms import TimeFunction

POINTS, MOST_POINTS, MOST_CALLS = 64, 2**18, 2**14
"""Points per step, and the most points of a run with one call for many of them or for each."""

POINTS_AT_ONCE = 2**20
"""The most numbers that a function is asked for in one call."""

SMALLEST_MISS, LARGEST_MISS = 0.03, 0.25
"""Of a function between its values, relative to its range over the run: what is looked at, and what
no step resolves."""

RESOLVED_FALL = 0.6
"""What is missed at half the step over what is missed at the step, where the step resolves it.

It is 1/4 for smooth functions, 1/2 at a kink amid a step, about 1 at a jump or
above half the frequency of the steps."""

AVERAGING_POINTS, AVERAGING_CALLS = 2048, 256
"""Points per step of averages, with one call for many of them or for each."""

SAME = 1e-12
"""Relative difference of values at one time and at many times at once."""

SMALLEST_RATE_JUMP, KINKED = 1e-3, 0.35
"""Relative to the largest rate, and second differences over those at twice the distance: 1/2 at a
kink, 1/4 where a function is smooth."""


def resolved_loads(function: TimeFunction, times: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the values of a load at equidistant times [s], averaged where steps miss something.

    Each column is judged alone, so no sample depends on the others. A warning names the function
    and the time where it is most beyond its values at the ends of a step, and its frequency if it
    vibrates; averages of a jump between two values need none.

    Parameters
    ----------
    values : those of the function at the times, shape (times, n).
    """
    steps, h = len(times) - 1, times[1] - times[0]
    at = _evaluation(function, values.shape[1], times)
    per = max(2, min(POINTS, (MOST_POINTS if at.at_once else MOST_CALLS) // steps) // 2 * 2)
    count = max(1, POINTS_AT_ONCE // (per * values.shape[1]))
    low, high = values.min(axis=0), values.max(axis=0)
    missed, halved, beyond = np.zeros((3, steps, values.shape[1]))
    part = np.arange(per)[:, None] / per
    for first in range(0, steps, count):
        block = slice(first, min(first + count, steps))
        number = block.stop - block.start
        inner = (times[block, None] + h * part[:, 0]).ravel()
        f = at(inner).reshape(number, per, -1)
        low, high = np.minimum(low, f.min(axis=(0, 1))), np.maximum(high, f.max(axis=(0, 1)))
        left, right = values[:-1][block, None], values[1:][block, None]
        beyond[block] = np.maximum(
            f.max(axis=1) - np.maximum(left, right)[:, 0],
            np.minimum(left, right)[:, 0] - f.min(axis=1),
        )
        middle, half = f[:, per // 2, None], 2 * part[: per // 2]
        missed[block] = np.abs(f - (left + part * (right - left))).max(axis=1)
        halved[block] = np.maximum(
            np.abs(f[:, : per // 2] - (left + half * (middle - left))).max(axis=1),
            np.abs(f[:, per // 2 :] - (middle + half * (right - middle))).max(axis=1),
        )
    spread = np.maximum(high - low, 1e-300)
    rough = (missed > SMALLEST_MISS * spread) & (halved > RESOLVED_FALL * missed)
    rough |= missed > LARGEST_MISS * spread
    if not rough.any():
        return values
    peaks = np.where(rough, beyond / spread, 0.0)
    if peaks.max() > SMALLEST_MISS:
        _warn(function, times, peaks, h, at)
    return _averaged(at, times, values, rough)


def _averaged(
    at: _Evaluation, times: np.ndarray, values: np.ndarray, rough: np.ndarray
) -> np.ndarray:
    """Return the values with averages at both ends of the steps that are `rough`."""
    steps, h = len(times) - 1, times[1] - times[0]
    ends = np.zeros(values.shape, dtype=bool)
    ends[:-1] |= rough
    ends[1:] |= rough
    needed = np.flatnonzero((ends[:-1] | ends[1:]).any(axis=1))
    count = AVERAGING_POINTS if at.at_once else AVERAGING_CALLS
    part = (np.arange(count) + 0.5) / count
    total = np.zeros(values.shape)
    for k in needed:
        f = at(times[k] + h * part)
        for end, weight in ((k, 1 - part), (k + 1, part)):
            total[end] += np.add.accumulate(weight[:, None] * f, axis=0)[-1] / count
    total[[0, steps]] *= 2  # half a hat
    return np.where(ends, total, values)


def _warn(
    function: TimeFunction,
    times: np.ndarray,
    peaks: np.ndarray,
    h: float,
    at: _Evaluation,
) -> None:
    step, column = np.unravel_index(np.argmax(peaks), peaks.shape)
    text = f"{named(function)} changes within the step at t = {times[step]:.4g} s"
    if (peaks[:, column] > 0).mean() > 0.5:
        window = np.arange(max(0, step - 8), min(len(times) - 1, step + 8))
        inner = (times[window, None] + h * np.arange(POINTS) / POINTS).ravel()
        f = at(inner)[:, column]
        energy = np.abs(np.fft.rfft((f - f.mean()) * np.hanning(len(f)))) ** 2
        frequency = np.argmax(energy) / (len(f) * h / POINTS)
        text = f"{named(function)} has about {frequency:.3g} Hz"
    warn(
        f"{text}, which steps of {h:.3g} s do not resolve: averages over steps are used, which "
        "keep its impulse; take a shorter step to see more of it",
        ResolutionWarning,
    )


def warn_of_rate_jumps(name: str, function: TimeFunction, times: np.ndarray, columns: int) -> None:
    """Warn if the rate of a prescribed motion jumps.

    Parameters
    ----------
    name : of what the function prescribes.
    times : equidistant [s].
    columns : number of samples that the function tells apart.
    """
    steps, h = len(times) - 1, times[1] - times[0]
    at = _evaluation(function, columns, times)
    per = max(4, min(POINTS, (MOST_POINTS if at.at_once else MOST_CALLS) // steps))
    count = max(8, POINTS_AT_ONCE // (per * columns))
    delta, jumps, rate = h / per, [], np.full(columns, 1e-300)
    for first in range(0, steps, count):
        last = min(first + count + 1, steps)
        inner = times[first] + delta * np.arange((last - first) * per + 1)
        f = at(np.minimum(inner, times[-1]))
        noise = 64 * np.finfo(float).eps * np.abs(f).max(axis=0)
        rate = np.maximum(rate, np.abs(np.diff(f, axis=0)).max(axis=0) / delta)
        second = np.abs(np.diff(f, 2, axis=0))
        place = np.argmax(second, axis=0)
        for column in range(columns):
            jumps.append((column, inner[place[column] + 1], second[place[column], column], noise))
    for column, time, size, noise in jumps:
        if size / delta < SMALLEST_RATE_JUMP * rate[column] or size < noise[column]:
            continue
        near = time + delta * np.linspace(-1.0, 1.0, 33)
        f = at(np.clip(near, times[0], times[-1]))[:, column]
        inside = (near[1:-1] - delta / 16 > times[0]) & (near[1:-1] + delta / 16 < times[-1])
        finer = np.abs(np.diff(f, 2) * inside).max()
        if finer > size * (1 / 16) * 2 * KINKED and finer > noise[column]:
            warn(
                f"{name} is prescribed by a function whose rate jumps near t = {time:.4g} s. No "
                "finite force can do that: reactions and Work there depend on the step; let the "
                "rate change over several steps",
                ResolutionWarning,
            )
            return


class _Evaluation:
    """A function of time at many times [s], shape (times, columns)."""

    def __init__(self, function: TimeFunction, columns: int, at_once: bool):
        self.function, self.columns, self.at_once = function, columns, at_once

    def __call__(self, times: np.ndarray) -> np.ndarray:
        if self.at_once:
            f = np.asarray(self.function(times[:, None]), dtype=float)  # pyright: ignore
            return np.broadcast_to(f, (len(times), self.columns))
        return np.array(
            [np.broadcast_to(np.ravel(returned(self.function, t)), self.columns)
             for t in times.tolist()]
        )  # fmt: skip


def _evaluation(function: TimeFunction, columns: int, times: np.ndarray) -> _Evaluation:
    """Return how a function is evaluated: at once if it takes arrays, else time by time."""
    single = _Evaluation(function, columns, at_once=False)
    together = _Evaluation(function, columns, at_once=True)
    probes = times[0] + (times[-1] - times[0]) * np.array([0.0, 0.11, 0.37, 0.83, 1.0])
    try:
        values, expected = together(probes), single(probes)
    except Exception:  # whatever a function of one time raises when it is given many
        return single
    size = np.abs(expected).max()
    return together if np.abs(values - expected).max() <= SAME * size else single
