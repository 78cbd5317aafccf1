"""Answers in the folder of a study: datasets that are computed from its surrogate.

Attribute "stale" marks those of an earlier surrogate; it is gone when the question is asked again.
"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from enum import Enum
from pathlib import Path
from typing import NamedTuple

import xarray as xr

from flexband.basics.computation import OutdatedError
from flexband.basics.files import try_write
from flexband.errors import InputError
from flexband.execution.names import ANSWERS
from flexband.study.results.netcdf import read_netcdf, write_netcdf

STALE = "stale"


OF_STUDY = "the study"
OF_QUESTION = "a question"
"""Values of attribute "of" of limits.nc: whose limits these are."""


class Unusable(Enum):
    """Why an answer that is in a folder cannot be used."""

    STALE = "of earlier results"
    ALTERED = "that are not as written"


def answer_file(folder: Path, name: str) -> Path:
    return folder / f"{name}.nc"


def answer_files(folder: Path, names: Iterable[str]) -> list[Path]:
    """Return where answers and their pictures are, or would be."""
    return [folder / f"{name}.{kind}" for name in names for kind in ("nc", "png")]


class Answers(NamedTuple):
    """Answers by name: usable ones, of the surrogate and as written; why others are unusable."""

    usable: dict[str, xr.Dataset]
    unusable: dict[str, Unusable]


def read_answers(folder: Path, names: Iterable[str] = ANSWERS) -> Answers:
    answers = Answers({}, {})
    for name in names:
        try:
            answer = read_netcdf(answer_file(folder, name))
        except FileNotFoundError:
            continue
        except OutdatedError:
            answers.unusable[name] = Unusable.STALE
            continue
        except InputError:
            answers.unusable[name] = Unusable.ALTERED
            continue
        if STALE in answer.attrs:
            answers.unusable[name] = Unusable.STALE
        else:
            answers.usable[name] = answer
    return answers


def read_answer(folder: Path, name: str) -> xr.Dataset | None:
    """Return an answer in a folder; None if it is missing, altered, or of an earlier surrogate."""
    return read_answers(folder, [name]).usable.get(name)


def mark_stale(folder: Path) -> None:
    """Mark all answers in a folder as those of an earlier surrogate."""
    for file in (answer_file(folder, name) for name in ANSWERS):
        with suppress(FileNotFoundError, InputError):  # one that was altered is not read either
            answer = read_netcdf(file).assign_attrs(
                {STALE: "an answer of earlier results: ask again"}
            )
            try_write(lambda answer=answer, file=file: write_netcdf(answer, file))


def stale_files(folder: Path) -> list[Path]:
    """Return the files of answers of an earlier surrogate, and their pictures."""
    stale = [k for k, why in read_answers(folder).unusable.items() if why is Unusable.STALE]
    return [file for file in answer_files(folder, stale) if file.is_file()]
