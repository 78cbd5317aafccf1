"""The lines below the verdicts, on the screen and on the page: how likely, how accurate, and why.

One line each; what is behind them stands in the report, and on the screen with --verbose.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from flexband.analysis.limits.least_margin import MarginRecord
from flexband.analysis.limits.limit_verdicts import LimitCheck
from flexband.analysis.probability.texts import chance, share_in_words, worst_chance
from flexband.basics.words import number_of
from flexband.report.text import band_tables
from flexband.report.text.doubts import doubt_line, doubt_text
from flexband.report.text.numbers import number, percent
from flexband.requirements.requirement import with_unit
from flexband.requirements.verdict import RequirementVerdict
from flexband.study.results.reliability import Doubt

MOST = 4
"""Outputs or requirements of which the input that matters most is told."""

RANDOM_SAMPLES = (
    "The yield is not the worst case: with equal weights and a linear output, 1000 random samples "
    "reach 90, 76, 56 and 40 % of the worst case for 3, 5, 10 and 20 tolerances"
)
"""Stands where worst case and yield do."""


def headline(
    doubts: Sequence[Doubt],
    verdicts: Sequence[RequirementVerdict],
    bands: xr.Dataset,
    verification: xr.Dataset | None,
    contributions: xr.Dataset | None,
    check: LimitCheck | None,
    *,
    unpredictable: str = "",
) -> list[str]:
    """Return doubts, the yield or the probability, the accuracy, and what matters most.

    Bands and contributions, of uncertain inputs alone, are in display units. What is
    `unpredictable` says from when on bands do not hold.
    """
    lines = [unpredictable] if unpredictable else [doubt_line(doubt) for doubt in doubts]
    lines += _likelihood(check, doubts)
    if not unpredictable:
        lines.append(band_tables.accuracy_line(bands, verification))
        if contributions is not None:
            lines.append(what_matters(contributions, verdicts))
    return lines


def background(check: LimitCheck | None) -> list[str]:
    """Return what is behind a yield: what it leaves out, and the worst case's probability."""
    if check is None or check.production is None:
        return []
    if check.probability is None:
        return [RANDOM_SAMPLES]
    of_any = check.probability.isel(limit=-1)
    return [RANDOM_SAMPLES, f"Probability of violating a requirement at any time: {chance(of_any)}"]


def _likelihood(check: LimitCheck | None, doubts: Sequence[Doubt]) -> list[str]:
    """Return the yield, or else the probability for the worst tolerances; none without either."""
    if check is None:
        return []
    reasons = [doubt_text(doubt) for doubt in doubts if doubt.rare_values]
    if check.probability is not None and reasons:
        return [" ".join([f"No probability: {reasons[0]}.", *_extremes(check.margins)])]
    if check.production is not None:
        of_all = check.production.isel(limit=-1)
        worst = of_all.isel(bound=-1) if "bound" in of_all.dims else of_all
        return [f"Yield: {share_in_words(worst, 'all requirements')}."]
    if check.probability is None:
        return []
    of_any = check.probability.isel(limit=-1)
    worst = ", for the worst tolerances" if "probability_at" in of_any else ""
    return [f"Probability of violating a requirement at any time{worst}: {worst_chance(of_any)}."]


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


def what_matters(contributions: xr.Dataset, verdicts: Sequence[RequirementVerdict]) -> str:
    """Return which uncertain input matters most, for each requirement, or else each output."""
    required = [
        (verdict.name, verdict.input, verdict.input_share)
        for verdict in verdicts
        if verdict.input and verdict.input_share > 0
    ]
    shares = required or _shares_of_outputs(contributions)
    if not shares:
        return "No input matters: all outputs are constant."
    texts = [
        f"{input_}{f' for {name}' if len(shares) > 1 else ''} ({percent(share)})"
        for name, input_, share in shares[:MOST]
    ]
    texts[0] = f"{texts[0][:-1]} of the width)"
    others = ", …" if len(shares) > MOST else ""
    return f"What matters most: {', '.join(texts)}{others}."


def _shares_of_outputs(contributions: xr.Dataset) -> list[tuple[str, str, float]]:
    """Return each output that varies, the input that matters most for it, and its share."""
    shares = []
    for name in band_tables.outputs_of(contributions["mean_share"]):
        if varies(contributions, name):
            share = band_tables.select(contributions["mean_share"], name)
            largest = share.max([dim for dim in share.dims if dim != "name"])
            best = int(np.argmax(largest.values))
            shares.append((name, str(share["name"].values[best]), float(largest[best])))
    return shares


def varies(contributions: xr.Dataset, name: str) -> bool:
    """Return whether an output is not constant, as far as contributions tell it."""
    if "varies" not in contributions:
        return True
    return bool(band_tables.select(contributions["varies"], name).values.any())
