"""The first lines of a report: doubts, errors, which limits are kept, and what matters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from flexband.analysis.probability.texts import chance
from flexband.analysis.requirements.production import share_in_words
from flexband.analysis.requirements.requirement import with_unit
from flexband.report.page.matters import what_matters
from flexband.report.text import tables
from flexband.report.text.doubts import doubt_line, doubt_text
from flexband.report.text.numbers import number
from flexband.report.text.parts import horizon_line
from flexband.report.text.verdicts import RANDOM_SAMPLES
from flexband.study.results.limits import LimitCheck
from flexband.study.results.reliability import Doubt
from flexband.study.results.result import StudyResult
from flexband.words import number_of


def uncertain_ones(contributions: xr.Dataset | None, inputs: tables.Table) -> xr.Dataset | None:
    """Return the contributions of inputs that are uncertain, and not chosen; None if none is."""
    chosen = {row[0] for row in inputs[1] if row[1] in ("size", "compensator")}
    if contributions is None:
        return None
    keep = [name not in chosen for name in contributions["name"].values.astype(str)]
    return contributions.isel(name=np.flatnonzero(keep)) if any(keep) else None


def why_unreliable(doubts: Sequence[Doubt]) -> list[str]:
    """Return why no number of a result is reliable; nothing if they are."""
    return [doubt_text(doubt) for doubt in doubts if doubt.unreliable]


def head_of(result: StudyResult) -> dict[str, Any]:
    """Return what the first lines of a report need that is in no other file."""
    sampled = result.parts if result.unpredictable else None
    return {
        "doubts": result.doubts,
        "unchecked": result.limits_unchecked,
        "unpredictable": "" if sampled is None else horizon_line(sampled),
    }


def verdict(
    given: Mapping[str, Any],
    bands: xr.Dataset,
    checked: xr.Dataset | None,
    contributions: xr.Dataset | None,
    check: LimitCheck | None,
) -> list[str]:
    """Return what the first lines of the report say after the verdicts on requirements."""
    doubts: Sequence[Doubt] = given["doubts"]
    unpredictable = given.get("unpredictable", "")
    lines = [unpredictable] if unpredictable else [doubt_line(doubt) for doubt in doubts]
    if not unpredictable:
        lines.append(tables.error_in_words(bands))
    if checked is not None and not unpredictable:
        lines.append(tables.checked_in_words(checked))
    limits = None if check is None else check.margins
    if why := given.get("unchecked"):
        lines.append(f"The limits are not checked: {why}.")
    if check is not None and check.probability is not None:
        last = check.probability.isel(limit=-1)  # of leaving any limit
        why = [doubt_text(doubt) for doubt in doubts if doubt.rare_values]
        lines.append(
            " ".join([f"No probability: {why[0]}.", *_extremes(check.margins)])
            if why
            else f"The probability of leaving a limit at any time is {chance(last)}."
        )
    if check is not None and check.production is not None:
        every = check.production.isel(limit=-1)  # all requirements
        worst = every.isel(bound=-1) if "bound" in every.dims else every
        share = share_in_words(worst).replace("meet it", "meet all requirements")
        lines.append(f"Yield: {share}. {RANDOM_SAMPLES}.")
    if contributions is not None and not unpredictable:
        lines.append(what_matters(contributions, limits))
    return lines


def _extremes(margins: xr.Dataset) -> list[str]:
    """Return which values of runs are nearest to bounds, or beyond them, if that was recorded."""
    sentences = []
    for k in range(margins.sizes["limit"]) if "run_value" in margins else ():
        limit = margins.isel(limit=k)
        known = str(limit["unit"].values) if "unit" in limit.coords else ""
        unit = str(limit["stated_unit"].values) or known
        sizes = (float(limit[name] / limit["stated_scale"]) for name in ("run_value", "run_bound"))
        value, bound = (with_unit(number(size), unit) for size in sizes)
        output = f" of {limit['output'].values}" if "output" in limit.coords else ""
        runs = number_of(margins.attrs["runs_recorded"], "run")
        extreme = f"The {limit['run_extreme'].values} value{output}"
        sentences.append(f"{extreme} in {runs} is {value} (limit {bound}).")
    return sentences
