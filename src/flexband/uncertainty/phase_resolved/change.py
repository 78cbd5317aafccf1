"""How far bands of two models are apart, and how far a model is from its check runs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexband.uncertainty.expansions.expansion import Extremes
from flexband.uncertainty.phases.decomposition import Stage
from flexband.uncertainty.phases.layout import PartColumns

GAIN = 0.8
"""A carrier is used for an output where it brings the error of prediction below this part."""

DOUBT, CAUTION = 0.5, 0.3
"""Where base and envelopes are off by more than `DOUBT` of the response in runs that they have not
seen, the expansion is not trusted, and `CAUTION` of their error counts in the estimate."""

PERIODS = 2
"""Values per period at which bands are compared."""


def chosen_carriers(errors: Sequence[np.ndarray]) -> np.ndarray:
    """Return how many carriers each output gets: more only where that pays.

    Parameters
    ----------
    errors : of predicting runs with 0, 1, … carriers, each of shape (outputs,).
    """
    chosen = np.zeros(len(errors[0]), dtype=int)
    for k in range(1, len(errors)):
        now = np.stack(errors)[chosen, np.arange(len(chosen))]
        chosen = np.where(errors[k] < GAIN * now, k, chosen)
    return chosen


def steady_miss(parts: np.ndarray, unseen: Stage) -> np.ndarray:
    """Return how far base and envelopes among predicted parts miss runs, (outputs, times).

    Phases are left out: where they are off, extremes over η hardly move.
    """
    base, carriers = PartColumns.of_stage(unseen).unpack(parts)
    miss = np.abs(unseen.base - base)
    for (_, re, im), c in zip(carriers, unseen.carriers, strict=True):
        miss = miss + np.abs(c.envelope - (re + 1j * im))
    return np.sqrt(np.mean(miss**2, axis=0))


def thinned(frequencies: Sequence[float], dt: float, times: int) -> tuple[slice, int]:
    """Return the times at which bands are compared, and a period of the first carrier in steps."""
    period = 1 / (frequencies[0] * dt) if len(frequencies) else times / 50
    return slice(None, None, max(1, int(period / PERIODS))), max(1, round(period))


def stacked(found: list[Extremes]) -> np.ndarray:
    """Return the values of bounds, shape (sigmas, 2, outputs, times)."""
    return np.stack([e.values for e in found])


def apart(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return how far interval means and error bars differ, mean of both bounds, (2, …)."""
    d = np.abs(a - b)
    return np.stack([d[0, 0] + d[0, 1], d[1, 0] + d[2, 1]]) / 2


def at_all_times(v: np.ndarray, thin: slice, times: int) -> np.ndarray:
    """Return values at thinned times repeated up to the next, shape (…, times)."""
    return np.repeat(v, thin.step, axis=-1)[..., :times]
