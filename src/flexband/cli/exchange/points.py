"""The commands for models that are run elsewhere."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flexband.basics.words import are
from flexband.cli.application import app
from flexband.cli.command_options import Failed, Method, Sigmas, Trust
from flexband.cli.folders import File, Folder, Output
from flexband.cli.messages import print_text, reported_errors, usage
from flexband.cli.methods import with_method_options
from flexband.cli.run_commands import run_plan
from flexband.errors import InputError
from flexband.study.folder import StudyFolder

if TYPE_CHECKING:  # imported when a command is called
    from flexband.cli.plan import Plan, plan_in
    from flexband.execution.journal import Finished
    from flexband.execution.store import Store
    from flexband.study.exchange.points import RequestedPoints
    from flexband.study.study import Study
    from flexband.uncertainty.runs.evaluations import EvaluationOptions, evaluations


@app.command()
@with_method_options
@reported_errors()
def export_points(
    file: File,
    output: Output = Path("output"),
    method: Method = None,
    sigmas: Sigmas = None,
    verify: Annotated[
        int | None, typer.Option(help="Number of runs that verify the result.  [default: 0]")
    ] = None,
    failed: Failed = "stop",
    **values: Any,
) -> None:
    """Write the next points of the study in FILE whose response is run elsewhere.

    points.csv in the folder has the number and all inputs of each point. `flexband import-results`
    records their results. After that, this command writes the next points (exit status 4) or, once
    the method has all the runs that it needs, the bands (exit status 0).
    """
    method_options = {name: value for name, value in values.items() if value is not None}
    with usage():
        plan = Plan(str(file.resolve()), method, method_options, sigmas, verify, failed)
    response_elsewhere(plan.study())
    run_plan(plan, output, plan.options())


@app.command()
@reported_errors()
def import_results(
    folder: Folder,
    results: Annotated[Path, typer.Argument(help="Table with the results (.csv or .nc).")],
    trust: Trust = False,
) -> None:
    """Record the results of points that were run elsewhere.

    RESULTS has the number of each point and one column per output, such as force or
    force[time=0.5]. Empty cells mark a failed run; a column "reason" may say why.
    """
    plan = plan_in(folder, trust=trust)
    study = plan.study()
    response = response_elsewhere(study)
    with StudyFolder(folder).hold_lock():
        point_results = RequestedPoints.from_folder(folder).read(results, response.labels)
        with evaluations(
            response, study.inputs, EvaluationOptions(store=Store(folder))
        ) as evaluate:
            record = evaluate.record
            assert record is not None
            record.begin(response.labels)
            new = 0
            for result in point_results:
                row = result.inputs[None]
                if record.find(result.setting, row)[0] >= 0:
                    continue
                values = None if result.values is None else result.values[None]
                record.add(Finished(result.setting, row, values, result.reason, 0.0, time.time()))
                new += 1
    failed = sum(result.values is None for result in point_results)
    text = f"{are(new, 'run')} recorded, {failed} of {len(point_results)} failed"
    earlier_runs = (
        f"; {len(point_results) - new} were recorded before" if new < len(point_results) else ""
    )
    print_text(f"{text}{earlier_runs}. `flexband resume {folder}` continues")


def response_elsewhere(study: Study) -> Any:
    """Return the response; raise `InputError` if it is not run elsewhere."""
    if not study.runs_elsewhere:
        raise InputError(
            "the response must be one that is run elsewhere, fb.models.elsewhere('a', 'b', …), "
            f"where a and b are inputs; got {study.response!r}. `flexband run` runs others"
        )
    return study.response
