"""The commands that make the runs of a study: run, resume, rerun."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from flexband.cli.application import app
from flexband.cli.carrying_out import carry_out
from flexband.cli.files import File, Folder, Output
from flexband.cli.messages import UsageError, reported_errors, usage
from flexband.cli.methods import METHODS, with_method_options
from flexband.cli.plan import POLICIES, Plan
from flexband.errors import StoreError
from flexband.study.folder import StudyFolder
from flexband.uncertainty.evaluations.evaluations import BATCH
from flexband.uncertainty.surrogates.verification import RUNS

Method = Annotated[
    str | None, typer.Option(help=f"Used instead of the study's method: {', '.join(METHODS)}.")
]
Sigmas = Annotated[
    float | None, typer.Option(help="k of the error bar μ ± kσ, instead of the study's (1).")
]
Failed = Annotated[
    str, typer.Option(help=f"What to do about a run that fails: {', '.join(POLICIES)}.")
]
Executor = Annotated[
    str | None,
    typer.Option(
        help="Where runs are made, instead of this process: processes (one per core), processes:4, "
        "or the address of a Dask scheduler."
    ),
]
TimeLimit = Annotated[
    float | None,
    typer.Option(
        help="Time [s] that one call of the response may take, in processes or on a cluster."
    ),
]
Trust = Annotated[
    bool, typer.Option("--trust", help="Run the file that the folder names, wherever it is.")
]
Insist = Annotated[
    bool, typer.Option("--insist", help="Use runs in the folder that are of another response.")
]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]


@app.command()
@reported_errors()
@with_method_options
def run(
    file: File,
    output: Output = Path("output"),
    method: Method = None,
    sigmas: Sigmas = None,
    verify: Annotated[
        int | None,
        typer.Option(help=f"New runs that verify the result; 0 for none.  [default: {RUNS}]"),
    ] = None,
    executor: Executor = None,
    time_limit: TimeLimit = None,
    failed: Failed = "stop",
    batch: Annotated[int, typer.Option(help="Most runs in one call of the response.")] = BATCH,
    store: Annotated[
        bool, typer.Option("--store/--no-store", help="Record every run in the folder.")
    ] = True,
    insist: Insist = False,
    replace: Annotated[
        bool, typer.Option("--replace", help="Delete the runs that are in the folder before.")
    ] = False,
    as_json: Json = False,
    **values: Any,
) -> None:
    """Run the study in FILE; write its bands, surrogate and a report.

    Every run is recorded in the folder as soon as it is finished. A study that was stopped or
    killed goes on where it was; another method, or other limits of the inputs, use the runs that
    serve them. Results of an earlier run in the same folder are replaced; what is left of
    them is named.

    Options of methods change the study's method, or the one given by --method.
    """
    given = {name: value for name, value in values.items() if value is not None}
    own = str(file.resolve())
    with usage():
        plan = Plan(own, method, given, sigmas, verify, failed, batch, executor, time_limit)
    carry_out(plan, output, recorded=store, insist=insist, replace=replace, as_json=as_json)


@app.command()
@reported_errors()
def resume(
    folder: Folder,
    executor: Executor = None,
    time_limit: TimeLimit = None,
    failed: Annotated[
        str | None, typer.Option(help=f"Instead of what was given: {', '.join(POLICIES)}.")
    ] = None,
    trust: Trust = False,
    insist: Insist = False,
    as_json: Json = False,
) -> None:
    """Go on with the study in FOLDER that was stopped or killed, or that failed."""
    changes = {"executor": executor, "time_limit": time_limit, "failed": failed}
    carry_out(plan_in(folder, trust=trust, **changes), folder, insist=insist, as_json=as_json)


@app.command()
@reported_errors()
def rerun(
    folder: Folder,
    failed: Annotated[bool, typer.Option("--failed", help="Make failed runs again.")] = False,
    executor: Executor = None,
    time_limit: TimeLimit = None,
    trust: Trust = False,
    insist: Insist = False,
    as_json: Json = False,
) -> None:
    """Make the failed runs of the study in FOLDER again, and go on with it."""
    if not failed:
        raise UsageError("rerun requires --failed; runs that succeeded are not made again")
    plan = plan_in(folder, trust=trust, executor=executor, time_limit=time_limit)
    carry_out(plan, folder, insist=insist, again=True, as_json=as_json)


def plan_in(folder: Path, *, trust: bool = False, **changes: Any) -> Plan:
    """Return the plan of the study in a folder.

    Parameters
    ----------
    trust : whether to run a file, or connect to a scheduler, that only the folder names.

    Raises
    ------
    StoreError
        If there is no study in the folder.
    UsageError
        If `trust` is required.
    """
    about = StudyFolder(folder).read()
    if not about:
        runs = ". `flexband run` with the study's file and this folder uses the runs that are there"
        raise StoreError(
            f"folder must be that of a study that `flexband run` began; there is no study.json in "
            f"{str(folder)!r}{runs if StudyFolder(folder).recorded else ''}"
        )
    with usage():
        plan = Plan.of(about, **changes)
    if trust:
        return plan
    if not is_near(Path(plan.file), folder):
        raise UsageError(
            f"the study of {folder} is {plan.file}, which is neither below the working "
            "directory nor beside the folder. If you know this file, give --trust to run it, or "
            "use `flexband run` with the file"
        )
    if changes.get("executor") is None and plan.has_remote_executor:
        raise UsageError(
            f"the executor of {folder} is {plan.executor}, on another host. If you know "
            "it, give --trust to connect to it, or --executor"
        )
    return plan


def is_near(file: Path, folder: Path) -> bool:
    """Return whether a file is below the working directory or beside a folder.

    A file in the folder may have come with it. It counts only where that is the working directory,
    or above.
    """
    file, folder, current = file.resolve(), folder.resolve(), Path.cwd()
    if file.is_relative_to(folder) and not current.is_relative_to(folder):
        return False
    return file.is_relative_to(current) or file.parent == folder.parent
