"""The figure of a path: the regions of its point, and how far they reach."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from flexband.report.answers.quantiles import COLORS

MOST_DRAWN = 400
"""Regions in a figure."""


def path_figure(found: xr.Dataset) -> Figure:
    """Draw the path with the regions of the point, and the radius of the regions over time.

    Parameters
    ----------
    found : result of `path`.
    """
    figure = Figure(figsize=(9, 8), layout="constrained")
    plane, below = figure.subplots(2, 1, height_ratios=(3, 1))
    vertices = np.stack([found[name].transpose("vertex", ...).values.T for name in "xy"], axis=-1)
    some = vertices[:: max(1, len(vertices) // MOST_DRAWN)]
    regions = PolyCollection(
        list(some), facecolor=(*to_rgb(COLORS[0]), 0.2), edgecolor=(*to_rgb(COLORS[0]), 0.5)
    )
    regions.set_linewidth(0.5)
    plane.add_collection(regions)
    plane.plot(found["x_nominal"], found["y_nominal"], color="black", linewidth=0.9)
    plane.autoscale_view()
    plane.set_aspect("equal", adjustable="datalim")
    names, unit = found.attrs["outputs"], found["x"].attrs.get("units")
    texts = [f"{name} [{unit}]" if unit else str(name) for name in names]
    plane.set(xlabel=texts[0].replace("$", r"\$"), ylabel=texts[1].replace("$", r"\$"))
    last = str(found["radius"].dims[0])
    x = found[last].values if last in found.coords else np.arange(found.sizes[last])
    below.plot(x, found["radius"], color=COLORS[0])
    below.set(xlabel=last, ylabel="radius" + (f" [{unit}]" if unit else ""))
    below.margins(x=0)
    return figure
