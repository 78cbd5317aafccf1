"""What is printed of the result of a study, and its report."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from flexband.basics.error_text import error_text
from flexband.cli.folders import draw_limits
from flexband.cli.messages import print_json, print_remark, print_table, print_text
from flexband.errors import InputError
from flexband.execution.names import FileName
from flexband.remarks.remark import Doubted
from flexband.report.page.page_record import check_shown, read_given
from flexband.report.study_report import (
    advice_of,
    headline_of,
    remarks,
    report_study,
    reported_as,
)
from flexband.report.text import band_tables
from flexband.report.text.doubts import doubt_text
from flexband.report.text.headline import background
from flexband.report.text.parts import parts_table, sampling_line
from flexband.report.text.remarks import remark_line, standing_remarks, untouched_by
from flexband.report.text.requirement_verdicts import verdict_line
from flexband.report.text.run_counts import run_count_text
from flexband.requirements.verdict import RequirementVerdict, Verdict

if TYPE_CHECKING:
    from flexband.cli.plan import Plan
    from flexband.study.results.result import StudyResult
    from flexband.study.study import Study


STYLES = {Verdict.PASS: "green", Verdict.FAIL: "bold red", Verdict.UNDECIDED: "yellow"}
"""How a line with a verdict is printed."""


def print_verdicts(verdicts: Sequence[RequirementVerdict]) -> None:
    """Print the verdicts, each with the remarks that touch it."""
    for verdict in verdicts:
        print_text(verdict_line(verdict), STYLES[verdict.verdict])
        for remark in standing_remarks(verdict):
            print_text(f"      remark: {remark_line(remark)}", "yellow")
    if verdicts:
        print_text("")


def write_report_of(plan: Plan, study: Study, result: StudyResult) -> bool:
    """Write the report of a result, unless it is there; print a remark if there can be none."""
    if result.reused and has_report(result.folder, study, Path(plan.file)):
        return True
    if result.limits is not None:
        draw_limits(result.limits, result.folder, study.display)
    try:
        report_study(study, result, plan.title, Path(plan.file))
    except OSError:
        raise
    except Exception as error:  # the results are there
        print_remark(f"the report is not written: {error_text(error)}")
        return False
    return True


def has_report(folder: Path, study: Study, file: Path) -> bool:
    """Return whether a folder has the report of its result, perhaps with more answers."""
    try:
        page_record = read_given(folder)
        check_shown(folder, page_record)
        there = (folder / FileName.REPORT).is_file() and bool(page_record)
        return there and reported_as(study, page_record, file)
    except InputError:
        return False


def print_result(
    plan: Plan, study: Study, result: StudyResult, reported: bool, *, as_json: bool, verbose: bool
) -> None:
    """Print the verdicts, the lines below them, and where the report is; if `verbose`, the rest.

    Without requirements, the table of the bands stands in place of the verdicts.
    """
    verdicts = result.verdicts_in(study.display)
    title = f"{plan.title}: {result.label}"
    sampled = result.parts
    display_bands = band_tables.predictable_part(study.display.data(result.bands), sampled)
    table = (
        None
        if display_bands is None
        else band_tables.summary_table(display_bands, result.verification)
    )
    parts = None if sampled is None else parts_table(sampled)
    lines = headline_of(study, result)
    notes = [*background(result.limits), *remarks(study, result)]
    if as_json:
        doubts = [doubt_text(doubt) for doubt in result.doubts]
        print_json(
            {"verdicts": [verdict.as_json() for verdict in verdicts],
             "warnings": [remark.as_json() for remark in result.remarks],
             "title": title, "table": table, "parts": parts, "answer": lines, "runs": result.runs,
             "doubts": doubts, "remarks": notes}
        )  # fmt: skip
        return
    # The verdicts or the bands, and what to know of them.
    print_verdicts(verdicts)
    if table is not None and (verbose or not verdicts):
        print_table(title, table)
    if sampled is not None and parts is not None:
        print_table(f"Distribution over {sampling_line(sampled)} (95 % confidence)", parts)
    lines += [f"{note}." for note in advice_of(study, result)]
    lines += [
        f"Remark: {remark_line(remark)}."
        for remark in untouched_by(verdicts, result.remarks)
        if verbose or (not verdicts and remark.worst.kind.doubt_scope is not Doubted.NONE)
    ]
    # The rest, and the files.
    if verbose:
        lines += ["", *(f"{note}." for note in notes if f"{note}." not in lines), ""]
    print_text("\n".join([*lines, *_files(result, reported, verbose=verbose)]))


def _files(result: StudyResult, reported: bool, *, verbose: bool) -> list[str]:
    """Return where the report is, of how many runs, and where the other files are if `verbose`."""
    margins = None if result.limits is None else result.limits.margins
    counts = run_count_text(result.bands, result.verification, margins)
    file = f"Report: {result.folder / FileName.REPORT}" if reported else f"Data: {result.folder}"
    lines = [f"{file} ({counts})"]
    if verbose:
        kinds: dict[str, str] = {
            FileName.SURROGATE: "Model: ",
            FileName.BANDS: "Data:  ",
            FileName.VERIFICATION: "Check: ",
        }
        lines += [f"{kinds[k]} {result.folder / k}" for k in result.files if k in kinds]
    return lines + [f"Older:  {result.folder / name}, of an earlier run" for name in result.stale]
