"""The probability of violating limits at one η, by importance sampling, with its confidence.

The mixture is built around rare samples and then fixed, so that the samples after it are
independent and the mean of weights is unbiased. The same samples give the probability at each time,
between the times, and with the limits moved by an error.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from scipy.special import gammaincinv, ndtri

from flexband.analysis.probability.importance import Mixture
from flexband.analysis.probability.states import LimitedOutputs, LimitState, least_of
from flexband.analysis.probability.subset import Margins, Rare, SubsetOptions, rare
from flexband.uncertainty.surrogates.sigmas import growth

TWO_SIDED = 1.96
"""Standard errors of a two-sided confidence interval of 95 %."""


@dataclass(frozen=True)
class ImportanceOptions:
    """How a probability is estimated by importance sampling."""

    batch_samples: int = 1000
    """Samples of a batch."""
    max_samples: int = 32_000
    """Most samples of an estimate."""
    mixture_rounds: int = 2
    """Mixtures after the first one."""
    mixture_samples: int = 600
    """Samples around which a mixture is built."""
    moved_samples: int = 500
    """Samples of a level that find a mixture for limits that are moved."""
    rough_factor: float = 2.5
    """Factor within which subset simulation is right."""
    max_unevenness: float = 25.0
    """Largest mean square of weights beyond limits, over their squared mean."""
    min_equal_samples: int = 9
    """Samples of equal weights with which a probability at one time is stated."""
    subset: SubsetOptions = field(default_factory=SubsetOptions)
    """How rare samples are searched."""

    def has_uneven_weights(self, weights: np.ndarray, count: int) -> bool:
        """Return whether weights of samples that violate limits are very unequal, or too many.

        They are too many as a part of the `count` of all samples.
        """
        return count + self.batch_samples > self.max_samples or bool(
            len(weights)
            and len(weights) * np.sum(weights**2) > self.max_unevenness * np.sum(weights) ** 2
        )


@dataclass(frozen=True, eq=False)
class Estimate:
    """The probability of violating limits at one η.

    `between_times` is that between the times too: an estimate, what it is at least, and at most, by
    rules for curves and by what runs do there that were looked at. `noise` is that of the search
    for η, as a logarithm of the probability: by how much that at the best η may be beyond this one.
    """

    probability: float  # of leaving them at any time, with the times as points
    error: float  # its standard error
    looser: float  # the probability with the limits moved by what may be missed there
    tighter: float
    between_times: np.ndarray  # (3,)
    between_times_error: np.ndarray  # its standard errors, (3,)
    at_each: np.ndarray  # at each output and time, (series,)
    at_each_error: np.ndarray  # its standard errors, (series,)
    subset_probability: float  # of subset simulation, rough; an upper bound without a sample
    u: np.ndarray
    weights: np.ndarray
    margins: np.ndarray  # the least of each sample
    options: ImportanceOptions
    noise: float = 0.0

    def confidence(self) -> tuple[float, float]:
        """Return the confidence interval of the probability."""
        return self._confidence(self.probability, self.error)

    def confidence_between(self) -> tuple[float, float]:
        """Return the interval that holds the probability between the times too."""
        _, lower, upper = zip(
            self.between_times.tolist(), self.between_times_error.tolist(), strict=True
        )
        return self._confidence(*lower)[0], self._confidence(*upper)[1]

    def _confidence(self, probability: float, error: float) -> tuple[float, float]:
        low, high = interval(np.array(probability), np.array(error), self.subset_probability)
        if self.has_uneven_weights:  # few samples have most of it: their spread may be too small
            low = min(low, self.subset_probability / self.options.rough_factor)
            high = max(high, min(1.0, self.subset_probability * self.options.rough_factor))
        return float(low) / math.exp(self.noise), min(1.0, float(high) * math.exp(self.noise))

    @property
    def has_uneven_weights(self) -> bool:
        """Whether sampling ended before the accuracy was reached, or weights are very unequal."""
        return self.options.has_uneven_weights(self.weights[self.margins < 0], len(self.u))

    def told_at_each(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the probabilities at each time that are clear, and confidence intervals."""
        upper_bound = self.confidence()[1]
        weights = self.weights[self.margins < 0]
        if len(weights):  # none of so many that violate the limits at some time does so at this one
            upper_bound *= min(
                1.0, -math.log(0.05) * float(np.sum(weights**2) / np.sum(weights) ** 2)
            )
        fewest = self.options.min_equal_samples
        return clear(self.at_each, self.at_each_error, self.confidence()[1], upper_bound, fewest)


def interval(
    probability: np.ndarray, error: np.ndarray, upper_bound: np.ndarray | float
) -> tuple[np.ndarray, np.ndarray]:
    """Return confidence intervals of estimates by their logarithm; [0, upper_bound] for zeros."""
    positive_mask = probability > 0
    relative = np.divide(error, probability, out=np.zeros(probability.shape), where=positive_mask)
    factor = np.exp(TWO_SIDED * relative)
    low = probability / factor
    high = np.minimum(1.0, probability * factor)
    return np.where(positive_mask, low, 0.0), np.where(positive_mask, high, upper_bound)


def clear(
    probability: np.ndarray,
    error: np.ndarray,
    upper_bound: np.ndarray | float,
    zero_count_bound: np.ndarray | float,
    fewest: int = 9,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return estimates that are clear, 0 for the others, and the confidence intervals of all.

    With n = (probability / error)², an estimate is as uncertain as a count of n samples of equal
    weights. Fewer than `fewest` are not clear: they are bounded like none at all, whose weights may
    be larger than theirs, and by Poisson's distribution. `upper_bound` bounds all estimates,
    and `zero_count_bound` those without any sample.
    """
    uncertain_mask = (probability > 0) & (error > 0)
    n = (
        np.divide(probability, error, out=np.full(probability.shape, np.inf), where=uncertain_mask)
        ** 2
    )
    unclear_mask = uncertain_mask & (n < fewest)
    estimates = np.where(unclear_mask, 0.0, probability)
    low, high = interval(estimates, error, zero_count_bound)
    count = np.where(unclear_mask, n, 1.0)
    bound = probability / count * gammaincinv(count + 1, 0.975)
    return (
        estimates,
        low,
        np.where(unclear_mask, np.minimum(upper_bound, np.maximum(zero_count_bound, bound)), high),
    )


def missed_at(k: float) -> float:
    """Return what may be missed k standard deviations from the mean, relative to what is expected.

    It is twice the expected error of μ ± kσ, or, farther out, what a term of third order has there
    whose root mean square is that of all that is missed: (k³ − 3k)/√6.
    """
    return max(2.0 * growth(k), (k**3 - 3 * k) / math.sqrt(6))


def estimate(
    state: LimitState,
    search_state: LimitState,
    eta: np.ndarray,
    rare_samples: Rare,
    accuracy: float,
    rng: np.random.Generator,
    *,
    options: ImportanceOptions = ImportanceOptions(),
) -> Estimate:
    """Return the probability of violating limits at one η.

    Mixtures are found around `rare_samples` with `search_state`, at the times that decide.
    Sampling ends at the relative standard error `accuracy`.
    """
    # How many standard deviations from the mean the limit is, at least 1.
    k = max(1.0, -float(ndtri(min(max(rare_samples.probability, 1e-300), 0.5))))
    moved = missed_at(k)
    mixture = mixture_around(
        partial(search_state.least_margins, eta=eta), rare_samples.u, rng, options=options
    )
    sums = _Sums(state, moved, options)
    batch = options.batch_samples
    while True:
        u = mixture.sample(batch, rng)
        sums.add(u, eta, mixture.weights(u))
        result = sums.estimate(rare_samples.probability)
        enough = result.probability and result.error <= accuracy * result.probability
        if enough or len(result.u) + batch > options.max_samples or not len(rare_samples.u):
            break
    if state.exact:
        return result
    least_margin = partial(state.tighter(moved).least_margins, eta=eta)
    first = rare(
        least_margin, rare_samples.u.shape[1], rng, options.moved_samples, options=options.subset
    )
    mixture = mixture_around(least_margin, first.u, rng, rounds=1, options=options)
    u = mixture.sample(batch, rng)
    inside = mixture.weights(u) * (least_margin(u) < 0)
    tighter_one = min(1.0, float(inside.mean()) or first.probability)
    return replace(result, tighter=max(result.probability, tighter_one))


def mixture_around(
    least_margin: Margins,
    rare_samples: np.ndarray,
    rng: np.random.Generator,
    rounds: int | None = None,
    *,
    options: ImportanceOptions = ImportanceOptions(),
) -> Mixture:
    """Return a mixture around `rare_samples`, (count, n), and then around those it finds.

    There may be none; `rounds` are the mixtures after the first one, by default the options'.
    """
    mixture = Mixture.from_samples(rare_samples, rng, options=options.subset.mixture)
    for _ in range((rounds or options.mixture_rounds) * bool(len(rare_samples))):
        u = mixture.sample(options.batch_samples, rng)
        weights = mixture.weights(u) * (least_margin(u) < 0)
        if np.count_nonzero(weights) <= 2 * rare_samples.shape[1]:
            break
        share = weights / weights.sum()
        around = u[rng.choice(len(u), options.mixture_samples, p=share)]
        mixture = Mixture.from_samples(around, rng, options=options.subset.mixture)
    return mixture


class _Sums:
    """Weighted counts of samples that violate the limits."""

    def __init__(self, state: LimitState, moved: float, options: ImportanceOptions):
        self.state = state
        self.moved = moved
        self.options = options
        self.u: list[np.ndarray] = []
        self.rows: list[np.ndarray] = []
        self.series_sums = np.zeros((2, state.width))

    def add(self, u: np.ndarray, eta: np.ndarray, weights: np.ndarray) -> None:
        """Add samples."""

        def reduce(block: slice, sides: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
            parts = self.state.parts
            impacts = self.state.impacts
            margins = [
                np.where(part.inside, part_sides.min(axis=1), np.inf)
                for part, part_sides in zip(parts, sides, strict=True)
            ]
            errors = [self.moved * part.error / part.scale for part in parts]
            pairs = list(zip(margins, errors, strict=True))
            least_margins = least_of(margins)
            looser = np.min([(margin + e).min(axis=(1, 2)) for margin, e in pairs], axis=0)
            all_time_margins = np.stack([least_margins, least_margins, least_margins])
            samples = slice(None) if impacts else least_margins >= 0  # others are out in any case
            for part, part_sides in zip(parts, sides, strict=True):
                lower = part.least_between(part_sides[samples], impacts=impacts)
                all_time_margins[:, samples] = np.minimum(all_time_margins[:, samples], lower)
            out = np.concatenate(
                [(margin < 0).reshape(len(margin), -1) for margin in margins], axis=1, dtype=float
            )
            powers = np.stack([weights[block], weights[block] ** 2])
            return np.stack(
                [weights[block], least_margins, looser, *all_time_margins]
            ), powers @ out

        blocks = self.state.reduce_margins(u, eta, reduce, LimitedOutputs.sides)
        self.u.append(u)
        self.rows += [rows for rows, _ in blocks]
        for _, sums in blocks:
            self.series_sums += sums

    def estimate(self, subset_probability: float) -> Estimate:
        """Return the estimate of all samples; `subset_probability` bounds it without any."""
        weights, *margins = np.concatenate(self.rows, axis=1)
        count = len(weights)
        out = np.array(margins) < 0
        moments = np.stack([out @ weights, out @ weights**2])
        weight_sums = np.array([weights.sum(), (weights**2).sum()])
        (probability, looser, *between_times), (error, _, *between_times_error) = probabilities(
            moments, weight_sums, count
        )
        # Each chooses for itself, and leaving at one time is no likelier than at any.
        series_probability, series_error = probabilities(self.series_sums, weight_sums, count)
        return Estimate(
            float(probability), float(error), float(min(looser, probability)), float(probability),
            np.maximum(between_times, probability), np.array(between_times_error),
            np.minimum(probability, series_probability), series_error, subset_probability,
            np.concatenate(self.u), weights, margins[0], self.options,
        )  # fmt: skip


def probabilities(
    out: np.ndarray, weight_sums: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return probabilities of violating limits, from sums over samples, and standard errors.

    The mean of all weights is one, so that those of samples that stay within the limits tell the
    probability as well: without error, if there are none. Whichever has the smaller error is taken.
    `out` are the sums of the weights of samples that violate the limits, and of their squares,
    (2, any), and `weight_sums` those of all samples, (2,).
    """
    leave = out / count
    stay = (weight_sums[:, None] - out) / count
    errors = [np.sqrt(np.maximum(b - a**2, 0.0) / count) for a, b in (leave, stay)]
    by_others = (errors[1] < errors[0]) & (stay[0] < 1)
    probability = np.where(by_others, 1 - np.maximum(stay[0], 0.0), np.minimum(leave[0], 1.0))
    return probability, np.where(by_others, errors[1], errors[0])
