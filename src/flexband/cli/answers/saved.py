"""The saved surrogate that answers are computed from, and the options of all answers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

import flexband as fb
from flexband.cli.messages import UsageError
from flexband.cli.runs import plan_in
from flexband.errors import InputError
from flexband.execution.store import RUNS

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
    """Return a surrogate, and the folder for what is computed from it."""
    file = folder / "surrogate.npz" if folder.is_dir() else folder
    if not file.is_file():
        if not folder.exists():
            raise InputError(f"there is no '{folder}'; the argument is the --output of a study")
        if (folder / "bands.nc").is_file():
            raise InputError(
                f"'{folder}' has no surrogate.npz to answer from: its method does not expand the "
                "response. Run the study with one that does, such as AdaptivePCCI"
            )
        raise InputError(
            "the argument must be a folder with the surrogate.npz of a finished study; "
            f"got '{folder}', which has none"
        )
    return fb.load_surrogate(file), file.parent


def runs_in(place: Path, purpose: str) -> dict[str, Any]:
    """Return the response of the study in a folder, and the store of its runs if there is one.

    Raise `InputError` if there is no study.
    """
    if not (place / "study.json").is_file():
        raise InputError(f"there is no study in '{place}' whose response {purpose}")
    store = place if (place / RUNS).is_dir() else None
    return {"response": plan_in(place).study().response, "store": store}
