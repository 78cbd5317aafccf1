"""Figures of interval quantiles and other answers with a lower and an upper bound."""

from __future__ import annotations

import xarray as xr
from matplotlib.figure import Figure

from flexband.report.figures import labelled_series
from flexband.report.tables import outputs_of, percent, select

COLORS = ("#1f78b4", "#d95f02", "#33a02c", "#7570b3", "#e7298a", "#a6761d")


def bounds_figure(answer: xr.Dataset, name: str) -> Figure:
    """Draw the lower and the upper bounds of a variable, the outputs below each other.

    Those of several probabilities, or inputs, have a colour each.
    """
    outputs = outputs_of(answer[name])
    figure = Figure(figsize=(9, 3.2 * len(outputs)), layout="constrained")
    grid = figure.subplots(len(outputs), 1, squeeze=False)
    for axes, output in zip(grid[:, 0], outputs, strict=True):
        one = select(answer[name], output)
        parts = {"": one}
        if "probability" in one.dims:
            parts = {
                f"{percent(float(p))} quantile": one.sel(probability=p)
                for p in one["probability"].values
            }
        if "name" in one.dims:
            names = [str(name) for name in one["name"].values]
            parts = {name.replace("$", r"\$"): one.sel(name=name) for name in names}
        for k, (label, own) in enumerate(parts.items()):
            x, (lower, upper) = labelled_series(axes, own, output)
            color = COLORS[k % len(COLORS)]
            axes.fill_between(x, lower, upper, color=color, alpha=0.3, linewidth=0)
            axes.plot(x, lower, color=color, linewidth=0.9, marker="." * (len(x) == 1))
            axes.plot(x, upper, color=color, linewidth=0.9, marker="." * (len(x) == 1), label=label)
        if len(parts) > 1:
            axes.legend(fontsize=8)
    grid[0, 0].set_title(answer[name].attrs.get("long_name", name), fontsize=10)
    return figure
