"""Which input matters when: how much narrower bands are with an input at its nominal value.

Let W be the width of the error bar, and W_S that with the inputs S at their midpoints and means.
The contribution of an input is W − W_i. The interaction, W less the sum of all contributions, may
have either sign. Shapley's values share W among the inputs: the mean of W_S − W_{S∪i} over all
orders in which the inputs are fixed.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from itertools import combinations
from math import comb

import numpy as np
import xarray as xr

from flexband.analysis.intervals import over_intervals
from flexband.analysis.labelled_answers import Variables, answer, check_free, expected_error, places
from flexband.analysis.selection import AnySurrogate, Labels
from flexband.basics.checks import check_flag
from flexband.errors import InputError
from flexband.uncertainty.expansions.expansion import extremes_of
from flexband.uncertainty.inputs.narrowing import fix_inputs
from flexband.uncertainty.surrogates.axes import units_of
from flexband.uncertainty.surrogates.sigmas import checked_sigmas, not_constant
from flexband.uncertainty.surrogates.surrogate import Surrogate

LONG_NAMES = {
    "varies": "whether the output varies beyond rounding",
    "width": "width of the error bar",
    "contribution": "by how much the error bar is narrower with the input at its nominal value",
    "interaction": "width of the error bar less the sum of all contributions",
    "shapley": "part of the width that Shapley's value gives the input",
    "mean_share": "mean contribution over time, as a part of the mean width",
    "share_at_widest": "contribution where the error bar is the widest, as a part of its width",
    "shapley_mean_share": "mean of Shapley's value over time, as a part of the mean width",
    "shapley_share_at_widest": "Shapley's value where the error bar is the widest, as a part of it",
    "worst_at": "values of the interval inputs at the ends of the error bar",
    "expected_error": "error expected of each width, twice that of the error bar",
}


def contributions(
    surrogate: AnySurrogate,
    *,
    sigmas: float = 1.0,
    shapley: bool = False,
    at: Labels | None = None,
) -> xr.Dataset:
    """Return how much each input widens the error bar of every output, over time.

    Parameters
    ----------
    surrogate : what `expand` or `load_surrogate` returns. No runs are made.
    sigmas : k of the error bar, from the lowest μ − kσ to the highest μ + kσ.
    shapley : whether Shapley's values are found as well, of up to eight inputs.
    at : dimension of the response -> its labels, as for `quantiles`.

    Returns
    -------
    Dataset with the dims of the outputs, and "name" for the inputs, the one that matters most
    first. Correlated inputs count as one, under their name in `inputs`:

    - `width` of the error bar;
    - `contribution`, by how much the error bar is narrower with an input at its midpoint or mean;
    - `interaction`, the width less the sum of the contributions, which may be negative;
    - `varies`, false for outputs that are constant, or nothing but rounding errors;
    - `mean_share` and `share_at_widest`, the contribution as a part of the width, 0 of constants;
    - `shapley`, which add up to the width, and `shapley_mean_share` and `shapley_share_at_widest`;
    - `worst_at`, with the dims "bound" and "input": at which values of the interval inputs the
      lower and the upper end of the error bar are reached;
    - `expected_error` of a width, if the method gives one.

    With choices, widths and contributions are the largest of all combinations of options.

    Raises
    ------
    InputError
        If `surrogate` is not a surrogate, `sigmas` is not positive, `at` does not fit the response,
        or there are more than eight inputs to share the width among.

    Examples
    --------
    >>> inputs = {"length": fb.Interval(0.8, 1.2), "pivot": fb.Interval(-0.1, 0.1)}
    >>> surrogate = fb.expand(lambda length, pivot: length + pivot, inputs, fb.PCCI(0, 1))
    >>> result = fb.analysis.contributions(surrogate)
    >>> result["name"].values.tolist(), result["contribution"].values.round(4)
    (['length', 'pivot'], array([0.4, 0.2]))
    """
    k, shapley = checked_sigmas(sigmas), check_flag("shapley", shapley)
    joint = over_intervals(lambda case: _contributions(case, k, shapley=shapley), surrogate, at)
    share = joint["mean_share"]
    largest = share.max([dim for dim in share.dims if dim != "name"])
    return joint.isel(name=np.argsort(-largest.values, kind="stable"))


def groups(surrogate: Surrogate) -> dict[str, list[str]]:
    """Return the inputs that are fixed together, by name: correlated ones, and each other alone."""
    space = surrogate.space
    singles = {name: [name] for name in space.uncertain if name not in space.dependent_names}
    return singles | {name: list(group.members) for name, group in space.groups.items()}


def _contributions(surrogate: Surrogate, sigmas: float, *, shapley: bool) -> xr.Dataset:
    """Return what `contributions` does, for one combination of options."""
    labels = surrogate.labels
    members = groups(surrogate)
    check_free(labels, "name", "bound", "input", *LONG_NAMES)
    names = list(members)
    dims = labels.dims[1:]
    shape = labels.shape[1:]
    if shapley and len(names) > 8:  # 2⁸ bands are to be found
        raise InputError(f"shapley takes at most 8 inputs; got {len(names)}: {', '.join(names)}")
    lower, upper = extremes_of(surrogate.expansions, sigmas=sigmas, of=(-1.0, 1.0))
    width = (upper.values[1] - lower.values[0]).reshape(shape)
    of_outputs = [dim for dim in dims if dim != surrogate.time]
    vary = not_constant(lower.values[0], upper.values[1], units_of(labels, of_outputs))
    vary = vary.reshape([labels.sizes[dim] for dim in of_outputs])

    def narrower(subset: Collection[str]) -> np.ndarray:
        """Return the width with a subset of the inputs fixed."""
        if len(subset) == len(names):
            return np.zeros(shape)
        substitution = fix_inputs(
            surrogate.space, [member for k in subset for member in members[k]]
        )
        parts = [expansion.substitute(*substitution) for expansion in surrogate.expansions]
        low, high = extremes_of(parts, sigmas=sigmas, of=(-1.0, 1.0))
        return (high.values[1] - low.values[0]).reshape(shape)

    # Find the contributions, and Shapley's values.
    contribution = np.stack([width - narrower([name]) for name in names])
    data: Variables = {
        "varies": (of_outputs, vary),
        "width": (dims, width),
        "contribution": (("name", *dims), contribution),
        "interaction": (dims, width - contribution.sum(axis=0)),
        **_shares(contribution, width, vary, surrogate),
    }
    if shapley:
        values = _shapley(names, width, narrower, contribution)
        data["shapley"] = ("name", *dims), values
        shares = _shares(values, width, vary, surrogate)
        data |= {f"shapley_{name}": variable for name, variable in shares.items()}
    # Add where the ends are, and the expected error.
    eta = np.stack([lower.places[0], upper.places[1]])
    data |= places("worst_at", surrogate.space, eta, ("bound", *dims), (2, *shape))
    if (error := expected_error(surrogate, sigmas)) is not None:
        data["expected_error"] = dims, 2 * error
    shares = [name for name in LONG_NAMES if "share" in name]
    long_names = LONG_NAMES
    if surrogate.time is None:
        long_names = LONG_NAMES | dict.fromkeys(shares, "part of the width")
    attrs = {"sigmas": sigmas}
    return answer(surrogate, data, {"name": names}, attrs, long_names, unitless=shares)


def _shares(
    parts: np.ndarray, width: np.ndarray, vary: np.ndarray, surrogate: Surrogate
) -> Variables:
    """Return what inputs have of the width, (names, …, times), relative to it; 0 of constants."""
    times = surrogate.times
    dims = surrogate.labels.dims[1:]
    shape = width.shape
    outer = shape if surrogate.time is None else shape[:-1]
    width = width.reshape(*outer, times)
    parts = parts.reshape(-1, *outer, times)
    widest = np.argmax(width, axis=-1, keepdims=True)
    at_widest = np.take_along_axis(parts, widest[None], axis=-1)[..., 0]
    share_dims = ("name", *(dim for dim in dims if dim != surrogate.time))
    return {
        "mean_share": (share_dims, parts.mean(-1) / np.where(vary, width.mean(-1), np.inf)),
        "share_at_widest": (share_dims, at_widest / np.where(vary, width.max(-1), np.inf)),
    }


def _shapley(
    names: list[str],
    width: np.ndarray,
    narrower: Callable[[Collection[str]], np.ndarray],
    contribution: np.ndarray,
) -> np.ndarray:
    """Return Shapley's values, (names, …), of a width; `contribution` is of single inputs."""
    n = len(names)
    widths = {frozenset[str](): width}
    widths |= {frozenset([name]): width - contribution[k] for k, name in enumerate(names)}
    for size in range(2, n + 1):
        widths |= {frozenset(subset): narrower(subset) for subset in combinations(names, size)}
    values = np.zeros((n, *width.shape))
    for k, name in enumerate(names):
        for subset, subset_width in widths.items():
            if name not in subset:
                values[k] += (subset_width - widths[subset | {name}]) / (
                    n * comb(n - 1, len(subset))
                )
    return values
