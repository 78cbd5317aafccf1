"""How far a study is: a bar on a terminal or in a notebook, lines elsewhere."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec

import rich.progress as rp
from rich.console import Console

from flexband.errors import InputError, shown

PERIOD = 10.0
"""Time [s] between two lines where there is no terminal."""

LOOKED_UP = 0.2
"""Time [s] in which runs of a store are looked up: it tells nothing about the time left."""

Progress = Callable[[int, int], object]


@contextmanager
def progress_bars(*, most: bool = False) -> Iterator[Callable[[str], Progress]]:
    """Give the function that begins a task by its name, and returns what reports its progress.

    Parameters
    ----------
    most : whether the number of all runs is the most that there may be, until the last is made.
    """
    console = Console(stderr=True, markup=False, emoji=False, highlight=False)
    live = find_spec("ipywidgets") is not None if console.is_jupyter else console.is_terminal
    if not live:
        yield lambda name: _Lines(name, console, "at most " * most)
        return
    columns = (rp.BarColumn(), rp.MofNCompleteColumn(), rp.TimeElapsedColumn())
    name, left = rp.TextColumn("{task.description}", markup=False), rp.TimeRemainingColumn()
    with rp.Progress(name, *columns, left, console=console) as bars:
        yield lambda name: _advancing(bars, f"{name}, at most" if most else name)


@contextmanager
def progress_bar(name: str = "runs") -> Iterator[Progress]:
    """Show how far a study is while it runs, in a notebook or on a terminal.

    Notebooks show a bar if ipywidgets is installed, and lines otherwise.

    Parameters
    ----------
    name : shown before the bar.

    Yields
    ------
    Callable
        The argument `progress` of `propagate`, `Study.run`, `verify` and others.

    Raises
    ------
    InputError
        If `name` is not text.

    Examples
    --------
    >>> with fb.progress_bar("slider–crank") as progress:  # doctest: +SKIP
    ...     bands = study.run(progress=progress)
    """
    if not isinstance(name, str):
        raise InputError(f"name must be text; got {shown(name)}")
    with progress_bars(most=True) as task:
        yield task(name)


def _advancing(bars: rp.Progress, name: str) -> Progress:
    task = bars.add_task(name, total=None)
    return lambda done, total: bars.update(task, completed=done, total=total)


class _Lines:
    """Progress as lines: at the start, after the first batch, from time to time, at the end."""

    def __init__(self, name: str, console: Console, most: str):
        self.name, self.console, self.most = name, console, most
        self.begin = self.told = time.monotonic()
        self.first: int | None = None
        self.batches = 0

    def __call__(self, done: int, total: int) -> None:
        now = time.monotonic()
        if self.first is None or now < self.begin + LOOKED_UP:
            self.first, self.begin = done, self.begin if self.first is not None else now
        self.batches += done > self.first
        if self.batches > 1 and now < self.told + PERIOD and done < total:
            return
        self.told = now
        made = done - self.first
        left = (now - self.begin) / made * (total - done) if made else None
        most = self.most if done < total else ""
        text = "" if left is None or done >= total else f", {most or 'about '}{duration(left)} left"
        self.console.print(f"{self.name}: {done} of {most}{total} runs{text}", soft_wrap=True)


def duration(seconds: float) -> str:
    """Return a duration in words, never negative: 12 s, 3 min, 5.2 h, 2.1 days."""
    seconds = max(0.0, seconds)
    for unit, size in (("days", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 1.5 * size:
            return (
                f"{seconds / size:.2g} {unit}"
                if seconds < 9.95 * size
                else (f"{seconds / size:.0f} {unit}")
            )
    return f"{seconds:.2g} s" if seconds < 9.95 else f"{seconds:.0f} s"
