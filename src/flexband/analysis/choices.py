"""Answers over all combinations of options."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr


def over_options(answers_by_label: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Return the lowest of all lower and the highest of all upper bounds.

    Variables with a dim "bound" are bounds, ``<name>_at`` their places. ``<name>_choice`` names the
    combination of options that a bound is due to. Errors are the largest of all combinations.

    Parameters
    ----------
    answers_by_label : label of the combination -> its answer.
    """
    names, answers = list(answers_by_label), list(answers_by_label.values())
    if len(answers) == 1:
        return answers[0]
    result = answers[0].copy()
    for name, variable in answers[0].data_vars.items():
        if str(name).endswith("_at"):
            continue
        values = np.stack([answer[name].transpose(*variable.dims).values for answer in answers])
        if "bound" not in variable.dims or str(name).endswith("_error"):
            result[name] = variable.dims, values.max(axis=0), variable.attrs
            continue
        axis = variable.dims.index("bound")
        moved = np.moveaxis(values, axis + 1, 1)
        best = np.stack([moved[:, 0].argmin(axis=0), moved[:, 1].argmax(axis=0)])
        best = np.moveaxis(best, 0, axis)
        result[name] = (
            variable.dims,
            np.take_along_axis(values, best[None], axis=0)[0],
            variable.attrs,
        )
        result[f"{name}_choice"] = variable.dims, np.array(names)[best]
        result[f"{name}_choice"].attrs["long_name"] = f"options at the bounds of the {name}"
        at = f"{name}_at"
        if at in answers[0]:
            stacked = xr.concat([answer[at] for answer in answers], "option")
            chosen = xr.DataArray(best, dims=variable.dims)
            result[at] = stacked.isel(option=chosen).transpose(*answers[0][at].dims)
            result[at].attrs = answers[0][at].attrs
    return result
