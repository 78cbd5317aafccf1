"""Answers of an earlier run, which are not those of the results beside them."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from flexband.cli.files import save
from flexband.errors import InputError

ANSWERS = (
    "allocation", "p_boxes", "derived", "limits", "narrowed", "p_box", "path", "probability",
    "quantiles", "range", "sobol",
)  # fmt: skip
"""Names of the files that commands write. `flexband run` itself writes contributions."""

OF_RUN = ("limits", "path", "probability")
"""Those that `flexband run` writes, too."""


def altered(folder: Path, names: Iterable[str] = ANSWERS) -> list[str]:
    """Return the names of the answers in a folder that are not as written."""
    from flexband.report.page.answers import ALTERED, read_answer  # noqa: PLC0415

    unusable: dict[str, str] = {}
    for name in names:
        read_answer(folder, name, unusable)
    return [name for name, reason in unusable.items() if reason == ALTERED]


def mark_older(folder: Path) -> None:
    """Mark the answers in a folder as those of earlier results.

    The data have an attribute "stale" then, which is gone when the question is asked again.
    """
    from flexband.report.results import read_netcdf, write_netcdf  # noqa: PLC0415

    for file in (folder / f"{name}.nc" for name in ANSWERS):
        with suppress(FileNotFoundError, InputError):  # one that was altered is not read either
            answer = read_netcdf(file).assign_attrs(stale="an answer of earlier results: ask again")
            save(lambda answer=answer, file=file: write_netcdf(answer, file))


def stale(folder: Path) -> list[Path]:
    """Return the answers of earlier results in a folder, and their pictures."""
    from flexband.report.page.answers import OLDER, read_answer  # noqa: PLC0415

    unusable: dict[str, str] = {}
    for name in ANSWERS:
        read_answer(folder, name, unusable)
    names = [name for name, reason in unusable.items() if reason == OLDER]
    files = (folder / f"{name}.{kind}" for name in names for kind in ("nc", "png"))
    return [file for file in files if file.is_file()]
