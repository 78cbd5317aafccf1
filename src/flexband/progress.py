"""How far a call is that makes many runs, told to whoever waits for it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

Progress = Callable[[int, int], object]
"""Called as ``progress(done, total)`` with numbers of runs."""

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
