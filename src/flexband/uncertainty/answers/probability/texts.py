"""Probabilities of leaving limits in words."""

from __future__ import annotations

import xarray as xr


def in_words(one: xr.Dataset) -> str:
    """Return the probability of leaving one limit as a sentence."""
    lower, upper = (told(one.isel(bound=k)) for k in range(2))
    both = upper if "probability_at" not in one and "probability_choice" not in one else (
        f"from {lower}{_place(one.isel(bound=0))} to {upper}{_place(one.isel(bound=1))}"
    )  # fmt: skip
    tighter = float(one["limit_tighter"][1])
    text = f"{one['limit'].values}: left with probability {both}"
    if "runs" in one:
        text += f", corrected with {int(one['runs'][1])} runs of the model"
        text += " each" * (both != upper)
    elif tighter > 0:
        text += f"; up to {tighter:.2g} with the expected error of the surrogate"
    return text


def told(one: xr.Dataset) -> str:
    """Return a probability with its confidence interval as text, or its upper bound."""
    value, low, high = (float(one[k]) for k in ("probability", "confidence_low", "confidence_high"))
    return f"{value:.3g} ({low:.3g} to {high:.3g})" if value else f"below {high:.2g}"


def _place(one: xr.Dataset) -> str:
    words = [str(one["probability_choice"].values)] if "probability_choice" in one else []
    if "probability_at" in one:
        pairs = zip(one["input"].values, one["probability_at"].values, strict=True)
        words += [f"{name} = {value:.6g}" for name, value in pairs]
    return f" at {', '.join(words)}"


LONG_NAMES = {
    "probability": "probability of leaving the limit at any time",
    "confidence_low": "lower end of its 95 % confidence interval",
    "confidence_high": "upper end of its 95 % confidence interval",
    "limit_looser": "probability with the limit looser by the expected error of the surrogate",
    "limit_tighter": "probability with the limit tighter by the expected error of the surrogate",
    "between_times": "probability with parabolas through the peaks between the times",
    "samples": "samples of the surrogate",
    "runs": "runs of the response that correct the probability",
    "disagreements": "runs in which the corrected surrogate was wrong about the limit",
    "surrogate_probability": "probability of the surrogate, not corrected",
    "at_each_time": "probability of being outside the limit at each time",
    "at_each_time_low": "lower end of its 95 % confidence interval",
    "at_each_time_high": "upper end of its 95 % confidence interval",
    "at_each_time_at": "values of the interval inputs at the bounds at each time",
    "probability_at": "values of the interval inputs at the bounds of the probability",
    "probability_choice": "options at the bounds of the probability",
    "bound": "bound over all values of the interval inputs",
}


def described(result: xr.Dataset) -> xr.Dataset:
    """Give every variable a `long_name`, and probabilities the unit 1."""
    for name, words in LONG_NAMES.items():
        if name in result.variables:
            result[name].attrs["long_name"] = words
            if name not in ("bound", "probability_choice") and not name.endswith("_at"):
                result[name].attrs["units"] = "1"
    return result
