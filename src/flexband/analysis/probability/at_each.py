"""The probability of being outside limits at each single time, as bounds over the intervals.

The values of the interval inputs are searched at each time on its own, with common weighted samples
around the rare samples at the ends of the probability of violating limits at any time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import ndtr

from flexband.analysis.descent import lowest_over_times
from flexband.analysis.probability.ends import EndOptions
from flexband.analysis.probability.estimates import Estimate, clear
from flexband.analysis.probability.importance import Mixture
from flexband.analysis.probability.states import LimitedOutputs, LimitState
from flexband.analysis.probability.subset import Rare
from flexband.analysis.sampled import SampledSeries
from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.expansions.threads import in_threads
from flexband.uncertainty.inputs.sampling import of_normals


@dataclass(frozen=True)
class AtEachTimeOptions:
    """How probabilities at single times are computed."""

    samples: int = 8000
    """Samples for the probabilities."""
    searched_samples: int = 400
    """Samples for the search."""
    values_at_once: int = 2**16
    """Values of the surrogate that are computed together."""
    tolerance: float = 1e-4
    """Relative gains of a search that count as none."""
    ends: EndOptions = field(default_factory=EndOptions)
    """Smoothing, and how mixtures are built."""


@dataclass(frozen=True)
class _OutputMargins:
    """The margins of one output at its times, at fixed samples."""

    series: SampledSeries
    part: LimitedOutputs  # has the limits of the output
    row: int  # of the output in this part
    psi: np.ndarray  # polynomials of the samples
    weights: np.ndarray  # of the samples
    options: AtEachTimeOptions

    def sums(self, eta: np.ndarray, times: np.ndarray, width: float) -> np.ndarray:
        """Return probabilities, and means of squared weights outside, shape (2, rows).

        η and times have the shapes (rows, m) and (rows,). The step at the limit is smoothed by
        `width`, in units of the margins, unless that is 0.
        """
        sums = np.empty((2, len(eta)))
        powers = np.stack([self.weights, self.weights**2]) / len(self.weights)
        block_size = max(1, self.options.values_at_once // len(self.psi))

        def add_up(first: int) -> None:
            rows = slice(first, first + block_size)
            at = (self.row, times[rows], None)
            values = self.series.values(self.psi, eta[rows], times[rows])
            margins = np.minimum(values - self.part.lower[at], self.part.upper[at] - values)
            margins /= self.part.scale[at]
            sums[:, rows] = powers @ (ndtr(-margins / width) if width else margins < 0).T

        in_threads(add_up, range(0, len(eta), block_size))
        return sums

    def objectives(self, eta: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Return the logarithm of a smoothed probability, and minus it, both to be minimized."""
        size = np.log(self.sums(eta, times, self.options.ends.smoothing)[0] + 1e-300)
        return np.stack([size, -size])


def at_each_time(
    state: LimitState,
    m: int,
    rare_at_ends: Sequence[Rare],
    ends: Sequence[Estimate],
    rng: np.random.Generator,
    *,
    options: AtEachTimeOptions = AtEachTimeOptions(),
) -> tuple[np.ndarray, np.ndarray]:
    """Return probabilities with their confidence intervals, (3, 2, series), and η, (2, series, m).

    `rare_at_ends` and `ends` are rare samples and estimates at the least and the largest
    probability of violating the limits at any time, which bound those at each time. Without such
    samples the probabilities are zero, and η is that of the middle of the intervals.
    """
    upper_bounds = np.array([estimate.confidence()[1] for estimate in ends])[:, None]
    if not any(len(rare_samples.u) for rare_samples in rare_at_ends):
        none = np.zeros((2, state.width))
        return np.stack([none, none, none + upper_bounds]), np.zeros((*none.shape, m))
    # Draw common samples: few for the search, and many for its result.
    importance = options.ends.importance
    mixture_options = importance.subset.mixture
    mixture = Mixture.mean(
        *(Mixture.from_samples(part.u, rng, options=mixture_options) for part in rare_at_ends)
    )
    counts = options.searched_samples, options.samples
    samples = [_weighted_samples(mixture, state.families, count, rng) for count in counts]
    probabilities = []
    places = []
    for part in state.parts:
        for row, series in enumerate(SampledSeries.of_outputs(part.expansion)):
            search_margins, final_margins = (
                _OutputMargins(series, part, row, series.basis(xi), w, options) for xi, w in samples
            )
            times = part.series.shape[1]
            # Search the ends at each time, and compute the probabilities there with all samples.
            eta, _ = lowest_over_times(
                search_margins.objectives, series.interval_scan, times, options.tolerance
            )
            flat = eta.reshape(2 * times, -1)
            first, second = final_margins.sums(flat, np.tile(np.arange(times), 2), 0.0)
            error = np.sqrt(np.maximum(second - first**2, 0) / options.samples)
            pair = np.minimum(first, 1.0).reshape(2, times), error.reshape(2, times)
            crossed = pair[0][0] > pair[0][1]  # which samples of the search could not tell apart
            pair = [np.where(crossed, bounds[::-1], bounds) for bounds in pair]
            bounds = np.stack(
                clear(pair[0], pair[1], upper_bounds, upper_bounds, importance.min_equal_samples)
            )
            # The upper bound is no less than the lower one, so that each tells of the other.
            bounds[:2, 1] = bounds[:2].max(axis=1)
            bounds[2, 0] = bounds[2].min(axis=0)
            probabilities.append(bounds)
            places.append(np.where(crossed[:, None], eta[::-1], eta))
    return np.concatenate(probabilities, axis=2), np.concatenate(places, axis=1)


def _weighted_samples(
    mixture: Mixture, families: Sequence[Family], count: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    u = mixture.sample(count, rng)
    return of_normals(u, families), mixture.weights(u)
