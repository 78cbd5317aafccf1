"""How far a call is that makes many runs, told to whoever waits for it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Protocol

from flexband.errors import check_function

MANY_STEPS, LONG = 1_000_000, 60.0
"""Steps of a run that are told at once, and time left [s] that is worth a line."""

Progress = Callable[[int, int], object]
"""Called as ``progress(done, total)`` with numbers of runs."""


class Budget(int):
    """A total of runs that may become smaller or, with other discretizations, larger.

    Attributes
    ----------
    each : the most runs on one discretization; 0 if there is only one, so that it is the total.
    """

    each = 0

    @classmethod
    def of(cls, total: int, each: int) -> Budget:
        """Return a total with what is known of it."""
        made = cls(total)
        made.each = each
        return made


_listener: ContextVar[Progress | None] = ContextVar("listener", default=None)


@contextmanager
def listening(progress: Progress | None) -> Iterator[None]:
    """Have calls of this thread tell `progress` how many of their runs are done."""
    before = _listener.set(progress)
    try:
        yield
    finally:
        _listener.reset(before)


def listener() -> Progress | None:
    """Return what a call has to tell how many of its runs are done; None if nobody listens."""
    return _listener.get()


class Hearer(Protocol):
    """Takes what is done now and, on a line of its own, why something is done again."""

    def __call__(self, now: str, line: str = "", /) -> object: ...


_hearer: ContextVar[Hearer | None] = ContextVar("hearer", default=None)


@contextmanager
def hearing(hearer: Hearer) -> Iterator[None]:
    """Have `doing` in this thread tell `hearer`, and whoever has heard so far."""
    before = _hearer.get()

    def both(now: str, line: str = "", /) -> None:
        hearer(now, line)
        if before is not None:
            before(now, line)

    token = _hearer.set(both)
    try:
        yield
    finally:
        _hearer.reset(token)


_now: ContextVar[str] = ContextVar("now", default="")


def doing(now: str, line: str = "") -> None:
    """Tell whoever waits what is done now; `line` is worth to be read later, too."""
    _now.set(now)
    hearer = _hearer.get()
    if hearer is not None:
        hearer(now, line)


def heard() -> bool:
    """Return whether somebody hears what is done now."""
    return _hearer.get() is not None


class Pace:
    """Tells how many steps a simulation has, and how long they take, measured on the first ones.

    Called about every second, it tells the time left beside what is done now. A line tells it once
    where it is more than a minute.
    """

    def __init__(self, steps: int, part: Callable[[], float]):
        """Take the number of steps of a run, and what returns the part of all that is done."""
        self.steps, self.part, self.told = steps, part, False
        self.first: tuple[float, float] | None = None
        if steps >= MANY_STEPS:
            self._tell(f"runs of {steps} steps", f"each run has {steps} steps")

    def __call__(self) -> None:
        """Tell the time left, once it is known."""
        now, part = time.monotonic(), self.part()
        if self.first is None or part <= self.first[1]:
            self.first = self.first or ((now, part) if part > 0 else None)
            return
        remaining = (now - self.first[0]) * (1 - part) / (part - self.first[1])
        text = f"{100 * part:.0f} % of runs of {self.steps} steps, about {duration(remaining)} left"
        self._tell(text, "" if self.told or remaining < LONG else text)
        self.told |= remaining >= LONG

    def _tell(self, text: str, line: str = "") -> None:
        if (hearer := _hearer.get()) is not None:
            hearer(", ".join(filter(None, (_now.get(), text))), line)

    def end(self) -> None:
        """Tell again what was done before."""
        if (hearer := _hearer.get()) is not None and self.first is not None:
            hearer(_now.get())


class Advance(Protocol):
    """Takes how many more runs are finished, and how many are done of a call that is not."""

    def __call__(self, finished: int, under_way: int = 0, /) -> object: ...


def counted(progress: Progress | None, total: int) -> Advance:
    """Return what adds up finished runs and tells their number to `progress`, if there is one."""
    done = 0

    def advance(finished: int, under_way: int = 0, /) -> None:
        nonlocal done
        done += finished
        if progress is not None:
            progress(done + under_way, total)

    if progress is not None:
        check_function("progress", progress)
    return advance


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
