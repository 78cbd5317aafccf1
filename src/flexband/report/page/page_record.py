"""page.json: what a report shows of a study's code, so that it can be written without that code."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from flexband.basics.computation import NUMBERING, check_numbering
from flexband.basics.files import read_json, write_json
from flexband.errors import InputError
from flexband.execution.names import WRITTEN_BY_RUN, FileName
from flexband.report.page.arrays import JsonRecord
from flexband.requirements.verdict import RequirementVerdict
from flexband.study.folder import StudyFolder
from flexband.study.results.answers import answer_files, read_answers
from flexband.study.results.netcdf import RESTORED
from flexband.study.results.reliability import Doubt


def write_given(folder: Path, page_record: JsonRecord) -> None:
    """Write page.json, with `doubts` and checksums `signed` of results, into a folder."""
    doubts = [doubt.as_json() for doubt in page_record["doubts"]]
    unchecked = [verdict.as_json() for verdict in page_record["unchecked"]]
    content = {**page_record, "doubts": doubts, "unchecked": unchecked, "numbering": NUMBERING}
    write_json(folder / FileName.PAGE, content)


def list_shown(folder: Path, files: Iterable[Path] | None = None) -> None:
    """Write into page.json which answers and pictures the page shows, with their checksums.

    These are all in the folder, or those `files` which were written again, of the ones before.
    """
    file = folder / FileName.PAGE
    try:
        content = read_json(file)
    except (OSError, ValueError):  # there is no page, or `read_given` tells
        return
    if files is None:
        page_files = answer_files(folder, read_answers(folder).usable)
        unchanged = {}
    else:
        before = content.get("shown", {})
        page_files = [path for path in files if path.name in before]
        names = {path.name for path in page_files}
        unchanged = {name: signed for name, signed in before.items() if name not in names}
    there = [path for path in page_files if path.is_file()]
    content["shown"] = {**unchanged, **StudyFolder(folder).checksums(there)}
    write_json(file, content)


def check_shown(folder: Path, page_record: JsonRecord) -> None:
    """Raise `InputError` if an answer or a picture that the page shows is missing or altered."""
    for name, checksum in page_record.get("shown", {}).items():
        if StudyFolder(folder).has({name: checksum}):
            continue
        what = "is not as written" if (folder / name).exists() else "is missing"
        raise InputError(
            f"{folder / name}, which the report shows, {what}; {restoring_command(name)}"
        )


def restoring_command(name: str) -> str:
    """Return which command writes an answer, or its picture, again."""
    answer = name.rpartition(".")[0]
    if answer in WRITTEN_BY_RUN:
        return RESTORED
    others = {
        "allocation": "allocate",
        "narrowed": "narrow",
        "p_box": "distribution",
        "p_boxes": "report --p-boxes",
        "quantiles": "distribution",
        "range": "distribution",
    }
    command = others.get(answer, answer)
    return f"`flexband {command}` restores it, and `flexband run` leaves it out"


def read_given(folder: Path) -> JsonRecord:
    """Return what page.json has, or nothing; raise `InputError` if outdated or not as written."""
    file = folder / FileName.PAGE
    try:
        page_record = read_json(file)
    except FileNotFoundError:
        return {}
    except (OSError, ValueError):
        raise InputError(f"{file} is not as written; {RESTORED}") from None
    try:
        page_record["doubts"] = [Doubt.from_json(content) for content in page_record["doubts"]]
        unchecked = map(RequirementVerdict.from_json, page_record["unchecked"])
        page_record["unchecked"] = list(unchecked)
    except (ValueError, KeyError, TypeError):
        older = "was written by an older version of flexband"
        raise InputError(f"{file} {older}; {RESTORED}") from None
    check_numbering(str(file), page_record.pop("numbering", None))
    for name, checksum in page_record["signed"].items():
        there = (folder / name).exists()
        if there and not StudyFolder(folder).has({name: checksum}):
            raise InputError(f"{folder / name} is not as written; {RESTORED}")
    return page_record
