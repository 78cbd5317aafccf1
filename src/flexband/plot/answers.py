"""Answers over time: what widens the error bar, margins and probabilities; tolerances as bars."""

from __future__ import annotations

from itertools import cycle
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from flexband.errors import InputError, known
from flexband.plot.series import (
    SYMBOLS,
    label,
    legend_above,
    literal,
    output_of,
    series,
    symbol,
    variable_of,
    with_unit,
)
from flexband.plot.style import LINES, MIDDLE, axes_of, shades


def contributions(
    found: xr.Dataset,
    output: str | None = None,
    *,
    variable: str = "contribution",
    ax: Axes | None = None,
) -> Axes:
    """Draw what each input contributes to the width of the error bar, above each other.

    Where they add up to less than the width, inputs act together; what is negative is not drawn.

    Parameters
    ----------
    found : result of `contributions`.
    output : name of the output; it may be left out if there is only one.
    variable : "contribution" or "shapley", which adds up to the width.
    ax : axes to draw on, those of a new figure by default.

    Returns
    -------
    The axes.

    Raises
    ------
    InputError
        If `found` is no result of `contributions`, has no such output or variable, or does not
        depend on time.
    """
    known("variable", variable, ("contribution", "shapley"))
    of = "contributions" if variable == "contribution" else "contributions with shapley=True"
    each = variable_of("found", found, variable, of).transpose("name", ...)
    width = variable_of("found", found, "width", "contributions")
    output = output_of(width, output)
    x, total = series(width, output)
    stacked = [np.maximum(series(one, output)[1], 0.0) for one in each]
    names = [symbol(str(name)) for name in each["name"].values]
    ax = axes_of(ax)
    if len(x) == 1:
        raise InputError("found must depend on time, or on another variable")
    ax.stackplot(
        x, stacked, labels=names, colors=shades(len(names)), edgecolor="white", linewidth=0.4
    )
    ax.plot(x, total, **LINES[0], label="width of the error bar")
    label(ax, width, output, "width of {}")
    legend_above(ax)
    return ax


def margins(found: xr.Dataset, *, ax: Axes | None = None) -> Axes:
    """Draw how far each limit is kept; below zero it is not.

    Parameters
    ----------
    found : result of `check_limits` or `allocate`, whose limits `allocate` makes bind at points.
    ax : axes to draw on, those of a new figure by default.

    Returns
    -------
    The axes.

    Raises
    ------
    InputError
        If `found` is no result of `check_limits` or `allocate`, or margins depend on more than one
        variable.
    """
    margin = variable_of("found", found, "margin", "check_limits or allocate")
    ax = axes_of(ax)
    _each_limit(ax, margin, margin.transpose("limit", ...).values)
    if "binding_at" in found and margin.ndim == 2 and found["binding_at"].dtype.kind in "iuf":
        free = {margin.dims[-1]: found["binding_at"]}
        ax.plot(found["binding_at"], margin.min("limit").sel(free, method="nearest"), "k.")
    ax.axhline(0.0, color="0.5", linewidth=0.6)
    units = {str(u) for u in np.ravel(found["unit"].values)} if "unit" in found.coords else {""}
    ax.set(ylabel=with_unit("margin", units.pop() if len(units) == 1 else ""))
    return ax


def probability(found: xr.Dataset, *, ax: Axes | None = None) -> Axes:
    """Draw the largest probability of being outside each limit, at each time.

    Parameters
    ----------
    found : result of `failure_probability`.
    ax : axes to draw on, those of a new figure by default.

    Returns
    -------
    The axes, logarithmic in the probability.

    Raises
    ------
    InputError
        If `found` is no result of `failure_probability`.
    """
    each = variable_of("found", found, "at_each_time", "failure_probability")
    if "bound" not in each.dims:
        raise InputError("found must be a result of failure_probability; got one of allocate")
    each = each.sel(bound="upper").transpose("limit", ...)
    others = list(each.dims[1:-1])
    least = each.where(each > 0).max(others) if others else each.where(each > 0)
    ax = axes_of(ax)
    _each_limit(ax, least, least.values)
    ax.set(yscale="log", ylabel="probability of being outside")
    return ax


def tolerances(found: xr.Dataset, *, ax: Axes | None = None) -> Axes:
    """Draw tolerances as parts of the largest ones, with their values beside.

    Parameters
    ----------
    found : result of `allocate`.
    ax : axes to draw on, those of a new figure by default.

    Returns
    -------
    The axes.

    Raises
    ------
    InputError
        If `found` is no result of `allocate`.
    """
    own = variable_of("found", found, "tolerance", "allocate")
    part = (own / variable_of("found", found, "largest", "allocate")).values
    ax = axes_of(ax)
    drawn = ax.barh([symbol(str(name)) for name in own["name"].values], part, color=MIDDLE)
    ax.bar_label(drawn, [f"{value:.3g}" for value in own.values], padding=3)
    ax.invert_yaxis()
    ax.set(xlim=(0, 1.2), xlabel="tolerance / largest tolerance")
    return ax


def _each_limit(ax: Axes, data: xr.DataArray, values: np.ndarray) -> None:
    """Draw one line per limit, and name the horizontal axis."""
    if values.ndim > 2:
        raise InputError(f"limits must depend on one variable at most; got dims {data.dims}")
    values = values.reshape(len(values), -1)
    last: Any = data.dims[-1]
    x = data[last].values if last in data.coords and last != "limit" else np.arange(values.shape[1])
    names = [literal(str(name)) for name in data["limit"].values]
    for own, name, look in zip(values, names, cycle(LINES), strict=False):
        ax.plot(x, own, **look, label=name, marker="." * (len(x) == 1))
    if last != "limit":
        ax.set(xlabel=with_unit(SYMBOLS.get(last, literal(last)), data[last].attrs.get("units")))
        ax.margins(x=0)
    ax.legend()
