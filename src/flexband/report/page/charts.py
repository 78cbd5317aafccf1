"""The data of the interactive charts: bands, their errors, limits and contributions over time."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from flexband.report.figures import drawable_outputs
from flexband.report.page.arrays import packed
from flexband.report.tables import deviations, outputs_of, select
from flexband.uncertainty.answers.results import ERRORS

DIGITS = 2e-6
"""To which part of the largest width of an error bar numbers are rounded."""

NARROW = 0.05
"""Width of an error bar, as a part of the nominal range, below which its deviation is shown."""

PARTS = {
    "error_bar_expansion_error": "expansion",
    "error_bar_discretization_error": "step and elements",
}


def chart_data(
    bands: xr.Dataset,
    nominal: xr.DataArray | None = None,
    contributions: xr.Dataset | None = None,
    limits: xr.Dataset | None = None,
) -> dict[str, Any] | None:
    """Return what charts.js draws, or None if outputs are no functions of one increasing number.

    Parameters
    ----------
    nominal : the response with every input at its nominal value, dims (output, time).
    contributions, limits : results of `contributions` and `check_limits`.
    """
    free = [str(d) for d in bands["mean"].dims if d not in ("output", "bound")]
    if len(free) != 1 or bands.sizes[free[0]] < 2:
        return None
    x = bands[free[0]]
    if x.dtype.kind not in "iuf" or not np.all(np.diff(x.values) > 0):
        return None
    return {
        "x": {
            "name": free[0],
            "unit": str(x.attrs.get("units", "s" if free[0] == "time" else "")),
            "values": packed(x.values),
        },
        "bar": f"μ ± {deviations(bands)}",
        "inputs": [str(k) for k in bands["input"].values] if "input" in bands.dims else [],
        "carriers": np.atleast_1d(bands.attrs.get("carrier_frequencies", [])).tolist(),
        "limits": _margins(limits),
        "outputs": [
            _output(bands, name, nominal, contributions, limits)
            for name in drawable_outputs(bands["mean"])
        ],
    }


def _output(
    bands: xr.Dataset,
    name: str,
    nominal: xr.DataArray | None,
    contributions: xr.Dataset | None,
    limits: xr.Dataset | None,
) -> dict[str, Any]:
    """Return the data of the chart of one output."""
    one = select(bands, name)
    bar = one["error_bar"].transpose("bound", ...).values
    width = float(np.max(bar[1] - bar[0], initial=0.0))
    quantum = DIGITS * width or None
    found: dict[str, Any] = {
        "name": name or "response",
        "unit": str(one["unit"].values) if "unit" in one.coords else "",
        "mean": packed(one["mean"].transpose("bound", ...).values, quantum),
        "error_bar": packed(bar, quantum),
        "rings": bool("carriers" in one and np.any(one["carriers"].values > 0)),
    }
    if error := next((name for name in ERRORS if name in one), None):
        found["error"] = packed(one[error].values, quantum)
        parts = {words: one[part].values for part, words in PARTS.items() if part in one}
        found["errors"] = {words: packed(values, quantum) for words, values in parts.items()}
    if "error_bar_at" in one:
        found["worst"] = packed(one["error_bar_at"].transpose("input", "bound", ...).values)
    if nominal is not None:
        values = select(nominal, name).values
        found["nominal"] = packed(values, quantum)
        found["narrow"] = bool(width < NARROW * np.ptp(values))
    if contributions is not None and name in outputs_of(contributions["width"]):
        own = select(contributions, name)
        found["contributions"] = {
            "names": [str(k) for k in contributions["name"].values],
            "values": packed(
                own["contribution"].transpose("name", ...).values, 100 * DIGITS * width or None
            ),
            "width": packed(own["width"].values, 100 * DIGITS * width or None),
        }
    if limits is not None:
        found["limits"] = _limits(limits, one, name)
    return found


def _margins(limits: xr.Dataset | None) -> dict[str, Any] | None:
    """Return k of the error bars μ ± kσ that limits were checked with, and least margins: where."""
    if limits is None:
        return None

    def of_limits(kind: str) -> dict[str, float]:
        if kind not in limits or limits[kind].dtype.kind not in "iuf":
            return {}
        found = zip(limits["limit"].values, limits[kind].values, strict=True)
        return {str(name): float(own) for name, own in found if np.isfinite(own)}

    least = {"least": of_limits("least_margin"), "at": of_limits("least_margin_at")}
    return {"sigmas": float(limits.attrs["sigmas"]), **least}


def _limits(limits: xr.Dataset, one: xr.Dataset, name: str) -> list[dict[str, Any]]:
    """Return the limits of an output: name, side, and curve."""
    found = []
    for k in range(limits.sizes["limit"]):
        own = limits.isel(limit=k)
        if "output" in own.coords and str(own["output"].values) != name:
            continue
        for side in ("below", "above"):
            values = np.broadcast_to(own[side].values, one["mean"].shape[1:])
            if np.any(np.isfinite(values)):
                curve = np.where(np.isfinite(values), values, np.nan)
                found.append(
                    {"name": str(own["limit"].values), "side": side, "values": packed(curve)}
                )
    return found
