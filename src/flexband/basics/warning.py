"""Warnings of a thread: issued at the line of the user, once, or not at all."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from flexband.errors import FlexbandWarning
from flexband.remarks.collection import catch
from flexband.remarks.remark import Remark, RemarkKind

_silent: ContextVar[tuple[type[FlexbandWarning], ...]] = ContextVar("silent", default=())


@contextmanager
def without_warnings(*kinds: type[FlexbandWarning], when: bool = True) -> Iterator[None]:
    """Issue no such warning in this thread: what is computed again was warned of before."""
    silent = kinds or (FlexbandWarning,)
    before = _silent.set((*_silent.get(), *silent) if when else _silent.get())
    try:
        yield
    finally:
        _silent.reset(before)


_told_once: ContextVar[dict[type[FlexbandWarning], bool] | None] = ContextVar("once", default=None)


@contextmanager
def warning_once(kind: type[FlexbandWarning]) -> Iterator[None]:
    """Issue one such warning at most in this thread: the first of many runs tells enough."""
    before = _told_once.get()
    token = _told_once.set({kind: False} | (before or {}))
    try:
        yield
    finally:
        _told_once.reset(token)


def warn(
    message: str,
    kind: type[FlexbandWarning] = FlexbandWarning,
    remarks: Iterable[Remark] | None = None,
) -> None:
    """Issue a warning that points to the line of the caller outside this package.

    A study keeps what is warned of as `remarks`, one for each sample; unless given, it is advice.
    """
    for remark in [Remark(RemarkKind.ADVICE, message)] if remarks is None else remarks:
        catch(remark)
    issued_kinds = _told_once.get()
    if issubclass(kind, _silent.get()) or (issued_kinds and issued_kinds.get(kind)):
        return
    if issued_kinds and kind in issued_kinds:
        issued_kinds[kind] = True
    package = str(Path(__file__).parents[1])
    frame = sys._getframe(1)
    level = 2
    while frame.f_back is not None and frame.f_code.co_filename.startswith(package):
        frame = frame.f_back
        level = level + 1
    warnings.warn(message, kind, stacklevel=level)
