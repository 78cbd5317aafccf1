"""The figure of limits: margins and probabilities over time."""

from __future__ import annotations

from itertools import cycle

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from flexband.report.figures import STYLES


def limits_figure(checked: xr.Dataset, probability: xr.Dataset | None = None) -> Figure:
    """Draw the margin of each limit over time and, below it, the probability of being outside.

    Parameters
    ----------
    checked : result of `check_limits`; margins must depend on one variable at most.
    probability : result of `failure_probability`, of which the upper bound is drawn.
    """
    rows = 1 if probability is None else 2
    figure = Figure(figsize=(9, 3.6 * rows), layout="constrained")
    grid = figure.subplots(rows, 1, squeeze=False, sharex=True)[:, 0]
    last = str(checked["margin"].dims[-1])
    x = checked[last].values if last in checked.coords and last != "limit" else None
    names = [str(name).replace("$", r"\$") for name in checked["limit"].values]
    for k, style in zip(range(len(names)), cycle(STYLES), strict=False):
        values = np.atleast_1d(checked["margin"].values[k])
        at = np.arange(len(values)) if x is None else x
        grid[0].plot(at, values, label=names[k], **style)
    grid[0].axhline(0.0, color="0.6", linewidth=0.7)
    grid[0].set(ylabel="margin")
    grid[0].legend(fontsize=8)
    if probability is not None:
        each = probability["at_each_time"].sel(bound="upper")
        for k, style in zip(range(len(names)), cycle(STYLES), strict=False):
            own = each.isel(limit=k).transpose(..., *each.dims[-1:]).values
            own = own.reshape(-1, own.shape[-1] if own.ndim else 1)
            values = np.fmax.reduce(np.where(own > 0, own, np.nan), axis=0)
            at = np.arange(len(values)) if x is None else x
            grid[1].semilogy(at, values, label=names[k], marker=".", markersize=3, **style)
        grid[1].set(ylabel="probability of being outside")
    grid[-1].set(xlabel=last if x is not None else "")
    grid[0].margins(x=0)
    return figure
