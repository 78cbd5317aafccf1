"""The commands that run a study: run, resume, rerun."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from flexband.analysis.verification.verify import RUNS
from flexband.cli.answers.checking import draw_limits
from flexband.cli.application import app
from flexband.cli.files import File, Folder, Output, check_folder
from flexband.cli.messages import (
    DOUBTFUL,
    WAITING,
    Ending,
    UsageError,
    print_json,
    print_remark,
    print_table,
    print_text,
    reported_errors,
    usage,
)
from flexband.cli.methods import METHODS, with_method_options
from flexband.cli.plan import POLICIES, Plan, Trust, plan_in
from flexband.error_text import error_text
from flexband.errors import InputError, RunsNeeded
from flexband.execution.names import BANDS, POINTS, REPORT, SURROGATE, VERIFICATION
from flexband.progress import doing
from flexband.report.page.page_file import read_given
from flexband.report.progress import progress_bars
from flexband.report.study_report import answer_of, remarks, report_study
from flexband.report.text import tables
from flexband.report.text.doubts import doubt_text
from flexband.study.folder import StudyFolder
from flexband.study.results.result import StudyResult
from flexband.study.run import run_study
from flexband.study.study import Study
from flexband.uncertainty.runs.evaluations import BATCH
from flexband.words import are, number_of

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
    path = str(file.resolve())
    with usage():
        plan = Plan(path, method, given, sigmas, verify, failed, batch, executor, time_limit)
    run_plan(plan, output, as_json=as_json, record=store, allow_mismatch=insist, replace=replace)


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
    plan = plan_in(folder, trust=trust, **changes)
    run_plan(plan, folder, as_json=as_json, allow_mismatch=insist)


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
    run_plan(plan, folder, as_json=as_json, allow_mismatch=insist, retry_failed=True)


def run_plan(plan: Plan, output: Path, *, as_json: bool = False, **options: Any) -> None:
    """Run a study; write its report, and print its result.

    Parameters
    ----------
    as_json : whether the result is printed as JSON.
    options : further ones of `RunOptions`.
    """
    study = plan.study()
    check_folder(output)
    about = {**plan.told(), "command": shlex.join(["flexband", *sys.argv[1:]])}
    how = plan.options(**options)
    try:
        with progress_bars() as task:
            result = run_study(study, output, how, about=about, task=task)
            doing("the report")
            reported = write_report_of(plan, study, result)
    except RunsNeeded as needed:
        if not how.record:
            raise
        print_text(f"{are(len(needed.points), 'point')} to be run: {output / POINTS}")
        print_text(f"`flexband ingest {output} RESULTS.csv` records their results")
        raise typer.Exit(WAITING) from None
    except KeyboardInterrupt:
        if how.record and StudyFolder(output).begun:
            goes_on = f"`flexband resume {shlex.quote(str(output))}` goes on"
            Ending.stopped = f"flexband: stopped; {goes_on}"
        raise
    print_result(plan, study, result, reported, as_json=as_json)
    if result.reused:
        print_text(f"{output} has this result already: no run was made.", error=True)
    if result.doubts:
        raise typer.Exit(DOUBTFUL)


def write_report_of(plan: Plan, study: Study, result: StudyResult) -> bool:
    """Write the report of a result, unless it is there; print a remark if there can be none."""
    if result.limits is not None and not result.reused:
        draw_limits(result.limits, result.folder)
    if result.reused and has_report(result.folder):
        return True
    try:
        report_study(study, result, plan.title, Path(plan.file))
    except OSError:
        raise
    except Exception as error:  # the results are there
        print_remark(f"the report is not written: {error_text(error)}")
        return False
    return True


def has_report(folder: Path) -> bool:
    """Return whether a folder has the report of its result, perhaps with more answers."""
    try:
        return (folder / REPORT).is_file() and bool(read_given(folder))
    except InputError:
        return False


def print_result(
    plan: Plan, study: Study, result: StudyResult, reported: bool, *, as_json: bool
) -> None:
    """Print the table of a result, what it answers, and the files that were written."""
    title = f"{plan.title}: {result.label}, {number_of(result.runs, 'run')}"
    table = tables.summary_table(result.bands, result.verification)
    answer = answer_of(study, result) if reported else []
    notes = remarks(study, result)
    if as_json:
        doubts = [doubt_text(doubt) for doubt in result.doubts]
        print_json(
            {"title": title, "table": table, "answer": answer, "runs": result.runs,
             "doubts": doubts, "remarks": notes}
        )  # fmt: skip
        return
    print_table(title, table)
    files = [f"Report: {result.folder / REPORT}"] * reported
    kinds = {SURROGATE: "Model: ", BANDS: "Data:  ", VERIFICATION: "Check: "}
    files += [f"{kinds[k]} {result.folder / k}" for k in result.files if k in kinds]
    files += [f"Older:  {result.folder / name}, of an earlier run" for name in result.stale]
    details = [line for line in notes if f"{line}." not in answer]
    print_text("\n".join([*answer, "", *details, "", *files]))
