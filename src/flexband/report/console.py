"""Tables, lines and progress bars on a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import rich.progress as bars
from rich.console import Console
from rich.markup import escape
from rich.table import Table as RichTable

from flexband.report.tables import Table

RESULTS, MESSAGES = Console(), Console(stderr=True)


def print_lines(lines: Iterable[str]) -> None:
    """Print lines of a result."""
    for line in lines:
        RESULTS.print(line, markup=False, highlight=False)


def print_table(title: str, content: Table) -> None:
    """Print a table of results; its first column is left-aligned and never wrapped."""
    table = RichTable(title=escape(title))
    header, rows = content
    for k, cell in enumerate(header):
        table.add_column(escape(cell), justify="left" if k == 0 else "right", no_wrap=k == 0)
    for row in rows:
        table.add_row(*map(escape, row))
    RESULTS.print(table)


def print_message(text: str, style: str | None = None) -> None:
    """Print a message to standard error."""
    MESSAGES.print(text, style=style, markup=False)


def progress_bars() -> bars.Progress:
    """Return a context in which tasks show their progress on standard error."""
    return bars.Progress(
        bars.TextColumn("{task.description}"),
        bars.BarColumn(),
        bars.MofNCompleteColumn(),
        bars.TimeElapsedColumn(),
        bars.TimeRemainingColumn(),
        console=MESSAGES,
    )


def add_task(progress: bars.Progress, name: str) -> Callable[[int, int], object]:
    """Add a bar; return the function that is called as ``(done, total)`` to advance it."""
    task = progress.add_task(name, total=None)
    return lambda done, total: progress.update(task, completed=done, total=total)
