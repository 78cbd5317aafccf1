"""The first lines of a report: doubts, errors, which limits are kept, and what matters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from flexband.analysis.limits.least_margin import MarginRecord
from flexband.analysis.limits.limit_verdicts import LimitCheck, largest_around
from flexband.analysis.probability.texts import chance, share_in_words
from flexband.basics.rounding import unit_of_variable
from flexband.basics.words import number_of
from flexband.report.page.inputs import mean_share_text
from flexband.report.text import band_tables
from flexband.report.text.doubts import doubt_line, doubt_text
from flexband.report.text.numbers import number
from flexband.report.text.parts import horizon_line
from flexband.report.text.requirement_verdicts import RANDOM_SAMPLES
from flexband.requirements.requirement import with_unit
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


def verdict(
    page_record: Mapping[str, Any],
    bands: xr.Dataset,
    verification: xr.Dataset | None,
    contributions: xr.Dataset | None,
    check: LimitCheck | None,
) -> list[str]:
    """Return what the first lines of the report say after the verdicts on requirements."""
    doubts: Sequence[Doubt] = page_record["doubts"]
    unpredictable = page_record.get("unpredictable", "")
    lines = [unpredictable] if unpredictable else [doubt_line(doubt) for doubt in doubts]
    if not unpredictable:
        lines.append(band_tables.error_in_words(bands))
    if verification is not None and not unpredictable:
        lines.append(band_tables.checked_in_words(verification))
    limits = None if check is None else check.margins
    if check is not None and check.probability is not None:
        last = check.probability.isel(limit=-1)  # of leaving any limit
        why = [doubt_text(doubt) for doubt in doubts if doubt.rare_values]
        lines.append(
            " ".join([f"No probability: {why[0]}.", *_extremes(check.margins)])
            if why
            else f"The probability of leaving a limit at any time is {chance(last)}."
        )
    if check is not None and check.production is not None:
        joint_yield = check.production.isel(limit=-1)  # all requirements
        worst = joint_yield.isel(bound=-1) if "bound" in joint_yield.dims else joint_yield
        share = share_in_words(worst, "all requirements")
        lines.append(f"Yield: {share}. {RANDOM_SAMPLES}.")
    if contributions is not None and not unpredictable:
        lines.append(what_matters(contributions, limits))
    return lines


def _extremes(margins: xr.Dataset) -> list[str]:
    """Return which values of runs are nearest to bounds, or beyond them, if that was recorded."""
    sentences = []
    for k in range(margins.sizes["limit"]) if "run_value" in margins else ():
        limit = margins.isel(limit=k)
        output_unit = str(limit["unit"].values) if "unit" in limit.coords else ""
        unit = str(limit["stated_unit"].values) or output_unit
        sizes = (float(limit[name] / limit["stated_scale"]) for name in ("run_value", "run_bound"))
        value, bound = (with_unit(number(size), unit) for size in sizes)
        output = f" of {limit['output'].values}" if "output" in limit.coords else ""
        runs = number_of(MarginRecord.read(margins).runs_recorded, "run")
        extreme = f"The {limit['run_extreme'].values} value{output}"
        sentences.append(f"{extreme} in {runs} is {value} (limit {bound}).")
    return sentences


MOST = 4
"""Outputs or limits of which the input that matters most is told."""


def what_matters(contributions: xr.Dataset, limits: xr.Dataset | None) -> str:
    """Return which uncertain input matters most, for each of the checked limits if any."""
    if limits is not None and "width" in contributions:
        return _for_limit(contributions, limits)
    share = contributions["mean_share"]
    names = [name for name in band_tables.outputs_of(share) if varies(contributions, name)]
    if not names:
        return "No input matters: all outputs are constant."
    largest = [_largest(band_tables.select(share, name)) for name in names]
    first, part = largest[0]
    words = (
        f"without its uncertainty, the error bar would be {band_tables.percent(part)} narrower"
        f"{mean_share_text(contributions)}"
    )
    if len(names) == 1:
        return f"What matters most is {first}: {words}."
    some = [
        f"{input_} for {name} ({band_tables.percent(part)})"
        for name, (input_, part) in list(zip(names, largest, strict=True))[1:MOST]
    ]
    others = "; the report has the other outputs" if len(names) > MOST else ""
    return f"What matters most is {first} for {names[0]} ({words}), {', '.join(some)}{others}."


def varies(contributions: xr.Dataset, name: str) -> bool:
    """Return whether an output is not constant, as far as contributions tell it."""
    if "varies" not in contributions:
        return True
    return bool(band_tables.select(contributions["varies"], name).values.any())


def _for_limit(contributions: xr.Dataset, limits: xr.Dataset) -> str:
    """Return which input matters most for each limit, least margin in parts of a width first."""
    margins = []
    outputs = band_tables.outputs_of(contributions["mean_share"])
    count = limits.sizes["limit"]
    names = limits["output"].values if "output" in limits.coords else outputs[0]
    for k, name in enumerate(np.broadcast_to(names, count).astype(str).tolist()):
        if not varies(contributions, name if len(outputs) > 1 else outputs[0]):
            continue
        width = band_tables.select(contributions["width"], name)
        size = float(width.mean()) or np.inf
        margins.append((float(limits["least_margin"][k]) / size, k, name))
    if not margins:
        return "No input matters for the limits: their outputs are constant."
    largest = [
        (str(limits["limit"].values[k]), *_around(contributions, limits.isel(limit=k), name))
        for _, k, name in sorted(margins)[:MOST]
    ]
    (limit, first, part, where), *rest = largest
    others = "".join(
        f"; for {name}, it is {input_} ({band_tables.percent(part)})"
        for name, input_, part, _ in rest
    )
    remark = "; there are further limits" if len(margins) > MOST else ""
    return (
        f"What matters most for the limit {limit} is {first}: without its uncertainty, the error "
        f"bar would be {band_tables.percent(part)} narrower{where}{others}{remark}."
    )


def _around(contributions: xr.Dataset, limit: xr.Dataset, name: str) -> tuple[str, float, str]:
    """Return the input that matters most around a limit's least margin, its share, and where."""
    input_, share, at = largest_around(contributions, limit, name)
    if at is None:
        return input_, share, mean_share_text(contributions)
    last = contributions["width"][contributions["width"].dims[-1]]
    unit = unit_of_variable(last, ("s" if last.name == "time" else ""))
    where = f" around {f'{last.name} {number(at)} {unit}'.rstrip()}, where its margin is least"
    return input_, share, where


def _largest(share: xr.DataArray) -> tuple[str, float]:
    largest = share.max([dim for dim in share.dims if dim != "name"])
    best = int(np.argmax(largest.values))
    return str(share["name"].values[best]), float(largest[best])
