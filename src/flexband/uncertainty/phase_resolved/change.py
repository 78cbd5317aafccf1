"""What check runs tell of a model: which carriers pay, and how far base and envelopes are off."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

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
