"""How far a call is that makes many runs, told to whoever waits for it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Protocol

from flexband.errors import function

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


def doing(now: str, line: str = "") -> None:
    """Tell whoever waits what is done now; `line` is worth to be read later, too."""
    hearer = _hearer.get()
    if hearer is not None:
        hearer(now, line)


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
        function("progress", progress)
    return advance
