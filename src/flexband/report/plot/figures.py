"""Figures that commands and reports write: what `flexband.report.plot` draws, below each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import flexband.report.plot as plot  # noqa: PLR0402 (not the package, which imports this)
from flexband.report.plot.margins import least_in_words, too_small_to_see
from flexband.report.plot.series import legend_above, title_above
from flexband.report.text.band_tables import deviations, outputs_of
from flexband.report.text.drawable import bounds, is_likely
from flexband.study.comparison import Comparison
from flexband.uncertainty.inputs.fields.field import Field
from flexband.uncertainty.inputs.fields.random_field import RandomField

WIDTH = 5.6
HEIGHT = 2.5
"""Of one axes [in]: letters of 10 pt are read on a phone that shows all of the width."""


def bands_figure(results: Mapping[str, xr.Dataset], output: str) -> Figure:
    """Draw interval mean and interval error bar of one output, of bands by their labels."""
    figure, rows = _stacked_axes(2)
    titles = bounds(next(iter(results.values())))
    for axes, (variable, title) in zip(rows, titles.items(), strict=True):
        legend_above(plot.comparison(results, output, variable=variable, ax=axes))
        title_above(axes, title)
    return figure


def response_figure(response: xr.DataArray, outputs: Sequence[str]) -> Figure:
    """Draw the outputs of one response below each other."""
    figure, rows = _stacked_axes(len(outputs))
    for axes, output in zip(rows, outputs, strict=True):
        plot.response(response, output, ax=axes)
        axes.label_outer()
    rows[0].set(title="Deterministic response")
    return figure


def variance_error_figure(
    fields: Mapping[str, RandomField], along: Mapping[str, str] | None = None
) -> Figure:
    """Draw the variance error of random fields against position or time, Eq. (31)."""
    figure, (axes,) = _stacked_axes(1)
    kinds = {(along or {}).get(name, "") for name in fields}
    kind = kinds.pop() if len(kinds) == 1 else ""
    plot.variance_error(fields, along=kind, ax=axes).set(
        title="Variance error of the random fields"
    )
    return figure


def fields_figure(fields: Mapping[str, Field], along: Mapping[str, str] | None = None) -> Figure:
    """Draw some realizations of each field along "position" or "time", with its limits."""
    along = along or {}
    figure, rows = _stacked_axes(len(fields))
    for axes, (name, field) in zip(rows, fields.items(), strict=True):
        title_above(plot.field(field, name, along=along.get(name, ""), ax=axes), field.summary)
    return figure


def errors_figure(results: Sequence[Comparison], output: str) -> Figure:
    """Draw relative errors of one output against runs, one line per class of methods."""
    figure, rows = _stacked_axes(2)
    for axes, variable in zip(rows, ("mean", "error_bar"), strict=True):
        plot.errors(results, output, variable=variable, ax=axes)
    return figure


def contributions_figure(contributions: xr.Dataset, variable: str = "contribution") -> Figure:
    """Draw, for every output, what widens the error bar, from a result of `contributions`."""
    outputs = outputs_of(contributions["width"])
    figure, rows = _stacked_axes(len(outputs))
    for axes, output in zip(rows, outputs, strict=True):
        plot.contributions(contributions, output, variable=variable, ax=axes)
    return figure


def bounds_figure(answer: xr.Dataset, name: str) -> Figure:
    """Draw the lower and the upper bounds of a variable, the outputs below each other."""
    outputs = outputs_of(answer[name])
    figure, rows = _stacked_axes(len(outputs))
    if name == "distribution":
        plot.p_box(answer, ax=rows[0])
        return figure
    for axes, output in zip(rows, outputs, strict=True):
        plot.bounds(answer, name, output, ax=axes)
    title_above(rows[0], str(answer[name].attrs.get("long_name", name)))
    return figure


def derived_figure(bands: xr.Dataset) -> Figure:
    """Draw the error bar of a quantity and, below it, its range, from a result of `derived`."""
    figure, rows = _stacked_axes(2)
    titles = {
        "error_bar": f"μ ± {deviations(bands)} over all values of the interval inputs",
        "range": f"range of {100 * bands.attrs['probability']:g} % of the values, over all "
        "values of the interval inputs",
    }
    for axes, (name, title) in zip(rows, titles.items(), strict=True):
        title_above(plot.bounds(bands, name, ax=axes), title)
    return figure


def limits_figure(margins: xr.Dataset, probability: xr.Dataset | None = None) -> Figure:
    """Draw the margins of limits by unit, again from close by if needed, and probabilities."""
    units = margins["unit"].values if "unit" in margins.coords else np.array("")
    units = np.broadcast_to(units.astype(str), margins.sizes["limit"])
    groups = {u: margins.isel(limit=np.flatnonzero(units == u)) for u in dict.fromkeys(units)}
    close = [unit for unit, limits in groups.items() if too_small_to_see(limits)]
    likely = is_likely(probability)
    figure, rows = _stacked_axes(len(groups) + len(close) + likely)
    row_iterator = iter(rows)
    for unit, limits in groups.items():
        plot.margins(limits, ax=next(row_iterator)).sharex(rows[0])
        if unit in close:
            _closest(limits, next(row_iterator), str(unit))
    title_above(rows[0], f"Margin: how far μ ± {deviations(margins)} is from the limit")
    if probability is not None and likely:
        plot.probability(probability, ax=rows[-1]).sharex(rows[0])
        title_above(rows[-1], "Probability of being outside at a time, at most")
    return figure


def _closest(limits: xr.Dataset, axes: Axes, unit: str = "") -> None:
    plot.margins(limits, closest=True, ax=axes)
    title_above(axes, f"The least margin from close by, {least_in_words(limits, unit)}")


def path_figure(path: xr.Dataset) -> Figure:
    """Draw a path with its regions, and their radius over time, from a result of `path`."""
    figure = Figure(figsize=(WIDTH, 3 * HEIGHT), layout="constrained")
    plane, below = figure.subplots(2, 1, height_ratios=(3, 1))
    plot.path(path, ax=plane)
    plot.response(path["radius"].rename("radius"), ax=below).set(ylabel="radius")
    return figure


def allocation_figure(allocation: xr.Dataset) -> Figure:
    """Draw tolerances, and below, if there are any over time, the margins that they leave."""
    margins = "margin" in allocation and allocation["margin"].ndim == 2
    close = margins and too_small_to_see(allocation)
    figure, rows = _stacked_axes(1 + margins + close)
    plot.tolerances(allocation, ax=rows[0])
    if margins:
        plot.margins(allocation, ax=rows[1])
    if close:
        _closest(allocation, rows[2])
    return figure


def _stacked_axes(count: int) -> tuple[Figure, list[Axes]]:
    """Return a figure with axes below each other."""
    figure = Figure(figsize=(WIDTH, HEIGHT * max(count, 1)), layout="constrained")
    return figure, list(figure.subplots(count, 1, squeeze=False)[:, 0])
