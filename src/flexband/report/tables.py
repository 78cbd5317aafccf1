"""Tables of bands and of methods, as a header and rows of text."""

from __future__ import annotations

from collections.abc import Sequence

import xarray as xr

from flexband.report.figures import outputs_of
from flexband.study.comparison import Comparison

Table = tuple[list[str], list[list[str]]]


def summary_table(bands: xr.Dataset) -> Table:
    """Return a table of the outputs: extremes over time and widest bands."""
    header = ["output", "unit", "mean: lowest", "mean: highest", "error bar: lowest"]
    header += ["error bar: highest", "widest error bar", "at"]
    rows = []
    for name in outputs_of(bands):
        one = bands.sel(output=name) if name else bands
        mean, bar = one["mean"], one["error_bar"]
        width = (bar.sel(bound="upper") - bar.sel(bound="lower")).squeeze()
        at = ""
        if "time" in width.dims:
            at = f"t = {float(width['time'].values[int(width.values.argmax())]):.4g} s"
        unit = str(one["unit"].values) if "unit" in one.coords else ""
        numbers = [mean.min(), mean.max(), bar.min(), bar.max(), width.max()]
        rows.append([name, unit, *(f"{float(x):.5g}" for x in numbers), at])
    return header, rows


def error_table(results: Sequence[Comparison], names: Sequence[str]) -> Table:
    """Return a table of runs, wall time and relative errors in per cent."""
    header = ["method", "runs", "time [s]"]
    header += [f"{name} {kind}" for kind in ("mean", "error bar") for name in names]
    rows = []
    for result in results:
        row = [result.method.label, str(result.runs), f"{result.seconds:.2f}"]
        for variable in ("mean", "error_bar"):
            for name in names:
                if result.errors is None:
                    row.append("–")
                else:
                    error = result.errors[variable]
                    value = float(error.sel(output=name) if name else error)
                    row.append(f"{100 * value:.2f}")
        rows.append(row)
    return header, rows
