"""Which dims of a response are its outputs, and which is time: one rule for all that reads it.

Time is the last dim, whatever its name is. A last dim that is called "output", or whose labels are
texts, is none: every entry is an output of its own, at one time.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
import xarray as xr

from flexband.basics.rounding import Units


class Axes(NamedTuple):
    """The axes of a response or of its bands, but the first: that of runs, or of the bounds."""

    # of the outputs
    dims: tuple[Hashable, ...]
    shape: tuple[int, ...]
    time: str | None  # the dim of time; None where there is none
    times: int  # number of times; 1 where there is no such dim


def axes_of(values: xr.DataArray) -> Axes:
    """Return the axes of a response with the first dim "sample", or of bands with "bound"."""
    dims = values.dims[1:]
    shape = values.shape[1:]
    if not dims or dims[-1] == "output" or _has_texts(values, dims[-1]):
        return Axes(dims, shape, None, 1)
    return Axes(dims[:-1], shape[:-1], str(dims[-1]), shape[-1])


def units_of(values: xr.DataArray, dims: Sequence[Hashable] | None = None) -> Units:
    """Return the units of outputs of a response or its bands, along `dims` or of `axes_of`."""
    return Units.along(values, axes_of(values).dims if dims is None else dims)


def _has_texts(values: xr.DataArray, dim: Hashable) -> bool:
    if dim not in values.coords:
        return False
    dim_labels = values[dim].values
    return dim_labels.dtype.kind in "US" or (
        dim_labels.dtype == object and isinstance(dim_labels[0], str)
    )


def series(values: xr.DataArray) -> np.ndarray:
    """Return a response as runs, outputs and times."""
    return values.values.reshape(len(values), -1, axes_of(values).times)


def names_of_outputs(labels: xr.DataArray) -> list[str]:
    """Return the names of the outputs of a response of shape (runs, …), "the response" for one."""
    dims = axes_of(labels).dims
    names = product(
        *(labels[d].values if d in labels.coords else range(labels.sizes[d]) for d in dims)
    )
    return [", ".join(map(str, name)) or "the response" for name in names]
