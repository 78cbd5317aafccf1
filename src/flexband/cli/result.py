"""What is printed of the result of a study, and its report."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from flexband.basics.error_text import error_text
from flexband.basics.words import number_of
from flexband.cli.folders import draw_limits
from flexband.cli.messages import print_json, print_remark, print_table, print_text
from flexband.errors import InputError
from flexband.execution.names import FileName
from flexband.report.page.page_record import check_shown, read_given
from flexband.report.study_report import answer_of, remarks, report_study, reported_as
from flexband.report.text import band_tables
from flexband.report.text.doubts import doubt_text
from flexband.report.text.parts import parts_table, sampling_line
from flexband.report.text.remarks import remark_line, standing_remarks, untouched_by
from flexband.report.text.requirement_verdicts import verdict_line
from flexband.requirements.verdict import RequirementVerdict, Verdict

if TYPE_CHECKING:
    from flexband.cli.plan import Plan
    from flexband.remarks.collection import CollectedRemark
    from flexband.study.results.result import StudyResult
    from flexband.study.study import Study


STYLES = {Verdict.PASS: "green", Verdict.FAIL: "bold red", Verdict.UNDECIDED: "yellow"}
"""How a line with a verdict is printed."""


def print_verdicts(
    verdicts: Sequence[RequirementVerdict], remarks: Iterable[CollectedRemark]
) -> None:
    """Print the verdicts, each with the remarks that touch it, and the other remarks."""
    for verdict in verdicts:
        print_text(verdict_line(verdict), STYLES[verdict.verdict])
        for remark in standing_remarks(verdict):
            print_text(f"      remark: {remark_line(remark)}", "yellow")
    for remark in untouched_by(verdicts, remarks):
        print_remark(remark_line(remark))
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
    plan: Plan, study: Study, result: StudyResult, reported: bool, *, as_json: bool
) -> None:
    """Print the table of a result, what it answers, and the files that were written."""
    verdicts = result.verdicts_in(study.display)
    title = f"{plan.title}: {result.label}, {number_of(result.runs, 'run')}"
    sampled = result.parts
    display_bands = band_tables.predictable_part(study.display.data(result.bands), sampled)
    table = (
        None
        if display_bands is None
        else band_tables.summary_table(display_bands, result.verification)
    )
    parts = None if sampled is None else parts_table(sampled)
    answer = answer_of(study, result) if reported else []
    notes = remarks(study, result)
    if as_json:
        doubts = [doubt_text(doubt) for doubt in result.doubts]
        print_json(
            {"verdicts": [verdict.as_json() for verdict in verdicts],
             "warnings": [remark.as_json() for remark in result.remarks],
             "title": title, "table": table, "parts": parts, "answer": answer, "runs": result.runs,
             "doubts": doubts, "remarks": notes}
        )  # fmt: skip
        return
    print_verdicts(verdicts, result.remarks)
    if table is not None:
        print_table(title, table)
    if sampled is not None and parts is not None:
        print_table(f"Distribution over {sampling_line(sampled)} (95 % confidence)", parts)
    files = [f"Report: {result.folder / FileName.REPORT}"] * reported
    kinds: dict[str, str] = {
        FileName.SURROGATE: "Model: ",
        FileName.BANDS: "Data:  ",
        FileName.VERIFICATION: "Check: ",
    }
    files += [f"{kinds[k]} {result.folder / k}" for k in result.files if k in kinds]
    files += [f"Older:  {result.folder / name}, of an earlier run" for name in result.stale]
    details = [line for line in notes if f"{line}." not in answer]
    print_text("\n".join([*answer, "", *details, "", *files]))
