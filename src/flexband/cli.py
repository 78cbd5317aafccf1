"""The command line: run a study from a file, or compare methods on it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import fields, replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table

import flexband as fb
from flexband.report.figures import (
    bands_figure,
    drawable_outputs,
    errors_figure,
    outputs_of,
    response_figure,
    variance_error_figure,
)
from flexband.report.html import write_report
from flexband.report.tables import error_table, remarks, summary_table, verification_table
from flexband.study.comparison import compare
from flexband.study.files import load_study
from flexband.study.netcdf import write_netcdf
from flexband.uncertainty.methods import Method

app = typer.Typer(no_args_is_help=True, help=__doc__, pretty_exceptions_enable=False)
console = Console()


class MethodName(StrEnum):
    """Methods by the names they have on the command line."""

    ADAPTIVE_PCCI = "adaptive-pcci"
    PHASE_RESOLVED_PCCI = "phase-resolved-pcci"
    IMPROVED_PCCI = "improved-pcci"
    PCCI = "pcci"
    LHS_SCANNING = "lhs-scanning"
    MONTE_CARLO = "monte-carlo"


METHODS: dict[MethodName, Method] = {
    MethodName.ADAPTIVE_PCCI: fb.AdaptivePCCI(),
    MethodName.PHASE_RESOLVED_PCCI: fb.PhaseResolvedPCCI(1, 1),
    MethodName.IMPROVED_PCCI: fb.ImprovedPCCI(3, 3),
    MethodName.PCCI: fb.PCCI(3, 3),
    MethodName.LHS_SCANNING: fb.LHSScanning(100, 10),
    MethodName.MONTE_CARLO: fb.MonteCarlo(100, 10),
}

File = Annotated[Path, typer.Argument(help="Python file that defines `study`.", dir_okay=False)]
Output = Annotated[Path, typer.Option(help="Folder for results and figures.", file_okay=False)]


def _print_version(wanted: bool) -> None:
    if wanted:
        console.print(fb.__version__)
        raise typer.Exit


@app.callback()
def main(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Print it."),
    ] = False,
) -> None:
    """Say how uncertain the motion of a machine is."""


@app.command()
def run(
    file: File,
    output: Output = Path("output"),
    method: Annotated[MethodName | None, typer.Option(help="Use this method instead.")] = None,
    tolerance: Annotated[float | None, typer.Option(help="Of adaptive PCCI.")] = None,
    max_runs: Annotated[int | None, typer.Option(help="Of adaptive PCCI.")] = None,
    random_order: Annotated[int | None, typer.Option(help="k, of PCCI methods.")] = None,
    interval_order: Annotated[int | None, typer.Option(help="q, of PCCI methods.")] = None,
    samples: Annotated[int | None, typer.Option(help="N, of sampling methods.")] = None,
    points: Annotated[int | None, typer.Option(help="p, of sampling methods.")] = None,
    seed: Annotated[int | None, typer.Option(help="Of the random numbers.")] = None,
    verify: Annotated[
        int, typer.Option(help="Fresh runs at each extreme that a PCCI method finds.", min=0)
    ] = 0,
) -> None:
    """Run the study in FILE; write bands.nc, surrogate.npz, figures and a report.

    Options of a method change the study's own one, or the one of --method.
    """
    with _reported_errors():
        study = load_study(file)
        options: dict[str, float | None] = {
            "tolerance": tolerance,
            "max_runs": max_runs,
            "random_order": random_order,
            "interval_order": interval_order,
            "samples": samples,
            "points": points,
            "seed": seed,
        }
        base = study.method if method is None else METHODS[method]
        study = study.using(_changed(base, options))
        label = study.method.label
        output.mkdir(parents=True, exist_ok=True)
        expands = callable(getattr(study.method, "expand", None))
        if verify and not expands:
            raise fb.InputError(f"{study.method.name} has no surrogate for --verify")
        surrogate = None
        with _progress() as bar:
            if expands:
                surrogate = study.expand(progress=_task(bar, label))
                bands = surrogate.bands()
            else:
                bands = study.run(progress=_task(bar, label))
        write_netcdf(bands, output / "bands.nc")
        figures = {
            f"bands_{_slug(name)}": (
                f"Interval mean and interval error bar of {name}",
                bands_figure({label: bands}, name),
            )
            for name in drawable_outputs(bands["mean"])
        }
        title = f"{file.stem}: {label}, {bands.attrs['runs']} runs"
        header, rows = summary_table(bands)
        told = remarks(bands)
        page = write_report(output, title, header, rows, figures, told)
        _print_table(title, header, rows)
        for line in told:
            console.print(line, markup=False, highlight=False)
        console.print(f"Report: {page}\nData:   {output / 'bands.nc'}")
        if surrogate is not None:
            fb.save_surrogate(surrogate, output / "surrogate.npz")
            console.print(f"Model:  {output / 'surrogate.npz'}")
            if verify:
                checked = fb.verify(surrogate, study.response, samples=verify, seed=seed or 0)
                write_netcdf(checked, output / "verification.nc")
                title = f"Fresh runs at the extremes of the error bar: {checked.attrs['runs']}"
                _print_table(title, *verification_table(checked))


@app.command("compare")
def compare_methods(
    file: File,
    output: Output = Path("output"),
    samples: Annotated[int, typer.Option(help="N of the LHS–Scanning reference.")] = 100,
    points: Annotated[int, typer.Option(help="p of the LHS–Scanning reference.")] = 10,
    seed: Annotated[int, typer.Option(help="Of the reference's random numbers.")] = 0,
    orders: Annotated[
        str, typer.Option(help="Orders k,q of PCCI and improved PCCI, separated by blanks.")
    ] = "1,1 1,2 2,2 3,3",
) -> None:
    """Compare PCCI methods on the study in FILE against LHS–Scanning.

    The phase-resolved one takes the first of the orders, the adaptive one finds its own.
    """
    with _reported_errors():
        study = load_study(file).located()
        pairs = _orders(orders)
        output.mkdir(parents=True, exist_ok=True)
        methods = [kind(k, q) for kind in (fb.PCCI, fb.ImprovedPCCI) for k, q in pairs]
        methods += [fb.PhaseResolvedPCCI(*pairs[0]), fb.AdaptivePCCI()]
        nominal = study.nominal()
        with _progress() as bar:
            results = compare(
                study,
                fb.LHSScanning(samples, points, seed),
                methods,
                progress=lambda method: _task(bar, method.label),
            )
        names = outputs_of(nominal)
        figures = {}
        if study.fields():
            figures["variance_error"] = (
                "Variance error of the random fields after discretization",
                variance_error_figure(study.fields()),
            )
        drawn = drawable_outputs(nominal)
        if drawn:
            figures["deterministic"] = (
                "Response without uncertainty",
                response_figure(nominal, drawn),
            )
        for name in drawn:
            for k, q in dict.fromkeys((pairs[0], pairs[-1])):
                chosen = [results[0]] + [
                    r
                    for r in results
                    if r.method in (fb.PCCI(k, q), fb.ImprovedPCCI(k, q), fb.AdaptivePCCI())
                ]
                figures[f"bands_{_slug(name)}_{k}_{q}"] = (
                    f"Interval mean and interval error bar of {name}, k = {k}, q = {q}",
                    bands_figure({r.method.label: r.bands for r in chosen}, name),
                )
            figures[f"errors_{_slug(name)}"] = (
                f"Relative errors of {name} against runs",
                errors_figure(results, name),
            )
        for result in results:
            write_netcdf(result.bands, output / f"{_slug(result.method.label.lower())}.nc")
        header, rows = error_table(results, names)
        title = f"{file.stem}: relative errors against {results[0].method.label}"
        page = write_report(output, title, header, rows, figures)
        for name, field in study.fields().items():
            largest = field.largest_variance_error()
            console.print(
                f"{name}: random field, {field.dimension} term(s), "
                f"largest variance error {largest:.4f}"
            )
        _print_table(title, header, rows)
        console.print(f"Report: {page}")


def _changed(method: Method, options: dict[str, float | None]) -> Method:
    """Return the method with the options that are given.

    Raises
    ------
    InputError
        Where the method has no such option.
    """
    given = {name: value for name, value in options.items() if value is not None}
    for name in given:
        if name not in {field.name for field in fields(method)}:  # type: ignore[arg-type]
            raise fb.InputError(f"{method.name} has no option --{name.replace('_', '-')}")
    return replace(method, **given)  # type: ignore[type-var]


def _orders(text: str) -> list[tuple[int, int]]:
    try:
        pairs = [tuple(int(order) for order in pair.split(",")) for pair in text.split()]
        found = [(k, q) for k, q in pairs]
    except ValueError:
        found = []
    if not found:
        raise fb.InputError(f"orders must be like '1,1 2,2'; got {text!r}")
    return found


def _slug(name: str) -> str:
    """Return a name made safe for a file."""
    return "_".join("".join(c if c.isalnum() else " " for c in name).split()) or "response"


def _print_table(title: str, header: list[str], rows: list[list[str]]) -> None:
    table = Table(title=escape(title))
    for k, cell in enumerate(header):
        table.add_column(escape(cell), justify="left" if k == 0 else "right", no_wrap=k == 0)
    for row in rows:
        table.add_row(*map(escape, row))
    console.print(table)


def _progress() -> Progress:
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        console=Console(stderr=True),
    )


def _task(bar: Progress, name: str) -> Callable[[int, int], object]:
    task = bar.add_task(name, total=None)
    return lambda done, total: bar.update(task, completed=done, total=total)


@contextmanager
def _reported_errors() -> Iterator[None]:
    """Show what is wrong with the input or the runs in plain words, and end with status 1."""
    try:
        yield
    except (fb.InputError, fb.AssemblyError, fb.SimulationError, OSError) as error:
        Console(stderr=True).print(f"flexband: {error}", style="red", markup=False)
        raise typer.Exit(1) from None
    except KeyboardInterrupt:
        Console(stderr=True).print("flexband: stopped", style="red")
        raise typer.Exit(130) from None
