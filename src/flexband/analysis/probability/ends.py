"""Values of the interval inputs at which the probability of violating limits is least and largest.

Probabilities at different η are compared with the same samples u (common random numbers), which are
those of a mixture around rare samples at several η. A search needs a function that is smooth and
never zero, so that margins g count as Φ(−g/s) with a small s: a part of how much they scatter with
u, each on its own, since some hardly do. It starts from the best of many η, vertices first.

What it finds is compared with more common samples, around rare samples of all that are compared;
the best is improved with further samples around its own. How far a search with fresh samples still
rises there, and how far another place may exceed it, is the noise of the search.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial
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

    samples: int = 512
    """Common samples of the search."""
    compared_samples: int = 4000
    """Samples with which the best places of the search are compared."""
    smoothing: float = 0.05
    """The s of the smoothing, in standard deviations of a margin."""
    scatter_samples: int = 32
    """Samples that give standard deviations of margins."""
    max_vertices: int = 128
    """Most vertices of the box from which the search starts."""
    inside_points: int = 32
    """Other points from which the search starts."""
    slack: float = 0.3
    """Margins that decide as well, in standard deviations of the least one."""
    rough_points: int = 2
    """Points that are best by means and scatters of margins, and looked at as well."""
    omitted_share: float = 0.01
    """Part of the probability, by means and scatters of margins, at a time left out."""
    starts: int = 3
    """Points that are improved, for each end."""
    steps: tuple[float, ...] = (0.5, 0.25, 0.1, 0.04)
    """Steps of the pattern search in η."""
    fine_steps: tuple[float, ...] = (0.1, 0.03, 0.01)
    """Steps of the search from the best place."""
    same_distance: float = 0.1
    """Distance of places that count as one."""
    importance: ImportanceOptions = field(default_factory=ImportanceOptions)


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
    search = _EndSearch(n, rng, options)
    count = options.samples
    if m == 0:
        rare_samples = search.rare(state, np.zeros(0))
        return np.zeros((2, 0)), [rare_samples, rare_samples], np.zeros(2), state

    def least_margins(z: np.ndarray) -> np.ndarray:
        return state.least_margins(z[:, :n], erf(z[:, n:] / np.sqrt(2)))

    # Select points from which the search may start, and the times that decide.
    joint = rare(least_margins, n + m, rng, options=options.importance.subset)
    joint_samples = joint.u if len(joint.u) else rng.standard_normal((count, n + m))
    points = np.concatenate([search.starts(m), erf(joint_samples[:8, n:] / np.sqrt(2))])
    scatter = state.scatter(ndtri(sobol(options.scatter_samples, n)), points)
    chances = [ndtr(-mean / std) for mean, std in scatter]
    chance_sums = np.sum([chance.sum(axis=(1, 2)) for chance in chances], axis=0)
    scaled_state = state.in_parts_of([std.mean(axis=0) for _, std in scatter])
    if thin:
        u = joint_samples[:count, :n]
        eta = erf(joint_samples[:count, n:] / np.sqrt(2))
        times = state.decisive_times(u, eta, options.slack * search.spread(state, eta))
        # Rare samples hardly see times that decide at few η only.
        floor = options.omitted_share * chance_sums[:, None, None]
        likely = [np.any(chance > floor, axis=(0, 1)) for chance in chances]
        times = [mask | other for mask, other in zip(times, likely, strict=True)]
        state, scaled_state = state.at(times), scaled_state.at(times)
    # Compare the points with common samples, then with those that are also around extremes.
    mixture = search.mixture([joint.u[:, :n]])
    size = search.sizes(scaled_state, mixture, count)
    sizes = np.array([size(point) for point in points])
    extremes = [sizes.argmin(), sizes.argmax(), *np.argsort(-chance_sums)[: options.rough_points]]
    at_extremes = search.mixture(search.rare(state, point).u for point in points[extremes])
    size = search.sizes(scaled_state, Mixture.mean(mixture, at_extremes), count)
    sizes = np.array([size(point) for point in points])
    # Climb from the best points to each end.
    eta = np.empty((2, m))
    noise = np.empty(2)
    for end, sign in enumerate((-1.0, 1.0)):
        likely = [
            np.argsort(-sign * heights)[: options.rough_points] for heights in (sizes, chance_sums)
        ]
        order = np.argsort(-sign * sizes, kind="stable")
        summits = (_climb(size, points[k], sign, options.steps) for k in order[: options.starts])
        highest, _ = max(summits, key=lambda pair: pair[1])
        candidates = np.concatenate([highest[None], *(points[k] for k in likely)])
        eta[end], noise[end] = search.best(state, scaled_state, np.unique(candidates, axis=0), sign)
    return eta, [search.rare(state, place) for place in eta], noise, state


def rare_at(
    state: LimitState,
    eta: np.ndarray,
    n: int,
    rng: np.random.Generator,
    count: int | None = None,
    *,
    options: EndOptions = EndOptions(),
) -> Rare:
    """Return rare samples of n variables u at one η; `count` is that of a level."""
    return rare(
        partial(state.least_margins, eta=eta), n, rng, count, options=options.importance.subset
    )


@dataclass(frozen=True)
class _EndSearch:
    """A search over η with common samples of n variables u."""

    n: int
    rng: np.random.Generator
    options: EndOptions

    def starts(self, m: int) -> np.ndarray:
        """Return η from which ends are searched, (points, m): vertices and points inside."""
        max_corners = self.options.max_vertices
        if 2**m <= max_corners:
            corners = np.array(list(product((-1.0, 1.0), repeat=m)))
        else:
            corners = self.rng.choice([-1.0, 1.0], (max_corners, m))
        faces = np.concatenate([np.zeros((1, m)), np.eye(m), -np.eye(m)])
        return np.concatenate([corners, faces, 2 * sobol(self.options.inside_points, m) - 1])

    def rare(self, state: LimitState, eta: np.ndarray, count: int | None = None) -> Rare:
        """Return rare samples at one η."""
        return rare_at(state, eta, self.n, self.rng, count, options=self.options)

    def mixture(self, groups: Iterable[np.ndarray]) -> Mixture:
        """Return a mixture around several groups of rare samples, in equal parts."""
        mixture_options = self.options.importance.subset.mixture
        return Mixture.mean(
            *(Mixture.from_samples(u, self.rng, options=mixture_options) for u in groups)
        )

    def spread(self, state: LimitState, points: np.ndarray) -> float:
        """Return how much the least margin varies with u: its standard deviation, mean over η."""
        count = self.options.scatter_samples
        points = points[:count]
        u = self.rng.standard_normal((len(points) * count, self.n))
        least_margins = state.least_margins(u, np.repeat(points, count, axis=0))
        return float(least_margins.reshape(-1, count).std(axis=1).mean())

    def sizes(
        self, state: LimitState, mixture: Mixture, count: int
    ) -> Callable[[np.ndarray], float]:
        """Return a function of η: the logarithm of a smoothed probability, by common samples."""
        u = mixture.sample(count, self.rng)
        weights = np.log(mixture.weights(u))

        def size(eta: np.ndarray) -> float:
            logs = weights + log_ndtr(-state.least_margins(u, eta) / self.options.smoothing)
            return float(np.logaddexp.reduce(logs))

        return size

    def best(
        self, state: LimitState, scaled_state: LimitState, places: np.ndarray, sign: float
    ) -> tuple[np.ndarray, float]:
        """Return the η with the largest probability, or the least if the sign is −1, and the noise.

        The common samples are around rare samples at all of the `places`, (places, m), that are
        compared: those of a few may hardly see what violates the limits at another. For the search
        near the best place, `scaled_state` has margins relative to their scatter.
        """
        options = self.options
        count = self.options.compared_samples
        # Compare the places with common samples around the rare samples of all.
        rare_samples = [self.rare(state, eta, options.samples) for eta in places]
        mixture = self.mixture(samples.u for samples in rare_samples)
        u = mixture.sample(count, self.rng)
        weights = mixture.weights(u)
        out = np.array([weights * (state.least_margins(u, eta) < 0) for eta in places])
        pairs = zip(out.mean(1), rare_samples, strict=True)
        heights = [(sign * p, sign * samples.probability) for p, samples in pairs]
        best = heights.index(max(heights))
        at = places[best]
        probability = float(out[best].mean())
        if not len(rare_samples[best].u) or not probability:
            return at, 0.0
        # Expect how far another place may exceed the best one: noise of the search.
        gain = sign * (out - out[best]).mean(axis=1)
        scatter = (out - out[best]).std(axis=1)
        scatter = scatter / np.sqrt(count) + 1e-300
        z = gain / scatter
        density = np.exp(-(z**2) / 2) / np.sqrt(2 * np.pi)
        exceeded = gain * ndtr(z) + scatter * density  # expectation
        noise = float(np.log1p(exceeded.max() / probability)) if len(places) > 1 else 0.0
        # Improve the best place with further samples around its own.
        least_margin = partial(state.least_margins, eta=at)
        local_mixture = mixture_around(
            least_margin, rare_samples[best].u, self.rng, options=options.importance
        )
        at, _ = _climb(self.sizes(scaled_state, local_mixture, count), at, sign, options.fine_steps)
        fresh = self.sizes(scaled_state, local_mixture, count)
        return at, noise + _climb(fresh, at, sign, options.fine_steps)[1] - sign * fresh(at)


def _climb(
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
                    at = trial
                    height = trial_height
                    moved = True
    return at, height
