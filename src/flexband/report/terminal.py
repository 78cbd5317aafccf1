"""Texts on terminals that do not know all characters."""

from __future__ import annotations

import codecs
import io
import sys

PLAIN = {"…": "...", "–": "-", "−": "-", "×": "x", "μ": "mu", "σ": "sigma", "ξ": "xi", "η": "eta"}
"""What is printed in place of a character that a terminal does not know; otherwise "?"."""


def print_anywhere() -> None:
    """Let standard output and error replace characters that they cannot encode."""
    codecs.register_error("flexband", _replaced)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="flexband")


def _replaced(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    unknown = error.object[error.start : error.end]
    return "".join(PLAIN.get(character, "?") for character in unknown), error.end
