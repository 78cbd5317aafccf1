"""Margins of limits over time, and where they are least."""

from __future__ import annotations

import textwrap
from itertools import cycle
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from flexband.basics.checks import check_flag
from flexband.basics.rounding import unit_of_variable
from flexband.errors import InputError
from flexband.report.plot.series import (
    SYMBOLS,
    TITLE,
    legend_above,
    literal,
    variable_of,
    with_unit,
)
from flexband.report.plot.style import LINES, axes_of
from flexband.report.text.numbers import number


def margins(found: xr.Dataset, *, closest: bool = False, ax: Axes | None = None) -> Axes:
    """Draw the margin to each limit; below zero the limit is violated.

    Parameters
    ----------
    found : result of `check_requirements` or `allocate`, whose limits `allocate` makes bind at
        points.
    closest : whether to draw only the surroundings of the least margin, on a scale at which it can
        be told from zero. Dots are the values at the output times.
    ax : axes to draw on, those of a new figure by default.

    Raises
    ------
    InputError
        If `found` is no result of `check_requirements` or `allocate`, `closest` is not True or
        False, margins depend on more than one variable, or they depend on none and the surroundings
        of the least one are to be drawn.
    """
    closest = check_flag("closest", closest)
    margin = variable_of("found", found, "margin", "check_requirements or allocate")
    ax = axes_of(ax)
    values = margin.transpose("limit", ...).values
    each_limit(ax, margin, values)
    if "binding_at" in found and margin.ndim == 2 and found["binding_at"].dtype.kind in "iuf":
        binding_points = {margin.dims[-1]: found["binding_at"]}
        ax.plot(
            found["binding_at"], margin.min("limit").sel(binding_points, method="nearest"), "k."
        )
    ax.axhline(0.0, color="0.5", linewidth=0.6)
    units = {str(u) for u in np.ravel(found["unit"].values)} if "unit" in found.coords else {""}
    unit = units.pop() if len(units) == 1 else ""
    ax.set(ylabel=with_unit("margin", unit))
    if closest:
        if margin.ndim != 2:
            raise InputError("margins must depend on time, or on another variable, to draw closest")
        _closest(ax, found, values, unit)
    return ax


def too_small_to_see(limits: xr.Dataset) -> bool:
    """Return whether the least margin over time cannot be told from zero beside the others."""
    # Part of the range of margins from which on the least one can be told from zero in a figure
    visible_part = 0.03
    margin = limits["margin"].transpose("limit", ...).values
    values = margin[np.isfinite(margin)]
    return margin.ndim == 2 and values.size > 0 and _scale(limits) < visible_part * np.ptp(values)


def least_in_words(limits: xr.Dataset, unit: str = "") -> str:
    """Return the least margin over time, and where it is."""
    margin = limits["margin"].transpose("limit", ...)
    limit, place = _place(margin.values)
    last: Any = margin.dims[-1]
    scale = float(np.nanmax(abs(margin.values)))
    margin_text = _with_unit(number(margin.values[limit, place], scale=scale), unit)
    at = _with_unit(number(margin[last].values[place]), unit_of_variable(margin[last]))
    return f"{margin['limit'].values[limit]}: {margin_text} at {last} {at}"


def _with_unit(text: str, unit: str | None) -> str:
    return f"{text} {unit}" if unit else text


def each_limit(ax: Axes, data: xr.DataArray, values: np.ndarray) -> None:
    """Draw one line per limit, name the horizontal axis, and put the legend above the axes."""
    if values.ndim > 2:
        raise InputError(f"limits must depend on one variable at most; got dims {data.dims}")
    values = values.reshape(len(values), -1)
    last: Any = data.dims[-1]
    x = data[last].values if last in data.coords and last != "limit" else np.arange(values.shape[1])
    names = [literal(textwrap.fill(str(name), TITLE)) for name in data["limit"].values]
    for curve, name, look in zip(values, names, cycle(LINES), strict=False):
        ax.plot(x, curve, **look, label=name, marker=("." if len(x) == 1 else ""))
    if last != "limit":
        ax.set(xlabel=with_unit(SYMBOLS.get(last, literal(last)), unit_of_variable(data[last])))
        ax.margins(x=0)
    legend_above(ax)


def _place(margin: np.ndarray) -> tuple[int, int]:
    """Return the limit and the place of the least margin, shape (limits, places)."""
    limit, place = np.unravel_index(np.nanargmin(margin), margin.shape)
    return int(limit), int(place)


def _scale(limits: xr.Dataset) -> float:
    """Return the size of the least margin, or of its expected error if that is larger."""
    margin = limits["margin"].transpose("limit", ...).values
    if margin.ndim != 2:
        return float(np.nanmin(abs(margin)))
    place = _place(margin)
    error = 0.0
    if "expected_error" in limits and limits["expected_error"].shape == margin.shape:
        error = float(np.nan_to_num(limits["expected_error"].transpose("limit", ...).values[place]))
    values = margin[np.isfinite(margin)]
    return max(abs(float(margin[place])), error, 1e-6 * float(np.ptp(values)))


def _closest(ax: Axes, limits: xr.Dataset, values: np.ndarray, unit: str) -> None:
    """Limit the axes to where the margin of the limit with the least one is about as small."""
    # Output times before and after the least margin, at least, that are shown around it
    min_near = 2
    # Multiples of the least margin, or of its expected error, that are shown around it
    headroom = 8.0
    (limit, place), scale = _place(values), _scale(limits)
    x = limits[limits["margin"].transpose("limit", ...).dims[-1]].values
    neighbours = values[limit, max(place - min_near, 0) : place + min_near + 1]
    top = max(values[limit, place] + headroom * scale, 1.1 * float(np.nanmax(neighbours)))
    above_top = np.flatnonzero(~(values[limit] <= top))
    before = above_top[above_top < place]
    after = above_top[above_top > place]
    first = before[-1] if before.size else 0
    last = after[0] if after.size else len(x) - 1
    bottom = min(values[limit, place], 0.0)
    ax.set(xlim=(x[first], x[last]), ylim=(bottom - 0.15 * (top - bottom), top))
    ax.xaxis.set_major_locator(MaxNLocator(5))
    for line in ax.lines[: len(values)]:
        line.set_marker(".")
