"""How far claimed and true errors of bands are apart, case by case and as rates with intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from scipy.stats import binomtest

from benchmarks.accuracy.estimates import claimed_error
from benchmarks.honesty.problems import Bands

FACTOR = 5.0
"""Factor between claim and true error up to which a claim counts as right."""

LEAST = 2e-5
"""Of the width: smaller errors, claimed or true, count as this large."""

VISIBLE = 1e-3
"""Of the width: errors in time above this are compared with what is claimed there."""

OUTLYING = 2.0
"""Factor between true and pointwise error that few points in time may exceed."""

ROUND_OFF = 1e-9
"""Of an output's size: a narrower band counts as this wide."""

RESAMPLES = 2000
"""Number of random choices of cases that tell the interval of the rate in time."""


@dataclass(frozen=True)
class Outcome:
    """The result of a case.

    Attributes
    ----------
    runs : all evaluations of the response.
    true : the largest error of mean and error bar of all outputs, mean over time, in parts of the
        true error bar's mean width.
    claim : the same of the expected errors, or `told` if that is smaller.
    told : ``attrs["expansion_error"]``, which refers to the width of the bands that were found.
    visible, missed : points in time whose true error is above `VISIBLE`, and how many of these
        have a claim that is too small.
    points, visible_bars, exceeded : points in time of error bars, those whose true error is above
        `VISIBLE`, and how many of these have an error of more than `OUTLYING` times the
        `pointwise_error`.
    seconds : CPU time of the method.
    failure : the error's text, if the method failed.
    """

    family: str
    seed: int
    runs: int = 0
    true: float = np.nan
    claim: float = np.nan
    told: float = np.nan
    visible: int = 0
    missed: int = 0
    points: int = 0
    visible_bars: int = 0
    exceeded: int = 0
    seconds: float = np.nan
    failure: str = ""


def errors(found: xr.Dataset, truth: Bands) -> tuple[np.ndarray, np.ndarray]:
    """Return true and claimed errors in parts of the width, each (2, outputs, times).

    The first axis is mean and error bar. Bands without claims in time have NaN there.
    """
    (mean, bar), width = truth, widths(truth)
    true = []
    claim = []
    for name, exact in (("mean", mean), ("error_bar", bar)):
        own = found[name].transpose("bound", "output", "time").values
        true.append(np.abs(own - exact).mean(axis=0))
        told = claimed_error(found, name)
        told = xr.full_like(found[name][0], np.nan) if told is None else told
        claim.append(told.transpose("output", "time").values)
    return np.stack(true) / width[:, None], np.stack(claim) / width[:, None]


def widths(truth: Bands) -> np.ndarray:
    """Return the mean widths of the true error bars, at least those of round-off, (outputs,)."""
    bar = truth[1]
    size = np.sqrt((bar**2).mean(axis=(0, 2)))
    return np.maximum((bar[1] - bar[0]).mean(axis=-1), np.maximum(ROUND_OFF * size, 1e-300))


def outcome(
    family: str, seed: int, found: xr.Dataset, truth: Bands, seconds: float = np.nan
) -> Outcome:
    """Compare bands with the true ones."""
    true, claim = errors(found, truth)
    told = float(found.attrs.get("expansion_error", found.attrs["expected_error"]))
    visible = true > VISIBLE
    pointwise = np.full_like(true[1], np.inf)
    if "pointwise_error" in found:
        pointwise = found["pointwise_error"].transpose("output", "time").values
        pointwise = pointwise / widths(truth)[:, None]
    largest = float(claim.mean(axis=-1).max())
    return Outcome(
        family,
        seed,
        int(found.attrs["runs"]),
        float(true.mean(axis=-1).max()),
        float(np.nanmin([largest, told])),
        told,
        int(visible.sum()),
        int((visible & (true > FACTOR * claim)).sum()),
        true[1].size,
        int(visible[1].sum()),
        int((visible[1] & (true[1] > OUTLYING * pointwise)).sum()),
        seconds,
    )


@dataclass(frozen=True)
class Rate:
    """A part of the cases in per cent, with the ends of its 95 % interval."""

    name: str
    value: float
    lower: float
    upper: float
    required: str

    def __str__(self) -> str:
        span = f"{self.lower:.1f} to {self.upper:.1f}"
        return f"{self.name}: {self.value:.1f} % ({span}; required: {self.required})"


def too_small(one: Outcome) -> bool:
    """Return whether the claim is too small by more than the factor."""
    return not one.failure and max(one.true, LEAST) > FACTOR * max(one.claim, LEAST)


def false(one: Outcome, tolerance: float) -> bool:
    """Return whether the claim is below the tolerance and the true error far above it."""
    return one.claim < tolerance and one.true > FACTOR * tolerance


def right(one: Outcome, tolerance: float) -> bool:
    """Return whether the claim is within the factor, or both errors are below the tolerance.

    Of a method that failed it is not.
    """
    if one.failure:
        return False
    claim = max(one.claim, LEAST)
    true = max(one.true, LEAST)
    near = claim <= FACTOR * true and true <= FACTOR * claim
    return near or (claim <= tolerance and true <= tolerance)


def rates(outcomes: Sequence[Outcome], tolerance: float) -> list[Rate]:
    """Return the required rates. Where the method failed, the claim counts as not right."""
    done = [one for one in outcomes if not one.failure]
    counted = [
        rate(f"claims too small by {FACTOR:g}", [too_small(o) for o in done], "at most 3 %"),
        rate(
            f"claims below the tolerance, true error {FACTOR:g} times above it",
            [false(one, tolerance) for one in done],
            "at most 1 %",
        ),
        rate(
            f"claims within a factor {FACTOR:g}, or rightly below the tolerance",
            [right(one, tolerance) for one in outcomes],
            "90 %",
        ),
    ]
    return [*counted, *_in_time(done)] if done else []


def rate(name: str, hits: Sequence[bool], required: str) -> Rate:
    """Return how often something is so."""
    test = binomtest(sum(hits), max(len(hits), 1))
    span = test.proportion_ci(method="exact")
    return Rate(name, *(100 * v for v in (test.statistic, span.low, span.high)), required)


def _in_time(done: Sequence[Outcome]) -> list[Rate]:
    """Return shares of points in time with wrong claims; cases are resampled."""
    above = f"points in time with errors above {100 * VISIBLE:g} %"
    twice = f"above {OUTLYING:g} times the pointwise error"
    kinds = [
        (f"{above} and claims too small by {FACTOR:g}", "missed", "visible", "at most 5 %"),
        (f"{above}, and {twice}", "exceeded", "visible_bars", "at most 10 %"),
        (f"points in time with errors {twice}", "exceeded", "points", "at most 10 %"),
    ]
    chosen = np.random.default_rng(0).integers(len(done), size=(RESAMPLES, len(done)))
    found = []
    for name, part, whole, required in kinds:
        counts = np.array([(getattr(one, part), getattr(one, whole)) for one in done])
        top, all_points = np.moveaxis(counts[chosen].sum(axis=1), -1, 0)
        shares = np.quantile(top / np.maximum(all_points, 1), [0.025, 0.975])
        value = counts[:, 0].sum() / max(counts[:, 1].sum(), 1)
        found.append(Rate(name, *(100 * float(v) for v in (value, *shares)), required))
    return found
