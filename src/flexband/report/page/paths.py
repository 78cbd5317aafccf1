"""The path of a point with its tube, for its chart."""

from __future__ import annotations

import numpy as np
import xarray as xr

from flexband.analysis.paths import path
from flexband.analysis.selection import AnySurrogate
from flexband.basics.rounding import unit_of_variable
from flexband.report.page.arrays import JsonRecord, pack
from flexband.report.text.band_tables import deviations, outputs_of
from flexband.study.presentation.display import Display
from flexband.uncertainty.surrogates.axes import axes_of


def widest_path(
    surrogate: AnySurrogate | None, bands: xr.Dataset, sigmas: float
) -> xr.Dataset | None:
    """Return the path of the most uncertain point NAME_X, NAME_Y in metres over time, or None."""
    directions = 16
    names = outputs_of(bands["mean"])
    axes = axes_of(bands["mean"].transpose("bound", ...))
    if surrogate is None or "unit" not in bands.coords or axes.dims != ("output",) or not axes.time:
        return None
    units = dict(zip(names, map(str, np.ravel(bands["unit"].values)), strict=True))
    bar = bands["error_bar"]
    width = (bar.sel(bound="upper") - bar.sel(bound="lower")).max(axes.time)
    widths = {}
    for name in names:
        point = name.removesuffix("_X")
        if point != name and units[name] == units.get(f"{point}_Y") == "m":
            pair = name, f"{point}_Y"
            widths[pair] = float(width.sel(output=list(pair)).max())
    if not widths:
        return None
    x, y = max(widths, key=lambda pair: widths[pair])
    return path(surrogate, x, y, sigmas=sigmas, directions=directions)


def path_data(tube: xr.Dataset | None, display: Display) -> JsonRecord | None:
    """Return what paths.js draws of a result of `path`."""
    tube = None if tube is None else display.data(tube)
    digits = 1e-4  # to which part of the largest radius of a region its vertices are rounded
    max_regions = 400  # that are drawn
    if tube is None or tube["radius"].ndim != 1:
        return None
    (dim,) = tube["radius"].dims
    step = max(1, -(-tube.sizes[dim] // max_regions))
    some = {dim: slice(None, None, step)}
    radius = float(tube["radius"].max())
    quantum = digits * radius or None
    vertices = np.stack(
        [tube[name].isel(some).transpose(dim, "vertex").values for name in "xy"], axis=1
    )
    return {
        "names": [str(tube[name].attrs["output"]) for name in "xy"],
        "unit": unit_of_variable(tube["x"]),
        "bar": f"μ ± {deviations(tube)}" if "sigmas" in tube.attrs else "a part of the samples",
        "places": pack(tube[dim].isel(some).values if dim in tube.coords else np.arange(0)),
        "nominal": pack([tube[f"{name}_nominal"].values for name in "xy"], quantum),
        "step": step,
        "reach": pack(tube["radius"].values, quantum),
        "vertices": pack(vertices, quantum),
        "radius": radius,
    }
