"""Former names, which work for one release and say what replaces them."""

from __future__ import annotations

import sys
import warnings

_announced: set[tuple[str, str]] = set()


class RenamedWarning(FutureWarning):
    """A former name was used."""


def renamed_text(former: str, name: str) -> str:
    """Return the sentence that says what replaces a former name."""
    return f"{former} is called {name} now; the former name works for one more release"


def warn_renamed(former: str, name: str) -> None:
    """Warn once per process that something has another name now, at the caller's line."""
    if (former, name) in _announced:
        return
    _announced.add((former, name))
    depth, frame = 1, sys._getframe(0)
    while frame and frame.f_globals.get("__name__", "").partition(".")[0] == "flexband":
        depth, frame = depth + 1, frame.f_back
    warnings.warn(renamed_text(former, name), RenamedWarning, stacklevel=depth)
