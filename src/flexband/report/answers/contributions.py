"""The figure of contributions: what widens the error bar, over time."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from flexband.report.figures import labelled_series
from flexband.report.tables import outputs_of


def contributions_figure(found: xr.Dataset) -> Figure:
    """Draw, for every output, the contributions of the inputs above each other, and the width.

    Where they add up to less than the width, inputs interact; a negative one is not drawn.

    Parameters
    ----------
    found : result of `contributions`, which depends on time.
    """
    width, outputs = found["width"], outputs_of(found["width"])
    figure = Figure(figsize=(9, 3.2 * len(outputs)), layout="constrained")
    grid = figure.subplots(len(outputs), 1, squeeze=False, sharex=True)[:, 0]
    names = [str(name).replace("$", r"\$") for name in found["name"].values]
    for axes, output in zip(grid, outputs, strict=True):
        x, total = labelled_series(axes, width, output)
        each = (found["contribution"].isel(name=k) for k in range(len(names)))
        stacked = [labelled_series(axes, own, output)[1] for own in each]
        axes.stackplot(x, np.maximum(stacked, 0.0), labels=names, alpha=0.7)
        axes.plot(x, total, color="black", linewidth=1.0, label="width of the error bar")
        axes.margins(x=0)
    grid[0].legend(fontsize=8)
    return figure
