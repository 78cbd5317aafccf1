"""Probabilities of violating limits, and shares of parts, in words."""

from __future__ import annotations

import numpy as np
import xarray as xr

from flexband.analysis.labelled_answers import AnswerRecord
from flexband.analysis.limits.least_margin import inputs_in_words
from flexband.analysis.probability.statements import ANYTHING, BETWEEN
from flexband.basics.words import number_of

NOT_GIVEN = "not given"
"""What stands in place of a probability of a surrogate that missed its tolerance."""


def in_words(result: xr.Dataset) -> str:
    """Return the probability of violating one requirement as a sentence."""
    text = f"{result['limit'].values}: violated with {chance(result, places=True)}"
    if np.isnan(result["between_times"]).any():
        return text
    tighter, alone = (float(result[k][1]) for k in ("limit_tighter", "surrogate_probability"))
    low, high = (float(result[k][1]) for k in BETWEEN[1:])
    if "runs" in result:
        text += f", corrected with {number_of(int(result['runs'][1]), 'run')} of the model"
        text += " each" if _differs(result) else ""
    elif alone and not result["probability"][1] and (low, high) != ANYTHING:
        text += (
            f"; the surrogate alone finds {_percent(alone, 2)}, too rare to be trusted without "
            "runs of the model (response=…, --runs 64)"
        )
    elif tighter > 0 and (low, high) != ANYTHING:
        clear_increase = _clearly_more(tighter, float(result["between_times"][1]))
        increase = f"up to {_percent(tighter, 2)}" if clear_increase else "hardly more"
        text += f"; {increase} with what the surrogate may miss"
    return text


def verdict_on(result: xr.Dataset) -> str:
    """Return the probabilities of violating all limits, and doubts about them, as sentences."""
    words = [in_words(result.isel(limit=k)) for k in range(result.sizes["limit"])]
    return ". ".join(
        [*words, *np.atleast_1d(AnswerRecord.read(result).doubts).astype(str).tolist()]
    )


def chance(result: xr.Dataset, *, places: bool = False) -> str:
    """Return the bounds of the probability of a violation, with their confidence: "P ≤ 0.02 %".

    With `places`, it has the values of the interval inputs at the bounds.
    """
    values, low, high = (result[k].values for k in BETWEEN)
    if np.isnan(values).any():
        return (
            f"P {NOT_GIVEN}, since the surrogate missed its tolerance; runs of the model correct it"
        )
    where = [_place(result.isel(bound=k)) if places else "" for k in range(len(values))]
    if (low[-1], high[-1]) == ANYTHING:
        ends = [f"{_percent(v)}{place}" for v, place in zip(values, where, strict=True)]
        differ = _differs(result) and ends[0] != ends[-1]
        return f"P {' to '.join(ends) if differ else ends[-1]} by the surrogate alone"
    sure = [
        f" (95 % confidence: {_percent(a)} to {_percent(b)})" if _percent(a) != _percent(b) else ""
        for a, b in zip(low, high, strict=True)
    ]
    text = f"P {_bounds(result, values, high, where, sure)}"
    at_times = result["probability"].values
    if _clearly_more(values, at_times).any():
        none = [""] * len(values)
        bounds_text = _bounds(result, at_times, result["confidence_high"].values, none, none)
        text += f"; at the output times alone, P {bounds_text}"
    return text


def worst_chance(result: xr.Dataset) -> str:
    """Return the largest probability over all values of the interval inputs, as `chance` does."""
    return chance(result.isel(bound=[-1]))


def _clearly_more(value: np.ndarray | float, other: np.ndarray | float) -> np.ndarray:
    """Return where a probability is so much larger than another that both are stated."""
    return np.asarray(value) > 1.02 * np.asarray(other)


def _bounds(result: xr.Dataset, values: np.ndarray, high: np.ndarray, *details: list[str]) -> str:
    """Return both bounds as text, the largest alone if they are the same, or none is stated.

    `details` tell where each bound is, and its confidence interval if it is not zero.
    """
    if not values[-1]:
        return f"≤ {_percent(high[-1], 2)}{details[0][-1]}"
    lower, upper = (
        f"{_percent(values[k])}{''.join(texts[k] for texts in details)}" for k in (0, -1)
    )
    if not _differs(result) or lower == upper:
        return f"= {upper}"
    return f"= {lower} to {upper}" if values[0] else f"≤ {upper}"


def _percent(part: float, digits: int = 3) -> str:
    return f"{100 * part:.{digits}g} %"


def _differs(result: xr.Dataset) -> bool:
    return "probability_at" in result or "probability_choice" in result


def bound_text(result: xr.Dataset) -> str:
    """Return the text of a bound of a probability, with its interval, or how large it may be."""
    value, low, high = (float(result[k]) for k in BETWEEN)
    if np.isnan(value):
        return NOT_GIVEN
    if (low, high) == ANYTHING:
        return f"{_percent(value)} by the surrogate alone"
    interval = f" ({_percent(low)} to {_percent(high)})"
    return f"{_percent(value)}{interval}" if value else f"≤ {_percent(high, 2)}"


def _place(result: xr.Dataset) -> str:
    words = [str(result["probability_choice"].values)] if "probability_choice" in result else []
    if "probability_at" in result:
        words += inputs_in_words(result, "probability_at")
    return f" at {', '.join(words)}" if words else ""


LONG_NAMES = {
    "probability": "probability of violating the limit at any of the output times",
    "confidence_low": "lower end of its 95 % confidence interval",
    "confidence_high": "upper end of its 95 % confidence interval",
    "limit_looser": "probability with the limit looser by what the surrogate may miss",
    "limit_tighter": "probability with the limit tighter by what the surrogate may miss",
    "between_times": "probability of violating the limit at or between the output times",
    "between_times_low": "lower end of the interval that holds it",
    "between_times_high": "upper end of the interval that holds it",
    "samples": "samples of the surrogate",
    "runs": "runs of the response that correct the probability",
    "disagreements": "runs in which the corrected surrogate was wrong about the limit",
    "surrogate_probability": "probability of the surrogate alone",
    "at_each_time": "probability of being outside the limit at each time",
    "at_each_time_low": "lower end of its 95 % confidence interval",
    "at_each_time_high": "upper end of its 95 % confidence interval",
    "at_each_time_at": "values of the interval inputs at the bounds at each time",
    "probability_at": "values of the interval inputs at the bounds of the probability",
    "probability_choice": "options at the bounds of the probability",
    "bound": "bound over all values of the interval inputs",
}


def with_texts(result: xr.Dataset) -> xr.Dataset:
    """Give every variable a `long_name`, and probabilities the unit 1."""
    for name, words in LONG_NAMES.items():
        if name in result.variables:
            result[name].attrs.update(long_name=words)
            if name not in ("bound", "probability_choice") and not name.endswith("_at"):
                result[name].attrs.update(units="1")
    return result


def share_in_words(production: xr.Dataset, what: str = "it") -> str:
    """Return which share of the parts meets `what`, with its interval."""
    share, interval = share_and_interval(production)
    if not share:
        return "no yield, since the accuracy target was missed; runs of the model correct it"
    confidence = f"{100 * production.attrs.get('confidence', 0.95):g} % confidence"
    sure = f" ({confidence}: {interval})" if interval else ""
    runs = int(production["runs"]) if "runs" in production else 0
    corrected = f", corrected with {number_of(runs, 'run')} of the model" if runs else ""
    return f"{share} of the parts meet {what}{sure}{corrected}"


def share_and_interval(production: xr.Dataset) -> tuple[str, str]:
    """Return which share of the parts meets a requirement, "" if withheld, and its interval.

    There is no interval where no sample fails: the share is more than something then.
    """
    value, low, high = (float(production[k]) for k in ("failing", "failing_low", "failing_high"))
    if np.isnan(value):
        return "", ""
    if not value:
        return f"more than {_share(1 - high)}", ""
    return _share(1 - value), f"{_share(1 - high)} to {_share(1 - low)}"


def _share(part: float) -> str:
    """Return a share near 1 in per cent, with two digits of what is missing of it, of four most."""
    missing = 100 * (1 - part)
    max_percent = 99.9999
    if missing <= 0:
        return "100 %"
    digits = min(max(0, 1 - int(np.floor(np.log10(missing)))), 4)
    text = f"{min(100 * part, max_percent):.{digits}f}"
    return f"{text.rstrip('0').rstrip('.') if '.' in text else text} %"
