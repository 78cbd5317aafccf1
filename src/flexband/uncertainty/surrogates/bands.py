"""The result: interval mean and interval error bar as a labelled dataset."""

from __future__ import annotations

import numpy as np
import xarray as xr

from flexband.uncertainty.expansions.bounds import Extremes
from flexband.uncertainty.inputs.space import Space

BOUNDS = ["lower", "upper"]
SIGMAS = (0.0, -1.0, 1.0)
"""Multiples of σ whose bounds make the bands: μ, μ − σ and μ + σ of Eqs. (3) and (4)."""


def bands(space: Space, labels: xr.DataArray, found: list[Extremes]) -> xr.Dataset:
    """Return the dataset of bands.

    Parameters
    ----------
    labels : a response of shape (runs, ...), for its dims and coordinates.
    found : bounds of μ, μ − σ and μ + σ, in this order.

    Returns
    -------
    Variables with first dim "bound" (lower, upper): `mean` is [μ] of Eq. (3), `error_bar` is [eb]
    of Eq. (5), `error_bar_lower` and `error_bar_upper` are [eb_l] and [eb_u] of Eq. (4);
    `mean_at` and `error_bar_at` give, along dim "input", the interval inputs' values at which the
    bounds are reached.
    """
    mean, lower, upper = found
    dims, shape = labels.dims[1:], labels.shape[1:]

    def variable(values: np.ndarray):
        return ("bound", *dims), values.reshape(2, *shape)

    def places(low: np.ndarray, high: np.ndarray):
        eta = np.stack([low, high])
        columns = [i.value(eta[..., k].reshape(-1, 1)) for k, i in enumerate(intervals.values())]
        values = np.stack([c.reshape(2, *shape) for c in columns])
        return ("input", "bound", *dims), values

    data = {
        "mean": variable(mean.values),
        "error_bar": variable(np.stack([lower.values[0], upper.values[1]])),
        "error_bar_lower": variable(lower.values),
        "error_bar_upper": variable(upper.values),
    }
    coords = {k: c.variable for k, c in labels.coords.items() if "sample" not in c.dims}
    coords["bound"] = xr.Variable("bound", BOUNDS)
    intervals = space.intervals
    if intervals:
        data["mean_at"] = places(mean.places[0], mean.places[1])
        data["error_bar_at"] = places(lower.places[0], upper.places[1])
        coords["input"] = xr.Variable("input", list(intervals))
    return xr.Dataset(data, coords)
