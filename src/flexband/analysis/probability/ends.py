"""Values of the interval inputs at which the probability of leaving limits is least and largest.

Probabilities at different η are compared with the same samples u (common random numbers), which are
those of a mixture around rare samples at several η. A search needs a function that is smooth and
never zero, so that margins g count as Φ(−g/s) with a small s: a part of how much they scatter with
u, each on its own, since some hardly do. It starts from the best of many η, vertices first.

What it finds is compared with more common samples, around rare samples of all that are compared;
the best is improved with further samples around its own. How far a search with fresh samples still
rises there, and how far another place may exceed it, is the noise of the search.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product

import numpy as np
from scipy.special import erf, log_ndtr, ndtr, ndtri
from scipy.stats import norm

from flexband.analysis.probability.estimates import mixture_around
from flexband.analysis.probability.importance import Mixture
from flexband.analysis.probability.states import LimitState
from flexband.analysis.probability.subset import COUNT, Rare, rare
from flexband.uncertainty.inputs.sampling import sobol

SAMPLES, COMPARED = 512, 4000
"""Common samples of the search, and those with which its best places are compared."""

SMOOTH, GROUP = 0.05, 32
"""s, in standard deviations of a margin, and samples that tell these."""

MAX_VERTICES, INSIDE = 128, 32
"""Most vertices of the box, and other points, from which the search starts."""

SLACK = 0.3
"""Margins up to this part of the standard deviation of the least margin decide as well."""

ROUGH = 2
"""Points that are the best by the means and scatters of margins, which are looked at as well."""

LEFT_OUT = 0.01
"""Part of the probability at some η, by the means and scatters of margins, of a time left out."""

STARTS = 3
"""Points that are improved, for each end."""

STEPS, FINE_STEPS = (0.5, 0.25, 0.1, 0.04), (0.1, 0.03, 0.01)
"""Steps in η of the pattern search, and of that from the best place."""


def places(m: int, rng: np.random.Generator) -> np.ndarray:
    """Return η from which ends are searched, shape (points, m): vertices and points inside."""
    if m == 0:
        return np.zeros((1, 0))
    if 2**m <= MAX_VERTICES:
        corners = np.array(list(product((-1.0, 1.0), repeat=m)))
    else:
        corners = rng.choice([-1.0, 1.0], (MAX_VERTICES, m))
    faces = np.concatenate([np.zeros((1, m)), np.eye(m), -np.eye(m)])
    return np.concatenate([corners, faces, 2 * sobol(INSIDE, m) - 1])


def ends(
    state: LimitState, n: int, m: int, rng: np.random.Generator, *, thin: bool = True
) -> tuple[np.ndarray, list[Rare], np.ndarray, LimitState]:
    """Return η of the least and of the largest probability, and rare samples at both.

    Parameters
    ----------
    n, m : numbers of variables u and η.
    thin : whether only times are searched that decide about some rare samples.

    Returns
    -------
    η, shape (2, m); rare samples at each; the noise of the search, as a logarithm of the
    probability, (2,); the state at the times that decide in the search.
    """
    if m == 0:
        alone = rare(lambda u: state.least(u, np.zeros(0)), n, rng)
        return np.zeros((2, 0)), [alone, alone], np.zeros(2), state
    joint = rare(lambda z: state.least(z[:, :n], erf(z[:, n:] / np.sqrt(2))), n + m, rng)
    near = joint.u if len(joint.u) else rng.standard_normal((SAMPLES, n + m))
    points = np.concatenate([places(m, rng), erf(near[:8, n:] / np.sqrt(2))])
    scatter = state.scatter(ndtri(sobol(GROUP, n)), points)
    chances = [ndtr(-mean / std) for mean, std in scatter]
    rough = np.sum([chance.sum(axis=(1, 2)) for chance in chances], axis=0)
    deciding_state, alike = state, state.in_parts_of([std.mean(axis=0) for _, std in scatter])
    if thin:
        u, eta = near[:SAMPLES, :n], erf(near[:SAMPLES, n:] / np.sqrt(2))
        times = state.deciding(u, eta, SLACK * _spread(state, n, eta[:GROUP], rng))
        # Rare samples hardly see times that decide at few η only.
        likely = [
            np.any(chance > LEFT_OUT * rough[:, None, None], axis=(0, 1)) for chance in chances
        ]
        times = [mask | other for mask, other in zip(times, likely, strict=True)]
        deciding_state, alike = deciding_state.at(times), alike.at(times)
    mixture = Mixture.of(joint.u[:, :n], rng)
    size = _sizes(alike, mixture, rng)
    sizes = np.array([size(point) for point in points])
    some = points[[sizes.argmin(), sizes.argmax(), *np.argsort(-rough)[:ROUGH]]]
    mixtures = [Mixture.of(_rare_at(deciding_state, point, n, rng).u, rng) for point in some]
    size = _sizes(alike, Mixture.mean(mixture, Mixture.mean(*mixtures)), rng)
    sizes = np.array([size(point) for point in points])
    eta, noise = np.empty((2, m)), np.empty(2)
    for end, sign in enumerate((-1.0, 1.0)):
        likely = [np.argsort(-sign * heights)[:ROUGH] for heights in (sizes, rough)]
        tried = [_improved(size, points, sign * sizes, sign)[None], *(points[k] for k in likely)]
        places_tried = np.unique(np.concatenate(tried), axis=0)
        eta[end], noise[end] = _best(deciding_state, alike, places_tried, n, sign, rng)
    return eta, [_rare_at(deciding_state, place, n, rng) for place in eta], noise, deciding_state


def _rare_at(
    state: LimitState, eta: np.ndarray, n: int, rng: np.random.Generator, count: int = COUNT
) -> Rare:
    """Return rare samples at one η."""
    return rare(lambda u: state.least(u, eta), n, rng, count)


def _best(
    state: LimitState,
    alike: LimitState,
    several: np.ndarray,
    n: int,
    sign: float,
    rng: np.random.Generator,
) -> tuple[np.ndarray, float]:
    """Return the η with the largest probability, or the least if the sign is −1, and the noise.

    The common samples are around rare samples at all of the places: those of a few may hardly see
    what leaves the limits at another.

    Parameters
    ----------
    alike : the state with margins in parts of their scatter, for the search near the best place.
    several : the places that are compared, shape (places, m).
    """
    known = [_rare_at(state, eta, n, rng, SAMPLES) for eta in several]
    mixture = Mixture.mean(*(Mixture.of(rare_samples.u, rng) for rare_samples in known))
    u = mixture.sample(COMPARED, rng)
    weights = mixture.weights(u)
    out = np.array([weights * (state.least(u, eta) < 0) for eta in several])
    heights = [
        (sign * p, sign * rare_samples.probability)
        for p, rare_samples in zip(out.mean(1), known, strict=True)
    ]
    best = heights.index(max(heights))
    at, probability = several[best], float(out[best].mean())
    if not len(known[best].u) or not probability:
        return at, 0.0
    gain, scatter = sign * (out - out[best]).mean(axis=1), (out - out[best]).std(axis=1)
    scatter = scatter / np.sqrt(COMPARED) + 1e-300
    exceeded = gain * ndtr(gain / scatter) + scatter * norm.pdf(gain / scatter)  # expectation
    noise = float(np.log1p(exceeded.max() / probability)) if len(several) > 1 else 0.0
    near = mixture_around(lambda u: state.least(u, at), known[best].u, rng)
    size = _sizes(alike, near, rng, COMPARED)
    at, _ = _climbed(size, at, sign, FINE_STEPS)
    fresh = _sizes(alike, near, rng, COMPARED)
    return at, noise + _climbed(fresh, at, sign, FINE_STEPS)[1] - sign * fresh(at)


def _spread(state: LimitState, n: int, points: np.ndarray, rng: np.random.Generator) -> float:
    """Return how much the least margin varies with u: its standard deviation, mean over η."""
    u = rng.standard_normal((len(points) * GROUP, n))
    least = state.least(u, np.repeat(points, GROUP, axis=0))
    return float(least.reshape(-1, GROUP).std(axis=1).mean())


def _sizes(
    state: LimitState, mixture: Mixture, rng: np.random.Generator, count: int = SAMPLES
) -> Callable[[np.ndarray], float]:
    """Return a function of η: the logarithm of a smoothed probability, by common samples."""
    u = mixture.sample(count, rng)
    weights = np.log(mixture.weights(u))

    def size(eta: np.ndarray) -> float:
        logs = weights + log_ndtr(-state.least(u, eta) / SMOOTH)
        return float(np.logaddexp.reduce(logs))

    return size


def _improved(
    size: Callable[[np.ndarray], float], points: np.ndarray, heights: np.ndarray, sign: float
) -> np.ndarray:
    """Return the best η that a pattern search finds from the best points; heights = sign size."""
    starts = points[np.argsort(-heights, kind="stable")[:STARTS]]
    return max((_climbed(size, at, sign, STEPS) for at in starts), key=lambda pair: pair[1])[0]


def _climbed(
    size: Callable[[np.ndarray], float], at: np.ndarray, sign: float, steps: Sequence[float]
) -> tuple[np.ndarray, float]:
    """Return the place that a pattern search reaches from another, and the sign times the size."""
    height = sign * size(at)
    for step in steps:
        moved = True
        while moved:
            moved = False
            for v, change in product(range(len(at)), (step, -step)):
                other = at.copy()
                other[v] = np.clip(at[v] + change, -1, 1)
                if other[v] != at[v] and (other_height := sign * size(other)) > height + 1e-12:
                    at, height, moved = other, other_height, True
    return at, height
