"""Outputs that converge at no affordable discretization: a verdict, and its words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np


class Cause(StrEnum):
    """Why the error of an output does not fall."""

    WAVES = "waves-of-the-mesh"
    """Members carry waves, whose phases no step resolves that is affordable."""
    STAGNANT = "no-longer-falls"
    """It is resolved, but the error does not fall."""


class Remedy(StrEnum):
    """What helps; `text` is the advice."""

    DAMPING = "retardation-time"
    SPECTRAL_RADIUS = "spectral-radius"
    AVERAGE = "average"
    OUTPUT_STEP = "output-step"
    LEAVE_OUT = "leave-out"

    @property
    def text(self) -> str:
        return {
            Remedy.DAMPING: "damp them (retardation_time of members)",
            Remedy.SPECTRAL_RADIUS: "choose a smaller spectral_radius",
            Remedy.AVERAGE: "use an average over some of their periods (sensors.Average)",
            Remedy.OUTPUT_STEP: "choose an output_step that shows them",
            Remedy.LEAVE_OUT: "omit such outputs",
        }[self]


REMEDIES = {
    Cause.WAVES: (
        Remedy.DAMPING,
        Remedy.SPECTRAL_RADIUS,
        Remedy.AVERAGE,
        Remedy.OUTPUT_STEP,
        Remedy.LEAVE_OUT,
    ),
    Cause.STAGNANT: (Remedy.LEAVE_OUT,),
}
INTEGRATION = (
    "the integration of the moments: the phase varies by too many turns over the random inputs "
    "for any affordable rule, and more runs do not help. A shorter duration, less scatter, or a "
    "method without an expansion (MonteCarlo, LHSScanning) does"
)
"""What is missed where no rule resolves the phases, and what helps."""

PREFIX = "unconverged_"


@dataclass(frozen=True)
class Unconverged:
    """An output whose error is above what is allowed, and falls at no affordable discretization."""

    output: str  # its name
    part: str  # what should be finer, "step" or "elements"
    cause: Cause  # why it does not help
    frequency: float  # at which runs on two levels differ most, per unit of time
    steps: float  # steps per period of this frequency; NaN if there is no step
    error: float  # due to this part, relative to the error bar's width


def attributes(outputs: Sequence[Unconverged]) -> dict[str, list[Any]]:
    """Return verdicts as attributes of a result, "unconverged_output" and so on; none if none."""
    if not outputs:
        return {}
    columns = {
        f"{PREFIX}{name}": [getattr(verdict, name) for verdict in outputs]
        for name in Unconverged.__dataclass_fields__
    }
    causes = dict.fromkeys(verdict.cause for verdict in outputs)
    remedies = dict.fromkeys(remedy for cause in causes for remedy in REMEDIES[cause])
    columns[f"{PREFIX}cause"] = [verdict.cause.value for verdict in outputs]
    return columns | {f"{PREFIX}remedies": [remedy.value for remedy in remedies]}


def of_attributes(attrs: Mapping[str, Any]) -> list[Unconverged]:
    """Return the verdicts of a result's attributes."""
    names = list(Unconverged.__dataclass_fields__)
    if f"{PREFIX}output" not in attrs:
        return []  # a file has verdict value in place of a list of one
    columns = [np.atleast_1d(attrs[f"{PREFIX}{name}"]).tolist() for name in names]
    rows = (dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True))
    return [Unconverged(**{**row, "cause": Cause(row["cause"])}) for row in rows]


def in_words(attrs: Mapping[str, Any]) -> str:
    """Return in words which outputs do not converge, why, and what helps; "" if all do."""
    groups: dict[tuple[str, Cause], list[Unconverged]] = {}
    for verdict in of_attributes(attrs):
        groups.setdefault((verdict.part, verdict.cause), []).append(verdict)
    lines = []
    for (part, cause), verdicts in groups.items():
        output_names = ", ".join(verdict.output for verdict in verdicts[:3]) + (
            ", …" if len(verdicts) > 3 else ""
        )
        worst = max(verdicts, key=lambda verdict: verdict.error)
        text = (
            f"the error of {output_names} that is due to the {part} no longer falls: it oscillates "
            f"about {worst.frequency:.3g} times per unit of time"
        )
        *others, last = (remedy.text for remedy in REMEDIES[cause])
        if cause is Cause.WAVES:
            text += f", as waves that the mesh carries, with {worst.steps:.2g} steps per period"
        lines.append(f"{text}; {', '.join(others)}{(', or ' if others else '')}{last}")
    return "; ".join(lines)


def why_not_finer(attrs: Mapping[str, Any]) -> str:
    """Return why a discretization that the method chose misses the tolerance."""
    too_coarse = (
        "the given step or elements are too coarse, or those left open need further refinement"
    )
    return attrs.get("not_refined") or in_words(attrs) or too_coarse
