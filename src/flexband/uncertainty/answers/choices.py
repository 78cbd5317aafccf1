"""Answers over all combinations of options."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr


def over_options(found: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Return the lowest of all lower and the highest of all upper bounds.

    Variables with a dim "bound" are bounds, ``<name>_at`` their places. ``<name>_choice`` names the
    combination of options that a bound is due to. Errors are the largest of all combinations.

    Parameters
    ----------
    found : label of the combination -> its answer.
    """
    names, answers = list(found), list(found.values())
    if len(answers) == 1:
        return answers[0]
    result = answers[0].copy()
    for name, own in answers[0].data_vars.items():
        if str(name).endswith("_at"):
            continue
        values = np.stack([one[name].transpose(*own.dims).values for one in answers])
        if "bound" not in own.dims or str(name).endswith("_error"):
            result[name] = own.dims, values.max(axis=0), own.attrs
            continue
        axis = own.dims.index("bound")
        moved = np.moveaxis(values, axis + 1, 1)
        best = np.stack([moved[:, 0].argmin(axis=0), moved[:, 1].argmax(axis=0)])
        best = np.moveaxis(best, 0, axis)
        result[name] = own.dims, np.take_along_axis(values, best[None], axis=0)[0], own.attrs
        result[f"{name}_choice"] = own.dims, np.array(names)[best]
        result[f"{name}_choice"].attrs["long_name"] = f"options at the bounds of the {name}"
        at = f"{name}_at"
        if at in answers[0]:
            stacked = xr.concat([one[at] for one in answers], "option")
            chosen = xr.DataArray(best, dims=own.dims)
            result[at] = stacked.isel(option=chosen).transpose(*answers[0][at].dims)
            result[at].attrs = answers[0][at].attrs
    return result
