"""The commands that run a study."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flexband.analysis.verification import RUNS
from flexband.basics.progress import listener
from flexband.basics.words import are
from flexband.cli.application import app
from flexband.cli.command_options import POLICIES, Failed, Method, Sigmas, Trust
from flexband.cli.exit_status import ExitStatus
from flexband.cli.folders import File, Folder, Output, check_folder
from flexband.cli.messages import Ending, print_text, reported_errors, usage
from flexband.cli.methods import with_method_options
from flexband.errors import RunsNeeded
from flexband.execution.names import FileName
from flexband.study.folder import StudyFolder
from flexband.uncertainty.runs import BATCH

if TYPE_CHECKING:  # imported when a command is called
    from flexband.cli.exit_status import exit_status
    from flexband.cli.plan import Plan, plan_in
    from flexband.cli.result import print_result, write_report_of
    from flexband.report.progress import progress_bars
    from flexband.study.run import RunOptions, run_study


Executor = Annotated[
    str | None,
    typer.Option(
        help="Where runs are made: processes (one per core), processes:4, or a Dask "
        "scheduler's address."
    ),
]
TimeLimit = Annotated[
    float | None,
    typer.Option(help="Time limit [s] of one call."),
]
AllowMismatch = Annotated[
    bool, typer.Option("--allow-mismatch", help="Use runs of another response.")
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON.")]
Verbose = Annotated[
    bool,
    typer.Option("--verbose", help="Print tables and all remarks."),
]


@app.command()
@with_method_options
@reported_errors()
def run(
    file: File,
    output: Output = Path("output"),
    method: Method = None,
    sigmas: Sigmas = None,
    verify: Annotated[
        int | None,
        typer.Option(help=f"Verification runs, 0 for none.  [default: {RUNS}]"),
    ] = None,
    executor: Executor = None,
    time_limit: TimeLimit = None,
    failed: Failed = "stop",
    batch: Annotated[
        int,
        typer.Option(help=f"Most runs in a call ({BATCH}).", show_default=False),
    ] = BATCH,
    store: Annotated[
        bool,
        typer.Option(
            "--store/--no-store",
            help="Record runs (the default).",
            show_default=False,
        ),
    ] = True,
    allow_mismatch: AllowMismatch = False,
    replace: Annotated[bool, typer.Option("--replace", help="Delete recorded runs first.")] = False,
    verbose: Verbose = False,
    as_json: Json = False,
    **values: Any,
) -> None:
    """Run the study in FILE; write its bands, surrogate and a report.

    Every run is recorded in the folder as soon as it is finished. A study that was stopped or
    killed continues where it was. Another method, or other bounds of the inputs, reuse the runs
    that fit. Results of an earlier run in the same folder are replaced; files of it that remain are
    listed. --help-methods lists the options of methods.
    """
    method_options = {name: value for name, value in values.items() if value is not None}
    path = str(file.resolve())
    with usage():
        plan = Plan(
            path, method, method_options, sigmas, verify, failed, batch, executor, time_limit
        )
    options = plan.options(record=store, allow_mismatch=allow_mismatch, replace=replace)
    run_plan(plan, output, options, as_json=as_json, verbose=verbose)


@app.command()
@reported_errors()
def resume(
    folder: Folder,
    retry_failed: Annotated[
        bool, typer.Option("--retry-failed", help="Repeat failed runs.")
    ] = False,
    executor: Executor = None,
    time_limit: TimeLimit = None,
    failed: Annotated[
        str | None,
        typer.Option(
            help=f"What to do if a run fails, instead of the earlier choice: {', '.join(POLICIES)}."
        ),
    ] = None,
    trust: Trust = False,
    allow_mismatch: AllowMismatch = False,
    verbose: Verbose = False,
    as_json: Json = False,
) -> None:
    """Continue the study in FOLDER that was stopped, was killed or failed."""
    changes = {"executor": executor, "time_limit": time_limit, "failed": failed}
    plan = plan_in(folder, trust=trust, **changes)
    options = plan.options(allow_mismatch=allow_mismatch, retry_failed=retry_failed)
    run_plan(plan, folder, options, as_json=as_json, verbose=verbose)


def run_plan(
    plan: Plan,
    output: Path,
    options: RunOptions,
    *,
    as_json: bool = False,
    verbose: bool = False,
) -> None:
    """Run a study into a folder, as the options say; write its report, and print its result."""
    study = plan.study()
    check_folder(output)
    about = {**plan.as_json(), "command": shlex.join(["flexband", *sys.argv[1:]])}
    try:
        with progress_bars() as task:
            result = run_study(study, output, options, about=about, task=task)
            listener().stage("the report")
            reported = write_report_of(plan, study, result)
    except RunsNeeded as missing_runs:
        if not options.record:
            raise
        print_text(
            f"{are(len(missing_runs.points), 'point')} to be run: {output / FileName.POINTS}"
        )
        print_text(f"`flexband import-results {output} RESULTS.csv` records their results")
        raise typer.Exit(ExitStatus.WAITING) from None
    except KeyboardInterrupt:
        if options.record and StudyFolder(output).has_record:
            resumption = f"`flexband resume {shlex.quote(str(output))}` continues"
            Ending.stopped = f"flexband: stopped; {resumption}"
        raise
    print_result(plan, study, result, reported, as_json=as_json, verbose=verbose)
    if result.reused:
        print_text(f"{output} has this result already: no run was made.", error=True)
    if status := exit_status(result.verdicts, result.doubts):
        raise typer.Exit(status)
