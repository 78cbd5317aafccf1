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
from dataclasses import dataclass, field
from itertools import product

import numpy as np
from scipy.special import erf, log_ndtr, ndtr, ndtri

from flexband.analysis.probability.estimates import ImportanceOptions, mixture_around
from flexband.analysis.probability.importance import Mixture
from flexband.analysis.probability.states import LimitState
from flexband.analysis.probability.subset import Rare, rare
from flexband.uncertainty.inputs.sampling import sobol


@dataclass(frozen=True)
class EndOptions:
    """How the least and the largest probability over the interval inputs are searched."""

    samples: int = 512  # common samples of the search
    compared_samples: int = 4000  # with which its best places are compared
    smoothing: float = 0.05  # s, in standard deviations of a margin
    scatter_samples: int = 32  # that give these
    max_vertices: int = 128  # of the box, from which the search starts
    inside_points: int = 32  # other points from which it starts
    slack: float = 0.3  # in standard deviations of the least margin: those below decide as well
    rough_points: int = 2  # the best by means and scatters of margins, which are compared as well
    omitted_share: float = 0.01  # part of the probability by these, at a time that is left out
    starts: int = 3  # points that are improved, for each end
    steps: tuple[float, ...] = (0.5, 0.25, 0.1, 0.04)  # of the pattern search, in η
    fine_steps: tuple[float, ...] = (0.1, 0.03, 0.01)  # of that from the best place
    importance: ImportanceOptions = field(default_factory=ImportanceOptions)


def starts(m: int, rng: np.random.Generator, options: EndOptions) -> np.ndarray:
    """Return η from which ends are searched, shape (points, m): vertices and points inside."""
    if 2**m <= options.max_vertices:
        corners = np.array(list(product((-1.0, 1.0), repeat=m)))
    else:
        corners = rng.choice([-1.0, 1.0], (options.max_vertices, m))
    faces = np.concatenate([np.zeros((1, m)), np.eye(m), -np.eye(m)])
    return np.concatenate([corners, faces, 2 * sobol(options.inside_points, m) - 1])


def ends(
    state: LimitState,
    n: int,
    m: int,
    rng: np.random.Generator,
    *,
    thin: bool = True,
    options: EndOptions = EndOptions(),
) -> tuple[np.ndarray, list[Rare], np.ndarray, LimitState]:
    """Return η of the least and of the largest probability, (2, m), and rare samples at both.

    Then the noise of the search, as a logarithm of the probability, (2,), and the state at the
    times that decide in the search: those that decide about some rare samples, if it is `thin`.
    There are n variables u, and m of η.
    """
    subset, count = options.importance.subset, options.samples
    if m == 0:
        known = _rare_at(state, np.zeros(0), n, rng, options)
        return np.zeros((2, 0)), [known, known], np.zeros(2), state

    def least(z: np.ndarray) -> np.ndarray:
        return state.least(z[:, :n], erf(z[:, n:] / np.sqrt(2)))

    joint = rare(least, n + m, rng, options=subset)
    near = joint.u if len(joint.u) else rng.standard_normal((count, n + m))
    points = np.concatenate([starts(m, rng, options), erf(near[:8, n:] / np.sqrt(2))])
    scatter = state.scatter(ndtri(sobol(options.scatter_samples, n)), points)
    chances = [ndtr(-mean / std) for mean, std in scatter]
    rough = np.sum([chance.sum(axis=(1, 2)) for chance in chances], axis=0)
    deciding_state, alike = state, state.in_parts_of([std.mean(axis=0) for _, std in scatter])
    if thin:
        u, eta = near[:count, :n], erf(near[:count, n:] / np.sqrt(2))
        times = state.deciding(u, eta, options.slack * _spread(state, n, eta, rng, options))
        # Rare samples hardly see times that decide at few η only.
        floor = options.omitted_share * rough[:, None, None]
        likely = [np.any(chance > floor, axis=(0, 1)) for chance in chances]
        times = [mask | other for mask, other in zip(times, likely, strict=True)]
        deciding_state, alike = deciding_state.at(times), alike.at(times)
    mixture = Mixture.of(joint.u[:, :n], rng, options=subset.mixture)
    size = _sizes(alike, mixture, rng, count, options)
    sizes = np.array([size(point) for point in points])
    some = points[[sizes.argmin(), sizes.argmax(), *np.argsort(-rough)[: options.rough_points]]]
    rare_samples = (_rare_at(deciding_state, point, n, rng, options) for point in some)
    mixtures = [Mixture.of(known.u, rng, options=subset.mixture) for known in rare_samples]
    size = _sizes(alike, Mixture.mean(mixture, Mixture.mean(*mixtures)), rng, count, options)
    sizes = np.array([size(point) for point in points])
    eta, noise = np.empty((2, m)), np.empty(2)
    for end, sign in enumerate((-1.0, 1.0)):
        likely = [np.argsort(-sign * heights)[: options.rough_points] for heights in (sizes, rough)]
        order = np.argsort(-sign * sizes, kind="stable")
        climbed = (_climbed(size, points[k], sign, options.steps) for k in order[: options.starts])
        highest, _ = max(climbed, key=lambda pair: pair[1])
        tried = [highest[None], *(points[k] for k in likely)]
        places_tried = np.unique(np.concatenate(tried), axis=0)
        eta[end], noise[end] = _best(deciding_state, alike, places_tried, n, sign, rng, options)
    known = [_rare_at(deciding_state, place, n, rng, options) for place in eta]
    return eta, known, noise, deciding_state


def _rare_at(
    state: LimitState,
    eta: np.ndarray,
    n: int,
    rng: np.random.Generator,
    options: EndOptions,
    count: int | None = None,
) -> Rare:
    return rare(lambda u: state.least(u, eta), n, rng, count, options=options.importance.subset)


def _best(
    state: LimitState,
    alike: LimitState,
    several: np.ndarray,
    n: int,
    sign: float,
    rng: np.random.Generator,
    options: EndOptions,
) -> tuple[np.ndarray, float]:
    """Return the η with the largest probability, or the least if the sign is −1, and the noise.

    The common samples are around rare samples at all of the `several` places, (places, m), that are
    compared: those of a few may hardly see what leaves the limits at another. For the search near
    the best place, the state `alike` has margins in parts of their scatter.
    """
    importance, count = options.importance, options.compared_samples
    known = [_rare_at(state, eta, n, rng, options, options.samples) for eta in several]
    mixture = Mixture.mean(
        *(Mixture.of(samples.u, rng, options=importance.subset.mixture) for samples in known)
    )
    u = mixture.sample(count, rng)
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
    scatter = scatter / np.sqrt(count) + 1e-300
    z = gain / scatter
    density = np.exp(-(z**2) / 2) / np.sqrt(2 * np.pi)
    exceeded = gain * ndtr(z) + scatter * density  # expectation
    noise = float(np.log1p(exceeded.max() / probability)) if len(several) > 1 else 0.0
    near = mixture_around(lambda u: state.least(u, at), known[best].u, rng, options=importance)
    size = _sizes(alike, near, rng, count, options)
    at, _ = _climbed(size, at, sign, options.fine_steps)
    fresh = _sizes(alike, near, rng, count, options)
    return at, noise + _climbed(fresh, at, sign, options.fine_steps)[1] - sign * fresh(at)


def _spread(
    state: LimitState, n: int, points: np.ndarray, rng: np.random.Generator, options: EndOptions
) -> float:
    """Return how much the least margin varies with u: its standard deviation, mean over η."""
    count = options.scatter_samples
    points = points[:count]
    u = rng.standard_normal((len(points) * count, n))
    least = state.least(u, np.repeat(points, count, axis=0))
    return float(least.reshape(-1, count).std(axis=1).mean())


def _sizes(
    state: LimitState,
    mixture: Mixture,
    rng: np.random.Generator,
    count: int,
    options: EndOptions,
) -> Callable[[np.ndarray], float]:
    """Return a function of η: the logarithm of a smoothed probability, by common samples."""
    u = mixture.sample(count, rng)
    weights = np.log(mixture.weights(u))

    def size(eta: np.ndarray) -> float:
        logs = weights + log_ndtr(-state.least(u, eta) / options.smoothing)
        return float(np.logaddexp.reduce(logs))

    return size


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
                trial = at.copy()
                trial[v] = np.clip(at[v] + change, -1, 1)
                if trial[v] != at[v] and (trial_height := sign * size(trial)) > height + 1e-12:
                    at, height, moved = trial, trial_height, True
    return at, height
