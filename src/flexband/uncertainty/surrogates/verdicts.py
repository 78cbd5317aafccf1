"""What new runs say of a surrogate, in words."""

from __future__ import annotations

import numpy as np
import xarray as xr

from flexband.uncertainty.inputs.evaluation import extremes_in_words
from flexband.uncertainty.surrogates.axes import axes_of
from flexband.uncertainty.surrogates.diagnostics import unseen
from flexband.words import number_of

CONFIRMED = "Confirmed"
"""Beginning of a verdict that the expected error is right."""


def verdict(
    checked: xr.Dataset, labels: xr.DataArray, good: np.ndarray, sampled: int, held_out: int
) -> dict[str, str]:
    """Return the attributes "confirmed" and "verdict".

    Parameters
    ----------
    good : the runs that did not fail.
    sampled, held_out : numbers of these runs, and of runs of the method, that are samples of the
        whole space.
    """
    attrs = _verdict(checked, labels, good)
    return attrs | {"verdict": f"{attrs['verdict']}. {_can_miss(sampled, held_out)}"}


def _can_miss(sampled: int, held_out: int) -> str:
    """Return the sentence on how much of the space such runs can all miss."""
    if not sampled + held_out:
        return "Effects elsewhere in the space of the inputs are not included"
    counts = {"new run": sampled, "held-out run": held_out}
    spread = " and ".join(number_of(count, noun) for noun, count in counts.items() if count)
    return (
        f"Effects in {in_percent(unseen(sampled + held_out))} of the space of the inputs or less "
        f"may not be included: {spread}, spread over all of it, can miss them"
    )


def _verdict(checked: xr.Dataset, labels: xr.DataArray, good: np.ndarray) -> dict[str, str]:
    failed = checked.sizes["sample"] - len(good)
    bounds = sum(place != "anywhere" for place in checked["run_place"].values[good].tolist())
    left_out = f" ({failed} more failed, and what fails is rarely random)" if failed else ""
    new = f"{number_of(len(good), 'new run')}{left_out}, {bounds} of them at the ends of the bands,"
    are, imply = ("is", "implies") if len(good) == 1 else ("are", "imply")
    width, implied, least = (
        np.ravel(checked[k]) for k in ("bar_width", "implied_error", "least_error")
    )
    share = implied / width
    most = int(share.argmax())
    if "allowed" not in checked:
        unknown = "the method does not estimate the error of its expansion"
        text = (
            f"{new} {imply} an error of {in_percent(share[most])} of the error bar's width; "
            f"{unknown}"
        )
        return {"confirmed": "no error was expected", "verdict": text}
    expected = np.ravel(checked["expected_error"])
    ratio = implied / expected
    wrong = np.flatnonzero(~np.ravel(checked["confirmed"].values))
    if not wrong.size:
        doubtful = bool(ratio.max() > 1)
        k = int(ratio.argmax()) if doubtful else most
        size = f"{in_percent(share[k])} of the error bar's width{_named(labels, k)}"
        text = (
            f"{CONFIRMED}: {new} {are} missed by no more than expected; the largest error that "
            f"follows is {size}"
        )
        if (claim := float((expected / width).max())) > share[k]:
            text += f"; the runs of the method imply {in_percent(claim)}"
        if doubtful:
            over = " (both are root mean squares over time)" if labels.ndim > 1 else ""
            sure = f"{100 * checked.attrs['confidence']:.0f} % confidence"
            text = (
                f"{CONFIRMED} as far as so few runs can tell: {new} {imply} an error of {size} "
                f"({in_percent(least[k] / width[k])} or more with {sure}), where "
                f"{in_percent(expected[k] / width[k])} is expected{over}"
            )
        return {"confirmed": "yes", "verdict": text}
    worst = int(wrong[ratio[wrong].argmax()])
    text = (
        f"NOT confirmed: {new} {are} missed by {ratio[worst]:.2g} times as much as the expected "
        f"error allows, {_where(checked, labels, worst)}; bands may be off by "
        f"{in_percent(share[worst])} of the error bar's width. If the expected error were right, "
        f"less than {in_percent(1 - checked.attrs['confidence'])} of verifications would find so "
        "much"
    )
    if wrong.size > 1:
        text += f". Outputs that are not confirmed: {wrong.size} of {len(ratio)}"
    return {"confirmed": "no", "verdict": text}


def of_doubtful(verdict: str) -> str:
    """Return the verdict on a result that is doubtful for other reasons: both have to be read.

    New runs judge the expected error alone, which may be right and yet far too large.
    """
    if not verdict.startswith(CONFIRMED):
        return verdict
    return f"The result is doubtful, but its expected error is confirmed{verdict[len(CONFIRMED) :]}"


def implied_error(checked: xr.Dataset) -> float:
    """Return the largest error that new runs imply, in parts of the error bar's width."""
    return float((checked["implied_error"] / checked["bar_width"]).max())


def _where(checked: xr.Dataset, labels: xr.DataArray, output: int) -> str:
    """Return in words where an output is missed most: output, time and inputs."""
    dims, sizes, last, _ = axes_of(labels)
    index = dict(zip(dims, np.unravel_index(output, sizes) if dims else (), strict=True))
    names, output_results = _names(labels, output), checked.isel(index)
    words = [f"most in {', '.join(names)}"] if names else ["most"]
    if last is not None:
        at = int(output_results["missed_most_at"])
        stamp = labels[last].values[at] if last in labels.coords else at
        number = f"{stamp:.4g}" if isinstance(stamp, int | float | np.number) else str(stamp)
        unit = labels[last].attrs.get("units", "") if last in labels.coords else ""
        words.append(f"at {last} {number} {unit}".rstrip())
    if "run_values" in checked:
        values = zip(checked["input"].values, checked["run_values"].values, strict=True)
        words.append(
            "with " + extremes_in_words(dict(values), int(output_results["missed_most_in"]), 6)
        )
    return " ".join(words)


def _names(labels: xr.DataArray, output: int) -> list[str]:
    """Return the labels of an output, by its number."""
    dims, shape, *_ = axes_of(labels)
    places = np.unravel_index(output, shape) if dims else ()
    return [
        str(labels[d].values[k]) if d in labels.coords else f"{d} {k}"
        for d, k in zip(dims, places, strict=True)
    ]


def _named(labels: xr.DataArray, output: int) -> str:
    """Return " for y", or nothing where there is one output only."""
    several = np.prod(axes_of(labels).shape) > 1
    return f" for {', '.join(_names(labels, output))}" if several else ""


def in_percent(part: float) -> str:
    """Return a part in per cent; of huge ones only that they are."""
    huge = 10.0  # larger parts of the error bar's width are not told, since it has none
    return f"{100 * part:.2g} %" if part < huge else f"more than {100 * huge:.0f} %"
