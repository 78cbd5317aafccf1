"""Figures of bands, of their errors and of random fields. Each function returns a `Figure`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FormatStrFormatter, LogLocator

from flexband.report.tables import deviations, outputs_of, select
from flexband.study.comparison import Comparison
from flexband.uncertainty.inputs.fields.field import Field
from flexband.uncertainty.inputs.fields.interval_field import IntervalField
from flexband.uncertainty.inputs.fields.random_field import RandomField

TITLES = {"mean": "Interval mean", "error_bar": "Interval error bar"}
STYLES = [
    {"color": "0.1", "linewidth": 0.9},
    {"color": "#d95f02", "linewidth": 0.9, "linestyle": "--"},
    {"color": "#1f78b4", "linewidth": 0.9, "linestyle": "-."},
    {"color": "#33a02c", "linewidth": 0.9, "linestyle": ":"},
    {"color": "#7570b3", "linewidth": 0.9, "linestyle": "--"},
    {"color": "#e7298a", "linewidth": 0.9, "linestyle": "-."},
    {"color": "#a6761d", "linewidth": 0.9, "linestyle": ":"},
    {"color": "#66a61e", "linewidth": 0.9, "linestyle": "-"},
]

REALIZATIONS = 8
"""Of each field that is drawn."""


def bounds(bands: xr.Dataset) -> dict[str, str]:
    """Return what interval mean and interval error bar are, by variable."""
    own = deviations(bands)
    return {
        "mean": "Interval mean: the range of the mean μ over all values of the interval inputs",
        "error_bar": f"Interval error bar: the range from the lowest μ − {own} to the highest "
        f"μ + {own} over all values of the interval inputs",
    }


def definitions(bands: xr.Dataset) -> str:
    """Return what interval mean and interval error bar are, as sentences."""
    return ". ".join(bounds(bands).values()) + "."


def _literal(text: str) -> str:
    """Return a text in which Matplotlib finds no formula."""
    return text.replace("$", r"\$")


def drawable_outputs(data: xr.DataArray) -> list[str]:
    """Return the outputs if each is a function of at most one variable, or an empty list."""
    free = [d for d in data.dims if d not in ("output", "bound")]
    return outputs_of(data) if len(free) <= 1 else []


def labelled_series(axes: Axes, data: xr.DataArray, output: str) -> tuple[np.ndarray, np.ndarray]:
    """Return x and the values of shape (..., x) of one output; label the axes with them.

    Raises
    ------
    ValueError
        If the output depends on more than one variable.
    """
    one = select(data, output)
    if one.ndim > 2:
        raise ValueError(f"an output must depend on one variable at most; got dims {one.dims}")
    last = str(one.dims[-1]) if one.dims else "bound"
    if last == "bound":
        axes.set(ylabel=_literal(output))
        return np.zeros(1), one.values[..., None]
    units = one[last].attrs.get("units"), one["unit"].values if "unit" in one.coords else ""
    x, y = (f"{n} [{u}]" if u else n for n, u in zip((last, output), units, strict=True))
    axes.set(xlabel=_literal(x), ylabel=_literal(y))
    axes.margins(x=0)
    return one[last].values, one.values


def bands_figure(results: Mapping[str, xr.Dataset], output: str) -> Figure:
    """Draw the interval mean and, below it, the interval error bar of one output.

    Parameters
    ----------
    results : label -> bands, all of the same multiple of σ.
    """
    figure = Figure(figsize=(10, 7.5), layout="constrained")
    titles = bounds(next(iter(results.values())))
    for axes, (variable, title) in zip(figure.subplots(2, 1), titles.items(), strict=True):
        for (label, bands), style in zip(results.items(), cycle(STYLES), strict=False):
            x, (lower, upper) = labelled_series(axes, bands[variable], output)
            if len(results) == 1:
                axes.fill_between(x, lower, upper, color="#1f78b4", alpha=0.3, linewidth=0)
            axes.plot(x, lower, label=f"{_literal(label)}, lower and upper bound", **style)
            axes.plot(x, upper, **style)
        axes.set_title(title, fontsize=10)
        axes.legend(fontsize=8, loc="best")
    return figure


def response_figure(response: xr.DataArray, outputs: Sequence[str]) -> Figure:
    """Draw the outputs of one response below each other."""
    figure = Figure(figsize=(8, 2.6 * len(outputs)), layout="constrained")
    grid = figure.subplots(len(outputs), 1, squeeze=False, sharex=True)
    for axes, output in zip(grid[:, 0], outputs, strict=True):
        axes.plot(*labelled_series(axes, response, output), **STYLES[0])
        axes.label_outer()
    grid[0, 0].set(title="Deterministic response")
    return figure


def variance_error_figure(fields: Mapping[str, RandomField]) -> Figure:
    """Draw the variance error of random fields against position, Eq. (31)."""
    figure = Figure(figsize=(6, 4), layout="constrained")
    axes = figure.subplots()
    for (name, field), style in zip(fields.items(), cycle(STYLES), strict=False):
        x = np.linspace(*field.located, 501)
        largest = field.largest_variance_error()
        label = f"{_literal(name)}, terms: {field.dimension}, largest: {largest:.4f}"
        axes.plot(x, field.variance_error(x), label=label, **style)
    axes.set(title="Variance error of the random fields", xlabel="position [m] or time [s]")
    axes.set(ylabel="variance error / variance")
    axes.margins(x=0)
    axes.legend(fontsize=8)
    return figure


def fields_figure(fields: Mapping[str, Field]) -> Figure:
    """Draw some realizations of each field, with its limits, or its mean and standard deviation."""
    figure = Figure(figsize=(8, 2.6 * len(fields)), layout="constrained")
    grid = figure.subplots(len(fields), 1, squeeze=False)
    for axes, (name, field) in zip(grid[:, 0], fields.items(), strict=True):
        x = np.linspace(*field.located, 501)
        axes.plot(x, field.realizations(x, REALIZATIONS).T, color="#1f78b4", linewidth=0.6)
        middle = field.nominal(x)
        if isinstance(field, RandomField):
            label, deviation = "μ ± σ", field.deviation(x)
            lines = [middle - deviation, middle + deviation]
        else:
            label = "limits"
            lines = field.limits(x) if isinstance(field, IntervalField) else []
        for line in lines:
            axes.plot(x, line, label=label, **STYLES[0])
            label = None
        axes.set(xlabel="position [m] or time [s]", ylabel=_literal(name))
        axes.set_title(field.summary, fontsize=9)
        axes.margins(x=0)
        if lines:
            axes.legend(fontsize=8, loc="upper right")
    return figure


def errors_figure(results: Sequence[Comparison], output: str) -> Figure:
    """Draw relative errors of one output against runs, one line per class of methods.

    Errors that are exactly zero are left out, since the axes are logarithmic.
    """
    figure = Figure(figsize=(11, 4.2), layout="constrained")
    compared = [r for r in results if r.errors]
    runs: list[int] = []
    for count in sorted({r.runs for r in compared}):
        if not runs or count > 1.15 * runs[-1]:  # labels must not overlap
            runs.append(count)
    names = dict.fromkeys(r.method.name for r in compared)
    for axes, variable in zip(figure.subplots(1, 2), TITLES, strict=True):
        for name, style in zip(names, cycle(STYLES[1:] + STYLES[:1]), strict=False):
            group = [r for r in compared if r.method.name == name]
            errors = np.array([float(select(r.errors[variable], output)) for r in group])
            errors[errors == 0.0] = np.nan
            axes.loglog([r.runs for r in group], 100 * errors, marker="o", label=name, **style)
        axes.set(title=f"{TITLES[variable]} of {_literal(output)}", xlabel="runs")
        axes.set(ylabel="relative error [%]")
        axes.set_xticks(runs, [str(r) for r in runs])
        axes.minorticks_off()
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.yaxis.set_major_formatter(FormatStrFormatter("%g"))
        axes.grid(alpha=0.3)
        axes.legend(fontsize=8)
    return figure
