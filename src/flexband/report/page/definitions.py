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
        "probability": "probability of violating the limit at any time of the motion, over the "
        "random inputs; its lowest and highest values are over all values of the interval inputs",
        "95 % confidence": "confidence interval of a probability that is estimated by sampling the "
        "surrogate; it does not include the error of the surrogate",
    }
    margin = (
        "distance of μ ± {} from the limit, for all values of the interval inputs; below zero the "
        "limit is violated. It may be smaller between the output times"
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
        "nominal": "response with every interval at its midpoint and every random input at its "
        "mean, or at its median if it is a LogNormal or has heavy tails",
        "expected error": "estimated error of the ends of an error bar. Percentages are relative "
        "to the width of the bar, or to its mean width over time. Below a chart it is the error at "
        "the cursor; in what if and in ranges, the largest. It is estimated by runs that were not "
        "fitted, and by runs with half the step and twice the elements",
        "confirmed": "whether verification runs, most of them at the worst tolerances, agree with "
        "the expected error; they are few, so rare effects may remain undetected",
        "matters": "how much narrower the error bar is with the input at its nominal value, "
        "relative to its width, or to its mean width over time",
        "interval": "an input of which only a lower and an upper bound are known",
        "random field": "a random property that varies with the position",
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
