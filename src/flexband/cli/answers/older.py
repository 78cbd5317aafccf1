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


def mark_older(folder: Path) -> None:
    """Mark the answers in a folder as those of earlier results.

    The data have an attribute "stale" then, which is gone when the question is asked again.
    """
    from flexband.report.results import write_netcdf  # noqa: PLC0415

    for file in (folder / f"{name}.nc" for name in ANSWERS):
        if file.is_file():
            save(lambda file=file: write_netcdf(_marked(file), file))


def stale(folder: Path) -> list[Path]:
    """Return the answers of earlier results in a folder, and their pictures."""
    from flexband.report.page.answers import read_answer  # noqa: PLC0415

    older: list[str] = []
    for name in ANSWERS:
        read_answer(folder, name, older)
    files = (folder / f"{name}.{kind}" for name in older for kind in ("nc", "png"))
    return [file for file in files if file.is_file()]


def _marked(file: Path) -> xr.Dataset:
    """Return an answer with the mark."""
    with xr.open_dataset(file, engine="scipy", decode_times=False) as found:
        return found.load().assign_attrs(stale="an answer of earlier results: ask again")
