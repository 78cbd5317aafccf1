"""The frame of the commands that ask a surrogate: what they load, print and write."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flexband.basics.files import try_write
from flexband.cli.answers.saved_result import saved_result
from flexband.cli.application import app
from flexband.cli.exit_status import exit_status
from flexband.cli.folders import check_folder, draw
from flexband.cli.messages import (
    Table,
    UsageError,
    print_json,
    print_table,
    print_text,
    reported_errors,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from flexband.requirements.verdict import RequirementVerdict

Sigmas = Annotated[float, typer.Option(help="k of the error bar μ ± kσ.")]
SomeSigmas = Annotated[float | None, typer.Option(help="k of the error bar μ ± kσ.")]
Samples = Annotated[int, typer.Option(help="Number of samples of the random inputs.")]
Seed = Annotated[int, typer.Option(help="Seed of the random samples.")]


@dataclass(frozen=True)
class CommandOutput:
    """What a command answers."""

    content: Mapping[str, object]  # what --json prints
    # titles and tables that are printed otherwise, before the text
    tables: Sequence[tuple[str, Table]] = ()
    text: str = ""  # lines that follow
    name: str = ""  # of the files that are written: NAME.nc and NAME.png
    data: xr.Dataset | None = None  # content of NAME.nc; None writes none
    # makes the figure of NAME.png; None for a command that draws none
    figure: Callable[[], Figure] | None = None
    # whether there is something to draw; otherwise an older picture is deleted
    drawable: bool = True
    verdicts: Sequence[RequirementVerdict] = ()  # which are printed first

    def write(self, folder: Path) -> list[Path]:
        """Write the files of the answer, and return them."""
        from flexband.report.page.page_record import list_shown  # noqa: PLC0415
        from flexband.study.results.answers import answer_file  # noqa: PLC0415
        from flexband.study.results.netcdf import write_netcdf  # noqa: PLC0415

        if (data := self.data) is None:
            return []
        check_folder(folder)
        file = answer_file(folder, self.name)
        picture = folder / f"{self.name}.png"
        written = [file] if try_write(lambda: write_netcdf(data, file)) else []
        if self.figure is not None and draw(self.figure, picture, drawable=self.drawable):
            written.append(picture)
        try_write(lambda: list_shown(folder, [file, picture]))
        return written

    def print(self, written: Sequence[Path], *, as_json: bool) -> None:
        """Print the answer, and which files were written."""
        from flexband.cli.result import print_verdicts  # noqa: PLC0415

        if as_json:
            verdicts = {"verdicts": [verdict.as_json() for verdict in self.verdicts]}
            files = {"written": [str(file) for file in written]}
            written_files = files if self.data is not None else {}
            print_json({**(verdicts if self.verdicts else {}), **self.content, **written_files})
            return
        print_verdicts(self.verdicts)
        for title, table in self.tables:
            print_table(title, table)
        lines = [*filter(None, [self.text]), *(f"Written: {file}" for file in written)]
        if lines:
            print_text("\n".join(lines))


def answer_command(
    name: str,
) -> Callable[[Callable[..., CommandOutput]], Callable[..., CommandOutput]]:
    """Return a decorator: ``question(result, ...)`` as a command with its folder and --json."""

    def register(question: Callable[..., CommandOutput]) -> Callable[..., CommandOutput]:
        def folder_and_json(
            folder: Annotated[
                Path, typer.Argument(help="Folder of a study, or a saved surrogate (.npz).")
            ],
            *,
            as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
        ) -> None: ...

        @wraps(question)
        def command(folder: Path, *, as_json: bool, **options: object) -> None:
            result = saved_result(folder)
            answer = question(result, **options)
            answer.print(answer.write(result.folder), as_json=as_json)
            if answer.verdicts and (status := exit_status(answer.verdicts, result.doubts)):
                raise typer.Exit(status)

        of_frame = inspect.signature(folder_and_json, eval_str=True).parameters
        asked = list(inspect.signature(question, eval_str=True).parameters.values())[1:]
        options = (parameter.replace(kind=parameter.KEYWORD_ONLY) for parameter in asked)
        parameters = [of_frame["folder"], *options, of_frame["as_json"]]
        command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        app.command(name)(reported_errors()(command))
        return question

    return register


def one_of(sigmas: float | None, probability: float | None, usual: float) -> float:
    """Return k of μ ± kσ, the usual one by default; refuse one beside a probability."""
    if sigmas is not None and probability is not None:
        raise UsageError("--sigmas and --probability exclude each other; give one of them")
    return usual if sigmas is None else sigmas
