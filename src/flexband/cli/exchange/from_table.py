"""The command that makes a surrogate of runs that exist."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flexband.cli.application import app
from flexband.cli.folders import File, Output, check_folder
from flexband.cli.messages import print_remark, print_text, reported_errors
from flexband.execution.names import FileName

if TYPE_CHECKING:  # imported when a command is called
    from flexband.analysis.labelled_answers import doubts_of
    from flexband.analysis.limits.least_margin import margins_in_words
    from flexband.analysis.limits.limit_verdicts import requirement_verdicts, uncertain_inputs
    from flexband.analysis.selection import surrogates_of
    from flexband.basics.words import number_of
    from flexband.cli.exit_status import exit_status
    from flexband.cli.result import print_verdicts
    from flexband.report.text.numbers import percent
    from flexband.requirements.requirement import requirement_tuple
    from flexband.study.exchange.surrogate_of import surrogate_of
    from flexband.study.results.limits import check_requirements_in
    from flexband.study.study import load_study
    from flexband.uncertainty.surrogates.bands import BandRecord
    from flexband.uncertainty.surrogates.surrogate_file import save_surrogate


@app.command()
@reported_errors()
def from_table(
    file: File,
    table: Annotated[
        Path, typer.Argument(help="Existing runs: a .csv or .nc file, or a folder of runs.")
    ],
    output: Output = Path("output"),
    time: Annotated[
        str | None, typer.Option(help="Column of the time, if there is one row per time.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the cross-validation.")] = 0,
) -> None:
    """Build a surrogate from existing runs alone, and check the requirements.

    Inputs and requirements are those of the study in FILE; its response is not run. TABLE has one
    column per input and output, such as force or force[time=0.5]. The surrogate is written to
    surrogate.npz in the folder, from which the other commands answer.
    """
    study = load_study(file)
    surrogate = surrogate_of(table, study.inputs, time=time, units=study.units, seed=seed)
    check_folder(output)
    written = output / FileName.SURROGATE
    save_surrogate(surrogate, written)
    lines = []
    verdicts = []
    if study.requirements:
        check = check_requirements_in(output, surrogate, requirement_tuple(study.requirements))
        verdicts = requirement_verdicts(check, uncertain_inputs(None, surrogate), None)
        lines.append(margins_in_words(check.margins))
    print_verdicts(verdicts)
    record = BandRecord.read(surrogate.bands())
    for case in surrogates_of(surrogate).values():
        for doubt in doubts_of(case):
            print_remark(doubt)
    if record.expected_error is not None:
        lines.append(
            f"Expected error: {percent(record.expected_error)} of the error bar's width, as "
            f"{number_of(record.runs_checked, 'row')} tell that were left out"
        )
    print_text("\n".join([*lines, f"Surrogate: {written}"]))
    if verdicts and (status := exit_status(verdicts, ())):
        raise typer.Exit(status)
