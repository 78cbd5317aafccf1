"""The result: interval mean and interval error bar as a labelled dataset."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from flexband.uncertainty.expansions.expansion import Extremes
from flexband.uncertainty.inputs.evaluation import coordinates
from flexband.uncertainty.inputs.space import Space

BOUNDS = ["lower", "upper"]

VARIABLES = frozenset(
    ("mean", "error_bar", "error_bar_lower", "error_bar_upper", "mean_at", "error_bar_at")
)
"""Names in the dataset of bands."""


def bands(
    space: Space, labels: xr.DataArray, found: Sequence[Extremes], sigmas: float
) -> xr.Dataset:
    """Return the dataset of bands.

    Parameters
    ----------
    labels : a response of shape (runs, ...), for its dims and coordinates.
    found : bounds of μ, μ − kσ and μ + kσ, in this order.
    sigmas : k.

    Returns
    -------
    Variables with first dim "bound" (lower, upper): `mean` is [μ] of Eq. (3), `error_bar` is [eb]
    of Eq. (5), `error_bar_lower` and `error_bar_upper` are [eb_l] and [eb_u] of Eq. (4), with kσ
    in place of σ, where k is ``attrs["sigmas"]``;
    `mean_at` and `error_bar_at` give, along dim "input", the values of the interval inputs at which
    the bounds are reached.
    """
    mean, lower, upper = found
    dims, shape = ("bound", *labels.dims[1:]), (2, *labels.shape[1:])

    def variable(values: np.ndarray):
        return dims, values.reshape(shape)

    def places(low: np.ndarray, high: np.ndarray):
        eta = np.stack([low, high]).reshape(-1, low.shape[-1])
        values = intervals.values(np.zeros((len(eta), 0)), eta).values()
        return ("input", *dims), np.array(list(values)).reshape(-1, *shape)

    data = {
        "mean": variable(mean.values),
        "error_bar": variable(np.stack([lower.values[0], upper.values[1]])),
        "error_bar_lower": variable(lower.values),
        "error_bar_upper": variable(upper.values),
    }
    coords = {k: c.variable for k, c in coordinates(labels).items()}
    coords["bound"] = xr.Variable("bound", BOUNDS)
    intervals = Space(space.of_kind(random=False))
    if intervals.inputs:
        data["mean_at"] = places(mean.places[0], mean.places[1])
        data["error_bar_at"] = places(lower.places[0], upper.places[1])
        coords["input"] = xr.Variable("input", list(intervals.inputs))
    return xr.Dataset(data, coords, {"sigmas": sigmas})
