"""The frame of the commands that ask a surrogate: what they load, print and write."""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

import flexband as fb
from flexband.basics.error_text import error_text
from flexband.basics.files import try_write
from flexband.basics.warning import without_warnings
from flexband.cli.application import app
from flexband.cli.exit_status import exit_status
from flexband.cli.folders import check_folder, draw
from flexband.cli.messages import (
    Table,
    UsageError,
    print_json,
    print_remark,
    print_table,
    print_text,
    reported_errors,
)
from flexband.errors import InputError
from flexband.execution.lock import is_locked
from flexband.execution.names import FileName

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from flexband.analysis.selection import AnySurrogate
    from flexband.basics.response import ResponseFunction
    from flexband.requirements.verdict import RequirementVerdict
    from flexband.study.presentation.display import Display
    from flexband.study.results.reliability import Doubt
    from flexband.study.study import Study

Sigmas = Annotated[float, typer.Option(help="k of the error bar μ ± kσ.")]
SomeSigmas = Annotated[float | None, typer.Option(help="k of the error bar μ ± kσ.")]
Samples = Annotated[int, typer.Option(help="Samples of the random inputs.")]
Seed = Annotated[int, typer.Option(help="Seed of the samples.")]


class SavedResult(NamedTuple):
    """What a question is asked of."""

    surrogate: AnySurrogate  # of the study
    folder: Path  # where it is, and where answers are written
    display: Display  # in which units numbers are shown
    doubts: Sequence[Doubt] = ()  # about the result of the study

    def dataset(self, name: FileName) -> xr.Dataset | None:
        """Return a result of the study, None if it has none; raise `InputError` if altered."""
        from flexband.study.results.netcdf import read_netcdf  # noqa: PLC0415

        file = self.folder / name
        return read_netcdf(file) if file.is_file() else None

    def study(self, *, trust: bool) -> Study:
        """Return the study; raise `UsageError` if its file is run only with `trust`."""
        from flexband.cli.plan import plan_in  # noqa: PLC0415

        with without_warnings():  # the run has printed them
            return plan_in(self.folder, trust=trust).study()

    def limits(self, *, trust: bool) -> list[fb.Requirement]:
        """Return the limits of the study; print a remark, or raise `UsageError` without `trust`."""
        from flexband.study.nominal import around_nominal  # noqa: PLC0415

        if not (self.folder / FileName.STUDY).is_file():
            return []
        try:
            limits = self.study(trust=trust).requirements
            return around_nominal(limits, self.folder, self.surrogate, self.display)
        except UsageError:
            raise
        except Exception as error:  # the study is a program
            print_remark(f"limits of the study are left out: {error_text(error)}")
            return []

    def response_and_store(
        self, purpose: str, *, trust: bool
    ) -> tuple[ResponseFunction, Path | None]:
        """Return the response of the study and its folder of runs; refuse what is not there."""
        if not (self.folder / FileName.STUDY).is_file():
            raise InputError(f"there is no study in '{self.folder}' whose response {purpose}")
        store = self.folder if (self.folder / FileName.RUNS).is_dir() else None
        return self.study(trust=trust).response, store


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
        print_verdicts(self.verdicts, ())
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


def saved_result(folder: Path) -> SavedResult:
    """Return the surrogate of a folder or file; remark if its result was not reliable."""
    from flexband.report.page.page_record import read_given  # noqa: PLC0415
    from flexband.report.text.doubts import doubt_text  # noqa: PLC0415
    from flexband.study.presentation.display import Display  # noqa: PLC0415
    from flexband.study.results.reliability import DoubtKind  # noqa: PLC0415

    # Find the surrogate, or tell why there is none.
    file = folder / FileName.SURROGATE if folder.is_dir() else folder
    if not file.is_file():
        if not folder.exists():
            raise InputError(f"there is no '{folder}'; the argument is the --output of a study")
        if (folder / FileName.BANDS).is_file():
            raise InputError(
                f"'{folder}' has no surrogate.npz to answer from: its method does not expand the "
                "response. Run the study with one that does, such as AdaptivePCCI"
            )
        running = (
            ": its study is running"
            if folder.is_dir() and is_locked(folder / FileName.STUDY_LOCK)
            else ""
        )
        raise InputError(
            "the argument must be a folder with the surrogate.npz of a finished study; "
            f"got '{folder}', which has none{running}"
        )
    # Remark on what the answer may be worth: a newer run, and doubts about the result.
    if is_locked(file.parent / FileName.STUDY_LOCK):
        written = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(file.stat().st_mtime))
        print_remark(
            f"the study in '{file.parent}' is running; this answer is from its surrogate.npz of "
            f"{written}, which may be that of an earlier run"
        )
    page_record = read_given(file.parent)
    display = Display(page_record.get("display_units", {}), page_record.get("units", {}))
    surrogate = fb.load_surrogate(file)
    for doubt in page_record.get("doubts", []):
        if doubt.unreliable:
            print_remark(f"what follows is NOT reliable: {doubt_text(doubt)}")
        elif doubt.kind is DoubtKind.TOLERANCE_NOT_MET:
            rare = "what depends on rare values, as probabilities do, is NOT reliable"
            print_remark(f"{doubt_text(doubt)}: {rare}")
    return SavedResult(surrogate, file.parent, display, page_record.get("doubts", ()))
