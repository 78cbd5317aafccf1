"""The report on the result of a study, written again whenever its answers change."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from flexband.basics.files import try_write
from flexband.report.page.arrays import JsonRecord
from flexband.report.page.given import given_by
from flexband.report.page.inputs import inputs_table
from flexband.report.page.page_record import list_shown, write_given
from flexband.report.page.paths import widest_path
from flexband.report.page.study import write_report
from flexband.report.page.verdict import head_of, uncertain_ones
from flexband.report.text import band_tables
from flexband.report.text.advice import advice_on
from flexband.report.text.headline import headline
from flexband.study.folder import StudyFolder
from flexband.study.presentation.title_block import title_block
from flexband.study.results.answers import answer_file, read_answer
from flexband.study.results.netcdf import write_netcdf
from flexband.study.results.result import StudyResult
from flexband.study.study import Study
from flexband.uncertainty.inputs.fields.field import Field
from flexband.uncertainty.surrogates.bands import BandRecord
from flexband.uncertainty.surrogates.surrogate import Surrogate


def report_study(study: Study, result: StudyResult, title: str, file: Path | None) -> Path:
    """Write report.html with a title into the folder of a result; return its path.

    page.json beside it has what it shows of the study's code, to write it again without that.
    """
    folder, checksums = result.folder, StudyFolder(result.folder).checksums
    _write_path(result)
    block = title_block(study.title_block, file)
    page_record = {
        "title": block.get("title") or title,
        "title_block": block,
        "label": result.label,
        "computed": dict(result.computed),
        "files": list(result.files),
        "remarks": remarks(study, result),
        **given_by(study, _inputs(study, result), result.surrogate, file,
                   seconds=result.seconds_per_run),
        **head_of(result),
        "signed": checksums([folder / name for name in result.result_files]),
    }  # fmt: skip
    try_write(lambda: write_given(folder, page_record))
    page = write_report(
        folder,
        page_record,
        result.bands,
        result.verification,
        result.contributions,
        result.surrogate,
    )
    try_write(lambda: list_shown(folder))
    return page


def reported_as(study: Study, page_record: JsonRecord, file: Path | None) -> bool:
    """Return whether a report shows a study with its units and its title block of now."""
    now = (study.units, study.display_units, title_block(study.title_block, file))
    return now == tuple(page_record.get(k, {}) for k in ("units", "display_units", "title_block"))


def headline_of(study: Study, result: StudyResult) -> list[str]:
    """Return what the first lines of a report say below the verdicts."""
    inputs = inputs_table(_inputs(study, result), study.display)
    return headline(
        result.doubts,
        result.verdicts_in(study.display),
        result.bands,
        result.verification,
        uncertain_ones(result.contributions, inputs),
        result.limits,
        unpredictable=head_of(result)["unpredictable"],
    )


def advice_of(study: Study, result: StudyResult) -> list[str]:
    """Return which runs failed, why an accuracy is missed, and what to do, as sentences."""
    bands = study.display.data(result.bands)
    failed = band_tables.failures(bands)
    return failed if result.unpredictable else [*failed, *advice_on(bands, result.verification)]


def remarks(study: Study, result: StudyResult) -> list[str]:
    """Return what diagnostics of a result and of its fields mean, as sentences."""
    inputs = _inputs(study, result)
    fields = {k: i for k, i in inputs.items() if isinstance(i, Field) and i.domain is not None}
    if result.unpredictable:  # no advice on bands helps
        return band_tables.failures(result.bands)
    about = band_tables.remarks(study.display.data(result.bands), result.verification)
    return [*about, *band_tables.field_remarks(fields)]


def _inputs(study: Study, result: StudyResult) -> dict[str, Any]:
    surrogate = result.surrogate
    if surrogate is None:
        return dict(study.inputs)
    return dict(
        surrogate.space.user_inputs if isinstance(surrogate, Surrogate) else surrogate.user_inputs
    )


def _write_path(result: StudyResult) -> None:
    """Write the path of the most uncertain point, unless another one was asked for."""
    automatic = "automatic"  # attribute of a path.nc that no one asked for
    before = read_answer(result.folder, "path")
    if before is not None and automatic not in before.attrs:
        return
    path = widest_path(result.surrogate, result.bands, BandRecord.read(result.bands).sigmas)
    if path is not None:
        path.attrs[automatic] = "the most uncertain point"
        try_write(lambda: write_netcdf(path, answer_file(result.folder, "path")))
