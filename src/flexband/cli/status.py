"""The command that tells how far a study is, while it runs or later."""

from __future__ import annotations

import shlex
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.live import Live

from flexband.cli.application import app
from flexband.cli.files import Folder
from flexband.cli.messages import print_json, print_text, reported_errors
from flexband.errors import StoreError
from flexband.execution.growing import GrowingArrays
from flexband.execution.names import AGAIN, DONE, FAILED
from flexband.report.doubts import doubt_text
from flexband.report.progress import duration
from flexband.study.folder import FORMAT, StudyFolder, checksum_of
from flexband.study.results.reliability import Doubt
from flexband.words import are, number_of

PERIOD = 1.0
"""Time [s] between two looks."""

SHOWN = 10
"""Failed runs that are listed."""


@app.command()
@reported_errors()
def status(
    folder: Folder,
    watch: Annotated[bool, typer.Option("--watch", help="Look again until it ends.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, with all failures.")] = False,
) -> None:
    """Print how far the study in FOLDER is: runs, what is done now, rate, and what failed.

    It works while the study runs, from another terminal or machine that sees the folder.
    """
    console = Console()
    if as_json or not (watch and console.is_terminal):
        before = ""
        for found in _looks(folder, watch=watch):
            text = "\n".join(lines(found))
            if as_json:
                print_json(found)
            elif text != before:
                print_text(text)
            before = text
        return
    with Live(console=console, auto_refresh=False) as live:
        for found in _looks(folder, watch=watch):
            live.update("\n".join(lines(found)), refresh=True)


def _looks(folder: Path, *, watch: bool) -> Iterator[dict[str, Any]]:
    yield (found := state_of(folder))
    while watch and found["state"] == "running":
        time.sleep(PERIOD)
        yield (found := state_of(folder))


def state_of(folder: Path) -> dict[str, Any]:
    """Return how far the study in a folder is.

    Raises
    ------
    StoreError
        If there is neither study.json nor any run in the folder, or they are damaged.
    """
    own = StudyFolder(folder)
    alive = own.in_use()
    about = own.read()
    if not about and not own.runs.exists():
        raise StoreError(f"folder must be that of a study; there is none in {str(folder)!r}")
    runs = _runs(own, about.get("session"))
    state = about.get("state", "running" if alive else "stopped")
    if state == "running" and not alive:
        state = "stopped"
        about["reason"] = f"{about.get('process', 'its process')} ended without a word"
    elif alive:
        state = "running"
    replaced = [one for one in runs["failures"] if one["replaced"]]
    total, done = about.get("total"), about.get("done", runs["done"])
    elapsed = max(0.0, float(about.get("elapsed", 0.0)))
    ran = float(about.get("ran", elapsed))
    rate = runs["made"] / ran if ran > 0 and runs["made"] else None
    left = None
    if state == "running" and total is not None and rate:
        left = max(0, total - done) / rate
    return {
        "folder": str(folder),
        "file": about.get("file"),
        "state": state,
        "reason": about.get("reason") if state != "running" else None,
        "process": about.get("process"),
        "alive": alive,
        "started": about.get("started"),
        "done": done,
        "total": total,
        "each": about.get("each", 0),
        "most": about.get("most", False),
        "now": about.get("now") if state == "running" else None,
        "recorded": runs["done"],
        "failed": len(runs["failures"]) - len(replaced),
        "replaced": len(replaced),
        "rate": rate,
        "elapsed": elapsed,
        "left": left,
        "doubts": doubts_in(about),
        "points": about.get("points"),
        "failures": runs["failures"],
    }


def doubts_in(about: dict[str, Any]) -> list[str] | None:
    """Return the doubts about the result in a study.json, as sentences; None without one."""
    result = about.get("result")
    if not result:
        return None
    if result.get("checksum") != checksum_of(result):
        return ["the result in study.json is not as written; `flexband run` restores it"]
    if about["format"] < FORMAT:
        return ["an older version of flexband has written the result; `flexband run` restores it"]
    return [doubt_text(Doubt.from_json(content)) for content in result["doubts"]]


def _runs(folder: StudyFolder, session: int | None) -> dict[str, Any]:
    """Return the numbers of recorded runs, and what failed.

    A run that was made several times counts as it ended last. One that failed is replaced if the
    same point was run on a finer discretization.

    Parameters
    ----------
    session : the first of those that opened the store since the study began or went on, from which
        on runs count as made; None is the last.
    """
    arrays = GrowingArrays(folder.runs)
    if "status" not in arrays.arrays or not arrays.runs:
        return {"done": 0, "made": 0, "failures": []}
    status, sessions = arrays.read("status"), arrays.read("session")
    names = arrays.read("input").tolist()
    settings: Any = arrays.read("setting")
    made = np.flatnonzero(np.isin(status, [DONE, FAILED]))
    rows = zip(made, arrays.read("inputs", made), strict=True)
    last = {(settings[k], row.tobytes()): int(k) for k, row in rows}
    done: dict[bytes, list[Counter[str]]] = {}
    for (setting, point), k in last.items():
        if status[k] == DONE:
            done.setdefault(point, []).append(parts_of(setting))
    failed = np.array([k for k in last.values() if status[k] == FAILED], dtype=int)
    inputs, reasons = arrays.read("inputs", failed), arrays.read("reason", failed)

    def replaced(k: Any, row: np.ndarray) -> bool:
        return any(parts_of(settings[k]) < finer for finer in done.get(row.tobytes(), []))

    first = len(arrays.attrs.get("sessions", [])) - 1 if session is None else session
    return {
        "done": int((status == DONE).sum()),
        "made": int(((sessions >= first) & np.isin(status, [DONE, FAILED, AGAIN])).sum()),
        "failures": [
            {"run": int(k), "inputs": dict(zip(names, row.tolist(), strict=True)),
             "setting": settings[k], "reason": reason, "replaced": replaced(k, row)}
            for k, row, reason in zip(failed, inputs, reasons, strict=True)
        ],
    }  # fmt: skip


def parts_of(setting: str) -> Counter[str]:
    """Return the options of a setting, and how often each part of the discretization is halved."""
    return Counter(filter(None, setting.split("; ")))


def going_on(found: dict[str, Any]) -> str:
    """Return how to go on with a study that was stopped, or that failed."""
    if found["file"] is not None:
        goes_on = f"`flexband resume {shlex.quote(found['folder'])}` goes on"
        if found["state"] == "stopped":
            return goes_on
        own = shlex.quote(found["file"]), shlex.quote(found["folder"])
        return (
            f"{goes_on} if the cause lies outside of the study, and fails again if it does not: "
            f"then mend {own[0]}, and `flexband run {own[0]} --output {own[1]}`"
        )
    return (
        "There is no study.json here. `flexband run` with the study's file and this folder goes "
        "on, and so does the Python program that made the runs"
    )


def counted(found: dict[str, Any]) -> str:
    """Return how many runs are done, and of how many as far as that is known."""
    if found["total"] is not None:
        most, total = "at most " * found["most"], number_of(found["total"], "run")
        return f"{found['done']} of {most}{total} done"
    most = f" (at most {found['each']} with the same step and elements)" * bool(found["each"])
    return f"{number_of(found['done'], 'run')} done{most}"


def now_and_left(found: dict[str, Any]) -> list[str]:
    """Return what a running study does now, how fast it is, and which time its runs still take."""
    told = [f"now: {found['now']}"] * bool(found["now"])
    rate, left = found["rate"], found["left"]
    if rate:
        speed = (
            f"{number_of(f'{rate:.3g}', 'run')} per second"
            if rate >= 1
            else f"{duration(1 / rate)} per run"
        )
        kind = "at most" if found["most"] else "about"
        rest = f", {kind} {duration(left)} left for the runs" if left else ""
        told.append(f"{speed} on average{rest}")
    return told


def lines(found: dict[str, Any]) -> list[str]:
    """Return the state of a study as lines."""
    state = found["state"]
    about = f"{found['folder']}: {state}"
    failures = [one for one in found["failures"] if not one["replaced"]]
    if found["reason"]:
        lines = found["reason"].splitlines()  # of failed runs, the others tell what follows here
        about += f" ({lines[0] if failures else ' '.join(lines)})"
    elif state == "running" and found["process"]:
        about += f", by {found['process']}"
    if state in ("running", "finished"):
        told = [about, f"{counted(found)}, {found['failed']} failed"]
    else:
        told = [
            about,
            f"{number_of(found['recorded'], 'run')} done and recorded, {found['failed']} failed",
        ]
    if state == "running":
        told += now_and_left(found)
    if found["replaced"]:
        told.append(
            f"{found['replaced']} more failed on a coarse discretization that was tried first, and "
            "were made again on a finer one"
        )
    for one in failures[:SHOWN]:
        own = ", ".join(f"{name} = {value:.9g}" for name, value in one["inputs"].items())
        where = f" ({one['setting']})" if one["setting"] else ""
        told.append(f"failed: run {one['run']}{where}: {own}: {one['reason']}")
    if len(failures) > SHOWN:
        told.append(
            f"… and {number_of(len(failures) - SHOWN, 'more failed run')} (--json lists all)"
        )
    if found["doubts"]:
        told.append(f"Doubts: {'; '.join(found['doubts'])}")
    if state == "waiting" and found["points"]:
        told.append(
            f"{are(found['points']['count'], 'point')} to be run: {found['points']['file']}"
        )
    if state in ("stopped", "failed"):
        told.append(going_on(found))
    return told
