"""Results of a study written into a folder: data, figures and a report."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import xarray as xr

from flexband.report.figures import (
    DEFINITIONS,
    bands_figure,
    drawable_outputs,
    errors_figure,
    response_figure,
    variance_error_figure,
)
from flexband.report.html import write_report
from flexband.report.tables import comparison_remarks, error_table, remarks, summary_table
from flexband.study.comparison import Comparison
from flexband.study.netcdf import write_netcdf
from flexband.study.study import Study
from flexband.uncertainty.adaptive.method import AdaptivePCCI
from flexband.uncertainty.methods import PCCI, ImprovedPCCI
from flexband.uncertainty.surrogates.files import save_surrogate
from flexband.uncertainty.surrogates.surrogate import Surrogate


def write_run(
    folder: Path, title: str, label: str, bands: xr.Dataset, surrogate: Surrogate | None = None
) -> Path:
    """Write bands.nc, surrogate.npz, a figure for every output and report.html; return its path.

    Parameters
    ----------
    title, label : of the report, and of the method in legends.
    surrogate : saved if given.
    """
    write_netcdf(bands, folder / "bands.nc")
    if surrogate:
        save_surrogate(surrogate, folder / "surrogate.npz")
    figures = {
        f"bands_{_slug(name)}": (
            f"Interval mean and interval error bar of {name}",
            bands_figure({label: bands}, name),
        )
        for name in drawable_outputs(bands["mean"])
    }
    return write_report(
        folder, title, summary_table(bands), figures, [*remarks(bands), DEFINITIONS]
    )


def write_comparison(
    folder: Path,
    title: str,
    study: Study,
    results: Sequence[Comparison],
    orders: Iterable[tuple[int, int]],
) -> Path:
    """Write the bands of every method, figures and report.html; return the path of the report.

    Parameters
    ----------
    results : of `compare`, the reference first.
    orders : k and q for which the bands of PCCI and improved PCCI are drawn, together with those of
        the reference and of adaptive PCCI.
    """
    for result in results:
        write_netcdf(result.bands, folder / f"{_slug(result.method.label.lower())}.nc")
    nominal, fields, figures = study.nominal(), study.fields(), {}
    if fields:
        figures["variance_error"] = (
            "Variance error of the random fields after discretization",
            variance_error_figure(fields),
        )
    drawn = drawable_outputs(nominal)
    if drawn:
        figures["deterministic"] = "Response without uncertainty", response_figure(nominal, drawn)
    for name in drawn:
        for k, q in dict.fromkeys(orders):
            compared = (results[0].method, PCCI(k, q), ImprovedPCCI(k, q), AdaptivePCCI())
            chosen = {r.method.label: r.bands for r in results if r.method in compared}
            figures[f"bands_{_slug(name)}_{k}_{q}"] = (
                f"Interval mean and interval error bar of {name}, k = {k}, q = {q}",
                bands_figure(chosen, name),
            )
        figures[f"errors_{_slug(name)}"] = (
            f"Relative errors of {name} against runs",
            errors_figure(results, name),
        )
    text = [*comparison_remarks(fields), DEFINITIONS]
    return write_report(folder, title, error_table(results), figures, text)


def _slug(name: str) -> str:
    """Return a name as a part of a file name."""
    return "_".join("".join(c if c.isalnum() else " " for c in name).split()) or "response"
