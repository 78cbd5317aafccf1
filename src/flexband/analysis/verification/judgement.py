"""The error of a surrogate whose method estimates none, from verification runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexband.uncertainty.surrogates.axes import axes_of, units_of
from flexband.uncertainty.surrogates.bands import BandRecord
from flexband.uncertainty.surrogates.diagnostics import missed_part, rms, trust
from flexband.uncertainty.surrogates.held_out import HeldOut
from flexband.uncertainty.surrogates.sigmas import growth, relative_to_bars
from flexband.uncertainty.surrogates.surrogate import Surrogate


def judge_by_runs(
    surrogate: Surrogate,
    runs: tuple[np.ndarray, np.ndarray, np.ndarray],
    missed: np.ndarray,
    weight: np.ndarray,
    *,
    window: float = 0.02,
) -> Surrogate:
    """Return a surrogate with the error that is expected from its verification runs.

    It is the surrogate itself if its method has runs of its own that judge it.

    Parameters
    ----------
    runs : ξ, η and values of the runs, (runs, outputs, times).
    missed : what the surrogate misses of them, of the same shape.
    weight : of each run, (runs,).
    window : part of the times over which the error at each is averaged.
    """
    record = BandRecord.read(surrogate.diagnostics)
    if "error_bar_expected_error" in surrogate.diagnostics and not record.judged_by:
        return surrogate
    (xi, eta, F), labels = runs, surrogate.labels
    times = F.shape[-1]
    half = min(times, max(1, round(window * times)))
    no_overshoot = np.zeros(F.shape[1:])
    held_out = HeldOut(xi, eta, missed, no_overshoot, half, weight)
    error = held_out.expected_error(surrogate.space.interval_dimension)
    error = np.maximum(error, np.finfo(float).eps * rms(F)[:, None]).reshape(labels.shape[1:])
    of_mean = growth(0) if surrogate.space.random_dimension else 1.0
    parts = missed_part(missed, F, units_of(labels))
    dims = labels.dims[1:]
    trusted = trust(labels, parts, "its variation in verification runs")
    diagnostics = surrogate.diagnostics.assign(
        mean_expected_error=(dims, of_mean * error),
        error_bar_expected_error=(dims, error),
        trusted=trusted["trusted"],
    )
    bar = surrogate.bands()["error_bar"].transpose("bound", *dims)
    relative = relative_to_bars(diagnostics, bar, F, units_of(labels))
    diagnostics = diagnostics.assign(relative_expected_error=(axes_of(labels).dims, relative))
    attrs = {
        "judged_by": "verification runs",
        "expected_error": float(np.max(relative)),
        **trusted.attrs,
    }
    return replace(surrogate, held_out=held_out, diagnostics=diagnostics.assign_attrs(attrs))
