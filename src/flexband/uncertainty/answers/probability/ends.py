"""Values of the interval inputs at which the probability of leaving limits is least and largest.

Probabilities at different η are compared with the same samples u (common random numbers), which are
those of a mixture around rare samples at several η. A search needs a function that is smooth and
never zero, so that margins g count as Φ(−g/s) with a small s: a part of how much they scatter with
u, each on its own, since some hardly do. It starts from the best of many η, vertices first.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np
from scipy.special import erf, log_ndtr, ndtr, ndtri

from flexband.uncertainty.answers.probability.importance import Mixture
from flexband.uncertainty.answers.probability.states import LimitState
from flexband.uncertainty.answers.probability.subset import COUNT, Rare, rare
from flexband.uncertainty.inputs.sampling import sobol

SAMPLES = 512
"""Common samples."""

SMOOTH, GROUP = 0.05, 32
"""s, in standard deviations of a margin, and samples that tell these."""

MOST_VERTICES, INSIDE = 128, 32
"""Most vertices of the box, and other points, from which the search starts."""

SLACK = 0.3
"""Margins up to this part of the standard deviation of the least margin decide as well."""

ROUGH = 2
"""Points that are the best by the means and scatters of margins, which are looked at as well."""

LEFT_OUT = 0.01
"""Part of the probability at some η, by the means and scatters of margins, of a time left out."""

STARTS = 3
"""Points that are improved, for each end."""

STEPS = (0.5, 0.25, 0.1, 0.04)
"""Steps in η of the pattern search."""


def places(m: int, rng: np.random.Generator) -> np.ndarray:
    """Return η from which ends are searched, shape (points, m): vertices and points inside."""
    if m == 0:
        return np.zeros((1, 0))
    if 2**m <= MOST_VERTICES:
        corners = np.array(list(product((-1.0, 1.0), repeat=m)))
    else:
        corners = rng.choice([-1.0, 1.0], (MOST_VERTICES, m))
    faces = np.concatenate([np.zeros((1, m)), np.eye(m), -np.eye(m)])
    return np.concatenate([corners, faces, 2 * sobol(INSIDE, m) - 1])


def ends(
    state: LimitState, n: int, m: int, rng: np.random.Generator, *, thin: bool = True
) -> tuple[np.ndarray, list[Rare], LimitState]:
    """Return η of the least and of the largest probability, and rare samples at both.

    Parameters
    ----------
    n, m : numbers of variables u and η.
    thin : whether only times are searched that decide about some rare samples.

    Returns
    -------
    η, shape (2, m); rare samples at each; the state at the times that decide in the search.
    """
    if m == 0:
        alone = rare(lambda u: state.least(u, np.zeros(0)), n, rng)
        return np.zeros((2, 0)), [alone, alone], state
    joint = rare(lambda z: state.least(z[:, :n], erf(z[:, n:] / np.sqrt(2))), n + m, rng)
    near = joint.u if len(joint.u) else rng.standard_normal((SAMPLES, n + m))
    points = np.concatenate([places(m, rng), erf(near[:8, n:] / np.sqrt(2))])
    scatter = state.scatter(ndtri(sobol(GROUP, n)), points)
    chances = [ndtr(-mean / std) for mean, std in scatter]
    rough = np.sum([own.sum(axis=(1, 2)) for own in chances], axis=0)
    own, alike = state, state.in_parts_of([std.mean(axis=0) for _, std in scatter])
    if thin:
        u, eta = near[:SAMPLES, :n], erf(near[:SAMPLES, n:] / np.sqrt(2))
        times = state.deciding(u, eta, SLACK * _spread(state, n, eta[:GROUP], rng))
        # Rare samples hardly see times that decide at few η only.
        likely = [np.any(one > LEFT_OUT * rough[:, None, None], axis=(0, 1)) for one in chances]
        times = [one | other for one, other in zip(times, likely, strict=True)]
        own, alike = own.at(times), alike.at(times)
    mixture = Mixture.of(joint.u[:, :n], rng)
    size = _sizes(alike, mixture, rng)
    sizes = np.array([size(one) for one in points])
    some = points[[sizes.argmin(), sizes.argmax(), *np.argsort(-rough)[:ROUGH]]]
    seen = [Mixture.of(_rare_at(own, one, n, rng).u, rng) for one in some]
    size = _sizes(alike, Mixture.mean(mixture, Mixture.mean(*seen)), rng)
    sizes = np.array([size(one) for one in points])
    eta = np.empty((2, m))
    for end, sign in enumerate((-1.0, 1.0)):
        likely = [np.argsort(-sign * heights)[:ROUGH] for heights in (sizes, rough)]
        tried = [_improved(size, points, sign * sizes, sign)[None], *(points[k] for k in likely)]
        eta[end] = _best(own, np.unique(np.concatenate(tried), axis=0), n, sign, rng)
    return eta, [_rare_at(own, one, n, rng) for one in eta], own


def _rare_at(
    state: LimitState, eta: np.ndarray, n: int, rng: np.random.Generator, count: int = COUNT
) -> Rare:
    """Return rare samples at one η."""
    return rare(lambda u: state.least(u, eta), n, rng, count)


def _best(
    state: LimitState, several: np.ndarray, n: int, sign: float, rng: np.random.Generator
) -> np.ndarray:
    """Return the η of several with the largest probability, or the least if the sign is −1.

    Each has samples of its own: common ones may hardly see what leaves the limits at one of them.
    """
    heights = []
    for eta in several:
        known = _rare_at(state, eta, n, rng, SAMPLES)
        mixture = Mixture.of(known.u, rng)
        u = mixture.sample(2 * SAMPLES, rng)
        inside = mixture.weights(u) * (state.least(u, eta) < 0)
        heights.append((sign * float(inside.mean()), sign * known.probability))
    return several[heights.index(max(heights))]


def _spread(state: LimitState, n: int, points: np.ndarray, rng: np.random.Generator) -> float:
    """Return how much the least margin varies with u: its standard deviation, mean over η."""
    u = rng.standard_normal((len(points) * GROUP, n))
    least = state.least(u, np.repeat(points, GROUP, axis=0))
    return float(least.reshape(-1, GROUP).std(axis=1).mean())


def _sizes(
    state: LimitState, mixture: Mixture, rng: np.random.Generator
) -> Callable[[np.ndarray], float]:
    """Return a function of η: the logarithm of a smoothed probability, by common samples."""
    u = mixture.sample(SAMPLES, rng)
    weights = np.log(mixture.weights(u))

    def size(eta: np.ndarray) -> float:
        logs = weights + log_ndtr(-state.least(u, eta) / SMOOTH)
        return float(np.logaddexp.reduce(logs))

    return size


def _improved(
    size: Callable[[np.ndarray], float], points: np.ndarray, heights: np.ndarray, sign: float
) -> np.ndarray:
    """Return the best η that a pattern search finds from the best points; heights = sign size."""
    best, highest = points[0], -np.inf
    for k in np.argsort(-heights, kind="stable")[:STARTS]:
        at, height = points[k], heights[k]
        for step in STEPS:
            moved = True
            while moved:
                moved = False
                for v, change in product(range(len(at)), (step, -step)):
                    other = at.copy()
                    other[v] = np.clip(at[v] + change, -1, 1)
                    if other[v] != at[v] and (found := sign * size(other)) > height + 1e-12:
                        at, height, moved = other, found, True
        if height > highest:
            best, highest = at, height
    return best
