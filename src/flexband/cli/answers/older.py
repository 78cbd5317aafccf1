"""Answers of an earlier run, which are not those of the results beside them."""

from __future__ import annotations

from pathlib import Path

import xarray as xr

from flexband.cli.files import save

ANSWERS = (
    "allocation", "p_boxes", "derived", "limits", "narrowed", "p_box", "path", "probability",
    "quantiles", "range", "sobol",
)  # fmt: skip
"""Names of the files that commands write. `flexband run` itself writes contributions."""


def mark_older(folder: Path) -> list[Path]:
    """Mark the answers in a folder as those of earlier results, and return their files.

    The data have an attribute "stale" then, which is gone when the question is asked again.
    """
    from flexband.report.results import write_netcdf  # noqa: PLC0415

    for file in (folder / f"{name}.nc" for name in ANSWERS):
        if file.is_file():
            save(lambda file=file: write_netcdf(_marked(file), file))
    names = [f"{name}.{kind}" for name in ANSWERS for kind in ("nc", "png")]
    names.append("contributions.png")
    return [folder / name for name in names if (folder / name).is_file()]


def _marked(file: Path) -> xr.Dataset:
    """Return an answer with the mark."""
    with xr.open_dataset(file, engine="scipy", decode_times=False) as found:
        return found.load().assign_attrs(stale="an answer of earlier results: ask again")
