"""Arguments that are files, and results that are written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryFile
from typing import Annotated, Any

import typer

from flexband.errors import InputError
from flexband.files import replaced, try_write

File = Annotated[Path, typer.Argument(help="Python file that defines `study`.", dir_okay=False)]
Output = Annotated[
    Path, typer.Option("--output", "-o", help="Folder for data and figures.", file_okay=False)
]
Replace = Annotated[
    bool, typer.Option("--replace", help="Replace what is in the folder of another study.")
]
Folder = Annotated[Path, typer.Argument(help="Folder of a study (--output).", file_okay=False)]


def check_folder(folder: Path) -> None:
    """Make a folder; raise `InputError` if no file can be written there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        TemporaryFile(dir=folder).close()
    except OSError as error:
        raise InputError(f"--output must be a folder to write to; got {error}") from None


def draw(figure: Callable[[], Any], file: Path, *, wanted: bool = True) -> bool:
    """Write a figure; if none is wanted, delete the one that is there, which is older."""
    if wanted:
        return try_write(lambda: write_figure(figure(), file))
    file.unlink(missing_ok=True)
    return False


def write_figure(figure: Any, file: Path, dpi: int = 150) -> None:
    """Write a figure as a PNG file, which appears only once it is complete."""
    with replaced(file) as partial:
        figure.savefig(partial, format="png", dpi=dpi)
