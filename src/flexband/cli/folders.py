"""Arguments that are files, and results that are written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Annotated

import typer

from flexband.basics.files import replace_file, try_write
from flexband.cli.messages import print_remark
from flexband.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from flexband.analysis.limits.limit_verdicts import LimitCheck
    from flexband.study.presentation.display import Display

File = Annotated[Path, typer.Argument(help="Python file that defines `study`.", dir_okay=False)]
Output = Annotated[
    Path,
    typer.Option(
        "--output",
        "-o",
        help="Folder of runs and results.  [default: output]",
        file_okay=False,
        show_default=False,
    ),
]
Replace = Annotated[
    bool, typer.Option("--replace", help="Replace the results of another study in the folder.")
]
Folder = Annotated[
    Path, typer.Argument(help="Folder of a study: the --output of its run.", file_okay=False)
]


def check_folder(folder: Path) -> None:
    """Make a folder; raise `InputError` if no file can be written there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        TemporaryFile(dir=folder).close()
    except OSError as error:
        raise InputError(f"--output must be a folder to write to; got {error}") from None


def draw(figure: Callable[[], Figure], file: Path, *, drawable: bool = True) -> bool:
    """Write a figure as a complete PNG file, or delete an older one if nothing is drawable."""
    if not drawable:
        file.unlink(missing_ok=True)
        return False

    def write() -> None:
        with replace_file(file) as partial:
            figure().savefig(partial, format="png", dpi=150)

    return try_write(write)


def draw_limits(check: LimitCheck, folder: Path, display: Display) -> None:
    """Draw limits.png in a folder, unless it keeps the limits of its study: a remark says so.

    A page that shows it shows the new one.
    """
    from flexband.report.page.page_record import list_shown  # noqa: PLC0415
    from flexband.report.plot.figures import limits_figure  # noqa: PLC0415
    from flexband.study.results.answers import answer_files  # noqa: PLC0415

    if not check.written:
        print_remark(
            "the report shows the requirements of the study only; others must be in its "
            "`requirements`"
        )
        return
    drawable = check.margins["margin"].ndim <= 2
    figure = folder / "limits.png"
    margins = display.data(check.margins)
    draw(lambda: limits_figure(margins, check.probability), figure, drawable=drawable)
    files = answer_files(folder, ("limits", "probability", "yield"))
    try_write(lambda: list_shown(folder, files))
