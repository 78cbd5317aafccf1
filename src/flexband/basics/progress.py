"""How far a call is that makes many runs."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Protocol

from flexband.basics.checks import check_function

Progress = Callable[[int, int], object]
"""Called as ``progress(done, total)`` with numbers of runs."""


class Budget(int):
    """A total of runs that may become smaller or, with other discretizations, larger.

    Attributes
    ----------
    per_level : the most runs on one discretization; 0 if there is only one, so that it is the
        total.
    exact : whether the total stays as it is.
    """

    per_level = 0
    exact = False

    @classmethod
    def from_levels(cls, total: int, per_level: int) -> Budget:
        """Return a total with what is known of it."""
        made = cls(total)
        made.per_level = per_level
        return made

    @classmethod
    def from_total(cls, total: int) -> Budget:
        """Return a total that may be a plain number, which is exact, as a budget."""
        if isinstance(total, Budget):
            return total
        plain = cls(total)
        plain.exact = True
        return plain


class ProgressListener:
    """Takes how far calls are; each method does nothing unless a subclass overrides it.

    Attributes
    ----------
    shows_stages : whether a user sees the stages and the messages.
    """

    shows_stages = True

    def stage(self, name: str) -> None:
        """Take what is done from now on."""

    def advance(self, done: int, total: int) -> None:
        """Take how many runs of a call of the response are done, and how many it makes."""

    def warn(self, message: str) -> None:
        """Take a message that is worth to be read later, too."""


class RunListener(ProgressListener):
    """Has a function take how many runs of a call are done, if there is one."""

    shows_stages = False

    def __init__(self, progress: Progress | None = None):
        self.progress = progress

    def advance(self, done: int, total: int) -> None:
        """Take how many runs are done."""
        if self.progress is not None:
            self.progress(done, total)


_listeners: ContextVar[tuple[ProgressListener, ...]] = ContextVar("listeners", default=())
_stage: ContextVar[str] = ContextVar("stage", default="")


@contextmanager
def add_listener(listener: ProgressListener) -> Iterator[None]:
    """Add a listener that takes how far calls of this thread are, beside those that listen already.

    Runs are told to the innermost listener alone.
    """
    token = _listeners.set((listener, *_listeners.get()))
    try:
        yield
    finally:
        _listeners.reset(token)


class _Listeners(ProgressListener):
    """All listeners of this thread, the innermost first."""

    def __init__(self) -> None:
        self.listeners = _listeners.get()
        self.shows_stages = any(listener.shows_stages for listener in self.listeners)

    def stage(self, name: str) -> None:
        _stage.set(name)
        self.substage(name)

    def substage(self, name: str) -> None:
        """Tell every listener of a part of the stage, which goes on after it."""
        for listener in self.listeners:
            listener.stage(name)

    def advance(self, done: int, total: int) -> None:
        """Tell the innermost listener."""
        for listener in self.listeners[:1]:
            listener.advance(done, total)

    def warn(self, message: str) -> None:
        for listener in self.listeners:
            listener.warn(message)


def listener() -> _Listeners:
    """Return all that listen in this thread, as one listener."""
    return _Listeners()


class Pace:
    """Tells how many steps a simulation has, and how long they take, measured on the first ones.

    Called about every second, it tells the time left beside what is done now. A message tells it
    once where that is long.

    Attributes
    ----------
    many_steps : steps of a run whose number is told at once.
    long : time left [s] that is worth a message.
    silent : time without a step [s] that is.
    """

    many_steps = 1_000_000
    long = 60.0
    silent = 60.0

    def __init__(self, steps: int, part: Callable[[], float], why: Callable[[], str] = str):
        """Take the number of steps of a run, and what returns the part of all that is done.

        `why` returns what takes long, or "" if that is not known.
        """
        self.steps = steps
        self.part = part
        self.why = why
        self.warned = False
        self.start_time = time.monotonic()
        self.listener = listener()
        self.stage = _stage.get()
        self.first: tuple[float, float] | None = None
        if steps >= self.many_steps:
            self._tell(f"runs of {steps} steps")
            self.listener.warn(f"each run has {steps} steps")

    def __call__(self) -> None:
        """Tell the time left, once it is known."""
        now = time.monotonic()
        part = self.part()
        if self.first is None or part <= self.first[1]:
            self.first = self.first or ((now, part) if part > 0 else None)
            if now - self.start_time >= self.silent:
                self._warn(f"no further time is reached after {duration(now - self.start_time)}")
            return
        remaining = (now - self.first[0]) * (1 - part) / (part - self.first[1])
        text = f"{100 * part:.0f} % of runs of {self.steps} steps, about {duration(remaining)} left"
        self._tell(text)
        if remaining >= self.long:
            self._warn(text)

    def _warn(self, text: str) -> None:
        if not self.warned:
            self.listener.warn("; ".join(filter(None, (text, self.why()))))
            self.warned = True

    def _tell(self, text: str) -> None:
        self.listener.substage(", ".join(filter(None, (self.stage, text))))

    def end(self) -> None:
        """Tell again what was done before."""
        if self.first is not None:
            self.listener.substage(self.stage)


class Advance(Protocol):
    """Takes how many more runs are finished, and how many are done of a call that is not."""

    def __call__(self, finished: int, under_way: int = 0, /) -> object: ...


def run_counter(progress: Progress | None, total: int) -> Advance:
    """Return a function that counts finished runs and tells `progress`, if there is one."""
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
