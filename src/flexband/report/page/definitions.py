"""The terms of a report with their meaning: those of what the study has."""

from __future__ import annotations

import xarray as xr

from flexband.report.text import band_tables
from flexband.report.text.drawable import bounds


def definitions(
    bands: xr.Dataset,
    inputs: band_tables.Table,
    limits: xr.Dataset | None,
    probability: xr.Dataset | None,
) -> list[tuple[str, str]]:
    """Return every term of the report with its meaning; `inputs` is their table."""
    chances = {
        "probability": "how likely the limit is left at any time of the motion, over the random "
        "inputs; the lower and the upper one are over all values of the interval inputs",
        "95 % confidence": "the interval that holds a probability, which is found by samples of "
        "the surrogate; what the surrogate misses is not in it",
    }
    margin = (
        "how far μ ± {} stays inside a limit, for all values of the interval inputs; below zero "
        "it is left. Between the output times it may be less"
    )
    moments = {
        "μ and σ": "mean and standard deviation over the random inputs, at values of the interval "
        "inputs",
    }
    # Kinds of inputs
    not_random = frozenset(
        ("constant", "interval", "interval field", "size", "compensator", "choice")
    )
    terms = {
        "nominal": "the response with every interval at its midpoint and every random input at its "
        "mean; at its median if it is a LogNormal or has heavy tails",
        "expected error": "the estimated accuracy of the ends of an error bar; in per cent: "
        "in parts of the width of the bar, over time in parts of its mean; below a chart: at the "
        "cursor; in what if and in ranges: the largest. It is found by runs that were not fitted, "
        "and by runs with half the step and twice the elements",
        "confirmed": "whether verification runs, most of them at the worst tolerances, agree with "
        "the expected error, as far as so few can tell",
        "matters": "by how much the error bar is narrower with the input at its nominal value, as "
        "a part of its width, over time as a part of its mean width",
        "interval": "all that is known of the input is that it is between two numbers",
        "random field": "a property that is random and varies with the position",
    }
    pairs = (text.split(": ", 1) for text in bounds(bands).values())
    kinds = {row[1] for row in inputs[1]}
    left_out = {kind for kind in ("interval", "random field") if kind not in kinds}
    meanings = {term.lower(): meaning for term, meaning in pairs}
    if kinds - not_random:
        meanings |= moments
    meanings |= {term: meaning for term, meaning in terms.items() if term not in left_out}
    if limits is not None:
        meanings["margin"] = margin.format(band_tables.deviations(limits))
    if probability is not None:
        meanings |= chances
    return list(meanings.items())
