"""The probability of violating limits, at each time and at any time: first passage."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import xarray as xr

from flexband.analysis.allocation.adjustment import compensators
from flexband.analysis.labelled_answers import NOT_JUDGED, check_free, doubts_of, missed_tolerance
from flexband.analysis.probability import COARSEST, FINEST
from flexband.analysis.probability.first_passage import first_passage
from flexband.analysis.probability.model import models
from flexband.analysis.probability.statements import (
    AT_EACH,
    BETWEEN,
    STATED,
    error_of_runs,
    tails_are_judged,
    with_bounds,
    withheld,
)
from flexband.analysis.probability.texts import LONG_NAMES, verdict_on, with_texts
from flexband.analysis.selection import AnySurrogate, labels_of, surrogates_of
from flexband.basics.checks import check_integer, check_numbers
from flexband.basics.former_names import former_arguments
from flexband.basics.progress import Progress
from flexband.basics.response import ResponseFunction
from flexband.errors import InputError
from flexband.execution.executors import ExecutorLike
from flexband.execution.store import StoreLike
from flexband.requirements.corridors import (
    Corridor,
    check_instantaneous,
    joint,
    offsets_in_words,
)
from flexband.requirements.requirement import Requirements, corridors
from flexband.requirements.scatter import Scatter, scattering_tolerances
from flexband.uncertainty.inputs.distributions.samples import Samples
from flexband.uncertainty.surrogates.bands import remark
from flexband.uncertainty.surrogates.surrogate import Surrogate

ANY = "any limit"

RUNS = 64
"""Runs of the model that correct a probability, unless another number is given."""


@former_arguments(limits="requirements")
def failure_probability(
    surrogate: AnySurrogate,
    requirements: Requirements,
    *,
    scatter: Scatter | None = None,
    response: ResponseFunction | None = None,
    runs: int = RUNS,
    accuracy: float = 0.025,
    seed: int = 0,
    store: StoreLike = None,
    executor: ExecutorLike = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Return the probability of violating requirements, as bounds over the interval inputs.

    A sample of the random inputs fails if it violates the limit at any time: first passage. Its
    probability is computed on the surrogate by importance sampling, without runs. The errors of
    the surrogate and of finite output steps are part of the result. With the response, runs near
    the limit correct the probability for the error of the surrogate.

    Few runs show the error of a surrogate in its tails. Probabilities below 1e-4 are therefore only
    bounded, unless the response is given, or the expected error is at most 1e-5 of the output's
    standard deviation, as where the response is a polynomial. A method with given orders, such as
    `PCCI`, has no runs that judge its tails, and those of `verify` do not: without the response, or
    such an error, intervals are from 0 to 1.

    Parameters
    ----------
    surrogate : what `expand` returns. At least one of its inputs must be random.
    requirements : a `Requirement`, or several; of several, the probability of violating any is
        given as well. It is never less than that of one of them: where sampling or the search over
        the intervals finds less, the result of this one is given.
    scatter : of the tolerances, as in `production_yield`; the result is then the probability that a
        part fails. The worst case unless given.
    response : of the surrogate, if its runs are to correct the probability.
    runs : number of these runs for each bound over the interval inputs, each limit and each
        combination of options, 16 or more. A quarter as many come before them for each limit: they
        tell for which values of the interval inputs the probability is largest.
    accuracy : relative standard error at which sampling ends.
    seed : seed of the random numbers.
    store, executor, progress : as in `propagate`, for the runs of the response.

    Returns
    -------
    Dataset with dims "bound" (lower, upper: over all values of the interval inputs) and "limit".
    `probability` is that of violating the limit at any output time; `confidence_low` and
    `confidence_high` are its confidence interval, 95 %, of the sampling, of the search over the
    interval inputs, and, without runs, of what the surrogate may miss. If no sample
    violates the limit, or the probability is only bounded, it is 0, `confidence_low` is 0, and
    `confidence_high` is a bound of it; `surrogate_probability` is what the surrogate alone finds.
    `limit_looser` and
    `limit_tighter` are the probability with the limit moved by what the surrogate may miss there:
    what it is expected to miss of a run (root mean square), times 2 √((1 + k²)/2), as for μ ± kσ,
    or (k³ − 3k)/√6, as a term of third order grows, with k = −Φ⁻¹(probability). `between_times`
    is the probability of violating the limit at the times or between them, by
    parabolas through the peaks, and by what the outputs do there in all runs in which that was
    looked at (`above_between` of `propagate`); `between_times_low` and `between_times_high` are the
    interval that holds it, with what they do in any of these runs. `probability_at`, dim "input",
    has the values of the interval inputs at the bounds, and `probability_choice` the options.
    `at_each_time`, `at_each_time_low` and `at_each_time_high` are the probability of being outside
    at each time, with its confidence interval, each bounded over the interval inputs on its own:
    `at_each_time_at` has their values. Where too few samples tell it, with a relative standard
    error of more than a third, it is 0, and `at_each_time_high` tells how large it may be.
    `samples` counts samples of the surrogate. With the response, `probability` and its confidence
    interval are unbiased for the response itself at `probability_at`, which the surrogate finds;
    `runs` counts runs, and `disagreements` those
    in which the surrogate was wrong about the limit after other runs had corrected its margins. All
    else is of the surrogate. ``attrs["error"]`` is as in `check_requirements`, or
    "pointwise_error" where the method tells one apart; ``attrs["verdict"]`` is a text.
    Probabilities of a surrogate whose expected error is above its tolerance are NaN, unless
    runs correct them. Of choices, the probability at any time, that between the times and that
    at each time are each of the options with the least or the largest.

    Raises
    ------
    InputError
        If `surrogate` is not a surrogate or has no random inputs, a requirement does not fit its
        outputs, or `accuracy` is not between 0.002 and 0.5; and as `propagate` does about the
        response.
    RunError
        If a run fails.

    Examples
    --------
    >>> inputs = {"length": fb.Interval(0.8, 1.2), "play": fb.Normal(0.0, 0.05)}
    >>> surrogate = fb.expand(lambda length, play: length + play, inputs, fb.PCCI(1, 1))
    >>> result = fb.analysis.failure_probability(surrogate, fb.Requirement("response", below=1.3))
    >>> result["probability"].values.round(2).ravel()  # 1 − Φ(10) and 1 − Φ(2)
    array([0.  , 0.02])
    """
    options = {"runs": runs, "accuracy": accuracy, "seed": seed, "store": store}
    return limit_probabilities(
        surrogate, requirements, scatter=scatter, response=response, executor=executor,
        progress=progress, **options,
    )  # fmt: skip


def limit_probabilities(
    surrogate: AnySurrogate,
    requirements: Requirements,
    *,
    scatter: Scatter | None = None,
    response: ResponseFunction | None = None,
    runs: int = RUNS,
    accuracy: float = 0.025,
    seed: int = 0,
    store: StoreLike = None,
    executor: ExecutorLike = None,
    progress: Progress | None = None,
    decided: Mapping[str, int] | None = None,
) -> xr.Dataset:
    """Return what `failure_probability` does.

    With a response, its runs correct all probabilities, or, of limits that are to be `decided` with
    numbers of runs, the largest one over the intervals.
    """
    surrogates = surrogates_of(surrogate)
    accuracy = float(check_numbers("accuracy", accuracy))
    if not FINEST <= accuracy <= COARSEST:
        raise InputError(f"accuracy must be from {FINEST} to {COARSEST}; got {accuracy:g}")
    if response is None and (not isinstance(runs, int) or runs != RUNS):
        raise InputError(f"runs requires a response, of which they are made; got runs={runs!r}")
    seed = check_integer("seed", seed, 0)
    labels = labels_of(surrogate)
    check_free(labels, "limit", *LONG_NAMES)
    corridors_of = {label: corridors(requirements, labels, label) for label in surrogates}
    for label, case in surrogates.items():
        check_instantaneous(corridors_of[label], case.diagnostics.attrs)
    # Refuse what has no probability, and limits that leave nothing between them.
    names = list(next(iter(corridors_of.values())))
    tolerances = {
        label: scattering_tolerances(scatter, case.space) for label, case in surrogates.items()
    }
    _check(surrogates, scatters=scatter is not None)
    if len(names) > 1:
        names.append(ANY)
        for limit_corridors in corridors_of.values():
            joint(limit_corridors)  # which refuses limits that leave nothing between them
    # Find the probabilities of each limit and of any, for each combination of options.
    results = {}
    boxes = [case.space.interval_dimension for case in surrogates.values()]
    intervals = scatter is None and any(boxes)
    options = {"store": store, "executor": executor}
    runs_of_limit = dict.fromkeys(names, runs) if decided is None else decided
    bounds = 1 + (intervals and decided is None)
    counts = list(runs_of_limit.values())
    with models(surrogates, response, counts, bounds, progress, **options) as models_by_label:
        for label, case in surrogates.items():
            per_limit = [
                first_passage(
                    case,
                    any_of,
                    models_by_label[label](runs_of_limit.get(name)),
                    accuracy,
                    seed,
                    tolerances=tolerances[label],
                    worst_alone=decided is not None,
                )
                for name, any_of in zip(
                    names, _groups(list(corridors_of[label].values())), strict=True
                )
            ]
            if response is not None:
                per_limit = [_with_counts(part) for part in per_limit]
            if len(per_limit) > 1:
                per_limit[-1] = _no_less(per_limit[-1], per_limit[:-1])
            all_limits = xr.concat(per_limit, "limit").assign_coords(limit=names)
            exact = all_limits["exact"]
            by_runs = all_limits["runs"] > 0 if "runs" in all_limits else exact
            all_limits = with_bounds(all_limits, exact | by_runs, STATED, BETWEEN)
            results[label] = with_bounds(all_limits, exact, AT_EACH).drop_vars("exact")
    # Withhold what surrogates are not good enough for, and say why.
    result = results[""] if "" in results else _over_choices(results)
    if any(map(missed_tolerance, surrogates.values())):
        exempt_names = {"samples", "runs", "disagreements", "probability_at", "probability_choice"}
        by_runs = {"surrogate_probability", *STATED, *BETWEEN} if "runs" in result else set()
        others = [str(k) for k in result.data_vars if k not in exempt_names | by_runs]
        result = withheld(withheld(result, others), sorted(by_runs), result.get("runs", 0) == 0)
    result = result.transpose("input", "bound", "limit", ..., missing_dims="ignore")
    case = next(iter(surrogates.values()))
    corrected = response is not None and set(runs_of_limit) >= set(names) - {ANY}
    no_judge = "No runs judge its tails: runs of the model (response=…, --runs 64) do"
    doubts = [
        *([] if corrected or all(map(tails_are_judged, surrogates.values())) else [no_judge]),
        *offsets_in_words(next(iter(corridors_of.values())), case.diagnostics.attrs),
        *_unreliable(surrogates, corrected=corrected),
        *_beyond_samples(surrogates, result),
    ]
    attrs = {
        "accuracy": accuracy,
        "seed": seed,
        "confidence": 0.95,
        "error": error_of_runs(case)[0] or NOT_JUDGED,
        "verdict": verdict_on(result.assign_attrs(doubts=doubts)),
        "doubts": doubts,
    }
    return with_texts(result.assign_attrs(remark(case.space) | attrs))


def _unreliable(surrogates: Mapping[str, Surrogate], *, corrected: bool) -> list[str]:
    """Return why surrogates are not reliable, whose probabilities runs may have corrected."""
    return [
        f"Not reliable: {reason}{f' with {label}' if label else ''}"
        for label, case in surrogates.items()
        for reason in doubts_of(case, corrected=corrected)
    ]


def _beyond_samples(surrogates: Mapping[str, Surrogate], result: xr.Dataset) -> list[str]:
    """Return which measured inputs have too few values for the largest of the probabilities."""
    largest = result["between_times"].isel(bound=-1)
    rarest = float(largest.where(result["between_times_high"].isel(bound=-1) > 0).min())
    inputs = dict(pair for case in surrogates.values() for pair in case.space.inputs.items())
    return [
        f"Probabilities below 1/{len(input_.values)} rest on the smoothing of {name}, {input_!r}"
        for name, input_ in inputs.items()
        if isinstance(input_, Samples) and rarest < 1 / len(input_.values)
    ]


def _check(surrogates: Mapping[str, Surrogate], *, scatters: bool) -> None:
    """Raise `InputError` if surrogates have no probability: no input is left to chance."""
    spaces = [case.space for case in surrogates.values()]
    if not scatters and not all(space.random_dimension for space in spaces):
        raise InputError(
            "surrogate must have random inputs; check_requirements takes one with intervals alone"
        )
    if compensator_names := [name for space in spaces for name in compensators(space)]:
        raise InputError(
            f"surrogate must have no Compensator, which is adjusted, not left to chance; got "
            f"{compensator_names[0]}. check_requirements and allocate adjust it"
        )


def _with_counts(result: xr.Dataset) -> xr.Dataset:
    """Return a result with the numbers of runs, 0 if none correct it."""
    missing = {"runs", "disagreements"} - set(result)
    return result.assign({name: xr.zeros_like(result["samples"]) for name in missing})


def _groups(limit_corridors: list[Corridor]) -> list[list[Corridor]]:
    """Return each corridor alone, and all together if there are several."""
    alone = [[corridor] for corridor in limit_corridors]
    return [*alone, limit_corridors] if len(alone) > 1 else alone


def _no_less(union: xr.Dataset, limits: Sequence[xr.Dataset]) -> xr.Dataset:
    """Return the result for any limit, where those of single limits are no more likely.

    Leaving any limit is at least as likely as leaving one of them, with which values of the
    interval inputs ever. Where sampling or the search found less, what was found of this one holds.
    """
    kinds = ("at_each_time", "between_times")
    for limit in limits:
        larger_masks = {k: limit[k] > union[k] for k in ("probability", *kinds)}
        for name in union:
            kind = next((k for k in kinds if str(name).startswith(k)), "probability")
            union[name] = limit[name].where(larger_masks[kind], union[name])
    return union


def _over_choices(results: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Return the least and the largest probability over all combinations of options.

    The probability at any time, that between the times and that at each time are each of the
    combination whose interval ends the lowest or the highest. Another one may be less likely than
    the least of these: the interval begins with the lowest.
    """
    all_choices = xr.concat(list(results.values()), "choice", join="exact")
    upper = all_choices["bound"] == "upper"
    variables = {}
    for value, low, high in (STATED, BETWEEN, AT_EACH):
        end = all_choices[high].fillna(0.0)  # at times without a limit
        which = xr.where(upper, end.argmax("choice"), end.argmin("choice"))
        names = (
            [k for k in all_choices if str(k).startswith(value)]
            if value != STATED[0]
            else all_choices
        )
        variables |= {k: all_choices[k].isel(choice=which) for k in names}
        variables[low] = variables[low].where(upper, all_choices[low].min("choice"))
        if value == STATED[0]:
            labels = xr.DataArray(list(results), dims="choice")
            variables["probability_choice"] = labels.isel(choice=which).transpose("bound", "limit")
    return xr.Dataset(variables)
