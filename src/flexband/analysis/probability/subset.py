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
from dataclasses import dataclass, field

import numpy as np
from scipy.special import chdtri

from flexband.analysis.probability.importance import Mixture, MixtureOptions

Margins = Callable[[np.ndarray], np.ndarray]
"""Standard normal variables u, shape (points, n) -> least margins, (points,)."""


@dataclass(frozen=True)
class SubsetOptions:
    """How rare samples are searched."""

    level_samples: int = 1000
    """Samples of a level."""
    level_share: float = 0.1
    """Part of a level that is below the next one."""
    min_probability: float = 1e-10
    """Smallest probability that is looked for."""
    accepted_share: float = 0.44
    """Part of the steps of a chain that are accepted."""
    scouts: int = 600
    """Scouts of each scale."""
    scout_scales: tuple[float, ...] = (1.3, 2.0, 3.0)
    """Scales of scouts, in standard deviations of the inputs."""
    beyond_scouts: float = 1e-12
    """Probability of larger radii than those of scouts."""
    scout_chains: int = 200
    """Chains that scouts start."""
    scout_renewals: int = 3
    """Times that each of these chains makes ten steps."""
    unlike_factor: float = 10.0
    """Factor of the weights of samples that a mixture around others hardly sees."""
    new_region_share: float = 0.02
    """Part of such samples from which on they are another region."""
    mixture: MixtureOptions = field(default_factory=MixtureOptions)
    """Mixtures that compare both."""


@dataclass(frozen=True)
class Rare:
    """Samples with negative margins."""

    u: np.ndarray  # (count, n); none if no margin is negative
    probability: float  # of a negative margin, about; an upper bound if there is no sample


def rare(
    least_margin: Margins,
    dimension: int,
    rng: np.random.Generator,
    count: int | None = None,
    *,
    scouts: bool = True,
    options: SubsetOptions = SubsetOptions(),
) -> Rare:
    """Return samples with negative margins; `count` is that of a level, by default the options'."""
    u = rng.standard_normal((count or options.level_samples, dimension))
    margin = least_margin(u)
    probability = 1.0
    step = 0.6
    share = options.level_share
    few = round(len(u) * share)
    while True:
        negative = margin < 0
        if negative.sum() >= few:
            probability *= float(negative.mean())
            break
        if probability * share < options.min_probability:
            probability *= float(negative.mean()) or -math.log(0.05) / few
            break
        probability *= share
        order = np.argsort(margin, kind="stable")[:few]
        u, margin, step = _chains(least_margin, u[order], margin[order], step, rng, options)
    rare_samples = Rare(u[negative], probability)
    if not scouts or probability >= share:
        return rare_samples
    return _with_scouts(rare_samples, least_margin, dimension, rng, options)


def _with_scouts(
    rare_samples: Rare,
    least_margin: Margins,
    n: int,
    rng: np.random.Generator,
    options: SubsetOptions,
) -> Rare:
    """Return rare samples with those that scouts find, and the probability of all of them."""
    # Send scouts in all directions.
    z = rng.standard_normal((options.scouts * len(options.scout_scales), n))
    scale = np.repeat(options.scout_scales, options.scouts)
    chains = options.scout_chains
    farthest = math.sqrt(chdtri(n, options.beyond_scouts))
    size = np.minimum(scale * np.linalg.norm(z, axis=1), farthest)
    u = z * (size / np.linalg.norm(z, axis=1))[:, None]
    margin = least_margin(u)
    out = margin < 0
    if not out.any():
        return rare_samples
    # Start chains from those outside, and see whether they are in another region.
    u = u[out]
    nearest = np.argsort(np.sum(u**2, axis=1), kind="stable")[: chains // 2]
    u = u[np.concatenate([nearest, rng.choice(len(u), chains - len(nearest))])]
    step = 0.3
    for _ in range(options.scout_renewals):
        chain_samples, _, step = _chains(least_margin, u, np.zeros(chains), step, rng, options)
        u = chain_samples[-chains:]  # those before it are too much like it to count
    if len(rare_samples.u):
        weights = Mixture.from_samples(rare_samples.u, rng, options=options.mixture).weights
        unlike = weights(u) > options.unlike_factor * np.quantile(weights(rare_samples.u), 0.9)
        if unlike.mean() < options.new_region_share:
            return rare_samples
    # Estimate the probability of all regions.
    all_samples = np.concatenate([rare_samples.u, u])
    mixture = Mixture.from_samples(all_samples, rng, options=options.mixture)
    trials = mixture.sample(options.level_samples, rng)
    estimate = float(np.mean(mixture.weights(trials) * (least_margin(trials) < 0)))
    scout_estimate = estimate or options.min_probability
    return Rare(
        all_samples,
        max(estimate, rare_samples.probability) if len(rare_samples.u) else scout_estimate,
    )


def _chains(
    least_margin: Margins,
    u: np.ndarray,
    margin: np.ndarray,
    step: float,
    rng: np.random.Generator,
    options: SubsetOptions,
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return chains from some samples, whose margins stay below the largest, and the next step."""
    level = margin.max()
    places = []
    margins = []
    for _ in range(round(1 / options.level_share)):
        z = rng.standard_normal(u.shape)
        proposed = math.sqrt(1 - step**2) * u + step * z
        proposed_margin = least_margin(proposed)
        accepted = proposed_margin <= level
        u = np.where(accepted[:, None], proposed, u)
        margin = np.where(accepted, proposed_margin, margin)
        step = min(0.99, step * math.exp(float(accepted.mean()) - options.accepted_share))
        places.append(u)
        margins.append(margin)
    return np.concatenate(places), np.concatenate(margins), step
