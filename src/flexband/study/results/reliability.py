"""Why a result is not what was asked for, as data; sentences are made of it where it is shown."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any


class DoubtKind(StrEnum):
    """What is doubtful about a result."""

    TOLERANCE_NOT_MET = "tolerance-not-met"
    NOT_TRUSTED = "not-trusted"
    NOT_CONFIRMED = "not-confirmed"
    INACCURATE = "inaccurate"
    NOT_VERIFIED = "not-verified"


UNRELIABLE = frozenset({DoubtKind.NOT_TRUSTED, DoubtKind.NOT_CONFIRMED, DoubtKind.INACCURATE})
"""Doubts that concern every answer from a result. A missed tolerance concerns rare values alone."""


@dataclass(frozen=True)
class Doubt:
    """A reason why a result is not what was asked for.

    Attributes
    ----------
    kind
        What is doubtful.
    error
        Error inferred from verification runs, in parts of the bar's width, if it is INACCURATE.
    """

    kind: DoubtKind
    error: float | None = None

    @property
    def unreliable(self) -> bool:
        """Whether no answer from the result is reliable."""
        return self.kind in UNRELIABLE

    def as_json(self) -> dict[str, Any]:
        """Return the fields as JSON has them."""
        return asdict(self)

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> Doubt:
        """Return what `as_json` has made; raise `ValueError` if it is of another version."""
        try:
            return cls(DoubtKind(content["kind"]), content["error"])
        except (TypeError, KeyError):
            raise ValueError(f"a doubt must have a kind and an error; got {content!r}") from None
