"""The probability of being outside limits at each single time, as bounds over the intervals.

The values of the interval inputs are searched at each time on its own, with common weighted samples
around the rare samples at the ends of the probability of leaving limits at any time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from flexband.analysis.descent import lowest_over_times
from flexband.analysis.probability.ends import SMOOTH
from flexband.analysis.probability.estimates import Estimate, clear
from flexband.analysis.probability.importance import Mixture
from flexband.analysis.probability.states import LimitedOutputs, LimitState
from flexband.analysis.probability.subset import Rare
from flexband.analysis.sampled import SampledSeries
from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.expansions.threads import in_threads
from flexband.uncertainty.inputs.sampling import of_normals

SAMPLES, SEARCHED = 8000, 400
"""Samples for the probabilities, and for the search."""

AT_ONCE = 2**16
"""Values of the surrogate that are computed together."""

TOLERANCE, TINY = 1e-4, 1e-300
"""Relative gains of a search that count as none, and what is added to probabilities."""


@dataclass(frozen=True)
class _OutputMargins:
    """The margins of one output at its times, at fixed samples.

    Attributes
    ----------
    part, row : where the limits of the output are.
    psi : polynomials of the samples.
    weights : of the samples.
    """

    series: SampledSeries
    part: LimitedOutputs
    row: int
    psi: np.ndarray
    weights: np.ndarray

    def sums(self, eta: np.ndarray, times: np.ndarray, width: float) -> np.ndarray:
        """Return probabilities, and means of squared weights outside, shape (2, rows).

        Parameters
        ----------
        eta, times : shape (rows, m) and (rows,).
        width : what the step at the limit is smoothed by, in units of the margins; 0 for none.
        """
        sums = np.empty((2, len(eta)))
        powers = np.stack([self.weights, self.weights**2]) / len(self.weights)
        most = max(1, AT_ONCE // len(self.psi))

        def add_up(first: int) -> None:
            rows = slice(first, first + most)
            at = (self.row, times[rows], None)
            values = self.series.values(self.psi, eta[rows], times[rows])
            margins = np.minimum(values - self.part.lower[at], self.part.upper[at] - values)
            margins /= self.part.scale[at]
            sums[:, rows] = powers @ (ndtr(-margins / width) if width else margins < 0).T

        in_threads(add_up, range(0, len(eta), most))
        return sums

    def scanned(self, eta: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Return what is minimized: the logarithm of a smoothed probability, and minus it."""
        size = np.log(self.sums(eta, times, SMOOTH)[0] + TINY)
        return np.stack([size, -size])

    def __call__(self, eta: np.ndarray, which: np.ndarray) -> np.ndarray:
        """Return what is minimized, by the number of bound and time."""
        upper, times = np.divmod(which, self.part.series.shape[1])
        return self.scanned(eta, times)[upper, np.arange(len(eta))]


def at_each_time(
    state: LimitState,
    m: int,
    known: Sequence[Rare],
    ends: Sequence[Estimate],
    rng: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray]:
    """Return probabilities with their confidence intervals, (3, 2, series), and η, (2, series, m).

    Parameters
    ----------
    m : number of variables η.
    known, ends : rare samples and estimates at the least and the largest probability of leaving
        the limits at any time, which bound those at each time. If there are no such samples, the
        probabilities are zero, and η is that of the middle of the intervals.
    """
    most = np.array([estimate.confidence()[1] for estimate in ends])[:, None]
    if not any(len(rare_samples.u) for rare_samples in known):
        none = np.zeros((2, state.width))
        return np.stack([none, none, none + most]), np.zeros((*none.shape, m))
    mixture = Mixture.mean(*(Mixture.of(rare_samples.u, rng) for rare_samples in known))
    samples = [_weighted(mixture, state.families, count, rng) for count in (SEARCHED, SAMPLES)]
    probabilities, places = [], []
    for part in state.parts:
        for row, series in enumerate(SampledSeries.of_outputs(part.expansion)):
            few, many = (
                _OutputMargins(series, part, row, series.basis(xi), w) for xi, w in samples
            )
            times = part.series.shape[1]
            eta, _ = lowest_over_times(few.scanned, few, series.scanned, times, TOLERANCE)
            flat = eta.reshape(2 * times, -1)
            first, second = many.sums(flat, np.tile(np.arange(times), 2), 0.0)
            error = np.sqrt(np.maximum(second - first**2, 0) / SAMPLES)
            pair = np.minimum(first, 1.0).reshape(2, times), error.reshape(2, times)
            crossed = pair[0][0] > pair[0][1]  # which samples of the search could not tell apart
            pair = [np.where(crossed, bounds[::-1], bounds) for bounds in pair]
            probabilities.append(_ordered(np.stack(clear(pair[0], pair[1], most, most))))
            places.append(np.where(crossed[:, None], eta[::-1], eta))
    return np.concatenate(probabilities, axis=2), np.concatenate(places, axis=1)


def _ordered(probabilities: np.ndarray) -> np.ndarray:
    """Return probabilities and the ends of their intervals, (3, bound, times), in order.

    The upper bound is no less than the lower one, so that each tells of the other.
    """
    probabilities[:2, 1] = probabilities[:2].max(axis=1)
    probabilities[2, 0] = probabilities[2].min(axis=0)
    return probabilities


def _weighted(
    mixture: Mixture, families: Sequence[Family], count: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Return samples ξ and their weights."""
    u = mixture.sample(count, rng)
    return of_normals(u, families), mixture.weights(u)
