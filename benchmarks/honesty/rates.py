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


def errors(band_set: xr.Dataset, truth: Bands) -> tuple[np.ndarray, np.ndarray]:
    """Return true and claimed errors in parts of the width, each (2, outputs, times).

    The first axis is mean and error bar. Bands without claims in time have NaN there.
    """
    (mean, bar), width = truth, widths(truth)
    true = []
    claim = []
    for name, exact in (("mean", mean), ("error_bar", bar)):
        band = band_set[name].transpose("bound", "output", "time").values
        true.append(np.abs(band - exact).mean(axis=0))
        expected = claimed_error(band_set, name)
        expected = xr.full_like(band_set[name][0], np.nan) if expected is None else expected
        claim.append(expected.transpose("output", "time").values)
    return np.stack(true) / width[:, None], np.stack(claim) / width[:, None]


def widths(truth: Bands) -> np.ndarray:
    """Return the mean widths of the true error bars, at least those of round-off, (outputs,)."""
    bar = truth[1]
    size = np.sqrt((bar**2).mean(axis=(0, 2)))
    return np.maximum((bar[1] - bar[0]).mean(axis=-1), np.maximum(ROUND_OFF * size, 1e-300))


def outcome(
    family: str, seed: int, band_set: xr.Dataset, truth: Bands, seconds: float = np.nan
) -> Outcome:
    """Compare bands with the true ones."""
    true, claim = errors(band_set, truth)
    expected_error = float(band_set.attrs.get("expansion_error", band_set.attrs["expected_error"]))
    visible = true > VISIBLE
    pointwise = np.full_like(true[1], np.inf)
    if "pointwise_error" in band_set:
        pointwise = band_set["pointwise_error"].transpose("output", "time").values
        pointwise = pointwise / widths(truth)[:, None]
    largest = float(claim.mean(axis=-1).max())
    return Outcome(
        family,
        seed,
        int(band_set.attrs["runs"]),
        float(true.mean(axis=-1).max()),
        float(np.nanmin([largest, expected_error])),
        expected_error,
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


def too_small(result: Outcome) -> bool:
    """Return whether the claim is too small by more than the factor."""
    return not result.failure and max(result.true, LEAST) > FACTOR * max(result.claim, LEAST)


def false(result: Outcome, tolerance: float) -> bool:
    """Return whether the claim is below the tolerance and the true error far above it."""
    return result.claim < tolerance and result.true > FACTOR * tolerance


def right(result: Outcome, tolerance: float) -> bool:
    """Return whether the claim is within the factor, or both errors are below the tolerance.

    Of a method that failed it is not.
    """
    if result.failure:
        return False
    claim = max(result.claim, LEAST)
    true = max(result.true, LEAST)
    within_factor = claim <= FACTOR * true and true <= FACTOR * claim
    return within_factor or (claim <= tolerance and true <= tolerance)


def rates(outcomes: Sequence[Outcome], tolerance: float) -> list[Rate]:
    """Return the required rates. Where the method failed, the claim counts as not right."""
    successes = [result for result in outcomes if not result.failure]
    case_rates = [
        rate(f"claims too small by {FACTOR:g}", [too_small(o) for o in successes], "at most 3 %"),
        rate(
            f"claims below the tolerance, true error {FACTOR:g} times above it",
            [false(result, tolerance) for result in successes],
            "at most 1 %",
        ),
        rate(
            f"claims within a factor {FACTOR:g}, or rightly below the tolerance",
            [right(result, tolerance) for result in outcomes],
            "90 %",
        ),
    ]
    return [*case_rates, *_in_time(successes)] if successes else []


def rate(name: str, hits: Sequence[bool], required: str) -> Rate:
    """Return how often something is so."""
    test = binomtest(sum(hits), max(len(hits), 1))
    span = test.proportion_ci(method="exact")
    return Rate(name, *(100 * v for v in (test.statistic, span.low, span.high)), required)


def _in_time(successes: Sequence[Outcome]) -> list[Rate]:
    """Return shares of points in time with wrong claims; cases are resampled."""
    above = f"points in time with errors above {100 * VISIBLE:g} %"
    twice = f"above {OUTLYING:g} times the pointwise error"
    kinds = [
        (f"{above} and claims too small by {FACTOR:g}", "missed", "visible", "at most 5 %"),
        (f"{above}, and {twice}", "exceeded", "visible_bars", "at most 10 %"),
        (f"points in time with errors {twice}", "exceeded", "points", "at most 10 %"),
    ]
    resamples = np.random.default_rng(0).integers(len(successes), size=(RESAMPLES, len(successes)))
    rates_in_time = []
    for name, part, total, required in kinds:
        counts = np.array([(getattr(result, part), getattr(result, total)) for result in successes])
        top, all_points = np.moveaxis(counts[resamples].sum(axis=1), -1, 0)
        shares = np.quantile(top / np.maximum(all_points, 1), [0.025, 0.975])
        value = counts[:, 0].sum() / max(counts[:, 1].sum(), 1)
        rates_in_time.append(Rate(name, *(100 * float(v) for v in (value, *shares)), required))
    return rates_in_time
