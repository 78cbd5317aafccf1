"""What the first lines of a report need of a result, and which of its inputs are uncertain."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from flexband.report.text import band_tables
from flexband.report.text.doubts import doubt_text
from flexband.report.text.parts import horizon_line
from flexband.study.results.reliability import Doubt
from flexband.study.results.result import StudyResult


def uncertain_ones(
    contributions: xr.Dataset | None, inputs: band_tables.Table
) -> xr.Dataset | None:
    """Return the contributions of inputs that are uncertain, and not chosen; None if none is."""
    design_inputs = {row[0] for row in inputs[1] if row[1] in ("size", "compensator")}
    if contributions is None:
        return None
    keep = [name not in design_inputs for name in contributions["name"].values.astype(str)]
    return contributions.isel(name=np.flatnonzero(keep)) if any(keep) else None


def why_unreliable(doubts: Sequence[Doubt]) -> list[str]:
    """Return why no number of a result is reliable; nothing if they are."""
    return [doubt_text(doubt) for doubt in doubts if doubt.unreliable]


def head_of(result: StudyResult) -> dict[str, Any]:
    """Return what the first lines of a report need that is in no other file."""
    sampled = result.parts if result.unpredictable else None
    return {
        "doubts": result.doubts,
        "unchecked": result.unchecked,
        "unpredictable": "" if sampled is None else horizon_line(sampled),
    }
