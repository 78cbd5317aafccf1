"""Tables of bands and of methods, as a header and rows of text."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from flexband.report.figures import outputs_of
from flexband.study.comparison import Comparison

Table = tuple[list[str], list[list[str]]]


def summary_table(bands: xr.Dataset) -> Table:
    """Return a row an output: bands over all times, and the widest error bar.

    The last column, for PCCI methods, is the largest error expected over that width.
    """
    header = ["output", "interval mean", "error bar", "widest", "at", "expected error"]
    rows = []
    for name in outputs_of(bands):
        one = bands.sel(output=name) if name else bands
        unit = f" [{one['unit'].values}]" if "unit" in one.coords else ""
        bar = one["error_bar"]
        width = bar.sel(bound="upper") - bar.sel(bound="lower")
        at = ""
        if width.dims == ("time",):
            at = f"{float(width['time'].values[int(width.values.argmax())]):.4g} s"
        doubt = ""
        for indicator in ("truncation", "error_bar_expected_error"):
            if indicator in one and float(width.max()) > 0:
                doubt = f"{100 * float(one[indicator].max()) / float(width.max()):.2g} %"
        spans = [f"{float(v.min()):.4g} … {float(v.max()):.4g}" for v in (one["mean"], bar)]
        rows.append([f"{name or 'response'}{unit}", *spans, f"{float(width.max()):.4g}", at, doubt])
    return header, rows


def remarks(bands: xr.Dataset) -> list[str]:
    """Return what an adaptive or phase-resolved method says of its result, a line each."""
    lines = []
    if "orders" in bands:
        found = zip(bands["variable"].values, bands["orders"].values, strict=True)
        lines.append("Orders: " + ", ".join(f"{name} {order}" for name, order in found))
    if "expected_error" in bands.attrs:
        error, tolerance = bands.attrs["expected_error"], bands.attrs["tolerance"]
        lines.append(
            f"Expected error, mean over time: {100 * error:.2g} % of the error bar's width"
        )
        if error > tolerance:
            lines.append(
                f"The tolerance of {100 * tolerance:g} % is NOT met: give more runs (--max-runs), "
                "or leave out outputs that cannot be followed"
            )
    if "trusted" in bands:
        doubtful = [
            name or "response"
            for name in outputs_of(bands)
            if not bool((bands["trusted"].sel(output=name) if name else bands["trusted"]).all())
        ]
        if doubtful:
            lines.append(f"Not to be trusted, runs were not foreseen: {', '.join(doubtful)}")
    return lines


def verification_table(checked: xr.Dataset) -> Table:
    """Return a row a bound and output: as the surrogate and as fresh runs have it."""
    header = ["output", "bound", "surrogate", "simulated", "difference", "rms over time"]
    rows = []
    for name in outputs_of(checked):
        for bound in checked["bound"].values:
            one = checked.sel(bound=bound)
            one = one.sel(output=name) if name else one
            columns = ("surrogate", "simulated", "difference", "rms_difference")
            values = [float(np.max(one[column])) for column in columns]
            rows.append([name or "response", str(bound), *(f"{v:.4g}" for v in values)])
    return header, rows


def error_table(results: Sequence[Comparison], names: Sequence[str]) -> Table:
    """Return runs, wall time and relative errors in per cent, a row a method and output."""
    header = ["method", "runs", "time [s]", "output", "mean [%]", "error bar [%]"]
    rows = []
    for result in results:
        head = [result.method.label, str(result.runs), f"{result.seconds:.2f}"]
        if result.errors is None:
            rows.append([*head, "reference", "", ""])
            continue
        for name in names:
            errors = [result.errors[v] for v in ("mean", "error_bar")]
            values = [float(e.sel(output=name) if name else e) for e in errors]
            rows.append([*head, name, *("–" if np.isnan(v) else f"{100 * v:.2f}" for v in values)])
            head = ["", "", ""]
    return header, rows
