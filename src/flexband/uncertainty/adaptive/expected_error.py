"""What both phase-resolved methods need to tell how far their bands are off."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from scipy.signal import fftconvolve

from flexband.errors import InputError
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


def series(values: xr.DataArray) -> np.ndarray:
    """Return a response as runs, outputs and times: all dims but the last, and the last."""
    shape = values.shape[1:]
    return values.values.reshape(len(values), -1, shape[-1] if shape else 1)


def step(values: xr.DataArray) -> float:
    """Return the step of the last dimension; 1 where it has no coordinate.

    Raises
    ------
    InputError
        Where it is not equidistant.
    """
    last = values.dims[-1]
    if values.ndim < 2 or values.shape[-1] < 2 or last not in values.coords:
        return 1.0
    times = values[last].values
    if not np.issubdtype(times.dtype, np.number):
        return 1.0
    steps = np.diff(times)
    if np.ptp(steps) > 1e-6 * np.abs(steps).max():
        raise InputError(
            f"a phase-resolved expansion needs equidistant values of {last!r}; "
            f"got steps from {steps.min():g} to {steps.max():g} "
            "(AdaptivePCCI(phase_resolved=False) takes any)"
        )
    return float(np.mean(steps))


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


def steady_miss(parts: np.ndarray, unseen: Stage, weight: np.ndarray | float = 1.0) -> np.ndarray:
    """Return how far base and envelopes among predicted parts miss runs, (outputs, times).

    Runs count by a weight of shape (runs, 1, 1), or all alike. Phases are left out: where they are
    off, extremes over η hardly move.
    """
    base, carriers = PartColumns.of_stage(unseen).unpack(parts)
    miss = np.abs(unseen.base - base)
    for (_, re, im), c in zip(carriers, unseen.carriers, strict=True):
        miss = miss + np.abs(c.envelope - (re + 1j * im))
    return np.sqrt(np.mean((weight * miss) ** 2, axis=0))


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


def running(v: np.ndarray, half: int) -> np.ndarray:
    """Return the root mean square over ±half times."""
    window = np.ones((1, 2 * half + 1))
    square = v.reshape(-1, v.shape[-1]) ** 2
    top = fftconvolve(square, window, mode="same", axes=-1)
    count = fftconvolve(np.ones((1, v.shape[-1])), window, mode="same", axes=-1)
    return np.sqrt(np.maximum(top / count, 0.0)).reshape(v.shape)


def diagnostics(
    labels: xr.DataArray,
    error: np.ndarray,
    carriers: np.ndarray,
    trusted: np.ndarray,
    frequencies: Sequence[float],
) -> xr.Dataset:
    """Return what a phase-resolved method says of its bands, labelled like the response.

    Parameters
    ----------
    labels : a response of shape (runs, …).
    error : expected of mean and error bar, (2, outputs, times).
    carriers, trusted : of each output.
    """
    dims, shape = labels.dims[1:], labels.shape[1:]
    return xr.Dataset(
        {
            "mean_expected_error": (dims, error[0].reshape(shape)),
            "error_bar_expected_error": (dims, error[1].reshape(shape)),
            "carriers": (dims[:-1], carriers.reshape(shape[:-1])),
            "trusted": (dims[:-1], trusted.reshape(shape[:-1])),
        },
        attrs={"carrier_frequencies": list(frequencies)},
    )


def rms(v: np.ndarray) -> np.ndarray:
    """Return the root mean square over runs and times, (outputs,)."""
    return np.sqrt(np.mean(v**2, axis=(0, 2)))
