"""The figure of allocated tolerances: what they take of each limit, and the margins left."""

from __future__ import annotations

from itertools import cycle

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from flexband.report.figures import STYLES


def allocation_figure(found: xr.Dataset) -> Figure:
    """Draw the tolerances in parts of the largest ones, and the margin of each limit over time.

    Beside every tolerance stands its value.

    Parameters
    ----------
    found : result of `allocate`; margins must depend on one variable at most.
    """
    figure = Figure(figsize=(9, 6), layout="constrained")
    bars, margins = figure.subplots(2, 1)
    names = [str(name).replace("$", r"\$") for name in found["name"].values]
    part = (found["tolerance"] / found["largest"]).values
    drawn = bars.barh(names, part, color="#1f78b4")
    bars.bar_label(drawn, [f"{t:.3g}" for t in found["tolerance"].values], padding=3)
    bars.invert_yaxis()
    bars.set(xlim=(0, 1.15), xlabel="tolerance, in parts of the largest")
    last = str(found["margin"].dims[-1])
    on_axis = last in found.coords and last != "limit"
    for one, style in zip(found["margin"], cycle(STYLES), strict=False):
        values = np.atleast_1d(one.values)
        at = found[last].values if on_axis else np.arange(len(values))
        margins.plot(at, values, label=str(one["limit"].values).replace("$", r"\$"), **style)
    if "binding_at" in found:
        margins.plot(found["binding_at"], np.zeros(found.sizes["binding"]), "k.")
    margins.axhline(0.0, color="0.6", linewidth=0.7)
    margins.set(ylabel="margin", xlabel=last if on_axis else "")
    margins.margins(x=0)
    margins.legend(fontsize=8)
    return figure
