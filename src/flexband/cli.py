"""The command line: run a study from a file, or compare methods on it."""

from __future__ import annotations

import inspect
import re
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryFile
from typing import Annotated, Any

import rich.progress as rp
import typer
import xarray as xr
from rich.console import Console
from rich.table import Column
from rich.table import Table as RichTable
from typer.core import TyperGroup

import flexband as fb
from flexband.errors import RunError, known, whole
from flexband.report import tables
from flexband.report.results import (
    data_file,
    write_bands_report,
    write_comparison_report,
    write_netcdf,
)
from flexband.report.terminal import print_anywhere
from flexband.study.comparison import compare, usual_methods
from flexband.study.options import method_classes, method_options, with_options
from flexband.study.study import Study, load_study
from flexband.uncertainty.surrogates.sigmas import checked_sigmas
from flexband.uncertainty.surrogates.verification import RUNS


class _Commands(TyperGroup):
    """The commands, whose texts can be printed on any terminal."""

    def main(self, *arguments: Any, **options: Any) -> Any:
        print_anywhere()
        return super().main(*arguments, **options)


app = typer.Typer(cls=_Commands, no_args_is_help=True, help=__doc__, pretty_exceptions_enable=False)
METHODS = method_classes(getattr(fb, name) for name in fb.__all__)

File = Annotated[Path, typer.Argument(help="Python file that defines `study`.", dir_okay=False)]
Output = Annotated[Path, typer.Option(help="Folder for data and figures.", file_okay=False)]


@contextmanager
def reported_errors() -> Iterator[None]:
    """Print warnings as remarks, and errors as one line; exit with status 1 after an error."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # those of other packages
            warnings.simplefilter("default", fb.FlexbandWarning)
            warnings.showwarning = lambda message, *_, **__: print_remark(str(message))
            yield
    except (fb.InputError, fb.AssemblyError, fb.SimulationError, OSError) as error:
        print_text(f"flexband: {error}", "red", error=True)
        raise typer.Exit(1) from None
    except (typer.Exit, typer.Abort):
        raise
    except Exception as error:  # of a response, for instance
        place = traceback.extract_tb(error.__traceback__)[-1]
        text = f"{type(error).__name__}: {error} ({place.filename}, line {place.lineno})"
        print_text(f"flexband: {text}", "red", error=True)
        raise typer.Exit(1) from None
    except KeyboardInterrupt:
        print_text("flexband: stopped", "red", error=True)
        raise typer.Exit(130) from None


def print_text(text: str, style: str = "", *, error: bool = False) -> None:
    """Print a text as it is, on standard output or error."""
    console = Console(stderr=error, markup=False, emoji=False, highlight=False)
    console.print(text, style=style, soft_wrap=True)


def print_remark(text: str) -> None:
    """Print a remark on standard error."""
    print_text(f"flexband: remark: {text}", "yellow", error=True)


def check_folder(folder: Path) -> None:
    """Make a folder; raise `InputError` if no file can be written there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        TemporaryFile(dir=folder).close()
    except OSError as error:
        raise fb.InputError(f"--output must be a folder to write to; got {error}") from None


def save(write: Callable[[], object]) -> bool:
    """Write results; print a remark and return False if that fails, so that the others are kept."""
    try:
        write()
    except (fb.InputError, OSError) as error:
        print_remark(str(error))
        return False
    return True


def verified(surrogate: Any, study: Study, runs: int) -> xr.Dataset | None:
    """Return how new runs judge a surrogate; print a remark and return None if they fail."""
    try:
        return fb.verify(surrogate, study.response, runs=runs, sigmas=study.sigmas)
    except (fb.InputError, RunError) as error:
        print_remark(f"the result is not verified: {error}")
        return None


def with_method_options(command: Any) -> Callable:
    """Put the options of all methods in place of the ``**values`` of a command."""
    signature = inspect.signature(command, eval_str=True)
    parameters = list(signature.parameters.values())[:-1]
    for name, (kind, defaults) in method_options(METHODS).items():
        takers = ", ".join(f"{method} ({value})" for method, value in defaults.items())
        info = typer.Option(help=takers, rich_help_panel="Options of methods (default)")
        parameters.append(
            inspect.Parameter(
                name,
                inspect.Parameter.KEYWORD_ONLY,
                default=None,
                annotation=Annotated[kind | None, info],  # type: ignore[valid-type]
            )
        )
    command.__signature__ = signature.replace(parameters=parameters)
    return command


def print_table(title: str, content: tables.Table) -> None:
    """Print a table; its first column is left-aligned and never wrapped."""
    (first, *others), rows = content
    columns = [Column(first, no_wrap=True), *(Column(cell, justify="right") for cell in others)]
    table = RichTable(*columns, title=title)
    for row in rows:
        table.add_row(*row)
    Console(markup=False, emoji=False).print(table)


def progress_bars() -> rp.Progress:
    """Return a context in which tasks show their progress on standard error."""
    columns = (rp.BarColumn(), rp.MofNCompleteColumn(), rp.TimeElapsedColumn())
    name, left = rp.TextColumn("{task.description}", markup=False), rp.TimeRemainingColumn()
    return rp.Progress(name, *columns, left, console=Console(stderr=True))


def add_task(bars: rp.Progress, name: str) -> Callable[[int, int], object]:
    """Add a bar; return the function that is called as ``(done, total)`` to advance it."""
    task = bars.add_task(name, total=None)
    return lambda done, total: bars.update(task, completed=done, total=total)


def _print_version(wanted: bool) -> None:
    if wanted:
        print_text(fb.__version__)
        raise typer.Exit


@app.callback()
def main(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Print it."),
    ] = False,
) -> None:
    """Compute how uncertain the motion of a mechanism is."""


@app.command()
@reported_errors()
@with_method_options
def run(
    file: File,
    output: Output = Path("output"),
    method: Annotated[
        str | None,
        typer.Option(help=f"Used instead of the study's method: {', '.join(METHODS)}."),
    ] = None,
    sigmas: Annotated[
        float | None,
        typer.Option(help="k of the error bar μ ± kσ, instead of the study's (1)."),
    ] = None,
    verify: Annotated[
        int | None,
        typer.Option(help=f"New runs that verify the result; 0 for none.  [default: {RUNS}]"),
    ] = None,
    **values: Any,
) -> None:
    """Run the study in FILE; write its bands, surrogate, figures and a report.

    Files of an earlier run in the same folder are replaced. Its pictures are removed if the new
    report has none of their name; a surrogate or a verification that is left is named.

    Options of methods change the study's method, or the one given by --method.
    """
    study = load_study(file)
    if method:
        known("--method", method, METHODS)
    study = study.using(with_options(METHODS[method]() if method else study.method, values))
    if sigmas is not None:
        study = replace(study, sigmas=checked_sigmas(sigmas))
    label = study.method.label
    if verify:
        whole("--verify", verify, 2)
        if not study.expands:
            raise fb.InputError(f"--verify requires a method with a surrogate; got {label}")
    new = RUNS if verify is None else verify
    check_folder(output)
    data, model, checks = (output / f for f in ("bands.nc", "surrogate.npz", "verification.nc"))
    with progress_bars() as bars:
        progress = add_task(bars, label)
        if study.expands:
            surrogate = study.expand(progress=progress)
            files = [model] * save(lambda: fb.save_surrogate(surrogate, model))
            bands = surrogate.bands(study.sigmas)
        else:
            surrogate, files, bands = None, [], study.run(progress=progress)
    files += [data] * save(lambda: write_netcdf(bands, data))
    checked = verified(surrogate, study, new) if surrogate and new else None
    if checked is not None:
        files += [checks] * save(lambda: write_netcdf(checked, checks))
    title = f"{file.stem}: {label}, {bands.attrs['runs']} runs"
    print_table(title, tables.summary_table(bands, checked))
    if surrogate is None:
        inputs = study.inputs
    else:
        inputs = surrogate.space.given if isinstance(surrogate, fb.Surrogate) else surrogate.given
    fields = {k: i for k, i in inputs.items() if isinstance(i, fb.Field) and i.domain is not None}
    page = write_bands_report(output, title, label, bands, checked, fields)
    older = [own for own in (model, checks) if own.exists() and own not in files]
    kinds = {model: "Model: ", data: "Data:  ", checks: "Check: "}
    written = [f"Report: {page}", *(f"{kinds[own]} {own}" for own in files)]
    written += [f"Older:  {own}, of an earlier run" for own in older]
    told = [*tables.remarks(bands, checked), *tables.field_remarks(fields)]
    print_text("\n".join([*told, *written]))


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
) -> None:
    """Compare all methods on the study in FILE with LHS–Scanning.

    Perturbation–Chebyshev uses the orders q, regression the larger of k and q as its total order,
    and the phase-resolved method the first of the orders; the adaptive method finds its own. Sobol'
    and Monte Carlo sampling have a quarter of the samples of the reference. Methods that would take
    more than a million runs are left out.
    """
    study = load_study(file)
    if not re.fullmatch(r"\d+,\d+(\s+\d+,\d+)*", orders.strip(), re.ASCII):
        raise fb.InputError(f"orders must be pairs k,q such as '1,1 2,2'; got {orders!r}")
    pairs = [(int(k), int(q)) for k, q in re.findall(r"(\d+),(\d+)", orders)]
    reference = fb.LHSScanning(samples, points, seed)
    methods = usual_methods(study, reference, pairs)
    check_folder(output)
    print_text("Everything is compiled before the methods are timed.", error=True)
    with progress_bars() as bars:
        results = compare(
            study,
            reference,
            methods,
            progress=lambda method: add_task(bars, method.label),
            finished=lambda one: save(lambda: write_netcdf(one.bands, data_file(output, one))),
        )
    title = f"{file.stem}: relative errors against {reference.label}"
    print_table(title, tables.error_table(results))
    page = write_comparison_report(output, title, study, results, (pairs[0], pairs[-1]))
    print_text("\n".join([*tables.comparison_remarks(study.fields()), f"Report: {page}"]))
