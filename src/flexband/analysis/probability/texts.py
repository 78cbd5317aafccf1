"""Probabilities of leaving limits, and shares of parts, in words."""

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
    """Return the probability of leaving one limit as a sentence."""
    if np.isnan(result["between_times"]).any():
        return f"{result['limit'].values}: the probability of leaving it is {chance(result)}"
    tighter, alone = (float(result[k][1]) for k in ("limit_tighter", "surrogate_probability"))
    low, high = (float(result[k][1]) for k in BETWEEN[1:])
    text = f"{result['limit'].values}: left with probability {chance(result, places=True)}"
    if "runs" in result:
        text += f", corrected with {number_of(int(result['runs'][1]), 'run')} of the model"
        text += " each" if _differs(result) else ""
    elif alone and not result["probability"][1] and (low, high) != ANYTHING:
        text += (
            f"; the surrogate alone finds {alone:.2g}, too rare to be trusted without runs of the "
            f"model (response=…, --runs 64)"
        )
    elif tighter > 0 and (low, high) != ANYTHING:
        clear_increase = _clearly_more(tighter, float(result["between_times"][1]))
        increase = f"up to {tighter:.2g}" if clear_increase else "hardly more"
        text += f"; {increase} with what the surrogate may miss"
    return text


def verdict_on(result: xr.Dataset) -> str:
    """Return the probabilities of leaving all limits, and doubts about them, as sentences."""
    words = [in_words(result.isel(limit=k)) for k in range(result.sizes["limit"])]
    return ". ".join(
        [*words, *np.atleast_1d(AnswerRecord.read(result).doubts).astype(str).tolist()]
    )


def chance(result: xr.Dataset, *, places: bool = False) -> str:
    """Return the bounds of the probability of leaving a limit, with their confidence, as text.

    With `places`, it has the values of the interval inputs at the bounds.
    """
    values, low, high = (result[k].values for k in BETWEEN)
    if np.isnan(values).any():
        return (
            f"{NOT_GIVEN}, since the surrogate missed its tolerance; runs of the model correct it"
        )
    where = [_place(result.isel(bound=k)) if places else "" for k in range(2)]
    if (low[-1], high[-1]) == ANYTHING:
        lower, upper = (f"{v:.3g}{place}" for v, place in zip(values, where, strict=True))
        bounds = f"from {lower} to {upper}" if _differs(result) and lower != upper else upper
        return f"{bounds} by the surrogate alone"
    sure = [
        f" (95 % confidence: {a:.3g} to {b:.3g})" if f"{a:.3g}" != f"{b:.3g}" else ""
        for a, b in zip(low, high, strict=True)
    ]
    text = _bounds(result, values, high, where, sure)
    at_times = result["probability"].values
    if _clearly_more(values, at_times).any():
        none = ["", ""]
        bounds_text = _bounds(result, at_times, result["confidence_high"].values, none, none)
        text += f"; at the output times alone, {bounds_text}"
    return text


def _clearly_more(value: np.ndarray | float, other: np.ndarray | float) -> np.ndarray:
    """Return where a probability is so much larger than another that both are stated."""
    return np.asarray(value) > 1.02 * np.asarray(other)


def _bounds(result: xr.Dataset, values: np.ndarray, high: np.ndarray, *details: list[str]) -> str:
    """Return both bounds as text, one of them if they are the same.

    `details` tell where each bound is, and its confidence interval if it is not zero.
    """
    rows = zip(values, high, *details, strict=True)
    lower, upper = (
        f"{v:.3g}{where}{sure}" if v else f"below {h:.2g}{where}" for v, h, where, sure in rows
    )
    return f"from {lower} to {upper}" if _differs(result) and lower != upper else upper


def _differs(result: xr.Dataset) -> bool:
    return "probability_at" in result or "probability_choice" in result


def bound_text(result: xr.Dataset) -> str:
    """Return the text of a bound of a probability, with its interval, or how large it may be."""
    value, low, high = (float(result[k]) for k in BETWEEN)
    if np.isnan(value):
        return NOT_GIVEN
    if (low, high) == ANYTHING:
        return f"{value:.3g} by the surrogate alone"
    return f"{value:.3g} ({low:.3g} to {high:.3g})" if value else f"below {high:.2g}"


def _place(result: xr.Dataset) -> str:
    words = [str(result["probability_choice"].values)] if "probability_choice" in result else []
    if "probability_at" in result:
        words += inputs_in_words(result, "probability_at")
    return f" at {', '.join(words)}" if words else ""


LONG_NAMES = {
    "probability": "probability of leaving the limit at any of the output times",
    "confidence_low": "lower end of its 95 % confidence interval",
    "confidence_high": "upper end of its 95 % confidence interval",
    "limit_looser": "probability with the limit looser by what the surrogate may miss",
    "limit_tighter": "probability with the limit tighter by what the surrogate may miss",
    "between_times": "probability of leaving the limit at any time, between the output times too",
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
    return f"{min(100 * part, max_percent):.{digits}f} %"
