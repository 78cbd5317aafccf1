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


@dataclass(frozen=True)
class Doubt:
    """A reason why a result is not what was asked for.

    Attributes
    ----------
    kind : what is doubtful.
    error : relative to the bar's width: expected, if it is TOLERANCE_NOT_MET; inferred from
        verification runs, if it is INACCURATE.
    target : the tolerance that is not met.
    """

    kind: DoubtKind
    error: float | None = None
    target: float | None = None

    @property
    def unreliable(self) -> bool:
        """Whether no answer from the result is reliable."""
        return self.kind in (DoubtKind.NOT_TRUSTED, DoubtKind.NOT_CONFIRMED, DoubtKind.INACCURATE)

    @property
    def rare_values(self) -> bool:
        """Whether answers about rare values, such as probabilities, are not reliable."""
        return self.unreliable or self.kind is DoubtKind.TOLERANCE_NOT_MET

    def as_json(self) -> dict[str, Any]:
        return asdict(self)

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> Doubt:
        """Return what `as_json` has made; raise `ValueError` if it is of another version."""
        try:
            return cls(DoubtKind(content["kind"]), content["error"], content.get("target"))
        except (TypeError, KeyError):
            raise ValueError(f"a doubt must have a kind and an error; got {content!r}") from None
