"""What figures and charts draw of results, as numbers and words."""

from __future__ import annotations

import numpy as np
import xarray as xr

from flexband.errors import InputError
from flexband.report.text.band_tables import deviations, outputs_of, select


def series(data: xr.DataArray, output: str) -> tuple[np.ndarray, np.ndarray]:
    """Return x and values (..., x) of an output of one variable at most, bounds first."""
    output_data = select(data, output)
    if "bound" in output_data.dims:
        output_data = output_data.transpose("bound", ...)
    last = str(output_data.dims[-1]) if output_data.dims else "bound"
    if output_data.ndim > 1 + ("bound" in output_data.dims):
        raise InputError(
            f"an output must depend on one variable at most; got dims {output_data.dims}"
        )
    if last == "bound":
        return np.zeros(1), output_data.values[..., None]
    x = output_data[last].values
    return (x if x.dtype.kind in "iuf" else np.arange(len(x))), output_data.values


def bounds(bands: xr.Dataset) -> dict[str, str]:
    """Return what interval mean and interval error bar are, by variable."""
    deviation = deviations(bands)
    return {
        "mean": "Interval mean: the range of the mean μ over all values of the interval inputs",
        "error_bar": f"Interval error bar: the range from the lowest μ − {deviation} to the "
        f"highest μ + {deviation} over all values of the interval inputs",
    }


def drawable_outputs(data: xr.DataArray) -> list[str]:
    """Return the outputs if each is a function of at most one variable, or an empty list."""
    domain_dims = [d for d in data.dims if d not in ("output", "bound")]
    return outputs_of(data) if len(domain_dims) <= 1 else []


def is_likely(probability: xr.Dataset | None) -> bool:
    """Return whether limits are violated with some probability at a time, so that it is drawn."""
    return probability is not None and bool((probability["at_each_time"] > 0).any())
