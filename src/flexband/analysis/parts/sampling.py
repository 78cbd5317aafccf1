"""How numbers such as peaks and counts are distributed over the parts that are made."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr

from flexband.analysis.parts.confidence import needed_samples, quantiles_of, share_of
from flexband.analysis.parts.first_order import first_order
from flexband.analysis.parts.numbers import Quantities, check_quantities, numbers_of
from flexband.analysis.parts.points import Parts
from flexband.analysis.parts.runs import plain_runs
from flexband.analysis.probability.failure import ANY
from flexband.analysis.requirements.criteria import ShareOfParts
from flexband.analysis.requirements.production import with_yield
from flexband.analysis.requirements.requirement import (
    Requirement,
    Requirements,
    by_name,
    several,
)
from flexband.analysis.requirements.scatter import Scatter
from flexband.analysis.verification.expanded_runs import Runs
from flexband.errors import InputError, check_finite, check_integer, check_numbers
from flexband.execution.executors import ExecutorLike
from flexband.execution.store import StoreLike
from flexband.progress import Progress, counted
from flexband.response import ResponseFunction
from flexband.uncertainty.inputs.unfolding import GivenInputs
from flexband.uncertainty.runs import BATCH
from flexband.uncertainty.runs.evaluations import EvaluationOptions

LONG_NAMES = {
    "quantile": "number that is not exceeded by this part of the parts",
    "quantile_low": "lower end of its confidence interval",
    "quantile_high": "upper end of its confidence interval",
    "first_order": "part of the variance that is due to the input alone",
    "first_order_error": "half the width of its confidence interval",
}


@dataclass(frozen=True)
class SamplingOptions:
    """What samples of parts are to tell.

    Attributes
    ----------
    probabilities : of the quantiles, increasing, between 0 and 1.
    confidence : of all intervals.
    accuracy : half the width of a quantile's interval, in parts of the probability beyond it.
    samples : number of samples; None for as many as confidence and accuracy need.
    max_samples : most samples, if their number is not given.
    at_first : samples with which quantities and requirements are checked before more are made.
    at_once : samples whose outputs are kept at a time.
    """

    probabilities: tuple[float, ...] = (0.05, 0.5, 0.95)
    confidence: float = 0.95
    accuracy: float = 0.5
    samples: int | None = None
    max_samples: int = 10_000
    at_first: int = 8
    at_once: int = 512

    def __post_init__(self) -> None:
        parts = check_finite("probabilities", self.probabilities, rank=None).ravel()
        if not parts.size or parts.min() <= 0 or parts.max() >= 1 or (np.diff(parts) <= 0).any():
            raise InputError(
                f"probabilities must increase between 0 and 1; got {self.probabilities}"
            )
        for name in ("confidence", "accuracy"):
            value = float(check_numbers(name, getattr(self, name)))
            if not 0 < value < 1:
                raise InputError(f"{name} must be between 0 and 1; got {value:g}")
        check_integer("max_samples", self.max_samples, 2)
        if self.samples is not None:
            check_integer("samples", self.samples, 2)

    def count(self, requirements: tuple[Requirement, ...]) -> int:
        """Return the number of samples."""
        if self.samples is not None:
            return self.samples
        allowed = [r.criterion.at_most for r in requirements if type(r.criterion) is ShareOfParts]
        parts = np.array(self.probabilities, dtype=float)
        return min(self.max_samples, needed_samples(parts, allowed, self.confidence, self.accuracy))


def sample_parts(
    response: ResponseFunction,
    inputs: GivenInputs,
    *,
    scatter: Scatter | None = None,
    quantities: Quantities | None = None,
    requirements: Requirements = (),
    probabilities: tuple[float, ...] = (0.05, 0.5, 0.95),
    confidence: float = 0.95,
    accuracy: float = 0.5,
    samples: int | None = None,
    max_samples: int = 10_000,
    seed: int = 0,
    batch: int = BATCH,
    store: StoreLike = None,
    executor: ExecutorLike = None,
    failed: str = "stop",
    progress: Progress | None = None,
) -> xr.Dataset:
    """Return how numbers are distributed over the parts that are made, by runs of the response.

    This needs no expansion, so it holds for motions past their horizon of predictability too, where
    the peak or the count of a single part tells nothing. Samples are independent: intervals of
    confidence are those of the binomial distribution, whatever the response is.

    Parameters
    ----------
    response, inputs : as in `propagate`, without choices.
    scatter : how intervals scatter, as in `production_yield`. One without a distribution is
        uniformly distributed, which ``attrs["scatter"]`` says.
    quantities : name -> quantity of one number, such as ``Peak("F")`` or ``Final("stop_number")``;
        by default the largest and the smallest value of each output.
    requirements : a `Requirement` or a `Limit`, or several, on outputs, which hold at their times,
        or on quantities.
    probabilities : of the quantiles.
    confidence : of all intervals.
    accuracy : half the width of the interval of a quantile, in parts of the probability beyond it:
        0.5 is from 92.5 % to 97.5 % for that of 95 %.
    samples : number of samples; by default as many as `accuracy` needs, and as show that a share of
        parts which `ShareOfParts` allows is not exceeded, if no sample fails.
    max_samples : most samples, if their number is not given.
    seed : of the samples. The first ones are the same for any number of samples.
    batch, store, executor, failed, progress : as in `propagate`. Runs that are left out make
        intervals of shares wider: they may meet a requirement or not.

    Returns
    -------
    Dataset with the dims "probability" and "quantity": `quantile`, a sample, and the ends of its
    interval, `quantile_low` and `quantile_high`, infinite where samples are too few; with "input"
    and "quantity": the `first_order` index, which part of the variance is due to each input alone,
    and `first_order_error`, half the width of its interval. Random fields have none. With
    requirements, the variables of `production_yield` along the dim "limit". ``attrs["samples"]``
    and ``attrs["runs"]`` count the samples, and ``attrs["runs_failed"]`` those that are left out.

    Raises
    ------
    InputError
        If a tolerance is no `Interval`, a number is out of its range, a quantity or requirement
        does not fit, and as `propagate`.
    RunError, StoreError
        As `propagate` raises them.

    Examples
    --------
    >>> inputs = {"a": fb.Interval(0.0, 1.0), "b": fb.Normal(0.0, 0.1)}
    >>> found = fb.analysis.sample_parts(lambda a, b: a + b, inputs, requirements=fb.Limit(below=1))
    >>> found["quantile"].sel(probability=0.5).values.round(1), found.attrs["samples"]
    (array([0.5]), 292)
    >>> found["yield"].values.round(2), found.attrs["scatter"]
    (array([0.96]), 'a: Uniform(lower=0.0, upper=1.0), assumed')
    """
    options = SamplingOptions(probabilities, confidence, accuracy, samples, max_samples)
    known = several(requirements, "requirements")
    check_quantities(quantities)
    seed, count = check_integer("seed", seed, 0), options.count(known)
    settings = EvaluationOptions(batch, store, executor, failed)
    with plain_runs(response, inputs, settings) as plain:
        parts = Parts.of(plain.space, scatter or {})
        run = plain.run(counted(progress, count))
        result = distribution(run, parts, known, quantities, seed, options)
    return result.assign_attrs(runs=count + plain.explored)


def distribution(
    run: Runs,
    parts: Parts,
    requirements: tuple[Requirement, ...],
    quantities: Quantities | None,
    seed: int,
    options: SamplingOptions,
) -> xr.Dataset:
    """Return what `sample_parts` does.

    Parameters
    ----------
    run : returns runs at points.
    parts : what is sampled.
    """
    count, blocks, margins = options.count(requirements), list[xr.DataArray](), list[np.ndarray]()
    xi, eta = parts.samples(count, seed)
    good = np.full(count, True)
    starts = [0, *range(options.at_first, count, options.at_once)]
    for first, end in itertools.pairwise([*starts, count]):
        made = run((xi[first:end], eta[first:end]))
        assert made.values is not None
        good[[first + k for k in made.failed]] = False
        response = made.values.isel(sample=good[first:end])
        blocks.append(numbers_of(response, quantities))
        margins.append(np.array([_margins(r, response, blocks[-1]) for r in requirements]))
    numbers = xr.concat(blocks, "sample")
    values = parts.space.numbers_at(xi[good], eta[good])
    result = _described(numbers, values, count - len(numbers), options)
    result.attrs |= {"samples": len(numbers), "seed": seed, "scatter": parts.scatter}
    if not requirements:
        return result
    fails, names = np.concatenate(margins, axis=1) < 0, list(by_name(requirements))
    if len(names) > 1:
        fails, names = np.concatenate([fails, fails.any(axis=0)[None]]), [*names, ANY]
    lost = count - len(numbers)
    shares = [share_of(int(hits), len(numbers), options.confidence, lost) for hits in fails.sum(1)]
    ends = dict(zip(("failing", "failing_low", "failing_high"), np.transpose(shares), strict=True))
    limits = xr.Dataset({k: ("limit", v) for k, v in ends.items()}, {"limit": names})
    limits = with_yield(limits.assign_attrs(result.attrs))
    return result.assign(limits.variables).assign_attrs(limits.attrs)


def _margins(requirement: Requirement, response: xr.DataArray, numbers: xr.DataArray) -> np.ndarray:
    """Return the least margin of each sample, (samples,)."""
    if requirement.output in numbers["quantity"].values.tolist():
        response = numbers.rename(quantity="output")
    corridor = requirement.corridor(response)
    margins = corridor.margin(response.values, response.values)
    return margins.reshape(len(response), -1).min(axis=1)


def _described(
    numbers: xr.DataArray,
    values: Mapping[str, np.ndarray],
    lost: int,
    options: SamplingOptions,
) -> xr.Dataset:
    """Return quantiles of numbers, and what part of their variance each input explains."""
    probabilities = np.array(options.probabilities, dtype=float)
    columns = np.reshape(list(values.values()), (len(values), len(numbers))).T
    of_quantiles = quantiles_of(numbers.values, probabilities, options.confidence, lost)
    indices = first_order(columns, numbers.values, options.confidence)
    data = dict(zip(("quantile", "quantile_low", "quantile_high"), of_quantiles, strict=True))
    of_inputs = dict(zip(("first_order", "first_order_error"), indices, strict=True))
    result = xr.Dataset(
        {k: (("probability", "quantity"), v) for k, v in data.items()}
        | {k: (("input", "quantity"), v) for k, v in of_inputs.items()},
        {"probability": probabilities, "input": list(values), **numbers.coords},
        {"confidence": options.confidence} | ({"runs_failed": lost} if lost else {}),
    )
    for name, words in LONG_NAMES.items():
        result[name].attrs["long_name"] = words
    return result
