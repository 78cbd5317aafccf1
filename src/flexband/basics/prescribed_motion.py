"""Functions of time that prescribe a motion must have a second derivative.

Mechanics differentiates them numerically and cannot see that a random process has none. A function
that knows asks what it is evaluated for, also where other functions of a user stand between.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

_motion: ContextVar[str] = ContextVar("motion", default="")


@contextmanager
def set_driven_part(name: str) -> Iterator[None]:
    """Name the part whose prescribed motion is evaluated in this context."""
    before = _motion.set(name)
    try:
        yield
    finally:
        _motion.reset(before)


def driven_part() -> str:
    """Return the name of the part whose prescribed motion is evaluated, or an empty text."""
    return _motion.get()
