"""Answers over the interval inputs, and over all combinations of options."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import xarray as xr

from flexband.analysis.selection import AnySurrogate, Labels, select_places, surrogates_of
from flexband.uncertainty.surrogates.surrogate import Surrogate


def over_intervals(
    functional: Callable[[Surrogate], xr.Dataset],
    surrogate: AnySurrogate,
    at: Labels | None = None,
    highest: str = "",
) -> xr.Dataset:
    """Return the bounds of a functional of a response over its interval inputs and options.

    `functional` returns its bounds over the intervals, dim "bound", for a combination of options;
    `at` has the labels, by dimension of the response, where they are needed only; `highest` is a
    variable without this dim, which has an upper bound only.
    """
    cases = surrogates_of(surrogate)
    selections = {label: select_places(case, at) for label, case in cases.items()}
    return over_options({label: functional(case) for label, case in selections.items()}, highest)


def over_options(answers_by_label: Mapping[str, xr.Dataset], highest: str = "") -> xr.Dataset:
    """Return the lowest of all lower and the highest of all upper bounds of answers, by label.

    Variables with a dim "bound" are bounds, ``<name>_at`` their places; `highest` is one that is an
    upper bound. ``<name>_choice`` names the combination of options that a bound is due to. Errors
    are the largest of all combinations; ``<name>_nominal`` is that of the first.
    """
    names = list(answers_by_label)
    answers = list(answers_by_label.values())
    if len(answers) == 1:
        return answers[0]
    result = answers[0].copy()
    for name, variable in answers[0].data_vars.items():
        if str(name).endswith(("_at", "_nominal")):
            continue
        values = np.stack([answer[name].transpose(*variable.dims).values for answer in answers])
        if name != highest and ("bound" not in variable.dims or str(name).endswith("_error")):
            result[name] = variable.dims, values.max(axis=0), variable.attrs
            continue
        # Find which combination has each bound, and take its place as well.
        best = values.argmax(axis=0)
        if name != highest:
            lowest = np.asarray(variable["bound"].values == "lower")
            axis = variable.dims.index("bound")
            at_lower = np.expand_dims(lowest, [k for k in range(variable.ndim) if k != axis])
            best = np.where(at_lower, values.argmin(axis=0), best)
        bounds = np.take_along_axis(values, best[None], axis=0)[0]
        result[name] = variable.dims, bounds, variable.attrs
        result[f"{name}_choice"] = variable.dims, np.array(names)[best]
        result[f"{name}_choice"].attrs.update(long_name=f"options at the bounds of the {name}")
        at = f"{name}_at"
        if at in answers[0]:
            stacked = xr.concat([answer[at] for answer in answers], "option")
            option_numbers = xr.DataArray(best, dims=variable.dims)
            result[at] = stacked.isel(option=option_numbers).transpose(*answers[0][at].dims)
            result[at].attrs = answers[0][at].attrs
    return result
