"""Bands of an output, and of answers with a lower and an upper bound."""

from __future__ import annotations

from itertools import cycle

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba

from flexband.basics.checks import check_instance
from flexband.basics.rounding import unit_of_variable
from flexband.errors import InputError
from flexband.report.plot.series import (
    deviation,
    fill,
    label,
    legend_above,
    literal,
    output_of,
    with_bounds,
    with_unit,
)
from flexband.report.plot.style import DARK, LIGHT, LINES, MIDDLE, axes_of
from flexband.report.text.drawable import series
from flexband.report.text.numbers import percent


def bands(bands: xr.Dataset, output: str | None = None, *, ax: Axes | None = None) -> Axes:
    """Draw the interval mean and the interval error bar of one output.

    Parameters
    ----------
    bands : result of `propagate`.
    output : name of the output; it may be left out if there is only one.
    ax : axes to draw on, those of a new figure by default.

    Returns
    -------
    The axes, whose labels name the output, what it depends on, and their units.

    Raises
    ------
    InputError
        If `bands` is no result of `propagate`, has no such output, or the output depends on more
        than one variable.
    """
    return _bands(bands, output, ax, None)


def deviations(
    bands: xr.Dataset,
    nominal: xr.DataArray | None = None,
    output: str | None = None,
    *,
    ax: Axes | None = None,
) -> Axes:
    """Draw how far the interval mean and the interval error bar are from the nominal run.

    This shows bands which are narrow compared with the motion.

    Parameters
    ----------
    bands : result of `propagate`.
    nominal : the response with nominal inputs, as `Study.nominal` returns it; the middle of the
        interval mean by default.
    output : name of the output; it may be left out if there is only one.
    ax : axes to draw on, those of a new figure by default.

    Raises
    ------
    InputError
        As `bands`, and if the nominal run has other outputs or times than the bands.
    """
    mean = with_bounds("bands", bands, "mean", "propagate")
    if nominal is None:
        nominal = mean.mean("bound")
    check_instance("nominal", nominal, xr.DataArray, "a DataArray as Study.nominal returns it")
    try:
        _, fitting = xr.align(mean, nominal, join="exact")
    except ValueError:
        fitting = None
    if fitting is None or set(fitting.dims) != set(mean.dims) - {"bound"}:
        raise InputError("nominal must have the outputs and times of the bands")
    return _bands(bands, output, ax, fitting)


def response(response: xr.DataArray, output: str | None = None, *, ax: Axes | None = None) -> Axes:
    """Draw one output of a single run.

    Parameters
    ----------
    response : as `Study.nominal` or `simulate` returns it, of one sample.
    output : name of the output; it may be left out if there is only one.
    ax : axes to draw on, those of a new figure by default.

    Raises
    ------
    InputError
        If `response` is no DataArray of one sample, or has no such output.
    """
    check_instance("response", response, xr.DataArray, "a DataArray as Study.nominal returns it")
    output = output_of(response, output)
    x, values = series(response, output)
    ax = axes_of(ax)
    ax.plot(x, values, **LINES[0], marker=("." if len(x) == 1 else ""))
    label(ax, response, output)
    return ax


def bounds(
    found: xr.Dataset, variable: str, output: str | None = None, *, ax: Axes | None = None
) -> Axes:
    """Draw the lower and the upper bounds of a variable of an answer.

    Bounds of several probabilities, or inputs, are drawn above each other.

    Parameters
    ----------
    found : result of `quantiles`, `value_range`, `sobol_indices`, `derived` or `propagate`.
    variable : such as "quantiles", "range", "total" or "error_bar".
    output : name of the output; it may be left out if there is only one.
    ax : axes to draw on, those of a new figure by default.

    Raises
    ------
    InputError
        If `found` has no such variable with bounds or no such output, or if it depends on more
        than one variable, besides the probability or the input.
    """
    data = with_bounds("found", found, variable)
    output = output_of(data, output)
    parts = {"": data}
    for dim, formatter in (
        ("probability", lambda p: f"{percent(float(p))} quantile"),
        ("name", literal),
    ):
        if dim in data.dims:
            values = data[dim].values
            parts = {formatter(v): data.isel({dim: k}) for k, v in enumerate(values.tolist())}
    drawn = {name: series(part, output) for name, part in parts.items()}
    ax = axes_of(ax)
    for (name, (x, values)), look in zip(drawn.items(), cycle(LINES), strict=False):
        fill(ax, x, values, to_rgba(look["color"], 0.2), "none")
        for bound, text in zip(values, (name, None), strict=True):
            ax.plot(x, bound, **look, label=text, marker=("." if len(x) == 1 else ""))
    label(ax, next(iter(parts.values())), output)
    if len(parts) > 1:
        ax.legend()
    return ax


def p_box(found: xr.Dataset, *, ax: Axes | None = None) -> Axes:
    """Draw the bounds of a distribution function.

    Parameters
    ----------
    found : result of `p_box`.
    ax : axes to draw on, those of a new figure by default.

    Raises
    ------
    InputError
        If `found` is no result of `p_box`.
    """
    bounds = with_bounds("found", found, "distribution", "p_box")
    output = str(found["output"].values) if "output" in found.coords else ""
    unit = found["unit"].values if "unit" in found.coords else unit_of_variable(found["value"])
    ax = axes_of(ax)
    fill(ax, found["value"].values, bounds.values, LIGHT, "none")
    for bound in bounds.values:
        ax.plot(found["value"], bound, **LINES[0])
    ax.set(xlabel=with_unit(literal(output) or "value", unit), ylabel="probability of values up to")
    ax.set(ylim=(0, 1))
    ax.margins(x=0)
    return ax


def _bands(
    bands: xr.Dataset, output: str | None, ax: Axes | None, nominal: xr.DataArray | None
) -> Axes:
    looks = {
        "error_bar": (LIGHT, MIDDLE, rf"interval error bar, $\mu \pm {deviation(bands)}$"),
        "mean": (MIDDLE, DARK, r"interval mean, $\mu$"),
    }
    drawn = {}
    name = ""
    for variable in looks:
        data = with_bounds("bands", bands, variable, "propagate")
        name = output_of(data, output)
        x, values = series(data, name)
        drawn[variable] = x, values - (0.0 if nominal is None else series(nominal, name)[1])
    ax = axes_of(ax)
    for variable, look in looks.items():
        fill(ax, drawn[variable][0], drawn[variable][1], *look)
    label(ax, bands["mean"], name, "{}" if nominal is None else "deviation of {}")
    legend_above(ax)
    return ax
