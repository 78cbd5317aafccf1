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
from rich.live import Live

from flexband.basics.computation import OutdatedError, check_numbering
from flexband.basics.words import are, number_of
from flexband.cli.application import app
from flexband.cli.folders import Folder
from flexband.cli.messages import print_json, print_text, reported_errors
from flexband.errors import StoreError
from flexband.execution.growing import GrowingArrays
from flexband.execution.names import RunStatus
from flexband.report.progress import duration
from flexband.report.text.doubts import doubt_text
from flexband.report.text.terminal import Terminal
from flexband.study.folder import FORMAT, StudyFolder, checksum_of
from flexband.study.results.reliability import Doubt


@app.command()
@reported_errors()
def status(
    folder: Folder,
    watch: Annotated[bool, typer.Option("--watch", help="Repeat until the study ends.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON with all failures.")] = False,
) -> None:
    """Show the progress, rate and failures of the study in FOLDER.

    Use it while the study runs, from another terminal or any machine that shares the folder.
    """
    console = Terminal()
    if as_json or not (watch and console.is_terminal):
        before = ""
        for facts in _looks(folder, watch=watch):
            text = "\n".join(lines(facts))
            if as_json:
                print_json(facts)
            elif text != before:
                print_text(text)
            before = text
        return
    with Live(console=console, auto_refresh=False) as live:
        for facts in _looks(folder, watch=watch):
            live.update("\n".join(lines(facts)), refresh=True)


def _looks(folder: Path, *, watch: bool) -> Iterator[dict[str, Any]]:
    yield (facts := state_of(folder))
    while watch and facts["state"] == "running":
        time.sleep(1.0)
        yield (facts := state_of(folder))


def state_of(folder: Path) -> dict[str, Any]:
    """Return how far the study in a folder is; raise `StoreError` if there is none."""
    study_folder = StudyFolder(folder)
    alive = study_folder.in_use()
    about = study_folder.read()
    if not about and not study_folder.runs.exists():
        raise StoreError(f"folder must be that of a study; there is none in {str(folder)!r}")
    runs = _runs(study_folder, about.get("session"))
    state = about.get("state", "running" if alive else "stopped")
    if state == "running" and not alive:
        state = "stopped"
        about["reason"] = f"{about.get('process', 'its process')} ended without a word"
    elif alive:
        state = "running"
    replaced = [failure for failure in runs["failures"] if failure["replaced"]]
    total = about.get("total")
    done = about.get("done", runs["done"])
    elapsed = max(0.0, float(about.get("elapsed", 0.0)))
    ran = float(about.get("ran", elapsed))
    rate = runs["made"] / ran if ran > 0 and runs["made"] else None
    remaining = None
    if state == "running" and total is not None and rate:
        remaining = max(0, total - done) / rate
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
        "left": remaining,
        "doubts": doubts_in(about),
        "points": about.get("points"),
        "failures": runs["failures"],
    }


def doubts_in(about: dict[str, Any]) -> list[str] | None:
    """Return the doubts about the result in a study.json, as sentences; None without one."""
    result = about.get("result")
    if not result:
        return None
    if about["format"] < FORMAT:
        return ["an older version of flexband has written the result; `flexband run` restores it"]
    try:
        check_numbering("the folder", about.get("numbering"))
    except OutdatedError as error:
        return [str(error)]
    if result.get("checksum") != checksum_of(result):
        return ["the result in study.json is not as written; `flexband run` restores it"]
    return [doubt_text(Doubt.from_json(content)) for content in result["doubts"]]


def _runs(folder: StudyFolder, session: int | None) -> dict[str, Any]:
    """Return the numbers of recorded runs since the first of a session, and what failed.

    A run counts as it ended last. One that failed is replaced if the same point was run on a finer
    discretization.
    """
    arrays = GrowingArrays(folder.runs)
    if "status" not in arrays.arrays or not arrays.runs:
        return {"done": 0, "made": 0, "failures": []}
    status = arrays.read("status")
    sessions = arrays.read("session")
    names = arrays.read("input").tolist()
    settings: Any = arrays.read("setting")
    made = np.flatnonzero(np.isin(status, [RunStatus.DONE, RunStatus.FAILED]))
    rows = zip(made, arrays.read("inputs", made), strict=True)
    last = {(settings[k], row.tobytes()): int(k) for k, row in rows}
    done: dict[bytes, list[Counter[str]]] = {}
    for (setting, point), k in last.items():
        if status[k] == RunStatus.DONE:
            done.setdefault(point, []).append(parts_of(setting))
    failed = np.array([k for k in last.values() if status[k] == RunStatus.FAILED], dtype=int)
    inputs = arrays.read("inputs", failed)
    reasons = arrays.read("reason", failed)

    def has_successor(k: Any, row: np.ndarray) -> bool:
        return any(parts_of(settings[k]) < done_parts for done_parts in done.get(row.tobytes(), []))

    first = len(arrays.sessions) - 1 if session is None else session
    return {
        "done": int((status == RunStatus.DONE).sum()),
        "made": int(((sessions >= first) & (status != RunStatus.LOST)).sum()),
        "failures": [
            {"run": int(k), "inputs": dict(zip(names, row.tolist(), strict=True)),
             "setting": settings[k], "reason": reason, "replaced": has_successor(k, row)}
            for k, row, reason in zip(failed, inputs, reasons, strict=True)
        ],
    }  # fmt: skip


def parts_of(setting: str) -> Counter[str]:
    """Return the options of a setting, and how often each part of the discretization is halved."""
    return Counter(filter(None, setting.split("; ")))


def going_on(facts: dict[str, Any]) -> str:
    """Return how to continue a study that was stopped, or that failed."""
    if facts["file"] is not None:
        resumption = f"`flexband resume {shlex.quote(facts['folder'])}` continues"
        if facts["state"] == "stopped":
            return resumption
        paths = shlex.quote(facts["file"]), shlex.quote(facts["folder"])
        return (
            f"{resumption} if the cause lies outside of the study. Otherwise correct {paths[0]}, "
            f"then `flexband run {paths[0]} --output {paths[1]}`"
        )
    return (
        "There is no study.json here. `flexband run` with the study's file and this folder "
        "continues, and so does the Python program that made the runs"
    )


def count_text(facts: dict[str, Any]) -> str:
    """Return how many runs are done, and of how many as far as that is known."""
    if facts["total"] is not None:
        limit_text = "at most " if facts["most"] else ""
        total = number_of(facts["total"], "run")
        return f"{facts['done']} of {limit_text}{total} done"
    limit_text = (
        f" (at most {facts['each']} with the same step and elements)" if facts["each"] else ""
    )
    return f"{number_of(facts['done'], 'run')} done{limit_text}"


def now_and_left(facts: dict[str, Any]) -> list[str]:
    """Return what a running study does now, how fast it is, and which time its runs still take."""
    texts = [f"now: {facts['now']}"] * bool(facts["now"])
    rate = facts["rate"]
    remaining = facts["left"]
    if rate:
        speed = f"{duration(1 / rate)} per run"
        if rate >= 1:
            speed = f"{number_of(f'{rate:.3g}', 'run')} per second"
        kind = "at most" if facts["most"] else "about"
        rest = f", {kind} {duration(remaining)} left for the runs" if remaining else ""
        texts.append(f"{speed} on average{rest}")
    return texts


def lines(facts: dict[str, Any], listed: int = 10) -> list[str]:
    """Return the state of a study as lines; so many failed runs are listed."""
    state = facts["state"]
    about = f"{facts['folder']}: {state}"
    failures = [failure for failure in facts["failures"] if not failure["replaced"]]
    if facts["reason"]:
        lines = facts["reason"].splitlines()  # of failed runs, the others tell what follows here
        about += f" ({lines[0] if failures else ' '.join(lines)})"
    elif state == "running" and facts["process"]:
        about += f", by {facts['process']}"
    # How many runs are done, and how fast.
    if state in ("running", "finished"):
        report = [about, f"{count_text(facts)}, {facts['failed']} failed"]
    else:
        report = [
            about,
            f"{number_of(facts['recorded'], 'run')} done and recorded, {facts['failed']} failed",
        ]
    if state == "running":
        report += now_and_left(facts)
    # Which runs failed.
    if facts["replaced"]:
        report.append(
            f"{facts['replaced']} more failed on a coarse discretization that was tried first, and "
            "were made again on a finer one"
        )
    for failure in failures[:listed]:
        inputs = ", ".join(f"{name} = {value:.9g}" for name, value in failure["inputs"].items())
        where = f" ({failure['setting']})" if failure["setting"] else ""
        report.append(f"failed: run {failure['run']}{where}: {inputs}: {failure['reason']}")
    if len(failures) > listed:
        report.append(
            f"… and {number_of(len(failures) - listed, 'more failed run')} (--json lists all)"
        )
    # Doubts, and how the study goes on.
    if facts["doubts"]:
        report.append(f"Doubts: {'; '.join(facts['doubts'])}")
    if state == "waiting" and facts["points"]:
        report.append(
            f"{are(facts['points']['count'], 'point')} to be run: {facts['points']['file']}"
        )
    if state in ("stopped", "failed"):
        report.append(going_on(facts))
    return report
