"""The probability of leaving one limit at any time: first passage, for one case."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import xarray as xr

from flexband.analysis.labelled_answers import Variables, is_judged, places
from flexband.analysis.probability.at_each import at_each_time
from flexband.analysis.probability.ends import EndOptions, ends, rare_at
from flexband.analysis.probability.estimates import TWO_SIDED, Estimate, estimate
from flexband.analysis.probability.model import ResponseModel
from flexband.analysis.probability.probability_correction import (
    Correction,
    correct_probability,
    with_missed,
)
from flexband.analysis.probability.statements import (
    ANYTHING,
    AT_EACH,
    BETWEEN,
    allowance,
    error_of_runs,
    tails_are_judged,
)
from flexband.analysis.probability.states import LimitState
from flexband.analysis.probability.subset import Rare
from flexband.requirements.corridors import Corridor
from flexband.requirements.scatter import ScatteringTolerances
from flexband.uncertainty.inputs.evaluation import coordinates
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.surrogates.bands import BOUNDS
from flexband.uncertainty.surrogates.surrogate import Surrogate


def first_passage(
    surrogate: Surrogate,
    corridors: Sequence[Corridor],
    model: ResponseModel | None,
    accuracy: float,
    seed: int,
    *,
    tolerances: ScatteringTolerances | None = None,
    worst_alone: bool = False,
    search: EndOptions = EndOptions(),
    max_unseen: float = 0.03,
) -> xr.Dataset:
    """Return the result of `failure_probability` for limits of which any counts.

    Where tolerances do not scatter, probabilities are bounded over the intervals. The model
    corrects both bounds, or the larger one if it is `worst_alone` that counts; where searches end
    at different places, runs are made at each. At most `max_unseen` of a
    probability is at times that the search for bounds leaves out.
    """
    space, labels, rng = surrogate.space, surrogate.labels, np.random.default_rng(seed)
    error = error_of_runs(surrogate)[1]
    state = LimitState.from_surrogate(surrogate, corridors, error, rng)
    n, m = space.random_dimension, space.interval_dimension
    if tolerances is not None:
        space, n, m = Space({}), n + tolerances.dimension, 0
        state = replace(state, tolerances=tolerances)
    corrected_state = state if model is None else with_missed(state, model, n, m, rng)
    # Search the ends, and sample there; with all times, if those that decide leave out too much.
    for thin in (True, False):
        eta, rare_samples, noise, search_state = ends(
            corrected_state, n, m, rng, thin=thin, options=search
        )
        search_state = replace(search_state, missed=None)
        if model is not None:
            rare_samples = [rare_at(state, place, n, rng, options=search) for place in eta]
        places_and_rare = list(zip(eta, rare_samples, strict=True))[: 1 + (m > 0)]
        estimates = [
            estimate(state, search_state, at, rare, accuracy, rng, options=search.importance)
            for at, rare in places_and_rare
        ]
        unseen = [
            _unseen_share(search_state, at, part) for at, part in zip(eta, estimates, strict=False)
        ]
        if max(unseen) <= max_unseen:
            break
    # Correct the ends with runs, and put them in order.
    raw = [replace(part, noise=float(e)) for part, e in zip(estimates, noise, strict=False)]
    final = list[Estimate | Correction](raw)
    if model is not None:
        end_numbers = range(len(raw))[-1 if worst_alone else 0 :]
        firsts = {k: Place(eta[k], rare_samples[k], raw[k].noise) for k in end_numbers}
        corrections = corrected_at_worst(
            state, corrected_state, model, firsts, accuracy, rng, search
        )
        for k, (place, final[k]) in corrections.items():
            if place is not firsts[k]:
                eta[k], rare_samples[k] = place.eta, place.rare_samples
                raw[k] = estimate(
                    state,
                    state,
                    place.eta,
                    place.rare_samples,
                    accuracy,
                    rng,
                    options=search.importance,
                )
                raw[k] = replace(raw[k], noise=place.noise)
    eta, raw, final = _order_ends(eta, raw, final)
    # Bound the probabilities at each time, and allow for what the surrogate may miss.
    dims = labels.dims[1:]
    if m:
        limited = at_each_time(state, m, rare_samples, raw, rng)
    else:
        limited = np.stack(raw[0].told_at_each())[:, None], np.zeros((1, state.width, 0))
    time_probabilities, places_of = _everywhere(state, *limited, labels.shape[1:])
    values, confidence, between_times = _with_errors(
        surrogate, state, raw, final, time_probabilities
    )
    of_bounds = {
        "probability": values,
        "confidence_low": confidence[0],
        "confidence_high": confidence[1],
        "limit_looser": [part.looser for part in raw],
        "limit_tighter": [max(part.tighter, part.probability) for part in raw],
        **dict(zip(BETWEEN, between_times, strict=True)),
        "surrogate_probability": [part.probability for part in raw],
        "samples": [len(part.u) for part in raw],
    }
    if model is not None:
        counts = [
            (part.runs, part.disagreements) if isinstance(part, Correction) else (0, 0)
            for part in final
        ]
        runs, disagreements = np.transpose(counts)
        runs[-1] += model.first_runs
        of_bounds |= {"runs": runs, "disagreements": disagreements}
    data: Variables = {name: ("bound", values) for name, values in of_bounds.items()}
    data["exact"] = _is_exact(state, surrogate)
    data |= {
        name: (("bound", *dims), v) for name, v in zip(AT_EACH, time_probabilities, strict=True)
    }
    data |= places("probability_at", space, eta, ("bound",), (2,))
    data |= places(
        "at_each_time_at", space, places_of, ("bound", *dims), time_probabilities.shape[1:]
    )
    coords = {str(k): c.variable for k, c in coordinates(labels).items()}
    result = xr.Dataset(data, {**coords, "bound": BOUNDS})
    return result.set_coords("input") if "input" in result else result


class Place(NamedTuple):
    """Values of the interval inputs at which a probability is the least or the largest."""

    eta: np.ndarray
    rare_samples: Rare  # of the surrogate alone
    noise: float  # of the search


def corrected_at_worst(
    state: LimitState,
    corrected_state: LimitState,
    model: ResponseModel,
    firsts: Mapping[int, Place],
    accuracy: float,
    rng: np.random.Generator,
    search: EndOptions,
) -> dict[int, tuple[Place, Correction]]:
    """Return places with the least (0) and the largest (1) probability, and what runs say there.

    The surrogate alone, and what few runs have taught (`corrected_state`), may each mislead a
    search. Runs are made at the `firsts` and, unless these confirm the surrogate, at the places to
    which the surrogate alone leads, and what all runs have taught.
    """
    first = next(iter(firsts.values()))
    n, m = first.rare_samples.u.shape[1], len(first.eta)
    places: dict[int, list[tuple[Place, Correction]]] = {k: [] for k in firsts}

    def judge(k: int, place: Place) -> LimitState:
        samples = rare_at(corrected_state, place.eta, n, rng, options=search)
        correction = correct_probability(
            corrected_state, model, place.eta, samples, accuracy, rng, place.noise
        )
        places[k].append((place, correction))
        return replace(corrected_state, missed=correction.missed)

    for k, place in firsts.items():
        corrected_state = judge(k, place)
    settled = all(correction.confirmed for of_end in places.values() for _, correction in of_end)
    for all_runs in () if settled or not m else (False, True):
        lead = corrected_state if all_runs else state
        eta, _, noise, _ = ends(lead, n, m, rng, options=search)
        for k in firsts:
            distances = [np.abs(eta[k] - place.eta).max() for place, _ in places[k]]
            if min(distances) > search.same_distance:
                rare_samples = rare_at(state, eta[k], n, rng, options=search)
                corrected_state = judge(k, Place(eta[k], rare_samples, float(noise[k])))
    return {k: _worst(of_end, largest=k > 0) for k, of_end in places.items()}


def _worst(
    places: Sequence[tuple[Place, Correction]], *, largest: bool
) -> tuple[Place, Correction]:
    """Return the place with the least or the largest probability, and the ends of all of them."""
    extreme = max if largest else min
    place, correction = extreme(places, key=lambda pair: pair[1].probability)
    low, high = (
        extreme(getattr(candidate, end) for _, candidate in places) for end in ("low", "high")
    )
    runs = sum(candidate.runs for _, candidate in places)
    return place, replace(correction, low=low, high=high, runs=runs)


def _order_ends(
    eta: np.ndarray, raw: list[Estimate], final: list[Estimate | Correction]
) -> tuple[np.ndarray, list[Estimate], list[Estimate | Correction]]:
    """Return places and estimates of the least and the largest probability, in this order."""
    if len(final) == 1:  # without intervals
        return eta, raw * 2, final * 2
    smallest, largest = final
    if type(smallest) is not type(largest) or smallest.probability <= largest.probability:
        return eta, raw, final
    # Both ends of what hardly depends on η: the search tells them apart, unless intervals do.
    disjoint = smallest.confidence()[0] > largest.confidence()[1]
    return eta[::-1] if disjoint else eta, raw[::-1], final[::-1]


def _is_exact(state: LimitState, surrogate: Surrogate) -> bool:
    """Return whether what a surrogate misses is known, and negligible."""
    return is_judged(surrogate) and state.exact


def _with_errors(
    surrogate: Surrogate,
    state: LimitState,
    raw: Sequence[Estimate],
    final: Sequence[Estimate | Correction],
    time_probabilities: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return probabilities at any time, (bound,), their intervals, and those between the times.

    What the surrogate may miss makes intervals wider that no runs correct; also those of
    `time_probabilities`, (3, bound, …), which are changed. `raw` are estimates by the surrogate.
    """
    confidence = np.array([part.confidence() for part in final]).T
    between_times = _probabilities_between_times(raw, final)
    by_runs = np.array([isinstance(part, Correction) for part in final])
    if _is_exact(state, surrogate):
        pass
    elif tails_are_judged(surrogate):
        grown = np.transpose([allowance(part) for part in raw])
        moved = time_probabilities[1:] * grown.reshape(2, 2, *[1] * (time_probabilities.ndim - 2))
        time_probabilities[1:] = np.sort(np.minimum(1.0, moved), axis=1)
        grown = np.where(by_runs, 1.0, grown)
        confidence = np.minimum(1.0, confidence * grown)
        between_times[1:] = np.minimum(1.0, between_times[1:] * grown)
    else:
        anything = np.reshape(ANYTHING, (2, 1))
        time_bounds = anything.reshape(2, *[1] * (time_probabilities.ndim - 1))
        time_probabilities[1:] = np.where(np.isnan(time_probabilities[1:]), np.nan, time_bounds)
        confidence, between_times[1:] = (
            np.where(by_runs, pair, anything) for pair in (confidence, between_times[1:])
        )
    values = np.array([part.probability for part in final])
    # The least probability is no larger than the largest.
    for pair in (values, *confidence, *between_times):
        pair[0] = min(pair)
    return values, confidence, between_times


def _everywhere(
    state: LimitState, probabilities: np.ndarray, eta: np.ndarray, shape: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """Return what is known of limited outputs and times for all, NaN where nothing is limited.

    The shapes of probabilities and η are (3, 2, series) and (2, series, m); bounds may be the same.
    """
    count = max(1, int(np.prod(shape)))
    all_probabilities = np.full((3, 2, count), np.nan)
    places_of = np.full((2, count, eta.shape[-1]), np.nan)
    inside = state.inside
    all_rows = slice(None)
    at = state.series[inside]  # several limits may be on one output: the most likely counts
    np.fmax.at(all_probabilities, (all_rows, all_rows, at), probabilities[..., inside])  # pyright: ignore
    places_of[:, at] = eta[:, inside]
    return all_probabilities.reshape(3, 2, *shape), places_of


def _probabilities_between_times(
    raw: Sequence[Estimate], final: Sequence[Estimate | Correction]
) -> np.ndarray:
    """Return the probabilities between the times too, and their confidence intervals, (3, bound).

    `raw` are those of the surrogate, `final` has what runs correct.
    """
    probabilities = []
    for part, correction in zip(raw, final, strict=True):
        low, high = part.confidence_between()
        value = part.between_times[0]
        if isinstance(correction, Correction):
            (low, high), grown = correction.confidence(), np.ones(3)
            if part.probability:  # as many more samples violate the limits between the times
                grown = part.between_times / part.probability
            value, low, high = grown * [correction.probability, low, high]
            # The errors of the samples alone.
            sampled = part.between_times_error / np.maximum(part.between_times, 1e-300)
            low = low * np.exp(-TWO_SIDED * sampled[1])
            high = high * np.exp(TWO_SIDED * sampled[2])
        probabilities.append(np.minimum([value, low, high], 1.0))
    same_kind = len(set(map(type, final))) == 1
    per_bound = np.transpose(probabilities)
    return np.sort(per_bound, axis=1) if same_kind else per_bound


def _unseen_share(search_state: LimitState, eta: np.ndarray, raw: Estimate) -> float:
    """Return the share of the samples that violate limits at times other than a state's."""
    out = raw.margins < 0
    missed = raw.weights[out] * (search_state.least_margins(raw.u[out], eta) >= 0)
    total_weight = raw.weights[out].sum()
    return float(missed.sum() / total_weight) if total_weight else 0.0
