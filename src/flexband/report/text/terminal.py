"""What a terminal is given: text, never the control characters of files that others wrote."""

from __future__ import annotations

import unicodedata
from typing import Any

from rich.console import Console
from rich.text import Text


def printable(text: str) -> str:
    r"""Return a text whose control characters are escapes: ESC is written as \x1b.

    These are the characters of Unicode's categories Cc (control), Cf (format, which reverse the
    direction of text, for example) and Cs (halves of pairs).
    """
    if text.isprintable():
        return text
    return "".join(
        character
        if character in "\n\t" or unicodedata.category(character) not in ("Cc", "Cf", "Cs")
        else character.encode("unicode_escape").decode("ascii")
        for character in text
    )


class Terminal(Console):
    """A console that prints text as it is, without control characters and without markup."""

    def __init__(self, *, error: bool = False, **options: Any):
        plain = {"markup": False, "emoji": False, "highlight": False}
        super().__init__(stderr=error, **{**plain, **options})

    def render_str(self, text: str, **options: Any) -> Text:
        """Return a text as it is printed; tables and lines all come here."""
        return super().render_str(printable(text), **options)
