"""Errors and interrupts as text."""

from __future__ import annotations

import signal
import sysconfig
import traceback
from pathlib import Path

from flexband.basics.arguments import ArgumentError
from flexband.errors import InputError, RunError, RunsNeeded, StoreError

LIBRARIES = Path(__file__).parents[1], *(sysconfig.get_path(k) for k in ("stdlib", "purelib"))
"""Folders of code that is not the user's."""

EXPLAINED = InputError, RunError, StoreError, RunsNeeded
"""Errors whose messages say what is wrong without a place in the code."""


def error_text(error: BaseException) -> str:
    """Return an error as text; for one that flexband did not raise, with its place."""
    cause = error.__cause__
    if isinstance(error, RunError) and cause is not None and not isinstance(cause, EXPLAINED):
        return f"{error}{_place(cause)}"
    if isinstance(error, ArgumentError):
        return f"{error}{_place(error)}"
    if isinstance(error, (*EXPLAINED, OSError)):
        return str(error)
    if isinstance(error, SystemExit):
        return f"the study called sys.exit({error.code!r})"
    return f"{type(error).__name__}: {error}{_place(error)}"


def _place(error: BaseException) -> str:
    """Return the file and line of an error: those of the user's code, if there is any."""
    frames = traceback.extract_tb(error.__traceback__)
    users = [f for f in frames if not any(map(Path(f.filename).is_relative_to, LIBRARIES))]
    last = (users or frames)[-1:]
    return f" ({last[0].filename}, line {last[0].lineno})" if last else ""


def signal_of(interrupt: KeyboardInterrupt) -> int:
    """Return the signal of an interrupt, which is that of Ctrl-C unless it names another one."""
    return int(interrupt.args[0]) if interrupt.args else signal.SIGINT
