"""The probability of leaving limits, corrected with runs of the model.

Let g(u) be the least margin on the surrogate, and g*(u) that of the model. Some of the runs, at
rare samples, tell what the surrogate misses there: a quadratic function b(u), and how much
g* − g − b scatters. With h = g + b, the probability is

    P = E[1(h < 0)] + E[1(g* < 0) − 1(h < 0)].

The first term takes no runs; importance sampling finds it anew. The second is due to samples near
h = 0, so that the other runs are drawn there and counted with the inverse of their chance (Horvitz
and Thompson, 1952). It makes the estimate unbiased, whatever b is. The confidence interval is that
of the Bayesian bootstrap (Rubin, 1981), with one more disagreement of the usual size on both sides:
what was not seen in so many runs may exist.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtr

from flexband.analysis.probability.discrepancy import DiscrepancyModel
from flexband.analysis.probability.estimates import (
    BATCH,
    MOST,
    ROUGH,
    are_uneven,
    mixture_around,
)
from flexband.analysis.probability.subset import COUNT, Rare, rare

Margins = Callable[[np.ndarray], np.ndarray]
"""u of shape (points, n) -> least margins, (points,)."""

PART, MIN_ROUNDS, MAX_ROUNDS = 8, 2, 6
"""Rounds of learning what is missed, each in an eighth of the runs, until the next finds all of its
samples beyond the limit."""

WIDENED, MIN_SCATTER = 1.3, 1e-3
"""By which the scatter is multiplied, and its least part of the margins' standard deviation."""

INSIDE, ANYWHERE = 0.2, 0.1
"""Least chance of samples beyond the limit to be drawn, where it is ½ at the limit, and the part of
the runs that are drawn anywhere."""

REPEATS, LEVELS = 4000, (0.025, 0.975)
"""Of the bootstrap, and the ends of the confidence interval."""


@dataclass(frozen=True)
class Correction:
    """A probability that was corrected with runs of the model.

    Attributes
    ----------
    probability, low, high : the estimate and the ends of its confidence interval.
    runs : number of runs.
    disagreements : runs of those that correct in which h and the model disagree about the limit.
    noise : of the search for η, as in `Estimate`.
    """

    probability: float
    low: float
    high: float
    runs: int
    disagreements: int
    noise: float = 0.0

    def confidence(self) -> tuple[float, float]:
        """Return the confidence interval of the probability."""
        return self.low / math.exp(self.noise), min(1.0, self.high * math.exp(self.noise))


def corrected(
    least: Margins, model: Margins, near: Rare, runs: int, accuracy: float,
    rng: np.random.Generator,
) -> Correction:  # fmt: skip
    """Return a probability corrected with runs of the model.

    Parameters
    ----------
    least, model : margins on the surrogate, and of the model.
    near : rare samples of the surrogate.
    runs : number of runs.
    accuracy : relative standard error of the first term.
    """
    n = near.u.shape[1]
    known = DiscrepancyModel(near.u[:0], np.zeros(0))

    def margin(u: np.ndarray) -> np.ndarray:
        return least(u) + known.expected(u)[0]

    remaining = runs
    for k in range(MAX_ROUNDS):
        at = near.u[rng.permutation(len(near.u))[: runs // PART]]
        if not len(at):
            break
        run_margins, remaining = model(at), remaining - len(at)
        if k >= MIN_ROUNDS and np.all(run_margins < 0):
            break
        known = known.with_runs(at, run_margins - least(at))
        kept = near.u[margin(near.u) < 0]  # far from runs, a margin would mislead scouts
        near = rare(margin, n, rng, scouts=False)
        near = replace(near, u=np.concatenate([near.u, kept[:COUNT]]))
    u, w, h = _samples(margin, near, accuracy, rng)
    inside = h < 0
    base, error = float(np.mean(w * inside)), float(np.std(w * inside)) / np.sqrt(len(w))
    scatter = np.maximum(WIDENED * known.expected(u)[1], MIN_SCATTER * np.std(least(u)))
    which, values = _drawn(h / scatter, w, remaining, rng)
    other = (model(u[which]) < 0).astype(float) - inside[which]
    z = (other * values[which])[other != 0]
    usual = [_usual(h / scatter, w, values, side) for side in (~inside, inside)]
    sizes = np.concatenate([z, [usual[0], -usual[1]]])
    parts = rng.standard_exponential((REPEATS, len(sizes)))
    rest = rng.standard_gamma(len(which) - len(z), REPEATS)
    moved = base + parts @ sizes / (parts.sum(axis=1) + rest)
    noise = np.exp(error / base * rng.standard_normal(REPEATS)) if base else np.ones(REPEATS)
    low, high = np.quantile(moved * noise, LEVELS)
    if are_uneven(w[inside], len(w)):
        low, high = low / ROUGH, high * ROUGH
    high += near.probability * (not len(near.u))
    low, high = (min(1.0, max(0.0, float(end))) for end in (low, high))
    probability = min(1.0, max(0.0, base + float(z.sum()) / len(which)))
    return Correction(probability, low, high, runs, len(z))


def _samples(
    margin: Margins, near: Rare, accuracy: float, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return samples around rare ones, their weights and margins."""
    mixture, batches = mixture_around(margin, near.u, rng), []
    while True:
        u = mixture.sample(BATCH, rng)
        batches.append((u, mixture.weights(u), margin(u)))
        samples, weights, margins = (
            np.concatenate(column) for column in zip(*batches, strict=True)
        )
        some = weights * (margins < 0)
        enough = np.std(some) <= accuracy * np.mean(some) * np.sqrt(len(some))
        if enough or len(some) + BATCH > MOST or not len(near.u):
            return samples, weights, margins


def _drawn(
    t: np.ndarray, weights: np.ndarray, count: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Return the numbers of samples that are drawn near the limit, and what each one counts.

    The sum of what is drawn, each times what it counts, over its number has the expectation of the
    weighted mean of all samples.

    Parameters
    ----------
    t : margins, in parts of how much they scatter.
    """
    chance = np.sqrt(ndtr(-np.abs(t)))
    chance = np.where(t < 0, np.maximum(chance, INSIDE), chance)
    chance = np.maximum(chance, ANYWHERE * np.mean(weights * chance) / np.mean(weights))
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
