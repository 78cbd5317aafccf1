"""The command that compares methods on a study."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import flexband as fb
from flexband.basics.files import try_write
from flexband.cli.application import app
from flexband.cli.folders import File, Output, Replace, check_folder
from flexband.cli.messages import UsageError, print_table, print_text, reported_errors, usage
from flexband.study.folder import StudyFolder

if TYPE_CHECKING:  # imported when a command is called
    from flexband.execution.fingerprint import fingerprint
    from flexband.report.progress import progress_bars
    from flexband.report.study_figures import data_file, write_comparison_report
    from flexband.report.text import band_tables
    from flexband.study.comparison import compare, usual_methods
    from flexband.study.compiling import compile_ahead
    from flexband.study.discretized import with_discretization
    from flexband.study.results.netcdf import write_netcdf
    from flexband.study.study import load_study


@app.command("compare")
@reported_errors()
def compare_methods(
    file: File,
    output: Output = Path("output"),
    samples: Annotated[int, typer.Option(help="N of the LHS–Scanning reference.")] = 100,
    points: Annotated[int, typer.Option(help="p of the LHS–Scanning reference.")] = 10,
    seed: Annotated[int, typer.Option(help="Seed of the reference's random numbers.")] = 0,
    orders: Annotated[
        str, typer.Option(help="Orders k,q of PCCI and improved PCCI, separated by blanks.")
    ] = "1,1 1,2 2,2 3,3",
    replace: Replace = False,
) -> None:
    """Compare all methods on the study in FILE with LHS–Scanning.

    Perturbation–Chebyshev uses the orders q. Regression uses the larger of k and q as its total
    order, and the phase-resolved method the first of the orders. The adaptive method chooses its
    own orders, and the step and the elements that the study leaves open. Sobol' and Monte Carlo
    sampling use a quarter of the samples of the reference. Methods that would take more than a
    million runs are omitted.
    """
    study = load_study(file)
    if not re.fullmatch(r"\d+,\d+(\s+\d+,\d+)*", orders.strip(), re.ASCII):
        raise UsageError(f"orders must be pairs k,q such as '1,1 2,2'; got {orders!r}")
    pairs = [(int(k), int(q)) for k, q in re.findall(r"(\d+),(\d+)", orders)]
    with usage():
        reference = fb.LHSScanning(samples, points, seed)
        methods = usual_methods(study, reference, pairs)
    with progress_bars():
        compile_ahead(study)
    check_folder(output)
    folder = StudyFolder(output)
    with folder.hold_lock(keep_lock=False):
        claim = str(file.resolve()), fingerprint(study.response)
        folder.check_claim(*claim, replace=replace)
        try_write(lambda: folder.claim(*claim))
        study = with_discretization(study.with_domains())
        print_text("Everything is compiled before the methods are timed.", error=True)
        with progress_bars() as task:
            results = compare(
                study,
                reference,
                methods,
                progress=lambda method: task(method.label),
                finished=lambda comparison: try_write(
                    lambda: write_netcdf(comparison.bands, data_file(output, comparison))
                ),
            )
        title = f"{file.stem}: relative errors against {reference.label}"
        print_table(title, band_tables.error_table(results))
        page = write_comparison_report(output, title, study, results, (pairs[0], pairs[-1]))
    print_text("\n".join([*band_tables.comparison_remarks(study.fields()), f"Report: {page}"]))
