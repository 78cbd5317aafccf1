"""page.json: what a report shows of a study's code, so that it can be written without that code."""

from __future__ import annotations

from pathlib import Path

from flexband.computation import NUMBERING, check_numbering
from flexband.errors import InputError
from flexband.execution.names import FileName
from flexband.files import read_json, write_json
from flexband.report.page.arrays import JsonRecord
from flexband.study.folder import StudyFolder
from flexband.study.results.netcdf import RESTORED
from flexband.study.results.reliability import Doubt


def write_given(folder: Path, given: JsonRecord) -> None:
    """Write page.json, with `doubts` and checksums `signed` of results, into a folder."""
    doubts = [doubt.as_json() for doubt in given["doubts"]]
    write_json(folder / FileName.PAGE, {**given, "doubts": doubts, "numbering": NUMBERING})


def read_given(folder: Path) -> JsonRecord:
    """Return what page.json has, or nothing; raise `InputError` if outdated or not as written."""
    file = folder / FileName.PAGE
    try:
        given = read_json(file)
    except FileNotFoundError:
        return {}
    except (OSError, ValueError):
        raise InputError(f"{file} is not as written; {RESTORED}") from None
    try:
        given["doubts"] = [Doubt.from_json(content) for content in given["doubts"]]
    except ValueError:
        older = "was written by an older version of flexband"
        raise InputError(f"{file} {older}; {RESTORED}") from None
    check_numbering(str(file), given.pop("numbering", None))
    for name, checksum in given["signed"].items():
        there = (folder / name).exists()
        if there and not StudyFolder(folder).has({name: checksum}):
            raise InputError(f"{folder / name} is not as written; {RESTORED}")
    return given
