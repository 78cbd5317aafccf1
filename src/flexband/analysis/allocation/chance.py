"""The cheapest tolerances for a stated probability of violating limits: a chance constraint.

The probability of violating any limit at any time is estimated by importance sampling, where it is
largest over the interval inputs. Near these tolerances it is a function of them by the same rare
samples (common random numbers), a smooth one if margins g count as Φ(−g/s) with a small s. This
function replaces it in a search within a trust region, at whose end it is estimated again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
import scipy
from scipy.special import log_ndtr

from flexband.analysis.allocation.tolerances import Tolerances
from flexband.analysis.labelled_answers import is_judged
from flexband.analysis.probability.ends import EndOptions, ends
from flexband.analysis.probability.estimates import Estimate, estimate, mixture_around
from flexband.analysis.probability.first_passage import Place, corrected_at_worst
from flexband.analysis.probability.model import ResponseModel
from flexband.analysis.probability.probability_correction import Correction, with_missed
from flexband.analysis.probability.statements import error_of_runs
from flexband.analysis.probability.states import LimitState
from flexband.analysis.probability.subset import Rare, rare
from flexband.errors import InputError
from flexband.requirements.corridors import Corridor
from flexband.uncertainty.surrogates.surrogate import Surrogate


@dataclass(frozen=True)
class ChanceOptions:
    """How the cheapest tolerances for a stated probability are searched."""

    accuracy: float = 0.02
    """Relative standard error of a probability."""
    aim: float = 0.95
    """Part of the stated probability that is aimed at, so that its interval is below it."""
    max_rounds: int = 10
    """Most searches."""
    max_places: int = 3
    """Most places of the interval inputs that are watched."""
    same_distance: float = 0.05
    """Distance in η up to which places are the same."""
    trust: float = 0.4
    """Largest change of logarithms of tolerances in a search."""
    size_trust: float = 0.1
    """Largest change of η of sizes in a search."""
    common_samples: int = 1000
    """Samples that a search shares."""
    min_saving: float = 2e-3
    """Part of the cost that is worth going on for."""
    step: float = 1e-3
    """Step of differences, of the logarithm of a tolerance."""
    max_corrections: int = 5
    """Most times that runs are made."""
    kept_share: float = 0.7
    """Part of the stated probability from which on that by runs is near enough."""
    min_ratio: float = 0.2
    """Least factor of the aim at a time, because of runs."""
    max_ratio: float = 5.0
    """Largest factor of the aim at a time."""
    ends: EndOptions = field(default_factory=EndOptions)
    """The search of the likeliest place."""


@dataclass(frozen=True, eq=False)
class ExceedanceEstimate:
    """How likely limits are violated with some tolerances, where it is the most likely."""

    x: np.ndarray  # the search's variables
    place: np.ndarray  # in the box of the tolerances, (m,)
    estimate: Estimate  # the probability there
    rare_samples: Rare  # rare samples there, of the narrower inputs
    noise: float  # of the search for the place, as in `Estimate`
    exact: bool  # whether the expected error of the surrogate is negligible


@dataclass(frozen=True, eq=False)
class Chance:
    """The cheapest tolerances for a probability of violating limits."""

    surrogate: Surrogate  # with the largest tolerances
    tolerances: Tolerances
    corridors: Sequence[Corridor]
    probability: float  # of leaving any of them, at most
    options: ChanceOptions = field(default_factory=ChanceOptions)

    def cheapest(self, x: np.ndarray) -> ExceedanceEstimate:
        """Return the cheapest tolerances from x; raise `InputError` if none meet requirements."""
        (low, high), options = self.tolerances.bounds, self.options
        best: ExceedanceEstimate | None = None
        now = self.estimate_exceedance(x)
        recent_places: list[np.ndarray] = []
        for k in range(options.max_rounds):
            now = self.estimate_exceedance(x) if k else now
            is_feasible = now.estimate.confidence()[1] <= self.probability
            if is_feasible and (best is None or self._cost(x) < self._cost(best.x)):
                saving = np.inf if best is None else self._cost(best.x) - self._cost(x)
                best = now
            else:
                saving = 0.0 if is_feasible else np.inf
            if is_feasible and (
                saving < options.min_saving * abs(self._cost(x)) or np.all(x >= high)
            ):
                break
            if not len(now.rare_samples.u):  # nothing violates the limits
                is_tolerance = np.arange(len(x)) < len(self.tolerances.names)
                x = np.clip(x + options.trust * is_tolerance, low, high)
                continue
            distances = [np.abs(place - now.place).max(initial=0) for place in recent_places]
            distinct_places = [
                p
                for p, d in zip(recent_places, distances, strict=True)
                if d > options.same_distance
            ]
            recent_places = [now.place, *distinct_places][: options.max_places]
            x = self._search_tolerances(now, recent_places)
        if best is None:
            text = f"{now.estimate.probability:.3g} with {self.tolerances.values(x)}"
            raise InputError(
                f"probability: no tolerances that keep it at {self.probability:g} were found; the "
                f"last probability is {text}"
            )
        return best

    def estimate_exceedance(self, x: np.ndarray) -> ExceedanceEstimate:
        """Estimate the largest probability that limits are violated with some tolerances."""
        rng = np.random.default_rng(0)
        state = self._narrow(x)
        space = self.surrogate.space
        n = space.random_dimension
        m = space.interval_dimension
        eta, rare_samples, noise, _ = ends(state, n, m, rng, options=self.options.ends)
        place_estimate = self._estimate(state, eta[1], rare_samples[1], rng)
        exact = is_judged(self.surrogate) and state.exact
        return ExceedanceEstimate(
            x, eta[1], place_estimate, rare_samples[1], float(noise[1]), exact
        )

    def _estimate(
        self, state: LimitState, eta: np.ndarray, rare_samples: Rare, rng: np.random.Generator
    ) -> Estimate:
        accuracy = self.options.accuracy
        importance = self.options.ends.importance
        return estimate(state, state, eta, rare_samples, accuracy, rng, options=importance)

    @property
    def series(self) -> np.ndarray:
        """The numbers of the limited outputs and times in the response."""
        return self._start.series[self._start.inside]

    @property
    def inside(self) -> np.ndarray:
        """Which of all outputs and times of `Estimate.at_each` are limited."""
        return self._start.inside

    def by_runs(self, solution: ExceedanceEstimate, model: ResponseModel) -> Correction:
        """Return the probability corrected with runs, at the same place or a worse one."""
        state = self._narrow(solution.x)
        space = self.surrogate.space
        n = space.random_dimension
        m = space.interval_dimension
        rng = np.random.default_rng(1)
        first = Place(solution.place, solution.rare_samples, solution.noise)
        search_state = with_missed(state, model, n, m, rng)
        options = self.options
        corrections = corrected_at_worst(
            state, search_state, model, {1: first}, options.accuracy, rng, options.ends
        )
        _, correction = corrections[1]
        return replace(correction, runs=correction.runs + model.first_runs)

    def elasticity(self, solution: ExceedanceEstimate) -> np.ndarray:
        """Return ∂ ln P / ∂ ln t of every tolerance t, (variables,); of sizes by η."""
        return self._slope(
            self._function(solution.x, solution.place, solution.rare_samples), solution.x
        )

    def _cost(self, x: np.ndarray) -> float:
        return float(self.tolerances.cost(x).sum())

    def _narrow(self, x: np.ndarray) -> LimitState:
        narrow = self.surrogate.narrowed(**self.tolerances.inputs(x))
        _, error = error_of_runs(narrow)
        return LimitState.from_surrogate(narrow, self.corridors, error, np.random.default_rng(0))

    def _search_tolerances(
        self, now: ExceedanceEstimate, places: Sequence[np.ndarray]
    ) -> np.ndarray:
        """Search the cheapest tolerances nearby that keep the probability at places."""
        x = now.x
        state = self._narrow(now.x)
        rng = np.random.default_rng(0)
        # Make a smooth function of each place, and its offset from the estimated probability.
        functions = []
        offsets = []
        for k, place in enumerate(places):
            rare_samples = now.rare_samples
            result = now.estimate
            if k:
                subset = self.options.ends.importance.subset
                n = now.rare_samples.u.shape[1]
                rare_samples = rare(partial(state.least_margins, eta=place), n, rng, options=subset)
                if not len(rare_samples.u):
                    continue
                result = self._estimate(state, place, rare_samples, rng)
            functions.append(self._function(x, place, rare_samples))
            offsets.append(functions[-1](x) - np.log(max(result.probability, 1e-300)))
        # Minimize the cost within the trust region.
        aim = np.log(self.options.aim * self.probability) + np.array(offsets)
        (low, high), count = self.tolerances.bounds, len(self.tolerances.names)
        is_tolerance = np.arange(len(x)) < count
        reach = np.where(is_tolerance, self.options.trust, self.options.size_trust)
        low = np.maximum(low, x - reach)
        high = np.minimum(high, x + reach)
        reference = abs(self._cost(x)) or 1.0
        result: Any = scipy.optimize.minimize(
            lambda at: self._cost(at) / reference,
            x,
            jac=lambda at: self.tolerances.cost_gradient(at) / reference,
            bounds=list(zip(low, high, strict=True)),
            constraints={
                "type": "ineq",
                "fun": lambda at: aim - [function(at) for function in functions],
                "jac": lambda at: -np.array([self._slope(function, at) for function in functions]),
            },
            method="SLSQP",
            options={"maxiter": 30, "ftol": 1e-6},
        )
        return np.clip(result.x, low, high)

    def _slope(self, function: Callable[[np.ndarray], float], x: np.ndarray) -> np.ndarray:
        step = self.options.step
        differences = [function(x + d) - function(x - d) for d in step * np.eye(len(x))]
        return np.array([difference / (2 * step) for difference in differences])

    def _function(
        self, x: np.ndarray, place: np.ndarray, rare_samples: Rare
    ) -> Callable[[np.ndarray], float]:
        """Return the logarithm of the smoothed probability at a place, as a function of x."""
        tolerances, rng, start = self.tolerances, np.random.default_rng(0), self._start
        options = self.options
        count = self.options.common_samples

        def eta(at: np.ndarray) -> np.ndarray:
            return np.clip(tolerances.center(at) + tolerances.radius(at) * place, -1.0, 1.0)

        def least_margins(u: np.ndarray) -> np.ndarray:
            return start.least_margins(self._old(u, x), eta(x))

        usual = least_margins(rng.standard_normal((count, rare_samples.u.shape[1]))).std()
        width = options.ends.smoothing * max(float(usual), 1e-12)
        mixture = mixture_around(
            least_margins, rare_samples.u, rng, options=options.ends.importance
        )
        u = mixture.sample(count, rng)
        weights = np.log(mixture.weights(u)) - np.log(count)
        shifts = (-options.trust, 0.0, options.trust)
        moving = [self._old(u, tolerances.tighter(x, by)) for by in shifts]
        eta_rows = np.tile(eta(x), (3 * count, 1))
        state = start.at(
            start.decisive_times(np.concatenate(moving), eta_rows, options.ends.slack * usual)
        )

        def function(at: np.ndarray) -> float:
            margins = state.least_margins(self._old(u, at), eta(at))
            return float(np.logaddexp.reduce(weights + log_ndtr(-margins / width)))

        return function

    @cached_property
    def _start(self) -> LimitState:
        none = np.zeros(self.surrogate.labels.shape[1:])
        return LimitState.from_surrogate(
            self.surrogate, self.corridors, none, np.random.default_rng(0)
        )

    def _old(self, u: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return normal variables of the surrogate's inputs from those of narrower ones."""
        normals = u.copy()
        space = self.surrogate.space
        stds = dict(zip(self.tolerances.names, self.tolerances.values(x), strict=True))
        for name, k in space.columns(random=True).items():
            if name in stds:
                old: Any = space.inputs[name]
                new = old.with_parameters({"std": float(stds[name])})
                normals[:, k] = old.to_normal(new.at_normal(u[:, k]))
        return normals
