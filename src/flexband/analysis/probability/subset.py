"""Subset simulation: rare samples, level by level (Au and Beck, 2001), and scouts.

The samples with the smallest margins, a tenth of all, start Markov chains that stay below their
largest margin. A tenth of these are below the next level, and so on until margins are negative.

The levels may lead to the wrong region, or to none: where margins decrease slowly on one side, all
chains may go there, although they are negative much nearer on another side (Breitung, 2019). Scouts
are samples of larger standard deviations, which see far regions on all sides. Those with negative
margins start chains as well, which stay in their regions and move to where these are likely.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from flexband.analysis.probability.importance import Mixture

COUNT, SHARE = 1000, 0.1
"""Samples of a level, and which part of them is below the next."""

LEAST = 1e-10
"""Smaller probabilities are not looked for."""

SCOUTS, SCALES = 600, (1.3, 2.0, 3.0)
"""Scouts of each scale, in standard deviations of the inputs."""

FARTHEST = 1e-12
"""Probability of larger radii than those of scouts."""

SEEDS, RENEWALS = 200, 3
"""Chains that scouts start, and how often each makes ten steps."""

UNLIKE, UNSEEN = 10.0, 0.02
"""Weight of samples that a mixture around others hardly sees, in parts of those of the others, and
part of them from which on they are another region."""

ACCEPTED = 0.44
"""The part of the steps of a chain that are accepted."""


@dataclass(frozen=True)
class Rare:
    """Samples with negative margins.

    Attributes
    ----------
    u : the samples, (count, n); none if no margin is negative.
    probability : of a negative margin, a rough estimate; an upper bound if there is no sample.
    """

    u: np.ndarray
    probability: float


def rare(
    least: Callable[[np.ndarray], np.ndarray],
    dimension: int,
    rng: np.random.Generator,
    count: int = COUNT,
    *,
    scouts: bool = True,
) -> Rare:
    """Return samples of standard normal variables with negative margins.

    Parameters
    ----------
    least : returns margins, shape (points,), of samples of shape (points, dimension).
    count : samples of a level.
    scouts : whether scouts are sent, too.
    """
    u = rng.standard_normal((count, dimension))
    margin, probability, step = least(u), 1.0, 0.6
    few = round(count * SHARE)
    while True:
        negative = margin < 0
        if negative.sum() >= few:
            probability *= float(negative.mean())
            break
        if probability * SHARE < LEAST:
            probability *= float(negative.mean()) or -math.log(0.05) / few
            break
        probability *= SHARE
        order = np.argsort(margin, kind="stable")[:few]
        u, margin, step = _chains(least, u[order], margin[order], step, rng)
    alone = Rare(u[negative], probability)
    if not scouts or probability >= SHARE:
        return alone
    return _with_scouts(alone, least, dimension, rng)


def _with_scouts(
    known: Rare, least: Callable[[np.ndarray], np.ndarray], n: int, rng: np.random.Generator
) -> Rare:
    """Return rare samples with those that scouts find, and the probability of all of them."""
    z = rng.standard_normal((SCOUTS * len(SCALES), n))
    scale = np.repeat(SCALES, SCOUTS)
    farthest = math.sqrt(chi2.isf(FARTHEST, n))
    size = np.minimum(scale * np.linalg.norm(z, axis=1), farthest)
    u = z * (size / np.linalg.norm(z, axis=1))[:, None]
    margin = least(u)
    out = margin < 0
    if not out.any():
        return known
    u = u[out]
    nearest = np.argsort(np.sum(u**2, axis=1), kind="stable")[: SEEDS // 2]
    u, step = u[np.concatenate([nearest, rng.choice(len(u), SEEDS - len(nearest))])], 0.3
    for _ in range(RENEWALS):
        every, _, step = _chains(least, u, np.zeros(SEEDS), step, rng)
        u = every[-SEEDS:]  # those before it are too much like it to count
    if len(known.u):
        weights = Mixture.of(known.u, rng).weights
        unlike = weights(u) > UNLIKE * np.quantile(weights(known.u), 0.9)
        if unlike.mean() < UNSEEN:
            return known
    both = np.concatenate([known.u, u])
    mixture = Mixture.of(both, rng)
    tried = mixture.sample(COUNT, rng)
    rough = float(np.mean(mixture.weights(tried) * (least(tried) < 0)))
    return Rare(both, max(rough, known.probability) if len(known.u) else rough or LEAST)


def _chains(
    least: Callable[[np.ndarray], np.ndarray],
    u: np.ndarray,
    margin: np.ndarray,
    step: float,
    rng: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return chains from some samples, whose margins stay below the largest, and the next step."""
    level, places, margins = margin.max(), [], []
    for _ in range(round(1 / SHARE)):
        z = rng.standard_normal(u.shape)
        other = math.sqrt(1 - step**2) * u + step * z
        other_margin = least(other)
        better = other_margin <= level
        u, margin = np.where(better[:, None], other, u), np.where(better, other_margin, margin)
        step = min(0.99, step * math.exp(float(better.mean()) - ACCEPTED))
        places.append(u)
        margins.append(margin)
    return np.concatenate(places), np.concatenate(margins), step
