"""Texts on terminals that do not know all characters."""

from __future__ import annotations

import codecs
import io
import sys


def print_anywhere() -> None:
    """Let standard output and error replace characters that they cannot encode."""
    codecs.register_error("flexband", _replaced)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="flexband")


def _replaced(error: UnicodeError) -> tuple[str, int]:
    # What is printed in place of a character that a terminal does not know; otherwise "?"
    plain = {
        "…": "...",
        "–": "-",
        "−": "-",
        "×": "x",
        "μ": "mu",
        "σ": "sigma",
        "ξ": "xi",
        "η": "eta",
    }
    if not isinstance(error, UnicodeEncodeError):
        raise error
    unknown = error.object[error.start : error.end]
    return "".join(plain.get(character, "?") for character in unknown), error.end
