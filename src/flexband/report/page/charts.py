"""The data of the interactive charts: bands, their errors, limits and contributions over time."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from flexband.analysis.labelled_answers import ERRORS
from flexband.analysis.selection import AnySurrogate
from flexband.basics.rounding import unit_of_variable
from flexband.report.page.arrays import JsonRecord, pack
from flexband.report.text.band_tables import Table, deviations, outputs_of, select, unit_of
from flexband.report.text.drawable import drawable_outputs, series
from flexband.report.text.numbers import number
from flexband.uncertainty.surrogates.bands import BandRecord
from flexband.uncertainty.surrogates.surrogate import Surrogate

DIGITS = 2e-6
"""To which part of the largest width of an error bar numbers are rounded."""


PARTS = {
    "error_bar_expansion_error": "expansion",
    "error_bar_discretization_error": "step and elements",
}


def chart_data(
    bands: xr.Dataset,
    nominal: xr.DataArray | None = None,
    contributions: xr.Dataset | None = None,
    limits: xr.Dataset | None = None,
    units: Mapping[str, str] | None = None,
) -> JsonRecord | None:
    """Return what charts.js draws, or None if outputs are no functions of one number.

    `nominal` has the dims (output, time); `units` are those of inputs, by name.
    """
    domain_dims = [str(d) for d in bands["mean"].dims if d not in ("output", "bound")]
    if len(domain_dims) != 1 or bands.sizes[domain_dims[0]] < 2:
        return None
    x = bands[domain_dims[0]]
    if x.dtype.kind not in "iuf" or not np.all(np.diff(x.values) > 0):
        return None
    inputs = [str(k) for k in bands["input"].values] if "input" in bands.dims else []
    return {
        "x": {
            "name": domain_dims[0],
            "unit": unit_of_variable(x, "s" if domain_dims[0] == "time" else ""),
            "values": pack(x.values),
        },
        "bar": f"μ ± {deviations(bands)}",
        "inputs": inputs,
        "input_units": [(units or {}).get(k, "") for k in inputs],
        "carriers": np.atleast_1d(BandRecord.read(bands).carrier_frequencies).tolist(),
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
) -> JsonRecord:
    # Width of an error bar, as a part of the nominal range, below which its deviation is shown
    narrow = 0.05
    output_bands = select(bands, name)
    bar = series(bands["error_bar"], name)[1]
    width = float(np.nanmax(bar[1] - bar[0], initial=0.0))
    quantum = DIGITS * width or None
    chart: JsonRecord = {
        "name": name or "response",
        "unit": str(output_bands["unit"].values) if "unit" in output_bands.coords else "",
        "mean": pack(series(bands["mean"], name)[1], quantum),
        "error_bar": pack(bar, quantum),
        "rings": bool("carriers" in output_bands and np.any(output_bands["carriers"].values > 0)),
    }
    if error := next((name for name in ERRORS if name in output_bands), None):
        chart["error"] = pack(output_bands[error].values, quantum)
        parts = {words: part for part, words in PARTS.items() if part in output_bands}
        chart["errors"] = {k: pack(output_bands[v].values, quantum) for k, v in parts.items()}
    if "error_bar_at" in output_bands:
        worst = output_bands["error_bar_at"].transpose("input", "bound", ...)
        chart["worst"] = pack(worst.values)
    if nominal is not None:
        values = series(nominal, name)[1]
        chart["nominal"] = pack(values, quantum)
        chart["narrow"] = bool(width < narrow * np.ptp(values))
    if contributions is not None and name in outputs_of(contributions["width"]):
        contribution = select(contributions, name)["contribution"]
        coarse = 100 * DIGITS * width or None
        chart["contributions"] = {
            "names": [str(k) for k in contributions["name"].values],
            "values": pack(contribution.transpose("name", ...).values, coarse),
            "width": pack(series(contributions["width"], name)[1], coarse),
        }
    if limits is not None:
        chart["limits"] = _limits(limits, output_bands, name)
    return chart


def _margins(limits: xr.Dataset | None) -> JsonRecord | None:
    """Return k of the error bars μ ± kσ that limits were checked with, and least margins: where."""
    if limits is None or "sigmas" not in limits.attrs:
        return None

    def of_limits(kind: str) -> dict[str, float]:
        if kind not in limits or limits[kind].dtype.kind not in "iuf":
            return {}
        pairs = zip(limits["limit"].values, limits[kind].values, strict=True)
        return {str(name): float(value) for name, value in pairs if np.isfinite(value)}

    least_margins = {"least": of_limits("least_margin"), "at": of_limits("least_margin_at")}
    return {"sigmas": float(BandRecord.read(limits).sigmas), **least_margins}


def _limits(limits: xr.Dataset, output_bands: xr.Dataset, name: str) -> list[JsonRecord]:
    curves = []
    for k in range(limits.sizes["limit"]):
        limit = limits.isel(limit=k)
        if "output" in limit.coords and str(limit["output"].values) != name:
            continue
        for side in ("below", "above"):
            values = np.broadcast_to(limit[side].values, output_bands["mean"].shape[1:])
            if np.any(np.isfinite(values)):
                curve = pack(np.where(np.isfinite(values), values, np.nan))
                curves.append({"name": str(limit["limit"].values), "side": side, "values": curve})
    return curves


def nominal_of(surrogate: AnySurrogate | None) -> xr.DataArray | None:
    """Return the response of a surrogate with all inputs nominal, without its samples."""
    if not isinstance(surrogate, Surrogate):
        return None
    values = surrogate.standard(*surrogate.space.nominal())
    labels = surrogate.labels
    coords = {k: c.variable for k, c in labels.coords.items() if "sample" not in c.dims}
    return xr.DataArray(values, dims=labels.dims).isel(sample=0).assign_coords(coords)


def numbers(bands: xr.Dataset, *, max_rows: int = 25) -> list[tuple[str, Table]]:
    """Return a table of numbers for every output, at some of its times."""
    titled_tables = []
    for name in outputs_of(bands["mean"]):
        output_bands = select(bands, name)
        (dim,) = (d for d in output_bands["mean"].dims if d != "bound")
        last = output_bands.sizes[dim] - 1
        some = output_bands.isel({dim: np.unique(np.linspace(0, last, max_rows).astype(int))})
        some = some.dropna(dim, subset=["mean"])  # those past the horizon
        error = next((some[k].values for k in ERRORS if k in some), None)
        columns = [some[dim].values]
        columns += [row for k in ("mean", "error_bar") for row in some[k].transpose("bound", dim)]
        of_output = ["lowest mean", "highest mean", "bar from", "to"]
        if error is not None:
            columns = [*columns, error]
            of_output = [*of_output, "expected error"]
        of_dim = unit_of_variable(some[dim], "s" if dim == "time" else "")
        unit = unit_of(output_bands)
        header = [f"{dim} [{of_dim}]" if of_dim else str(dim), *(f"{k}{unit}" for k in of_output)]
        scales = [0.0, *[float(abs(output_bands["error_bar"]).max())] * 4, 0.0]
        rows = [
            [number(v, 5, scale) for v, scale in zip(row, scales, strict=False)]
            for row in zip(*columns, strict=True)
        ]
        titled_tables.append((f"{name or 'response'}{unit_of(output_bands)}", (header, rows)))
    return titled_tables
