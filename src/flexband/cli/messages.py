"""What commands print, and how they end."""

from __future__ import annotations

import json
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import typer
from rich.cells import cell_len
from rich.table import Column
from rich.table import Table as RichTable

from flexband.basics.error_text import error_text, signal_of
from flexband.cli.exit_status import ExitStatus
from flexband.errors import FlexbandWarning, InputError
from flexband.report.text.terminal import Terminal, printable

Table = tuple[list[str], list[list[str]]]
"""The header and the rows of a table."""


class Ending:
    """How this process ends."""

    debug = False  # whether errors are raised with their traceback
    stopped = "flexband: stopped"  # what is printed after Ctrl-C or SIGTERM


class UsageError(InputError):
    """A command line that cannot be carried out; the message tells what is wrong with it."""


@contextmanager
def usage() -> Iterator[None]:
    """Raise `UsageError` for what is refused, where only the command line can be wrong."""
    try:
        yield
    except InputError as error:
        raise UsageError(str(error)) from error


@contextmanager
def reported_errors() -> Iterator[None]:
    """Print warnings as remarks, errors as one line; exit with status 2 for usage, else 1."""
    Ending.stopped = "flexband: stopped"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # those of other packages
            warnings.simplefilter("default", FlexbandWarning)
            warnings.showwarning = lambda message, *_, **__: print_remark(str(message))
            yield
    except (typer.Exit, typer.Abort):
        raise
    except KeyboardInterrupt as error:
        print_text(Ending.stopped, "red", error=True)
        raise typer.Exit(ExitStatus.STOPPED + signal_of(error)) from None
    except BaseException as error:  # also SystemExit: of a response, for instance
        if isinstance(error.__context__, BrokenPipeError):  # nobody reads what is printed
            raise typer.Exit(ExitStatus.ERROR) from None
        if Ending.debug:
            traceback.print_exception(error)
        print_text(f"flexband: {error_text(error)}", "red", error=True)
        raise typer.Exit(
            ExitStatus.USAGE if isinstance(error, UsageError) else ExitStatus.ERROR
        ) from None


def print_text(text: str, style: str = "", *, error: bool = False) -> None:
    """Print a text as it is, on standard output or error."""
    console = Terminal(error=error)
    console.print(text, style=style, soft_wrap=True)


def print_remark(text: str) -> None:
    """Print a remark on standard error."""
    print_text(f"flexband: remark: {text}", "yellow", error=True)


def print_json(content: Any) -> None:
    """Print JSON on standard output, in ASCII; numbers that are not finite are null."""
    typer.echo(json.dumps(_finite(content), indent=2, allow_nan=False))


def _finite(content: Any) -> Any:
    if isinstance(content, dict):
        return {key: _finite(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [_finite(value) for value in content]
    if isinstance(content, float) and not abs(content) < float("inf"):
        return None
    return content


def print_table(title: str, content: Table) -> None:
    """Print a table without wrapping cells; further columns follow below, beside the first one."""
    from flexband.report.text.numbers import with_minus  # noqa: PLC0415

    header = list(map(printable, content[0]))
    rows = [[printable(row[0]), *map(with_minus, row[1:])] for row in content[1]]
    console = Terminal()
    full_widths = _widths(header, rows)
    words = _widths([max(head.split() or [""], key=cell_len) for head in header], rows)
    parts = [list(range(len(header)))]
    if not _fits(full_widths, console.width):
        parts = _parts(words, console.width)
    print_text(title)
    for part in parts:
        widths = full_widths if _fits([full_widths[c] for c in part], console.width) else words
        columns = [
            Column(header[c], width=widths[c], justify="right" if c else "left") for c in part
        ]
        table = RichTable(*columns)
        for row in rows:
            table.add_row(*(row[c] for c in part))
        console.print(table)


def _fits(widths: list[int], max_width: int) -> bool:
    """Return whether a table with these columns is not wider than `max_width` characters."""
    return sum(widths) + 3 * len(widths) + 1 <= max_width


def _widths(header: list[str], rows: list[list[str]]) -> list[int]:
    """Return the width of every column whose cells are not wrapped."""
    return [max(1, *map(cell_len, column)) for column in zip(header, *rows, strict=True)]


def _parts(widths: list[int], max_width: int) -> list[list[int]]:
    """Return the columns of the fewest tables not wider than `max_width`, as evenly as possible."""
    size = [width + 3 for width in widths]
    count = len(_fill_columns(size, max_width))
    min_width = next(
        w
        for w in range(size[0] + 1, max_width + sum(size) + 2)
        if len(_fill_columns(size, w)) <= count
    )
    return _fill_columns(size, min_width)


def _fill_columns(size: list[int], max_width: int) -> list[list[int]]:
    """Return the columns of tables, each filled until it would be wider than `max_width`."""
    parts = [[0]]
    for c in range(1, len(size)):
        if len(parts[-1]) > 1 and sum(size[k] for k in [*parts[-1], c]) + 1 > max_width:
            parts.append([0])
        parts[-1].append(c)
    return parts
