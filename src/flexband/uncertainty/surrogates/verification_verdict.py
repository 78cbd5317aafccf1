"""What verification runs say of a surrogate: a verdict, and its words."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import xarray as xr

from flexband.basics.rounding import unit_of_variable
from flexband.basics.words import number_of
from flexband.uncertainty.inputs.evaluation import extremes_in_words
from flexband.uncertainty.surrogates.axes import axes_of
from flexband.uncertainty.surrogates.bands import AttributeRecord
from flexband.uncertainty.surrogates.diagnostics import unnoticed_text


class Confirmation(StrEnum):
    """Whether verification runs confirm the expected error of a surrogate."""

    CONFIRMED = "yes"
    REFUTED = "no"
    NOT_ESTIMATED = "no error was expected"


@dataclass(frozen=True)
class VerificationRecord(AttributeRecord):
    """What a result of `verify` says beside its numbers.

    Attributes
    ----------
    runs, runs_failed : numbers of runs.
    sigmas : k of the error bar that is verified.
    confirmed : "yes", "no" or "no error was expected", see `Confirmation`.
    inferred_share : error that the runs imply, relative to the error bar's width.
    verdict : the same in words.
    """

    runs: int = 0
    runs_failed: int = 0
    sigmas: float = 1.0
    confidence: float = 0.95
    confirmed: str = ""
    inferred_share: float = 0.0
    verdict: str = ""


@dataclass(frozen=True)
class VerificationVerdict:
    """A verdict of verification runs, and its numbers."""

    confirmation: Confirmation  # the verdict
    # numbers of runs that did not fail, that did, and at bounds
    runs: int
    failed_runs: int
    at_bounds: int
    # number of the output that decides: with the largest error of those that are refuted, of those
    # that may be, or of all
    output: int
    # errors of this output, relative to the error bar's width: inferred from the runs, a lower
    # bound with confidence, and what the method expected
    inferred_error: float
    lower_bound: float
    expected_error: float = np.nan
    # the largest error that the method expected of any output, relative to its width
    claimed_error: float = np.nan
    ratio: float = np.nan  # inferred over expected error of this output
    refuted_count: int = 0
    """Number of outputs whose expected error is not confirmed."""
    confidence: float = np.nan  # of `lower_bound`

    @staticmethod
    def from_runs(results: xr.Dataset, good_runs: np.ndarray) -> VerificationVerdict:
        """Return the verdict of the results of runs; `good_runs` are those that did not fail."""
        at_bounds = sum(
            place != "anywhere" for place in results["run_place"].values[good_runs].tolist()
        )
        counts = len(good_runs), results.sizes["sample"] - len(good_runs), at_bounds
        width, inferred_error, lower_bound = (
            np.ravel(results[k]) for k in ("bar_width", "implied_error", "least_error")
        )
        share = inferred_error / width
        lower_bound = lower_bound / width
        output = int(share.argmax())
        if "allowed" not in results:
            errors = float(share[output]), float(lower_bound[output])
            return VerificationVerdict(Confirmation.NOT_ESTIMATED, *counts, output, *errors)
        expected_error = np.ravel(results["expected_error"])
        ratio = inferred_error / expected_error
        refuted_outputs = np.flatnonzero(~np.ravel(results["confirmed"].values))
        if refuted_outputs.size:
            output = int(refuted_outputs[ratio[refuted_outputs].argmax()])
        elif ratio.max() > 1:
            output = int(ratio.argmax())
        claims = expected_error / width
        full_width = 1.0  # an output with a larger error than its bars are wide varies by rounding
        claimed_error = claims[claims < full_width].max(initial=0.0)
        return VerificationVerdict(
            Confirmation.REFUTED if refuted_outputs.size else Confirmation.CONFIRMED,
            *counts,
            output=output,
            inferred_error=float(share[output]),
            lower_bound=float(lower_bound[output]),
            expected_error=float(claims[output]),
            claimed_error=float(claimed_error),
            ratio=float(ratio[output]),
            refuted_count=refuted_outputs.size,
            confidence=VerificationRecord.read(results).confidence,
        )

    def in_words(self, results: xr.Dataset, labels: xr.DataArray) -> str:
        """Return the verdict as a sentence without its full stop."""
        failure_text = f" ({self.failed_runs} more failed, and what fails is rarely random)"
        runs = (
            f"{number_of(self.runs, 'verification run')}{failure_text if self.failed_runs else ''}"
            ", "
        )
        runs += f"{self.at_bounds} of them at the ends of the bands,"
        are, imply = ("is", "implies") if self.runs == 1 else ("are", "imply")
        if self.confirmation is Confirmation.NOT_ESTIMATED:
            return (
                f"{runs} {imply} an error of {in_percent(self.inferred_error)} of the error bar's "
                "width; the method does not estimate the error of its expansion"
            )
        if self.confirmation is Confirmation.REFUTED:
            text = (
                f"NOT confirmed: {runs} {are} missed by {self.ratio:.2g} times as much as the "
                f"expected error allows, {_where(results, labels, self.output)}; bands may be off "
                f"by {in_percent(self.inferred_error)} of the error bar's width. If the expected "
                f"error were right, less than {in_percent(1 - self.confidence)} of verifications "
                "would find so much"
            )
            outputs = (
                f". Outputs that are not confirmed: {self.refuted_count} of "
                f"{results['missed'].size}"
            )
            return text + outputs * (self.refuted_count > 1)
        size = f"{in_percent(self.inferred_error)} of the error bar's width"
        size += _output_text(labels, self.output)
        if self.ratio > 1:
            over = " (both are root mean squares over time)" if labels.ndim > 1 else ""
            confidence_text = f"{100 * self.confidence:.0f} % confidence"
            return (
                f"Estimate confirmed within the scatter of so few runs: {runs} {imply} an error of "
                f"{size} ({in_percent(self.lower_bound)} or more with {confidence_text}), where "
                f"{in_percent(self.expected_error)} is expected{over}"
            )
        text = (
            f"Estimate confirmed: {runs} {are} missed by no more than expected; the largest error "
            f"that follows is {size}"
        )
        claim = f"; the runs of the method imply {in_percent(self.claimed_error)}"
        return text + claim * (self.claimed_error > self.inferred_error)


def verdict(
    results: xr.Dataset, labels: xr.DataArray, good_runs: np.ndarray, sampled: int, held_out: int
) -> dict[str, str | float]:
    """Return attributes "confirmed", "verdict" and "inferred_share" of good runs.

    `sampled` and `held_out` count those of them, and of the runs of the method, that are samples of
    the whole space.
    """
    outcome = VerificationVerdict.from_runs(results, good_runs)
    return {
        "confirmed": outcome.confirmation.value,
        "inferred_share": outcome.inferred_error,
        "verdict": f"{outcome.in_words(results, labels)}. {_can_miss(sampled, held_out)}",
    }


def _can_miss(sampled: int, held_out: int) -> str:
    """Return the sentence on how much of the space such runs can all miss."""
    if not sampled + held_out:
        return "Effects elsewhere in the input space can go unnoticed"
    return unnoticed_text(sampled + held_out)


def inferred_share(results: xr.Dataset) -> float:
    """Return the largest error inferred from verification runs, relative to the bar's width."""
    return float((results["implied_error"] / results["bar_width"]).max())


def _where(results: xr.Dataset, labels: xr.DataArray, output: int) -> str:
    """Return in words where an output is missed most: output, time and inputs."""
    dims, sizes, last, _ = axes_of(labels)
    index = dict(zip(dims, np.unravel_index(output, sizes) if dims else (), strict=True))
    names = _names(labels, output)
    output_results = results.isel(index)
    words = [f"most in {', '.join(names)}"] if names else ["most"]
    if last is not None:
        at = int(output_results["missed_most_at"])
        stamp = labels[last].values[at] if last in labels.coords else at
        number = f"{stamp:.4g}" if isinstance(stamp, int | float | np.number) else str(stamp)
        unit = unit_of_variable(labels[last]) if last in labels.coords else ""
        words.append(f"at {last} {number} {unit}".rstrip())
    if "run_values" in results:
        values = zip(results["input"].values, results["run_values"].values, strict=True)
        words.append(
            "with " + extremes_in_words(dict(values), int(output_results["missed_most_in"]), 6)
        )
    return " ".join(words)


def _names(labels: xr.DataArray, output: int) -> list[str]:
    dims, shape, *_ = axes_of(labels)
    places = np.unravel_index(output, shape) if dims else ()
    return [
        str(labels[d].values[k]) if d in labels.coords else f"{d} {k}"
        for d, k in zip(dims, places, strict=True)
    ]


def _output_text(labels: xr.DataArray, output: int) -> str:
    """Return " for y", or nothing where there is one output only."""
    needs_name = np.prod(axes_of(labels).shape) > 1
    return f" for {', '.join(_names(labels, output))}" if needs_name else ""


def in_percent(part: float) -> str:
    """Return a part in per cent; of huge ones only that they are."""
    huge = 10.0  # larger parts of the error bar's width are not told, since it has none
    digits = ".2g" if part < 0.995 else ".0f"
    return f"{100 * part:{digits}} %" if part < huge else f"more than {100 * huge:.0f} %"
