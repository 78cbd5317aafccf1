"""The probability of leaving limits, at each time and at any time: first passage."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from flexband.errors import InputError, instance, numbers, whole
from flexband.uncertainty.answers.limits import Corridor, corridors
from flexband.uncertainty.answers.margins import error_of, labels_of
from flexband.uncertainty.answers.probability.ends import ends
from flexband.uncertainty.answers.probability.estimates import Estimate, estimate
from flexband.uncertainty.answers.probability.states import LimitState
from flexband.uncertainty.inputs.evaluation import coordinates
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.surrogates.bands import BOUNDS
from flexband.uncertainty.surrogates.choices import SurrogateOfChoices
from flexband.uncertainty.surrogates.diagnostics import share
from flexband.uncertainty.surrogates.surrogate import Surrogate

ANY = "any limit"

UNSEEN = 0.03
"""Part of a probability that may be due to times at which bounds are not searched."""

FINEST, COARSEST = 0.002, 0.5
"""Relative standard errors that can be asked for."""


def failure_probability(
    surrogate: Surrogate | SurrogateOfChoices,
    limits: Any,
    *,
    accuracy: float = 0.025,
    seed: int = 0,
) -> xr.Dataset:
    """Return the probability that a response leaves its limits, as bounds over interval inputs.

    A sample of the random inputs fails if it leaves the limit at any time: first passage, on the
    times of the response. Its probability is computed on the surrogate, without runs, by importance
    sampling, down to 1e-9. What the surrogate and the times miss is part of the result.

    Parameters
    ----------
    surrogate : what `expand` returns. At least one of its inputs must be random.
    limits : a `Limit`, or several; of several, the probability of leaving any is given as well.
    accuracy : relative standard error at which sampling ends.
    seed : seed of the random numbers.

    Returns
    -------
    Dataset with dims "bound" (lower, upper: over all values of the interval inputs) and "limit".
    `probability` is that of leaving the limit at any time; `confidence_low` and `confidence_high`
    are its confidence interval, 95 %, of the sampling. If no sample leaves the limit the
    probability is 0 and `confidence_high` a bound of it. `limit_looser` and `limit_tighter` are the
    probability with the limit moved by what the surrogate is expected to miss of a run (root mean
    square), times √((1 + k²)/2) with k = −Φ⁻¹(probability), as for μ ± kσ. `between_times` is the
    probability with parabolas through the peaks between the times. `probability_at`, dim "input",
    has the values of the interval inputs at the bounds, and `probability_choice` the options.
    `at_each_time`, `at_each_time_low` and `at_each_time_high` are the probability of being outside
    at each time, with its confidence interval, for the same values of the interval inputs.
    `samples` counts samples of the surrogate, ``attrs["error"]`` is as in `check_limits`,
    ``attrs["verdict"]`` a text.

    Raises
    ------
    InputError
        If `surrogate` is none or has no random inputs, a limit does not fit its outputs, or
        `accuracy` is not between 0.002 and 0.5.
    """
    kinds = Surrogate | SurrogateOfChoices
    instance("surrogate", surrogate, kinds, "one that `expand` returns")
    accuracy = float(numbers("accuracy", accuracy))
    if not FINEST <= accuracy <= COARSEST:
        raise InputError(f"accuracy must be from {FINEST} to {COARSEST}; got {accuracy:g}")
    seed = whole("seed", seed, 0)
    several = isinstance(surrogate, SurrogateOfChoices)
    surrogates = surrogate.surrogates if several else {"": surrogate}
    labels = labels_of(surrogate)
    wanted = corridors(limits, labels)
    if any(not one.space.random_dimension for one in surrogates.values()):
        raise InputError(
            "surrogate must have random inputs; check_limits takes one with intervals alone"
        )
    if len(wanted) > 1:
        wanted[ANY] = joint(wanted)
    found = {}
    for label, own in surrogates.items():
        each = [_probability(own, one, accuracy, seed) for one in wanted.values()]
        found[label] = xr.concat(each, "limit").assign_coords(limit=list(wanted))
    result = _over_choices(found) if several else found[""]
    result = result.transpose("input", "bound", "limit", ..., missing_dims="ignore")
    source = error_of(next(iter(surrogates.values())).diagnostics, labels)[0]
    doubts = [] if source else [". The error of the surrogate is not estimated"]
    for label, one in surrogates.items():
        if "not_trusted" in one.diagnostics.attrs:
            where = f" with {label}" if label else ""
            doubts.append(f". Not reliable: {one.diagnostics.attrs['not_trusted']}{where}")
    words = [in_words(result.isel(limit=k)) for k in range(len(wanted))]
    told = {
        "accuracy": accuracy,
        "seed": seed,
        "confidence": 0.95,
        "error": source or "not estimated",
        "verdict": ". ".join(words)
        + ("" if source else ". The surrogate's error is not estimated"),
    }
    return _described(result.assign_attrs(told))


def joint(found: Mapping[str, Corridor]) -> Corridor:
    """Return the corridor in which all limits are kept."""
    lower = np.max([one.lower for one in found.values()], axis=0)
    upper = np.min([one.upper for one in found.values()], axis=0)
    if np.any(lower >= upper):
        raise InputError(f"limits must leave something between them; got {', '.join(found)}")
    return Corridor("", lower, upper, (...,))


def _probability(
    surrogate: Surrogate, corridor: Corridor, accuracy: float, seed: int
) -> xr.Dataset:
    """Return the result for one limit and one combination of options."""
    space, labels, rng = surrogate.space, surrogate.labels, np.random.default_rng(seed)
    _, error = error_of(surrogate.diagnostics, labels)
    error = np.asarray(error) / share(space.interval_dimension)
    state = LimitState.of(surrogate, corridor, error, rng)
    n, m = space.random_dimension, space.interval_dimension
    for thin in (True, False):
        eta, known, near = ends(state, n, m, rng, thin=thin)
        pairs = list(zip(eta, known, strict=True))
        own = [estimate(state, near, at, one, accuracy, rng) for at, one in pairs[: 1 + (m > 0)]]
        if all(_seen(near, at, one) for at, one in zip(eta, own, strict=False)):
            break
    if not m:
        own = [own[0], own[0]]
    elif own[0].probability > own[1].probability:  # both ends of what does not depend on η
        own, eta = own[::-1], eta[::-1]
    dims = labels.dims[1:]
    each = np.full((3, 2, max(1, int(np.prod(labels.shape[1:])))), np.nan)
    for k, one in enumerate(own):
        each[:, k, state.series] = one.at_each, *one.confidence_at_each()
    each = each.reshape(3, 2, *labels.shape[1:])
    low, high = zip(*(one.confidence() for one in own), strict=True)
    data: dict[str, Any] = {
        "probability": ("bound", [one.probability for one in own]),
        "confidence_low": ("bound", list(low)),
        "confidence_high": ("bound", list(high)),
        "limit_looser": ("bound", [one.looser for one in own]),
        "limit_tighter": ("bound", [max(one.tighter, one.probability) for one in own]),
        "between_times": ("bound", [one.between for one in own]),
        "samples": ("bound", [len(one.u) for one in own]),
    }
    for name, values in zip(("", "_low", "_high"), each, strict=True):
        data[f"at_each_time{name}"] = ("bound", *dims), values
    coords: dict[Any, Any] = {k: c.variable for k, c in coordinates(labels).items()}
    coords["bound"] = BOUNDS
    intervals = Space(space.of_kind(random=False))
    if intervals.inputs:
        values = intervals.numbers_at(np.zeros((2, 0)), eta)
        coords["input"] = list(values)
        data["probability_at"] = ("input", "bound"), np.array(list(values.values()))
    return xr.Dataset(data, coords)


def _seen(near: LimitState, eta: np.ndarray, found: Estimate) -> bool:
    """Return whether the times of a state are nearly all that samples leave the limits at."""
    out = found.margins < 0
    missed = found.weights[out] * (near.least(found.u[out], eta) >= 0)
    return bool(missed.sum() <= UNSEEN * found.weights[out].sum())


def _over_choices(found: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Return the least and the largest probability over all combinations of options."""
    names = np.array(list(found))
    every = xr.concat(list(found.values()), "choice", join="exact")
    high = every["confidence_high"].transpose("choice", "bound", "limit").values
    which = np.stack([high[:, 0].argmin(axis=0), high[:, 1].argmax(axis=0)])
    index = {
        "choice": xr.DataArray(which, dims=("bound", "limit")),
        "bound": xr.DataArray([0, 1], dims="bound"),
        "limit": xr.DataArray(range(which.shape[1]), dims="limit"),
    }
    chosen = every.isel(index)
    return chosen.assign(probability_choice=(("bound", "limit"), names[which]))


def in_words(one: xr.Dataset) -> str:
    """Return the probability of leaving one limit as a sentence."""
    lower, upper = (told(one.isel(bound=k)) for k in range(2))
    both = upper if "probability_at" not in one and "probability_choice" not in one else (
        f"from {lower}{_place(one.isel(bound=0))} to {upper}{_place(one.isel(bound=1))}"
    )  # fmt: skip
    tighter = float(one["limit_tighter"][1])
    text = f"{one['limit'].values}: left with probability {both}"
    if tighter > 0 and "probability" in one:
        text += f"; up to {tighter:.2g} with the expected error of the surrogate"
    return text


def told(one: xr.Dataset) -> str:
    """Return a probability with its confidence interval as text, or its upper bound."""
    value, low, high = (float(one[k]) for k in ("probability", "confidence_low", "confidence_high"))
    return f"{value:.3g} ({low:.3g} to {high:.3g})" if value else f"below {high:.2g}"


def _place(one: xr.Dataset) -> str:
    words = [str(one["probability_choice"].values)] if "probability_choice" in one else []
    if "probability_at" in one:
        pairs = zip(one["input"].values, one["probability_at"].values, strict=True)
        words += [f"{name} = {value:.6g}" for name, value in pairs]
    return f" at {', '.join(words)}"


LONG_NAMES = {
    "probability": "probability of leaving the limit at any time",
    "confidence_low": "lower end of its 95 % confidence interval",
    "confidence_high": "upper end of its 95 % confidence interval",
    "limit_looser": "probability with the limit looser by the expected error of the surrogate",
    "limit_tighter": "probability with the limit tighter by the expected error of the surrogate",
    "between_times": "probability with parabolas through the peaks between the times",
    "samples": "samples of the surrogate",
    "at_each_time": "probability of being outside the limit at each time",
    "at_each_time_low": "lower end of its 95 % confidence interval",
    "at_each_time_high": "upper end of its 95 % confidence interval",
    "probability_at": "values of the interval inputs at the bounds of the probability",
    "probability_choice": "options at the bounds of the probability",
    "bound": "bound over all values of the interval inputs",
}


def _described(result: xr.Dataset) -> xr.Dataset:
    """Give every variable a `long_name`, and probabilities the unit 1."""
    for name, words in LONG_NAMES.items():
        if name in result.variables:
            result[name].attrs["long_name"] = words
            if name not in ("probability_at", "probability_choice", "bound"):
                result[name].attrs["units"] = "1"
    return result
