"""Texts with placeholders for the values of inputs."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from flexband.basics.warning import warn
from flexband.basics.words import value_text
from flexband.errors import InputError

PLACEHOLDER = re.compile(
    r"(?P<literal>\$\$\{)|\$\{(?P<name>[^{}:]*)(?::(?P<spec>[^{}]*))?\}|(?P<open>\$\{)"
)


@dataclass(frozen=True)
class Template:
    """A text in which ``${name}`` or ``${name:format}`` stands for the value of an input.

    The format is one of Python's, such as ``.6e``; without one, a number is written with all its
    digits. Other braces and dollars stay as they are; ``$${`` becomes ``${``.
    """

    text: str
    source: str
    """What the text is, for messages."""

    def __post_init__(self) -> None:
        for match in self._placeholders():
            name = match["name"] or ""
            spec = match["spec"] or ""
            line = self.text[match.start() :].splitlines()[0]
            written = f"{self.source}: the placeholder at {value_text(line)}"
            if not name.isidentifier():
                raise InputError(
                    f"{written} must be the name of an input in braces; a literal ${{ is written "
                    "$${"
                )
            if all(_format(value, spec) is None for value in (1.0, 1, "a")):
                raise InputError(f"{written} must have a format of Python, such as .6e")

    def _placeholders(self) -> list[re.Match[str]]:
        return [match for match in PLACEHOLDER.finditer(self.text) if not match["literal"]]

    @property
    def names(self) -> list[str]:
        """The names of the inputs, in the order in which they first appear."""
        return list(dict.fromkeys(match["name"] for match in self._placeholders()))

    def substitute(self, values: Mapping[str, Any]) -> str:
        """Substitute all values in the text; warn of rounding by over 0.1 %, refuse misfits."""

        def write_value(match: re.Match[str]) -> str:
            if match["literal"]:
                return "${"
            name = match["name"]
            spec = match["spec"] or ""
            text = _format(values[name], spec)
            if text is None:
                raise InputError(
                    f"{self.source}: {name} = {value_text(values[name])} cannot be written as "
                    f"{spec!r}"
                )
            if _rounding_error(values[name], text) > 1e-3:
                warn(
                    f"{self.source}: format {spec!r} of {name} changes a value by more than 0.1 %; "
                    "use one with more digits, such as .9g"
                )
            return text

        return PLACEHOLDER.sub(write_value, self.text)


def _format(value: Any, spec: str) -> str | None:
    """Return a value as text; None if the format is not one for it."""
    try:
        return format(value, spec)
    except (ValueError, TypeError):
        return None


def _rounding_error(value: Any, text: str) -> float:
    """Return by which part of a number its text differs from it; 0 if that cannot be read."""
    try:
        return abs(float(text) - value) / abs(value) if value else abs(float(text))
    except (ValueError, TypeError):
        return 0.0
