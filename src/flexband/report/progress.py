"""How far a study is: a bar on a terminal or in a notebook, lines elsewhere."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec

import rich.progress as rp
from rich.console import Console

from flexband.basics.progress import Budget, Progress, ProgressListener, add_listener, duration
from flexband.basics.words import number_of, value_text
from flexband.errors import InputError
from flexband.report.text.terminal import Terminal, printable

PERIOD = 10.0
"""Time [s] between two lines where there is no terminal."""


@contextmanager
def progress_bars() -> Iterator[Callable[[str], Progress]]:
    """Give the function that begins a named task; stages are shown beside the latest one."""
    console = Terminal(error=True)
    live = find_spec("ipywidgets") is not None if console.is_jupyter else console.is_terminal
    tasks: list[_Lines | _Bar] = []

    class LastTask(ProgressListener):
        def stage(self, name: str) -> None:
            if tasks:
                tasks[-1].stage(name)

        def warn(self, message: str) -> None:
            if tasks:
                tasks[-1].warn(message)
            else:
                console.print(message, soft_wrap=True)

    def add_task(task: _Lines | _Bar) -> _Lines | _Bar:
        tasks.append(task)
        return task

    with add_listener(LastTask()):
        if not live:
            yield lambda name: add_task(_Lines(name, console))
            return
        texts = [
            rp.TextColumn(f"{{task.{column}}}", markup=False)
            for column in ("description", "fields[told]")
        ]
        times = rp.TimeElapsedColumn(), rp.TimeRemainingColumn()
        with rp.Progress(texts[0], rp.BarColumn(), texts[1], *times, console=console) as bars:
            yield lambda name: add_task(_Bar(name, bars))


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
        raise InputError(f"name must be text; got {value_text(name)}")
    with progress_bars() as task:
        yield task(name)


def _count_text(done: int, total: int, *, with_limit: bool = False) -> str:
    """Return the number of runs done as text, and of how many, or at most per discretization."""
    budget = Budget.from_total(total)
    if budget.per_level:
        limit = f", at most {budget.per_level} with the same step and elements"
        return f"{number_of(done, 'run')} so far{limit * with_limit}"
    return f"{done} of {('at most ' if not budget.exact else '')}{number_of(total, 'run')}"


class _Bar(ProgressListener):
    """Progress as a bar, with what is done now beside it."""

    def __init__(self, name: str, bars: rp.Progress):
        self.bars = bars
        self.now = ""
        self.text = ""
        self.task = bars.add_task(printable(name), total=None, told="")

    def __call__(self, done: int, total: int) -> None:
        bar_total = None if Budget.from_total(total).per_level else total
        self.text = _count_text(done, total)
        if done >= total and total is bar_total:
            self.now = ""
        self.bars.update(self.task, completed=done, total=bar_total, told=self._status_text())

    def stage(self, name: str) -> None:
        self.now = printable(name).partition(" (")[
            0
        ]  # a bar has little room, and a line has told the rest
        self.bars.update(self.task, told=self._status_text())

    def warn(self, message: str) -> None:
        self.bars.console.print(message, soft_wrap=True)

    def _status_text(self) -> str:
        return ": ".join(filter(None, (self.text, self.now)))


class _Lines(ProgressListener):
    """Progress as lines: at the start, from time to time, and at the end."""

    def __init__(self, name: str, console: Console):
        self.name = name
        self.console = console
        self.printed = float("-inf")
        self.text = ""
        self.now = ""
        self.first: int | None = None
        self.measured: tuple[float, int] | None = None  # time and runs after the first batch

    def __call__(self, done: int, total: int) -> None:
        now = time.monotonic()
        if self.first is None:
            self.first = done
        if self.measured is None and done > self.first:
            self.measured = now, done
        ended = done >= total and Budget.from_total(total).exact
        text = _count_text(done, total, with_limit=not done) + (
            "" if ended else self.time_left(now, done, total) + self.now
        )
        if text != self.text and (ended or now >= self.printed + PERIOD):
            self.printed = now
            self.text = text
            self.console.print(f"{self.name}: {text}", soft_wrap=True)

    def stage(self, name: str) -> None:
        self.now = f"; now {name}" if name else ""

    def warn(self, message: str) -> None:
        self.console.print(f"{self.name}: {message}", soft_wrap=True)

    def time_left(self, now: float, done: int, total: int) -> str:
        """Return the time left as text, once it is known from more than the first batch."""
        # Time [s] after the first batch, which may compile, from which on the time left is told
        measured = 5.0
        begin, before = self.measured or (now, done)
        budget = Budget.from_total(total)
        if budget.per_level or done == before or now < begin + measured:
            return ""
        seconds = (now - begin) / (done - before) * (total - done)
        return f", {'about' if budget.exact else 'at most'} {duration(seconds)} left"
