"""The report of a study: written by `flexband run`, and again by `flexband report`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import flexband as fb
from flexband.basics.checks import check_integer
from flexband.basics.files import try_write
from flexband.cli.application import app
from flexband.cli.folders import Folder
from flexband.cli.messages import UsageError, print_remark, print_text, reported_errors, usage
from flexband.errors import InputError
from flexband.execution.names import FileName

if TYPE_CHECKING:  # imported when a command is called
    import xarray as xr

    from flexband.analysis.selection import AnySurrogate
    from flexband.remarks.collection import remarks_of
    from flexband.report.page.p_boxes import p_boxes
    from flexband.report.page.page_record import (
        check_shown,
        list_shown,
        read_given,
        restoring_command,
    )
    from flexband.report.page.pdf import print_pdf
    from flexband.report.page.study import write_report
    from flexband.report.text.remarks import remark_line
    from flexband.study.results.answers import Unusable, answer_file, read_answers
    from flexband.study.results.netcdf import RESTORED, read_netcdf, write_netcdf
    from flexband.uncertainty.surrogates.bands import BandRecord


@app.command("report")
@reported_errors()
def report(
    folder: Folder,
    p_boxes: Annotated[
        int | None,
        typer.Option(help="Times at which distribution functions are computed for a chart."),
    ] = None,
    pdf: Annotated[
        bool,
        typer.Option("--pdf", help="Also print it to report.pdf with Chromium, Chrome or Edge."),
    ] = False,
) -> None:
    """Write the report of the study in FOLDER again, with all answers computed since.

    No runs are made. report.html is a single file that needs nothing else. Distribution functions
    take about a second each and are kept in p_boxes.nc.
    """
    # Refuse a folder whose files are not those of its report.
    page_record = read_given(folder)
    if not page_record:
        raise InputError(f"folder must have results of `flexband run`; got '{folder}'")
    if missing := [name for name in page_record["files"] if not (folder / name).is_file()]:
        raise InputError(f"'{folder}' has lost {', '.join(missing)}; `flexband run` makes it again")
    check_answers(folder)
    check_shown(folder, page_record)
    if FileName.BANDS not in page_record["files"]:
        raise InputError(f"'{folder}' has no {FileName.BANDS} of its study; {RESTORED}")
    # Read the results, and add the answers that are missing.
    data = read_netcdf(folder / FileName.BANDS)
    verification, shares = (
        read_netcdf(folder / name) if name in page_record["files"] else None
        for name in (FileName.VERIFICATION, FileName.CONTRIBUTIONS)
    )
    saved = FileName.SURROGATE in page_record["files"]
    surrogate = fb.load_surrogate(folder / FileName.SURROGATE) if saved else None
    sigmas = float(BandRecord.read(data).sigmas)
    of_others = shares is not None and BandRecord.read(shares).sigmas != sigmas  # asked for since
    if surrogate and of_others:
        shares = fb.analysis.contributions(surrogate, sigmas=sigmas)
    if p_boxes is not None:
        add_p_boxes(surrogate, data, folder, p_boxes)
    page = write_report(folder, page_record, data, verification, shares, surrogate)
    try_write(lambda: list_shown(folder))
    for remark in remarks_of(data.attrs if verification is None else verification.attrs):
        print_remark(remark_line(remark))
    print_text(f"Report: {page}")
    if pdf:
        print_text(f"PDF:    {print_pdf(page)}")


def check_answers(folder: Path) -> None:
    """Raise `InputError` if an answer in a folder is not as written."""
    for name, why in read_answers(folder).unusable.items():
        if why is not Unusable.ALTERED:
            continue
        raise InputError(f"{folder / name}.nc is not as written; {restoring_command(f'{name}.nc')}")


def add_p_boxes(
    surrogate: AnySurrogate | None, bands: xr.Dataset, folder: Path, count: int
) -> None:
    """Write the bounds of distribution functions at some times."""
    with usage():
        check_integer("--p-boxes", count, 1, 1000)
    bounds = None if surrogate is None else p_boxes(surrogate, bands, count)
    if bounds is None:
        raise UsageError("--p-boxes requires a surrogate with random inputs, over one variable")
    file = answer_file(folder, "p_boxes")
    try_write(lambda: write_netcdf(bounds, file))
    list_shown(folder, [file])
