"""A remark on a run: what kind it is of, its number, and which outputs it puts in doubt."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from enum import StrEnum
from typing import Any


class Doubted(StrEnum):
    """Which outputs a kind of remarks puts in doubt."""

    NONE = "none"
    """Advice, and what does not change a number."""
    NAMED = "named"
    """Those that the remark names."""
    ALL = "all"
    """Those that the remark names, or all if it names none."""


class RemarkKind(StrEnum):
    """What a run warns of."""

    LARGE_STRAIN = "large strain"
    """A flexible member is strained beyond linear elasticity; the number is the strain."""
    COARSE_STEP = "coarse step"
    """The step is too long for a motion; the number is the relative error."""
    COARSE_MESH = "coarse mesh"
    """A flexible member has too few elements for its section forces."""
    HALVED_STEP = "halved step"
    """A run diverged, and was completed with a shorter step; the number is how many times."""
    SHARED_REACTIONS = "shared reactions"
    """Redundant constraints share their forces, which are one choice of many."""
    UNRESOLVED_REACTIONS = "unresolved reactions"
    """More constraints depend on each other somewhere than at the start."""
    ALMOST_DEPENDENT = "almost dependent constraints"
    """A constraint was left out at the start that is almost redundant."""
    IMPULSES = "impulses"
    """Speeds of prescribed motions jump; forces at an instant are impulses that no output shows."""
    OTHER_BRANCH = "other branch"
    """A loop closed in another branch than that of the given angles."""
    CHANGED_START = "changed start"
    """Joints change the given places or velocities; the number is by how much."""
    NOISE = "noise"
    """The same inputs give other values if they are run again; the number is the difference."""
    ADVICE = "advice"
    """Whatever else is warned of."""

    @property
    def doubt_scope(self) -> Doubted:
        """Which outputs it puts in doubt."""
        kinds = RemarkKind
        match self:
            case (
                kinds.LARGE_STRAIN
                | kinds.COARSE_STEP
                | kinds.HALVED_STEP
                | kinds.ALMOST_DEPENDENT
                | kinds.OTHER_BRANCH
            ):
                return Doubted.ALL
            case (
                kinds.COARSE_MESH
                | kinds.SHARED_REACTIONS
                | kinds.UNRESOLVED_REACTIONS
                | kinds.IMPULSES
                | kinds.NOISE
            ):
                return Doubted.NAMED
            case _:
                return Doubted.NONE


@dataclass(frozen=True)
class Remark:
    """A remark on one run, or on all runs of a call.

    Attributes
    ----------
    kind : what is remarked.
    text : the same in words, without the sample.
    size : the number of its kind, larger where it is worse; NaN without one.
    part : the part of the model that it is about, "" if it is about all.
    outputs : names of outputs that it puts in doubt, if its kind names them.
    error : of these outputs, relative to their range over all runs and times; NaN if not known.
    time : where it is worst [s]; NaN if it is not about a time.
    sample : number of the sample in its call; None for all of them.
    """

    kind: RemarkKind
    text: str
    size: float = math.nan
    part: str = ""
    outputs: tuple[str, ...] = ()
    error: float = math.nan
    time: float = math.nan
    sample: int | None = None

    @property
    def topic(self) -> tuple[str, ...]:
        """What tells remarks of one kind apart that are not the same."""
        about = self.text if self.kind is RemarkKind.ADVICE else self.part
        return self.kind.value, about, *self.outputs

    def touches(self, output: str) -> bool:
        """Return whether it puts an output in doubt; "" is the only one of a response."""
        names_output = output in self.outputs or (self.outputs and not output)
        match self.kind.doubt_scope:
            case Doubted.NAMED:
                return bool(names_output)
            case Doubted.ALL:
                return bool(names_output or not self.outputs)
            case _:
                return False

    def as_json(self) -> dict[str, Any]:
        """Return it as plain data, without the sample; numbers that are NaN are left out."""
        field_values = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "sample"}
        return {
            name: list(value) if isinstance(value, tuple) else value
            for name, value in field_values.items()
            if not (isinstance(value, float) and math.isnan(value)) and value not in ("", ())
        }

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> Remark:
        """Return what `as_json` has made; raise `ValueError` if it is of another version."""
        try:
            return cls(
                kind=RemarkKind(content["kind"]),
                text=str(content["text"]),
                size=float(content.get("size", math.nan)),
                part=str(content.get("part", "")),
                outputs=tuple(map(str, content.get("outputs", ()))),
                error=float(content.get("error", math.nan)),
                time=float(content.get("time", math.nan)),
            )
        except (TypeError, KeyError):
            raise ValueError(f"a remark must have a kind and numbers; got {content!r}") from None
