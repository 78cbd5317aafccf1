"""How numbers such as peaks and counts are distributed over the parts that are made."""

from __future__ import annotations

import xarray as xr

from flexband.analysis.parts.numbers import Quantities, check_quantities
from flexband.analysis.parts.part_distribution import SamplingOptions, distribution
from flexband.analysis.parts.part_runs import plain_runs
from flexband.analysis.parts.points import Parts
from flexband.basics.checks import check_integer
from flexband.basics.progress import Progress, run_counter
from flexband.basics.response import ResponseFunction
from flexband.execution.executors import ExecutorLike
from flexband.execution.store import StoreLike
from flexband.requirements.requirement import Requirements, requirement_tuple
from flexband.requirements.scatter import Scatter
from flexband.uncertainty.inputs.unfolding import GivenInputs
from flexband.uncertainty.runs import BATCH
from flexband.uncertainty.runs.evaluations import EvaluationOptions


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
    requirements : a `Requirement`, or several, on outputs, which hold at their times,
        or on quantities.
    probabilities : of the quantiles.
    confidence : of all intervals.
    accuracy : half the width of the interval of a quantile, relative to the probability beyond it:
        0.5 is from 92.5 % to 97.5 % for that of 95 %.
    samples : number of samples; by default as many as `accuracy` needs, and as show that the
        share of `ShareOfParts` is met, if no sample fails, up to 10 000.
    seed : of the samples. The first ones are the same for any number of samples.
    batch, store, executor, failed, progress : as in `propagate`. Runs that are left out make
        intervals of shares wider: they may meet a requirement or not.

    Returns
    -------
    Dataset with the dims "probability" and "quantity": `quantile`, a sample, and the ends of its
    interval, `quantile_low` and `quantile_high`, infinite where samples are too few; with "input"
    and "quantity": the `first_order` index, which part of the variance is due to each input alone,
    and `first_order_error`, half the width of its interval. Random fields have none. With
    requirements, the variables of `production_yield` along the dim "limit", whose intervals include
    what may happen between the times in a motion that turns at once. ``attrs["samples"]``
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
    >>> limit = fb.Requirement("response", below=1)
    >>> result = fb.analysis.sample_parts(lambda a, b: a + b, inputs, requirements=limit)
    >>> result["quantile"].sel(probability=0.5).values.round(1), result.attrs["samples"]
    (array([0.5]), 292)
    >>> result["yield"].values.round(2), result.attrs["scatter"]
    (array([0.96]), 'a: Uniform(lower=0.0, upper=1.0), assumed')
    """
    options = SamplingOptions(probabilities, confidence, accuracy, samples)
    requirement_list = requirement_tuple(requirements)
    check_quantities(quantities)
    seed = check_integer("seed", seed, 0)
    count = options.count(requirement_list)
    settings = EvaluationOptions(batch, store, executor, failed)
    scatter = {} if scatter is None else scatter
    with plain_runs(response, inputs, settings) as (space, explored, runs_of):
        parts = Parts.from_scatter(space, scatter)
        run = runs_of(run_counter(progress, count))
        result = distribution(run, parts, requirement_list, quantities, seed=seed, options=options)
    return result.assign_attrs(runs=count + explored)
