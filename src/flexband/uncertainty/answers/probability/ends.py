"""Values of the interval inputs at which the probability of leaving limits is least and largest.

Probabilities at different η are compared with the same samples u (common random numbers), which are
those of a mixture around rare samples at several η. A search needs a function that is smooth and
never zero, so that margins g count as Φ(−g/s) with a small s. It starts from the best of many η,
vertices first.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np
from scipy.special import erf, log_ndtr

from flexband.uncertainty.answers.probability.importance import Mixture
from flexband.uncertainty.answers.probability.states import LimitState
from flexband.uncertainty.answers.probability.subset import Rare, rare
from flexband.uncertainty.inputs.sampling import sobol

SAMPLES = 512
"""Common samples."""

SMOOTH, GROUP = 0.05, 32
"""s, in standard deviations of the least margin, and samples that tell these."""

MOST_VERTICES, INSIDE = 128, 32
"""Most vertices of the box, and other points, from which the search starts."""

SLACK = 0.3
"""Margins up to this part of the standard deviation of the least margin decide as well."""

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
    own = state
    if thin:
        some = near[:SAMPLES]
        slack = SLACK * _spread(state, n, erf(some[:GROUP, n:] / np.sqrt(2)), rng)
        own = state.where_least(some[:, :n], erf(some[:, n:] / np.sqrt(2)), slack)
    points = np.concatenate([places(m, rng), erf(near[:8, n:] / np.sqrt(2))])
    width = SMOOTH * max(_spread(own, n, points, rng), 1e-12)
    mixture = Mixture.of(joint.u[:, :n], rng)
    found: list[Rare] = []
    eta = np.zeros((2, m))
    for improve in (False, True):
        size = _sizes(own, mixture, width, rng)
        sizes = np.array([size(one) for one in points])
        eta = points[[sizes.argmin(), sizes.argmax()]]
        if improve:
            eta = np.stack([_improved(size, points, sign * sizes, sign) for sign in (-1.0, 1.0)])
        found = [rare(lambda u, one=one: own.least(u, one), n, rng) for one in eta]
        low, high = (Mixture.of(one.u, rng) for one in found)
        mixture = mixture + (low + high)
    return eta, found, own


def _spread(state: LimitState, n: int, points: np.ndarray, rng: np.random.Generator) -> float:
    """Return how much the least margin varies with u: its standard deviation, mean over η."""
    u = rng.standard_normal((len(points) * GROUP, n))
    least = state.least(u, np.repeat(points, GROUP, axis=0))
    return float(least.reshape(-1, GROUP).std(axis=1).mean())


def _sizes(
    state: LimitState, mixture: Mixture, width: float, rng: np.random.Generator
) -> Callable[[np.ndarray], float]:
    """Return a function of η: the logarithm of a smoothed probability, by common samples."""
    u = mixture.sample(SAMPLES, rng)
    weights = np.log(mixture.weights(u))

    def size(eta: np.ndarray) -> float:
        logs = weights + log_ndtr(-state.least(u, eta) / width)
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
