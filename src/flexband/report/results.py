"""Results of a study written into a folder: data, figures and a report."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import xarray as xr

from flexband.files import replaced
from flexband.report import figures, tables
from flexband.report.html import write_report
from flexband.study.comparison import Comparison
from flexband.study.study import Study
from flexband.uncertainty.adaptive.method import AdaptivePCCI
from flexband.uncertainty.methods import PCCI, ImprovedPCCI
from flexband.uncertainty.surrogates.files import save_surrogate
from flexband.uncertainty.surrogates.surrogate import Surrogate

BANDS = "Interval mean and interval error bar"


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
    drawn = {
        f"bands_{_slug(name)}": (f"{BANDS} of {name}", figures.bands_figure({label: bands}, name))
        for name in figures.drawable_outputs(bands["mean"])
    }
    text = [*tables.remarks(bands), figures.DEFINITIONS]
    return write_report(folder, title, tables.summary_table(bands), drawn, text)


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
    fields, response, drawn = study.fields(), study.nominal(), {}
    if fields:
        caption = "Variance error of the random fields after discretization"
        drawn["variance_error"] = caption, figures.variance_error_figure(fields)
    if outputs := figures.drawable_outputs(response):
        figure = figures.response_figure(response, outputs)
        drawn["deterministic"] = "Response without uncertainty", figure
    for name in outputs:
        for k, q in dict.fromkeys(orders):
            compared = (results[0].method, PCCI(k, q), ImprovedPCCI(k, q), AdaptivePCCI())
            chosen = {r.method.label: r.bands for r in results if r.method in compared}
            caption = f"{BANDS} of {name}, k = {k}, q = {q}"
            drawn[f"bands_{_slug(name)}_{k}_{q}"] = caption, figures.bands_figure(chosen, name)
        caption = f"Relative errors of {name} against runs"
        drawn[f"errors_{_slug(name)}"] = caption, figures.errors_figure(results, name)
    text = [*tables.comparison_remarks(fields), figures.DEFINITIONS]
    return write_report(folder, title, tables.error_table(results), drawn, text)


def write_netcdf(dataset: xr.Dataset, file: Path) -> None:
    """Write a dataset as a NetCDF file, which appears only once it is complete."""
    with replaced(file) as partial:
        dataset.to_netcdf(partial, engine="scipy", format="NETCDF3_64BIT")


def _slug(name: str) -> str:
    """Return a name as a part of a file name."""
    return "_".join("".join(c if c.isalnum() else " " for c in name).split()) or "response"
