"""Numbers that are made of a response: quantities by name, or the extremes of its outputs."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from flexband.analysis.quantities import Quantity, made_of
from flexband.basics.checks import check_function, check_instance
from flexband.errors import InputError
from flexband.uncertainty.surrogates.axes import axes_of, names_of_outputs, series

Quantities = Mapping[str, Quantity]
"""Quantities of one number per sample, by name."""


def check_quantities(quantities: Quantities | None) -> None:
    """Raise `InputError` if these are no functions by name, or none at all."""
    if quantities is None:
        return
    check_instance("quantities", quantities, Mapping, '{"peak": fb.analysis.Peak("F")}')
    if not quantities:
        raise InputError("quantities must have one or more; got none")
    for name, quantity in quantities.items():
        check_instance("a name of quantities", name, str, "a text")
        check_function(f"quantities[{name!r}]", quantity, ", such as Peak(), of a response")


def numbers_of(response: xr.DataArray, quantities: Quantities | None) -> xr.DataArray:
    """Return numbers of every sample, dims ("sample", "quantity"), with the coordinate "unit".

    Without quantities they are the largest and the smallest value of each output over its times, or
    the outputs themselves if they have none.
    """
    if quantities is None:
        return _extremes(response)
    columns = []
    units = []
    for name, quantity in quantities.items():
        numbers = made_of(response, quantity)
        if numbers.size != len(response):
            raise InputError(
                f"quantities[{name!r}] must return one number per sample; got dims "
                f"{numbers.dims} and shape {numbers.shape}"
            )
        columns.append(numbers.values.ravel())
        units.append(str(numbers["unit"].values.item()) if "unit" in numbers.coords else "")
    return _with_labels(np.stack(columns, axis=1), list(quantities), units)


def units_by_name(response: xr.DataArray) -> list[str]:
    """Return the unit of each output, "" for those without."""
    axes = axes_of(response)
    unit = response.coords.get("unit", xr.DataArray(""))
    if not set(unit.dims) <= set(axes.dims):
        return [""] * int(np.prod(axes.shape, dtype=int))
    firsts = dict.fromkeys(set(response.dims) - set(axes.dims), 0)
    units = unit.broadcast_like(response.isel(firsts)).transpose(*axes.dims)
    return [str(text) for text in units.values.ravel()]


def _extremes(response: xr.DataArray) -> xr.DataArray:
    values = series(response)
    names = names_of_outputs(response)
    units = units_by_name(response)
    if values.shape[2] == 1:
        return _with_labels(values[..., 0], names, units)
    extremes = np.concatenate([values.max(axis=2), values.min(axis=2)], axis=1)
    kinds = [f"{kind} {name}" for kind in ("largest", "smallest") for name in names]
    return _with_labels(extremes, kinds, 2 * units)


def _with_labels(values: np.ndarray, names: list[str], units: list[str]) -> xr.DataArray:
    coords = {"quantity": names, "unit": ("quantity", units)}
    return xr.DataArray(values, coords, ("sample", "quantity"))
