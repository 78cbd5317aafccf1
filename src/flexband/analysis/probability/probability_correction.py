"""The probability of violating limits, corrected with runs of the model.

Let g(u) be the least margin on the surrogate, and g*(u) that of the model. Some of the runs tell
what the surrogate misses: a function b(u), and how much g* − g − b scatters. First they are at rare
samples and at all distances from the middle; then round by round where it is the least sure on
which side of the limit a sample is. With h = g + b, the probability is

    P = E[1(h < 0)] + E[1(g* < 0) − 1(h < 0)].

The first term takes no runs; importance sampling finds it anew. The second is due to samples near
h = 0, so that the other runs are drawn there and counted with the inverse of their chance (Horvitz
and Thompson, 1952). It makes the estimate unbiased, whatever b is. The confidence interval is that
of the Bayesian bootstrap (Rubin, 1981). Its ends have one more disagreement of the usual size each,
which lowers the one and raises the other: what was not seen in so many runs may exist. Where
margins of these runs scatter about h by more than was learnt, the interval holds what this scatter
makes of the probability.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.special import chdtri, erf, ndtr

from flexband.analysis.probability.discrepancy import DiscrepancyModel
from flexband.analysis.probability.estimates import ImportanceOptions, mixture_around
from flexband.analysis.probability.importance import Mixture
from flexband.analysis.probability.model import ResponseModel
from flexband.analysis.probability.states import LimitState, with_eta
from flexband.analysis.probability.subset import Margins, Rare, rare


@dataclass(frozen=True)
class CorrectionOptions:
    """How runs of the model correct a probability."""

    beyond_spread: float = 1e-5
    """Probability of samples farther from the middle than runs that are spread to learn."""
    vertex_share: float = 0.5
    """Part of such runs that are at vertices of the intervals."""
    learning_part: int = 8
    """Runs per run of a round that learns what is missed."""
    spread_share: float = 0.25
    """Part of them that are spread."""
    min_rounds: int = 2
    """Rounds before little doubt about samples ends the learning."""
    max_rounds: int = 6
    """Most rounds."""
    widened: float = 1.3
    """Factor of the scatter."""
    min_scatter: float = 1e-3
    """Least scatter, relative to the margins' standard deviation."""
    min_chance_beyond: float = 0.2
    """Least chance to be drawn of samples beyond the limit; it is ½ at the limit."""
    anywhere_share: float = 0.1
    """Part of the runs that are drawn anywhere."""
    negligible: float = 1e-5
    """Differences of margins that count as none, relative to their standard deviation."""
    max_misfit: float = 1.5
    """Scatter of margins of runs relative to what was learnt, beyond which it counts itself."""
    repeats: int = 4000
    """Repeats of the bootstrap."""
    importance: ImportanceOptions = field(default_factory=ImportanceOptions)


def with_missed(
    state: LimitState,
    model: ResponseModel,
    n: int,
    m: int,
    rng: np.random.Generator,
    *,
    options: CorrectionOptions = CorrectionOptions(),
) -> LimitState:
    """Return a state with what the surrogate misses, learnt from first runs.

    Half of the runs are at rare samples of u and η, if the surrogate has any; the others are at all
    distances from the middle, in pairs on both sides of it, at vertices of the intervals or
    anywhere in them. What violates limits is where more is looked for.
    """
    count = model.first_runs

    def least_margins(z: np.ndarray) -> np.ndarray:
        return state.least_margins(z[:, :n], erf(z[:, n:] / np.sqrt(2)))

    rare_samples = rare(
        least_margins, n + m, rng, scouts=False, options=options.importance.subset
    ).u
    rare_points = rare_samples[rng.permutation(len(rare_samples))[: count // 2]]
    others = count - len(rare_points)
    half = (others + 1) // 2  # of them, and their mirror images: there may be a limit on each side
    spread = _spread(half, n, rng, options)
    spread = np.concatenate([spread, -spread])[:others]
    u = np.concatenate([rare_points[:, :n], spread])
    eta = np.concatenate([erf(rare_points[:, n:] / np.sqrt(2)), _anywhere(others, m, rng, options)])
    runs = state.least_of_response(model(*state.places(u, eta)))
    missed = DiscrepancyModel(with_eta(u, eta), runs - state.least_margins(u, eta))
    return replace(state, missed=missed, beyond=u[runs < 0])


@dataclass(frozen=True)
class Correction:
    """A probability that was corrected with runs of the model, and its confidence interval."""

    probability: float
    low: float
    high: float
    runs: int
    disagreements: int  # runs that correct in which h and the model disagree about the limit
    noise: float  # of the search for η, as in `Estimate`
    missed: DiscrepancyModel  # what all these runs have taught
    confirmed: bool  # whether the surrogate misses next to nothing in any of them

    def confidence(self) -> tuple[float, float]:
        """Return the confidence interval of the probability."""
        return self.low / math.exp(self.noise), min(1.0, self.high * math.exp(self.noise))


def correct_probability(
    state: LimitState,
    model: ResponseModel,
    eta: np.ndarray,
    rare_samples: Rare,
    accuracy: float,
    rng: np.random.Generator,
    noise: float,
    *,
    options: CorrectionOptions = CorrectionOptions(),
) -> Correction:
    """Return the probability at one η, corrected with runs of the model.

    The state knows what first runs have taught (`with_missed`); `rare_samples` are those of the
    state at this η, and `accuracy` is the relative standard error of the first term.
    """
    n, importance = rare_samples.u.shape[1], options.importance
    assert state.missed is not None  # of the first runs
    surrogate, discrepancy = replace(state, missed=None), state.missed

    def least_margins(v: np.ndarray) -> np.ndarray:  # v are u and η
        return surrogate.least_margins(v[:, :n], v[:, n:])

    def least_of_runs(v: np.ndarray) -> np.ndarray:
        return state.least_of_response(model(*state.places(v[:, :n], v[:, n:])))

    def margin_and_scatter(v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return least_margins(v) + discrepancy.predict(v), options.widened * discrepancy.scatter(v)

    def margin(u: np.ndarray) -> np.ndarray:
        v = with_eta(u, eta)
        return least_margins(v) + discrepancy.predict(v)

    # Learn what the surrogate misses where the side of the limit is doubtful, round by round.
    beyond, remaining = state.beyond.reshape(-1, n), model.runs
    rare_samples = replace(rare_samples, u=np.concatenate([rare_samples.u, beyond]))
    for k in range(options.max_rounds):
        at, doubt = _doubtful(
            margin_and_scatter, rare_samples, eta, model.runs // options.learning_part, rng, options
        )
        if not len(at) or (k >= options.min_rounds and doubt < accuracy):
            break
        run_margins, remaining = least_of_runs(at), remaining - len(at)
        discrepancy = discrepancy.with_runs(at, run_margins - least_margins(at))
        failure_samples = rare_samples.u[margin(rare_samples.u) < 0]
        # Far from runs, a margin would mislead scouts.
        rare_samples = rare(margin, n, rng, scouts=False, options=importance.subset)
        failure_samples = np.concatenate(
            [failure_samples[: importance.subset.level_samples], beyond]
        )
        rare_samples = replace(rare_samples, u=np.concatenate([rare_samples.u, failure_samples]))
    # Estimate the first term without runs, and the second by the other runs, near the limit.
    u, w, h = _samples(margin, rare_samples, accuracy, rng, importance)
    inside = h < 0
    base, error = float(np.mean(w * inside)), float(np.std(w * inside)) / np.sqrt(len(w))
    size, v = float(np.std(h)), with_eta(u, eta)
    scatter = np.maximum(margin_and_scatter(v)[1], options.min_scatter * size + 1e-300)
    which, values = _draw_samples(h / scatter, w, remaining, rng, options)
    run_margins = least_of_runs(v[which])
    differences = (run_margins < 0).astype(float) - inside[which]
    z = (differences * values[which])[differences != 0]
    usual = [_usual(h / scatter, w, values, side) for side in (~inside, inside)]
    if np.all(np.abs(run_margins - h[which]) <= options.negligible * size):
        usual = [0.0, 0.0]  # the surrogate is exact near the limit
    # Find the interval, and make it wider where weights or margins scatter too much.
    low, high = _ends(base, error, z, len(which), usual, rng, options)
    if importance.has_uneven_weights(w[inside], len(w)):
        low, high = low / importance.rough_factor, high * importance.rough_factor
    high += rare_samples.probability * (not len(rare_samples.u))
    low, high = (min(1.0, max(0.0, float(end))) for end in (low, high))
    low *= bool(base or len(z))  # nothing was found that violates the limit
    run_scatter = scatter * np.sqrt(np.mean(((run_margins - h[which]) / scatter[which]) ** 2))
    if np.any(run_scatter > options.max_misfit * scatter):  # margins scatter more than was learnt
        low = min(low, float(np.mean(w * (h < -2 * run_scatter))))
        high = max(high, float(np.mean(w * ndtr(-h / run_scatter))))
    probability = min(1.0, max(0.0, base + float(z.sum()) / len(which)))
    discrepancy = discrepancy.with_runs(v[which], run_margins - least_margins(v[which]))
    high = max(high, min(1.0, _possible(margin_and_scatter, n, eta, rng, options)))
    confirmed = bool(np.abs(discrepancy.missed).max() <= options.min_scatter * size)
    return Correction(probability, low, high, model.runs, len(z), noise, discrepancy, confirmed)


def _ends(
    base: float,
    error: float,
    z: np.ndarray,
    count: int,
    usual: list[float],
    rng: np.random.Generator,
    options: CorrectionOptions,
) -> np.ndarray:
    """Return the ends of the Bayesian bootstrap's interval, with one more disagreement each.

    Of `count` runs, those that disagree count z; `usual` are the sizes outside and inside.
    """
    repeats = options.repeats
    ends = np.empty(2)
    of_base = np.exp(error / base * rng.standard_normal(repeats)) if base else np.ones(repeats)
    rest = rng.standard_gamma(count - len(z), repeats)
    for k, (one_more, part) in enumerate(((-usual[1], 0.025), (usual[0], 0.975))):
        sizes = np.append(z, one_more)
        parts = rng.standard_exponential((repeats, len(sizes)))
        moved = base + parts @ sizes / (parts.sum(axis=1) + rest)
        ends[k] = np.quantile(moved * of_base, part)
    return ends


def _doubtful(
    margin_and_scatter: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]],
    rare_samples: Rare,
    eta: np.ndarray,
    count: int,
    rng: np.random.Generator,
    options: CorrectionOptions,
) -> tuple[np.ndarray, float]:
    """Return u and η of which little is known on which side of the limit they are, and the doubt.

    Most are drawn at the given η, with the probability that they are taken for the wrong side; the
    others are spread over u and η, also to where this hardly counts yet. The doubt is the
    probability of the wrong side, relative to that beyond the limit.
    """
    samples, (_, n) = options.importance.batch_samples, rare_samples.u.shape
    if not len(rare_samples.u):
        return np.zeros((0, n + len(eta))), 0.0
    mixture = Mixture.from_samples(rare_samples.u, rng, options=options.importance.subset.mixture)
    u = mixture.sample(samples, rng)
    spread_count = round(options.spread_share * count)
    spread = _spread(samples, n, rng, options)
    v = with_eta(u, eta)
    spread = with_eta(spread, _anywhere(samples, len(eta), rng, options))
    weights, (h, scatter), (h_spread, scatter_spread) = (
        mixture.weights(u), margin_and_scatter(v), margin_and_scatter(spread)
    )  # fmt: skip
    wrong = weights * ndtr(-np.abs(h) / scatter)
    beyond = float(weights @ (h < 0))
    wrong_spread = ndtr(-np.abs(h_spread) / scatter_spread)
    at = (
        v[_systematic(wrong, count - spread_count, rng)],
        spread[_systematic(wrong_spread, spread_count, rng)],
    )
    return np.concatenate(at), float(wrong.sum() / max(wrong.sum(), beyond, 1e-300))


def _possible(
    margin_and_scatter: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]],
    n: int,
    eta: np.ndarray,
    rng: np.random.Generator,
    options: CorrectionOptions,
) -> float:
    """Return the expected probability of violating the limit, by what is known of all samples.

    Where no run was made, the scatter of margins is large.
    """
    options_of_mixture = replace(options.importance.subset.mixture, wide_std=2.0, wide_share=0.5)
    mixture = Mixture.from_samples(np.zeros((0, n)), rng, options=options_of_mixture)
    u = mixture.sample(options.repeats, rng)
    h, scatter = margin_and_scatter(with_eta(u, eta))
    return float(np.mean(mixture.weights(u) * ndtr(-h / scatter)))


def _anywhere(
    count: int, m: int, rng: np.random.Generator, options: CorrectionOptions
) -> np.ndarray:
    """Return η at vertices of the intervals or anywhere in them, (count, m)."""
    return np.where(
        rng.random((count, 1)) < options.vertex_share,
        rng.choice([-1.0, 1.0], (count, m)),
        rng.uniform(-1, 1, (count, m)),
    )


def _spread(count: int, n: int, rng: np.random.Generator, options: CorrectionOptions) -> np.ndarray:
    """Return samples in random directions, (count, n), whose distances are the rarer the larger."""
    direction = rng.standard_normal((count, n))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True) + 1e-300
    farther = options.beyond_spread ** ((np.arange(count) + 0.5) / count)
    return direction * np.sqrt(chdtri(n, farther))[:, None]


def _systematic(sizes: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Return different numbers that are drawn in proportion to sizes; none if these are zero."""
    ends = np.cumsum(sizes)
    at = np.searchsorted(ends, (np.arange(count) + rng.random()) / count * ends[-1], "right")
    return np.unique(at[at < len(sizes)])


def _samples(
    margin: Margins,
    rare_samples: Rare,
    accuracy: float,
    rng: np.random.Generator,
    options: ImportanceOptions,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    mixture = mixture_around(margin, rare_samples.u, rng, options=options)
    batches = []
    while True:
        u = mixture.sample(options.batch_samples, rng)
        batches.append((u, mixture.weights(u), margin(u)))
        samples, weights, margins = (
            np.concatenate(column) for column in zip(*batches, strict=True)
        )
        beyond = weights * (margins < 0)
        enough = np.std(beyond) <= accuracy * np.mean(beyond) * np.sqrt(len(beyond))
        full = len(beyond) + options.batch_samples > options.max_samples
        if enough or full or not len(rare_samples.u):
            return samples, weights, margins


def _draw_samples(
    t: np.ndarray,
    weights: np.ndarray,
    count: int,
    rng: np.random.Generator,
    options: CorrectionOptions,
) -> tuple[np.ndarray, np.ndarray]:
    """Draw samples near the limit; return their numbers, and what each one counts.

    The sum of what is drawn, each times what it counts, over its number has the expectation of the
    weighted mean of all samples. Margins t are relative to how much they scatter.
    """
    chance = np.sqrt(ndtr(-np.abs(t)))
    chance = np.where(t < 0, np.maximum(chance, options.min_chance_beyond), chance)
    anywhere = options.anywhere_share * np.mean(weights * chance) / np.mean(weights)
    chance = np.maximum(chance, max(float(anywhere), 1e-100))  # all may be far from the limit
    order = np.argsort(t, kind="stable")
    ends = np.cumsum((weights * chance)[order])
    at = (np.arange(count) + rng.random()) / count * ends[-1]
    which = order[np.minimum(np.searchsorted(ends, at, "right"), len(order) - 1)]
    return which, np.mean(weights * chance) / chance


def _usual(t: np.ndarray, weights: np.ndarray, values: np.ndarray, side: np.ndarray) -> float:
    """Return what a disagreement on one side counts in the mean, if margins scatter as expected."""
    drawn = (weights / values * ndtr(-np.abs(t)))[side]
    total = float(drawn.sum())
    return float(drawn @ values[side]) / total if total else 0.0
