"""The report of a study: written by `flexband run`, and again by `flexband report`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer
import xarray as xr

import flexband as fb
from flexband.cli.answers.checking import check
from flexband.cli.answers.older import OF_RUN, altered
from flexband.cli.application import app
from flexband.cli.files import Folder, save
from flexband.cli.messages import UsageError, print_remark, print_text, reported_errors, usage
from flexband.errors import InputError, whole
from flexband.study.folder import StudyFolder
from flexband.study.study import Study

SHARES = "contributions.nc"
GIVEN, PAGE = "page.json", "report.html"
BANDS = "bands.nc"
DATA = (BANDS, "verification.nc", SHARES)
MODEL = "surrogate.npz"


def report_on(
    study: Study,
    folder: Path,
    bands: xr.Dataset,
    surrogate: Any,
    checked: xr.Dataset | None,
    inputs: Mapping[str, Any],
    about: dict[str, Any],
) -> tuple[Path, list[str]]:
    """Write the report of a study that was carried out; return its path, and its answer in words.

    What it shows of the study's code is written beside it, so that it can be written again.

    Parameters
    ----------
    inputs : fields with their domains.
    about : `title`, `label`, `file`, `computed`, `remarks`, `doubts`, `files`, the names of those
        that were written, and `seconds` of a run.
    """
    from flexband.report.page.given import given_by, write_given  # noqa: PLC0415
    from flexband.report.page.study import uncertain_ones, verdict, write_report  # noqa: PLC0415
    from flexband.report.results import write_netcdf  # noqa: PLC0415

    contributions = contributions_of(surrogate, study.sigmas)
    limits, probability, unchecked = limits_of(study, surrogate, folder)
    add_path(surrogate, bands, folder)
    signed = StudyFolder(folder).signed([folder / name for name in about["files"]])
    if contributions is not None and save(lambda: write_netcdf(contributions, folder / SHARES)):
        about["files"].append(SHARES)  # another command writes it as well
    seconds = about.pop("seconds")
    found = given_by(study, inputs, surrogate, Path(about["file"]), seconds=seconds)
    given = {**about, **found, "unchecked": unchecked, "signed": signed}
    save(lambda: write_given(folder, given))
    page = write_report(folder, given, bands, checked, contributions, surrogate)
    uncertain = uncertain_ones(contributions, given["inputs"])
    answer = verdict(given, bands, checked, uncertain, limits, probability)
    return page, answer


def limits_of(
    study: Study, surrogate: Any, folder: Path
) -> tuple[xr.Dataset | None, xr.Dataset | None, str]:
    """Return whether the limits of a study are kept, and the probability of leaving them.

    The text is why that is not known; it is empty if it is, or if there are no limits.
    """
    if study.limits and surrogate is None:
        return None, None, "the method expands no response"
    if study.limits:
        try:
            return *check(surrogate, study.limits, folder), ""
        except Exception as error:  # the bands are there
            return None, None, str(error) or type(error).__name__
    return None, None, ""


def add_path(surrogate: Any, bands: xr.Dataset, folder: Path) -> None:
    """Write the path of the most uncertain point, unless another one was asked for."""
    from flexband.report.page.answers import read_answer  # noqa: PLC0415
    from flexband.report.page.paths import widest_path  # noqa: PLC0415
    from flexband.report.results import write_netcdf  # noqa: PLC0415

    before = read_answer(folder, "path")
    if before is not None and "automatic" not in before.attrs:
        return
    found = widest_path(surrogate, bands, bands.attrs["sigmas"])
    if found is not None:
        told = found.assign_attrs(automatic="the most uncertain point")
        save(lambda: write_netcdf(told, folder / "path.nc"))


def contributions_of(surrogate: Any, sigmas: float) -> xr.Dataset | None:
    """Return how much each input widens the error bars; print a remark if that fails."""
    if surrogate is None:
        return None
    try:
        return fb.contributions(surrogate, sigmas=sigmas)
    except Exception as error:  # the bands are there
        print_remark(f"which input matters is not known: {error}")
        return None


@app.command("report")
@reported_errors()
def report(
    folder: Folder,
    p_boxes: Annotated[
        int | None,
        typer.Option(help="Times at which distribution functions are bounded for a chart."),
    ] = None,
) -> None:
    """Write the report of the study in FOLDER again, with the answers that were computed since.

    Nothing is run. report.html is one file with all that it needs, which can be sent. Distribution
    functions take about a second each; they are kept in p_boxes.nc.
    """
    from flexband.report.page.given import RESTORED, read_given  # noqa: PLC0415
    from flexband.report.page.study import write_report  # noqa: PLC0415
    from flexband.report.results import read_netcdf  # noqa: PLC0415

    given = read_given(folder)
    if not given:
        raise InputError(f"folder must have results of `flexband run`; got '{folder}'")
    if missing := [name for name in given["files"] if not (folder / name).is_file()]:
        raise InputError(f"'{folder}' has lost {', '.join(missing)}; `flexband run` makes it again")
    if BANDS not in given["files"]:
        raise InputError(f"'{folder}' has no {BANDS} of its study; {RESTORED}")
    bands, *more = (folder / name for name in DATA)
    data = read_netcdf(bands)
    checked, contributions = (
        read_netcdf(one) if one.name in given["files"] else None for one in more
    )
    surrogate = fb.load_surrogate(folder / MODEL) if MODEL in given["files"] else None
    sigmas = float(data.attrs["sigmas"])
    if contributions is not None and contributions.attrs["sigmas"] != sigmas:  # asked for since
        contributions = contributions_of(surrogate, sigmas)
    if p_boxes is not None:
        add_p_boxes(surrogate, data, folder, p_boxes)
    check_answers(folder)
    page = write_report(folder, given, data, checked, contributions, surrogate)
    print_text(f"Report: {page}")


def check_answers(folder: Path) -> None:
    """Raise `InputError` if an answer in a folder is not as written."""
    from flexband.report.page.given import RESTORED  # noqa: PLC0415

    for name in altered(folder):
        restored = RESTORED if name in OF_RUN else "ask again, or delete it"
        raise InputError(f"{folder / name}.nc is not as written; {restored}")


def add_p_boxes(surrogate: Any, bands: xr.Dataset, folder: Path, count: int) -> None:
    """Write the bounds of distribution functions at some times."""
    from flexband.report.page.p_boxes import p_boxes  # noqa: PLC0415
    from flexband.report.results import write_netcdf  # noqa: PLC0415

    with usage():
        whole("--p-boxes", count, 1, 1000)
    found = None if surrogate is None else p_boxes(surrogate, bands, count)
    if found is None:
        raise UsageError("--p-boxes requires a surrogate with random inputs, over one variable")
    save(lambda: write_netcdf(found, folder / "p_boxes.nc"))
