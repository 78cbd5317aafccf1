"""The command line: run a study from a file, or compare methods on it."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

import flexband as fb
from flexband.report.console import (
    add_task,
    print_lines,
    print_message,
    print_table,
    progress_bars,
)
from flexband.report.results import write_comparison, write_run
from flexband.report.tables import (
    comparison_remarks,
    error_table,
    remarks,
    summary_table,
    verification_table,
)
from flexband.study.comparison import compare
from flexband.study.files import load_study
from flexband.study.netcdf import write_netcdf
from flexband.study.options import Option, method_classes, method_options, with_options

app = typer.Typer(no_args_is_help=True, help=__doc__, pretty_exceptions_enable=False)
METHODS = method_classes(getattr(fb, name) for name in fb.__all__)

File = Annotated[Path, typer.Argument(help="Python file that defines `study`.", dir_okay=False)]
Output = Annotated[Path, typer.Option(help="Folder for data and figures.", file_okay=False)]


@contextmanager
def reported_errors() -> Iterator[None]:
    """Print errors of the input or of runs as one line, and exit with status 1."""
    try:
        yield
    except (fb.InputError, fb.AssemblyError, fb.SimulationError, OSError) as error:
        print_message(f"flexband: {error}", style="red")
        raise typer.Exit(1) from None
    except KeyboardInterrupt:
        print_message("flexband: stopped", style="red")
        raise typer.Exit(130) from None


def with_method_options(options: Mapping[str, Option]) -> Callable:
    """Return a decorator that puts options in place of the ``**values`` of a command."""

    def parameter(name: str, option: Option) -> inspect.Parameter:
        takers = ", ".join(f"{method} ({value})" for method, value in option.defaults.items())
        info = typer.Option(help=takers, rich_help_panel="Options of methods (default)")
        annotation = Annotated[option.kind | None, info]  # type: ignore[valid-type]
        return inspect.Parameter(
            name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=annotation
        )

    def decorated(command: Any) -> Callable:
        signature = inspect.signature(command, eval_str=True)
        own = list(signature.parameters.values())[:-1]
        added = [parameter(name, option) for name, option in options.items()]
        command.__signature__ = signature.replace(parameters=[*own, *added])
        return command

    return decorated


def _print_version(wanted: bool) -> None:
    if wanted:
        print_lines([fb.__version__])
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
@with_method_options(method_options(METHODS))
def run(
    file: File,
    output: Output = Path("output"),
    method: Annotated[
        str | None,
        typer.Option(help=f"Used instead of the study's method: {', '.join(METHODS)}."),
    ] = None,
    verify: Annotated[
        int, typer.Option(help="New runs at each extreme of the surrogate's error bar.", min=0)
    ] = 0,
    **values: Any,
) -> None:
    """Run the study in FILE; write its bands, surrogate, figures and a report.

    Options of methods change the study's method, or the one given by --method.
    """
    study = load_study(file)
    if method and method not in METHODS:
        raise fb.InputError(f"--method must be one of {', '.join(METHODS)}; got {method!r}")
    study = study.using(with_options(METHODS[method]() if method else study.method, values))
    label = study.method.label
    if verify and not study.expands:
        raise fb.InputError(f"--verify requires a method with a surrogate; got {label}")
    output.mkdir(parents=True, exist_ok=True)
    with progress_bars() as bars:
        progress = add_task(bars, label)
        surrogate = study.expand(progress=progress) if study.expands else None
        bands = surrogate.bands() if surrogate else study.run(progress=progress)
    title = f"{file.stem}: {label}, {bands.attrs['runs']} runs"
    page = write_run(output, title, label, bands, surrogate)
    print_table(title, summary_table(bands))
    print_lines([*remarks(bands), f"Report: {page}", f"Data:   {output / 'bands.nc'}"])
    if surrogate:
        print_lines([f"Model:  {output / 'surrogate.npz'}"])
    if surrogate and verify:
        checked = fb.verify(surrogate, study.response, samples=verify)
        write_netcdf(checked, output / "verification.nc")
        title = f"New runs at the extremes of the error bar: {checked.attrs['runs']}"
        print_table(title, verification_table(checked))


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
    """Compare PCCI methods on the study in FILE with LHS–Scanning.

    The phase-resolved method uses the first of the orders; the adaptive method finds its own.
    """
    study = load_study(file).located()
    pairs = _orders(orders)
    reference = fb.LHSScanning(samples, points, seed)
    methods = [kind(k, q) for kind in (fb.PCCI, fb.ImprovedPCCI) for k, q in pairs]
    methods += [fb.PhaseResolvedPCCI(*pairs[0]), fb.AdaptivePCCI()]
    output.mkdir(parents=True, exist_ok=True)
    print_message("Everything is compiled before the methods are timed.")
    with progress_bars() as bars:
        results = compare(study, reference, methods, progress=lambda m: add_task(bars, m.label))
    title = f"{file.stem}: relative errors against {reference.label}"
    page = write_comparison(output, title, study, results, (pairs[0], pairs[-1]))
    print_table(title, error_table(results))
    print_lines([*comparison_remarks(study.fields()), f"Report: {page}"])


def _orders(text: str) -> list[tuple[int, int]]:
    try:
        pairs = [tuple(int(order) for order in pair.split(",")) for pair in text.split()]
        found = [(k, q) for k, q in pairs]
    except ValueError:
        found = []
    if not found:
        raise fb.InputError(f"orders must be pairs k,q such as '1,1 2,2'; got {text!r}")
    return found
