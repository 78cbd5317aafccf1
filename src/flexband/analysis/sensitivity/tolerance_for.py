"""The tolerance of one input with which an error bar has a given part of its width."""

from __future__ import annotations

from functools import cache

import numpy as np
import xarray as xr

from flexband.analysis.allocation.tolerances import with_tolerance
from flexband.analysis.labelled_answers import answer, check_free
from flexband.analysis.selection import AnySurrogate, surrogates_of
from flexband.basics.checks import check_fraction
from flexband.basics.warning import without_warnings
from flexband.basics.words import value_text
from flexband.errors import InputError
from flexband.uncertainty.inputs.choices import Sizing
from flexband.uncertainty.inputs.constants import is_number
from flexband.uncertainty.inputs.fields.random_field import RandomField
from flexband.uncertainty.inputs.inputs import Input
from flexband.uncertainty.surrogates.axes import axes_of, units_of
from flexband.uncertainty.surrogates.sigmas import checked_sigmas, not_constant
from flexband.uncertainty.surrogates.surrogate import Surrogate

LONG_NAMES = {
    "width": "largest width of the error bar",
    "least_width": "largest width of the error bar with the input at its nominal value",
    "factor": "part of the input's tolerance",
    "tolerance": "tolerance of the input: half the width of an interval, or a standard deviation",
}


def tolerance_for(
    surrogate: AnySurrogate, name: str, share: float = 0.5, *, sigmas: float = 1.0
) -> xr.Dataset:
    """Return the tolerance of an input that reduces error bars to a fraction of their width.

    All other inputs stay as they are. No runs are made.

    Parameters
    ----------
    surrogate : what `expand` or `load_surrogate` returns, of a response without choices.
    name : an interval, a distribution with a number `std`, or a normal `RandomField`.
    share : fraction of the largest width over time, between 0 and 1; 0.5 halves the band.
    sigmas : k of the error bar.

    Returns
    -------
    Dataset with the dims of the response but its last, time. `tolerance`, half the width of an
    interval or a standard deviation, is the largest with which the width is at most `share` of what
    it is, for it and for all smaller ones that are tried; NaN if there is none. `factor` is the
    same as a fraction of the present tolerance; `width` and `least_width` are the largest widths
    with the latter, and without any.

    Raises
    ------
    InputError
        If `surrogate` is not a surrogate or has choices, `name` is not such an input, or
        `share` or `sigmas` are out of their ranges.

    Examples
    --------
    >>> inputs = {"length": fb.Interval(0.8, 1.2), "pivot": fb.Interval(-0.1, 0.1)}
    >>> surrogate = fb.expand(lambda length, pivot: length + pivot, inputs, fb.PCCI(0, 1))
    >>> float(fb.analysis.tolerance_for(surrogate, "length", share=0.5)["tolerance"].round(3))
    0.05
    """
    surrogates = surrogates_of(surrogate)
    k = checked_sigmas(sigmas)
    if len(surrogates) > 1:
        raise InputError("tolerance_for takes a surrogate without choices, that of one option")
    (plain_surrogate,) = surrogates.values()
    share = check_fraction("share", share)
    tolerance, input_ = _tolerance(plain_surrogate, name)
    labels = plain_surrogate.labels
    check_free(labels, "bound")
    dims, shape, time, _ = axes_of(labels)

    def ends(part: Surrogate) -> tuple[np.ndarray, np.ndarray]:
        _, lower, upper = part.extremes(k)
        return lower.values[0], upper.values[1]

    @cache
    def width(factor: float) -> np.ndarray:
        with without_warnings():  # of inputs that are only tried
            part = plain_surrogate.narrowed(**{name: input_.with_tolerance(factor * tolerance)})
        lower, upper = ends(part)
        return (upper - lower).reshape(*shape, -1).max(axis=-1)

    # Try some factors, then halve the interval between the last that is enough and the next.
    lower, upper = ends(plain_surrogate)
    before = (upper - lower).reshape(*shape, -1).max(axis=-1)
    vary = not_constant(lower, upper, units_of(labels)).reshape(shape)
    factors = np.linspace(0.0, 1.0, 9)
    min_factor = 1e-6  # a part of the tolerance that counts as none
    widths = np.stack([width(max(f, min_factor)) for f in factors[:-1]])
    target_width = share * before
    narrow = np.logical_and.accumulate(widths <= target_width, axis=0).sum(axis=0)
    largest_factor = np.full(shape, np.nan)
    for at in np.argwhere(narrow > 0):
        place = tuple(at)
        low = factors[narrow[place] - 1]
        high = factors[narrow[place]]
        for _ in range(12):
            middle = (low + high) / 2
            inside = width(max(middle, min_factor))[place] <= target_width[place]
            low, high = (middle, high) if inside else (low, middle)
        largest_factor[place] = low
    largest_factor[~vary] = np.nan
    data = {
        "varies": (dims, vary),
        "width": (dims, before),
        "least_width": (dims, widths[0]),
        "factor": (dims, largest_factor),
        "tolerance": (dims, largest_factor * tolerance),
    }
    attrs = {"sigmas": k, "share": share, "input": name}
    frame = labels if time is None else labels.isel({time: 0}, drop=True)
    unitless = "factor", "tolerance"
    result = answer(plain_surrogate, data, {}, attrs, LONG_NAMES, frame, unitless)
    return result.drop_vars("bound")


def _tolerance(surrogate: Surrogate, name: str) -> tuple[float, Input]:
    inputs = surrogate.space.inputs
    allowed = with_tolerance(surrogate.space)
    allowed = {k: v for k, v in allowed.items() if not isinstance(inputs[k], Sizing)}
    for input_name, field in inputs.items():
        if isinstance(field, RandomField) and field.distribution == "normal":
            allowed |= {input_name: float(field.std)} if is_number(field.std) else {}
    if not isinstance(name, str) or name not in allowed:
        raise InputError(
            "name must be an input with a tolerance, an interval, a distribution with a std or a "
            f"normal RandomField, which are {', '.join(allowed) or 'none'}; got {value_text(name)}"
        )
    return allowed[name], inputs[name]
