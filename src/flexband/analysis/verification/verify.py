"""Verification: whether runs differ from a surrogate by more than its expected error allows.

Most of the runs are at values of the interval inputs at which bounds are attained, spread over
outputs, times and both ends of the error bar; every fourth is anywhere. Surrogate and response are
compared run by run, at the same ξ and η, so the comparison contains no noise of sampling, and every
run judges all outputs and times. Intervals that the expansion leaves out have no such values: runs
at bounds come in pairs that differ in these alone, which lie on opposite sides of their midpoints.
Half the difference of a pair is their effect, which at their worst corner adds up.

Three of four runs are farther out in the random variables than samples are: along a direction of
each, drawn at random, they are uniformly distributed. A kink that few samples reach is met more
often, and the ratio of the densities is the weight of the run, so that expectations remain those of
samples.

Let q_i be the mean square of what the surrogate misses in run i, over all times, relative to what
the expected error allows, times the weight. If that is right, E[q_i] ≤ 1, and for every λ ≤ 1 the
product of 1 + λ(q_i − 1) has an expectation of 1 at most; so has its mean over several λ. By
Markov's inequality it exceeds 1/α with a probability below α, whatever the distribution of the q_i
is (Waudby-Smith and Ramdas, 2024). The smallest error that would not be refuted in this way is a
lower confidence limit of the error; the expected error is confirmed where it is larger.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray as xr

from flexband.analysis.labelled_answers import error_of, remarks_on
from flexband.analysis.selection import AnySurrogate, surrogates_of
from flexband.analysis.verification import MAX_RUNS, RUNS
from flexband.analysis.verification.expanded_runs import Runs, runs_as_expanded
from flexband.analysis.verification.judgement import judge_by_runs
from flexband.basics.checks import check_integer
from flexband.basics.progress import Progress, run_counter
from flexband.basics.response import ResponseFunction
from flexband.remarks.collection import as_attribute
from flexband.uncertainty.expansions.bounds.discs import in_discs
from flexband.uncertainty.expansions.expansion import extremes_of
from flexband.uncertainty.inputs.evaluation import coordinates
from flexband.uncertainty.inputs.sampling import (
    latin_hypercube_normals,
    of_normals,
    stretch_samples,
)
from flexband.uncertainty.surrogates.axes import axes_of, units_of
from flexband.uncertainty.surrogates.choices import SurrogateOfChoices
from flexband.uncertainty.surrogates.diagnostics import (
    CONFIDENCE,
    SMALLEST,
    share,
)
from flexband.uncertainty.surrogates.sigmas import (
    AT_ONE_TIME,
    checked_sigmas,
    growth,
)
from flexband.uncertainty.surrogates.surrogate import Surrogate
from flexband.uncertainty.surrogates.verification_verdict import verdict

if TYPE_CHECKING:
    from flexband.execution.executors import ExecutorLike
    from flexband.execution.store import StoreLike

ASIDE = 3**-0.5
"""Distance of intervals that are left out from their midpoints: that of a uniform variable."""

TINY = 1e-140
"""Added to round-off: its square is not zero."""


@dataclass(frozen=True)
class VerificationOptions:
    """Where verification runs are, and how they judge."""

    anywhere: int = 4
    """One of so many runs is a sample of the space, the others are at bounds."""
    farthest: float = 3.0
    """Standard deviations to which the others spread along a direction of ξ."""
    times: int = 48
    """Times at which bounds are computed."""
    round_off: float = 1e-12
    """Errors below this part of an output are none."""
    min_pairs: int = 2
    """Pairs per interval left out from which effects are computed one by one."""
    betting_factors: tuple[float, ...] = (0.01, 0.02, *np.linspace(0.05, 0.95, 19))
    """Values of λ."""
    min_part: float = 1e-6
    """Lowest value of what is missed at least, relative to the mean."""
    halvings: int = 60
    """Halvings of the search for what is missed at least."""


class VerificationPoints(NamedTuple):
    """Where verification runs are."""

    xi: np.ndarray  # (runs, n)
    eta: np.ndarray  # (runs, m)
    weight: np.ndarray  # ratio of the density of samples to that of the run, (runs,)
    sampled: np.ndarray  # which runs are samples of the whole space, (runs,)
    place: list[str]  # of every run, in words
    pairs: np.ndarray  # runs that differ in the intervals that are left out alone, (pairs, 2)


def verify(
    surrogate: AnySurrogate,
    response: ResponseFunction,
    *,
    runs: int = RUNS,
    sigmas: float = 1.0,
    seed: int = 0,
    store: StoreLike = None,
    executor: ExecutorLike = None,
    failed: str = "stop",
    progress: Progress | None = None,
) -> AnySurrogate:
    """Return a surrogate with what verification runs say of it.

    The verdict is about the expected error of the expansion: whether the surrogate misses more of
    these runs than it allows. If the expected errors of all
    outputs are right, at most 5 % of verifications do not confirm them. The error of the
    discretization is not verified, since the verification runs have it too.

    A method with given orders, such as `PCCI`, has no runs that judge it, so no answer of its
    surrogate has an error, and no requirement is met or violated by it. The verification runs give
    it one: the surrogate that is returned has the expected errors of `AdaptivePCCI`. It is
    the largest that is missed of these runs, most of which are where bounds are.

    Parameters
    ----------
    runs : number of verification runs, whatever the number of outputs.
    sigmas : k of the error bar μ ± kσ.
    seed : seed of the random numbers.
    store, executor, failed, progress : as in `propagate`. Runs that are left out are not compared;
        the verdict counts them.

    Returns
    -------
    The surrogate, which keeps these runs also in a file. Its `verification` is a dataset with the
    dims of the outputs: what is `missed` of the verification runs, root mean square over runs and
    times; the inferred error of the error bar, `implied_error`, the
    `least_error` with a confidence of 95 %, and the `bar_width`, means over time; and, if the
    method expects an error, this `expected_error`, what it `allowed` to miss, and whether it is
    `confirmed`: whether it is above the least error.
    Runs that are farther out than samples count by their `run_weight`.
    `missed_most_in` is the number of the run that is missed most, `missed_most_at` that of the
    time. Along the dim "sample" are `missed_in_run`, the `run_values` of the inputs, the
    `run_place`: at a bound or anywhere, and the `run_weight`. ``attrs["verdict"]`` is a text,
    ``attrs["confirmed"]`` "yes", "no" or "no error was expected", ``attrs["inferred_share"]`` the
    inferred error that decides, relative to the error bar's width, ``attrs["runs"]`` the number of
    runs. With choices there is a dim "choice", and every combination has so many runs.

    Raises
    ------
    InputError
        As `propagate` does, and if the response has not the dims and coordinates of the surrogate.

    Examples
    --------
    >>> def response(a, b):
    ...     return a * (1 + b) ** 2
    ...
    >>> inputs = {"a": fb.Interval(1.0, 2.0), "b": fb.Normal(0.0, 0.1)}
    >>> surrogate = fb.expand(response, inputs, fb.AdaptivePCCI(tolerance=0.01))
    >>> fb.verify(surrogate, response, runs=8).verification.attrs["confirmed"]
    'yes'
    """
    surrogates = dict(surrogates_of(surrogate))
    runs = check_integer("runs", runs, 2, MAX_RUNS)
    seed = check_integer("seed", seed, 0)
    sigmas = checked_sigmas(sigmas)
    inputs = next(iter(surrogates.values())).space.user_inputs
    advance = run_counter(progress, runs * len(surrogates))
    execution = {"store": store, "executor": executor, "failed": failed}
    with runs_as_expanded(response, inputs, **execution) as runs_of:
        advance(0)
        for label, case_surrogate in surrogates.items():
            run = runs_of(case_surrogate, label, advance)
            surrogates[label] = _verify(case_surrogate, run, runs, sigmas, seed)
    if isinstance(surrogate, SurrogateOfChoices):
        return replace(surrogate, surrogates=surrogates)
    return surrogates[""]


def _verify(
    surrogate: Surrogate,
    run: Runs,
    runs: int,
    sigmas: float,
    seed: int,
    *,
    options: VerificationOptions = VerificationOptions(),
) -> Surrogate:
    space, labels = surrogate.space, surrogate.labels
    axes, times = axes_of(labels), surrogate.times
    orders = [expansion.hybrid.interval_orders for expansion in surrogate.expansions]
    left_out = np.max(orders, axis=0) == 0  # interval variables in no term, (m,)
    # Make the runs, and compare them with the surrogate.
    points, width = _points(surrogate, runs, sigmas, seed, left_out, options)
    xi, eta = points.xi, points.eta
    evaluation = run((xi, eta))
    assert evaluation.values is not None
    valid_runs = np.setdiff1d(np.arange(runs), list(evaluation.failed))
    pairs = np.searchsorted(valid_runs, points.pairs[np.isin(points.pairs, valid_runs).all(axis=1)])
    F = evaluation.values.values[valid_runs]
    missed = np.abs(surrogate.standard(xi[valid_runs], eta[valid_runs]) - F).reshape(
        len(valid_runs), -1, times
    )
    F = F.reshape(missed.shape)
    size = np.abs(F).max(axis=(0, 2))
    spread = np.ptp(F, axis=0).max(axis=-1) + missed.max(axis=(0, 2)) + width
    missed[:, ~units_of(labels).varies(spread, size)] = 0.0  # what is constant has no error
    width = np.maximum(width, round_off := options.round_off * size + TINY)
    # Infer the error of the error bar, and compare it with what is expected.
    square, claim = np.mean(missed**2, axis=2), _expected_error(surrogate)
    part, left_out_eta = share(int(left_out.sum())) * growth(sigmas), eta[valid_runs][:, left_out]
    weighted = points.weight[valid_runs, None] * square
    missed_by = np.sqrt(weighted.mean(axis=0))
    least_missed = _at_least(_independent(weighted, pairs), options)
    inferred = np.maximum(part * missed_by, _at_corner(F, left_out_eta, pairs, options.min_pairs))
    worst, outputs = square.argmax(axis=0), np.arange(square.shape[1])
    results = {
        "missed": missed_by,
        "implied_error": np.maximum(inferred, SMALLEST * width),
        "least_error": part * least_missed,
        "bar_width": width,
        "missed_most_in": valid_runs[worst],
        "missed_most_at": missed[worst, outputs].argmax(axis=1),
    }
    if claim is not None:
        error_floor = np.maximum(SMALLEST * width, round_off)
        allowed = (
            np.maximum(np.sqrt(np.mean(claim**2, axis=1)), error_floor) * growth(sigmas) / part
        )
        results["allowed"] = allowed
        results["expected_error"] = part * allowed
        results["confirmed"] = allowed > least_missed
    # Make the dataset of the verification, and judge the surrogate by it.
    dims, shape = axes.dims, axes.shape
    coords = {k: c for k, c in coordinates(labels).items() if set(c.dims) <= set(dims)}
    verification = xr.Dataset({k: (dims, v.reshape(shape)) for k, v in results.items()}, coords)
    in_run = np.full((runs, *shape), np.nan)
    in_run[valid_runs] = np.sqrt(square).reshape(-1, *shape)
    verification["missed_in_run"] = ("sample", *dims), in_run
    verification["run_place"] = "sample", points.place
    verification["run_weight"] = "sample", points.weight
    if values := space.numbers_at(xi, eta):
        verification["run_values"] = ("input", "sample"), np.array(list(values.values()))
        verification = verification.assign_coords(input=list(values))
    attrs = {"runs": runs, "sigmas": sigmas, "confidence": CONFIDENCE}
    attrs |= {"runs_failed": len(evaluation.failed)} if evaluation.failed else {}
    attrs |= as_attribute(remarks_on(surrogate, evaluation.collected_remarks))
    sampled = int(points.sampled[valid_runs].sum())
    attrs |= _judgement(verification.assign_attrs(attrs), surrogate, valid_runs, sampled)
    verification = verification.assign_attrs(attrs)
    verified = replace(surrogate, verification=verification)
    return judge_by_runs(
        verified, (xi[valid_runs], eta[valid_runs], F), missed, points.weight[valid_runs]
    )


def _judgement(
    verification: xr.Dataset, surrogate: Surrogate, valid_runs: np.ndarray, sampled: int
) -> dict[str, Any]:
    """Return the verdict on a surrogate, with what is corrected in its runs, if something is."""
    attrs = surrogate.diagnostics.attrs  # which count check runs of the whole space
    held_out = 0 if "runs_inside" in attrs else int(attrs.get("runs_generic", 0))
    judgement = verdict(verification, surrogate.labels, valid_runs, sampled, held_out)
    if surrogate.correction:
        judgement["corrected"] = attrs.get("corrected", "")
        corrected = f"corrected like the surrogate: {judgement['corrected']}"
        judgement["verdict"] = f"{judgement['verdict']}. The verification runs are {corrected}"
    return judgement


def _at_least(
    square: np.ndarray, options: VerificationOptions = VerificationOptions()
) -> np.ndarray:
    """Return the root mean square missed at least, (outputs,): (runs, outputs) refute less."""
    scale = np.sqrt(square.mean(axis=0)) + TINY
    threshold = np.log(square.shape[1] / (1 - CONFIDENCE))
    factors = options.betting_factors
    low, high = (np.full(len(scale), end) for end in (options.min_part, 1.0))
    bets = np.array(factors)[:, None, None]
    for _ in range(options.halvings):  # what is claimed to be missed, relative to what is
        middle = np.sqrt(low * high)
        q = square / (middle * scale) ** 2
        products = np.log1p(bets * (q - 1)).sum(axis=1)
        evidence = np.logaddexp.reduce(products, axis=0) - np.log(len(factors))
        low, high = np.where(evidence < threshold, [low, middle], [middle, high])
    return low * scale


def _independent(square: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Return what is missed of runs, (runs, outputs), with the mean of a pair instead of both."""
    if not pairs.size:
        return square
    return np.concatenate([np.delete(square, pairs, axis=0), square[pairs].mean(axis=1)])


def _at_corner(F: np.ndarray, eta: np.ndarray, pairs: np.ndarray, min_pairs: int) -> np.ndarray:
    """Return what intervals that are left out do at their worst corner, (outputs,).

    It is a root mean square over time. Their effects are linear, a η, of shape (runs, m). They are
    told one by one if there are enough `pairs` of runs F, (runs, outputs, times), that differ in
    these alone; fewer pairs tell Σ a², and Σ |a| is √m times its root at most.
    """
    if not pairs.size:
        return np.zeros(F.shape[1])
    half = (F[pairs[:, 0]] - F[pairs[:, 1]]) / 2
    m = eta.shape[1]
    if len(pairs) < min_pairs * m:
        return np.sqrt(m * np.mean(half**2, axis=(0, 2))) / ASIDE
    effects = np.linalg.lstsq(eta[pairs[:, 0]], half.reshape(len(half), -1))[0]
    return np.sqrt(np.mean(np.abs(effects).sum(axis=0).reshape(F.shape[1:]) ** 2, axis=1))


def _points(
    surrogate: Surrogate,
    runs: int,
    sigmas: float,
    seed: int,
    left_out: np.ndarray,
    options: VerificationOptions,
) -> tuple[VerificationPoints, np.ndarray]:
    """Return where the runs are, and each output's error bar's width."""
    space = surrogate.space
    rng = np.random.default_rng(seed)
    period = options.anywhere
    golden = (5**0.5 - 1) / 2
    # Spread runs over outputs and times, at places where bounds are attained.
    k = np.arange(max(runs, options.times))
    at = (surrogate.times * ((0.5 + golden * k) % 1)).astype(int)
    scattered, which = np.unique(at, return_inverse=True)
    _, low, high = extremes_of(surrogate.expansions, scattered, sigmas)
    width = (high.values[1] - low.values[0]).mean(axis=-1)
    k = k[:runs]
    bound = (k + k // period) % 2
    output = (k // 2) * max(1, 2 * len(width) // runs) % len(width)
    eta = np.stack([low.places[0], high.places[1]])[bound, output, which[:runs]]
    # Pair runs that differ in the intervals left out alone.
    sampled = k % period == period - 1
    anywhere = sampled | (space.interval_dimension == 0)
    at_bounds = np.flatnonzero(~anywhere)
    pairs = at_bounds[: len(at_bounds) // 2 * 2 * left_out.any()].reshape(-1, 2)
    first, second = pairs.T
    bound[second] = bound[first]
    eta[second] = eta[first]
    sides = ASIDE * rng.choice([-1.0, 1.0], (len(pairs), left_out.sum()))
    for run_numbers, side in ((first, 1), (second, -1)):
        eta[np.ix_(run_numbers, left_out)] = side * sides
    if not space.random_dimension:  # a place is run once
        once = np.unique(eta[at_bounds].round(6), axis=0, return_index=True)[1]
        anywhere |= ~np.isin(k, at_bounds[once])
        pairs = pairs[~anywhere[pairs].any(axis=1)]
    eta = np.where(anywhere[:, None], in_discs(rng.uniform(-1, 1, eta.shape), space.discs), eta)
    # Draw the random variables: samples anywhere, and wider ones for each bound.
    normals = np.zeros((runs, space.random_dimension))
    weight = np.ones(runs)
    sample = sampled | (space.random_dimension == 0)
    for kind in (sample, ~sample & (bound == 0), ~sample & (bound == 1)):
        rows = np.setdiff1d(np.flatnonzero(kind), second)
        draw = int(rng.integers(2**31))
        normals[rows] = latin_hypercube_normals(len(rows), normals.shape[1], draw)
    normals[~sample], weight[~sample] = stretch_samples(normals[~sample], options.farthest, rng)
    normals[second] = normals[first]
    weight[second] = weight[first]
    xi = of_normals(normals, space.families)
    names = np.where(anywhere, "anywhere", np.array(["lower bound", "upper bound"])[bound])
    return VerificationPoints(xi, eta, weight, sample & anywhere, names.tolist(), pairs), width


def _expected_error(surrogate: Surrogate) -> np.ndarray | None:
    """Return the error expected of μ ± σ of the expansion at any point, (outputs, times)."""
    names = "pointwise_error", "error_bar_expansion_error", "error_bar_expected_error"
    name, error = error_of(surrogate.diagnostics, surrogate.labels, names)
    factor = 1 / AT_ONE_TIME if name == "pointwise_error" else 1.0
    return factor * error.reshape(-1, surrogate.times) if name else None
