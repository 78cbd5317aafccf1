"""The saved surrogate that answers are computed from, and the options of all answers."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer

import flexband as fb
from flexband.cli.messages import UsageError, print_remark
from flexband.cli.plan import plan_in
from flexband.error_text import error_text
from flexband.errors import InputError
from flexband.execution.lock import is_locked
from flexband.execution.names import BANDS, RUNS, STUDY, STUDY_LOCK, SURROGATE

Saved = Annotated[Path, typer.Argument(help="Folder of a study, or a saved surrogate (.npz).")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON.")]
Sigmas = Annotated[float, typer.Option(help="k of the error bar μ ± kσ.")]


def one_of(sigmas: float | None, probability: float | None, usual: float) -> float:
    """Return k of μ ± kσ, which is the usual one if none is given.

    Raise `UsageError` if a probability is given too, which would take its place.
    """
    if sigmas is not None and probability is not None:
        raise UsageError("--sigmas and --probability exclude each other; give one of them")
    return usual if sigmas is None else sigmas


def saved(folder: Path) -> tuple[Any, Path]:
    """Return a surrogate, and the folder for what is computed from it.

    A remark says if the result of the study was not reliable.
    """
    from flexband.report.page.page_file import read_given  # noqa: PLC0415
    from flexband.report.text.doubts import doubt_text  # noqa: PLC0415
    from flexband.study.results.reliability import DoubtKind  # noqa: PLC0415

    file = folder / SURROGATE if folder.is_dir() else folder
    if not file.is_file():
        if not folder.exists():
            raise InputError(f"there is no '{folder}'; the argument is the --output of a study")
        if (folder / BANDS).is_file():
            raise InputError(
                f"'{folder}' has no surrogate.npz to answer from: its method does not expand the "
                "response. Run the study with one that does, such as AdaptivePCCI"
            )
        running = ": its study is running" * (folder.is_dir() and is_locked(folder / STUDY_LOCK))
        raise InputError(
            "the argument must be a folder with the surrogate.npz of a finished study; "
            f"got '{folder}', which has none{running}"
        )
    if is_locked(file.parent / STUDY_LOCK):
        written = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(file.stat().st_mtime))
        print_remark(
            f"the study in '{file.parent}' is running; this answer is from its surrogate.npz of "
            f"{written}, which may be that of an earlier run"
        )
    doubts = read_given(file.parent).get("doubts", [])
    surrogate = fb.load_surrogate(file)
    for doubt in doubts:
        if doubt.unreliable:
            print_remark(f"what follows is NOT reliable: {doubt_text(doubt)}")
        elif doubt.kind is DoubtKind.TOLERANCE_NOT_MET:
            rare = "what depends on rare values, as probabilities do, is NOT reliable"
            print_remark(f"{doubt_text(doubt)}: {rare}")
    return surrogate, file.parent


def study_limits(place: Path, *, trust: bool) -> list[fb.Limit]:
    """Return the limits of the study in a folder; print a remark if it cannot be read.

    Raise `UsageError` if its file is run only with `trust`.
    """
    if not (place / STUDY).is_file():
        return []
    try:
        return list(plan_in(place, trust=trust).study().limits)
    except UsageError:
        raise
    except Exception as error:  # the study is a program
        print_remark(f"limits of the study are left out: {error_text(error)}")
        return []


def runs_in(place: Path, purpose: str, *, trust: bool) -> dict[str, Any]:
    """Return the response of the study in a folder, and the store of its runs if there is one.

    Raise `InputError` if there is no study, `UsageError` if its file is run only with `trust`.
    """
    if not (place / STUDY).is_file():
        raise InputError(f"there is no study in '{place}' whose response {purpose}")
    store = place if (place / RUNS).is_dir() else None
    return {"response": plan_in(place, trust=trust).study().response, "store": store}
