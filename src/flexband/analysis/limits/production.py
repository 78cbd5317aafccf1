"""How many of the parts that are made meet requirements, if their tolerances scatter."""

from __future__ import annotations

from typing import Any

import xarray as xr

from flexband.analysis.labelled_answers import AnswerRecord
from flexband.analysis.probability.failure import RUNS, limit_probabilities
from flexband.analysis.probability.texts import share_in_words
from flexband.analysis.selection import AnySurrogate
from flexband.basics.progress import Progress
from flexband.basics.response import ResponseFunction
from flexband.execution.executors import ExecutorLike
from flexband.execution.store import StoreLike
from flexband.requirements.requirement import Requirements
from flexband.requirements.scatter import Scatter

LONG_NAMES = {
    "yield": "share of the parts that meet the requirement",
    "yield_low": "lower end of its confidence interval",
    "yield_high": "upper end of its confidence interval",
    "failing": "share of the parts that do not meet the requirement",
    "failing_low": "lower end of its confidence interval",
    "failing_high": "upper end of its confidence interval",
    "samples": "samples of the surrogate",
    "runs": "runs of the response that correct the share",
    "disagreements": "runs in which the corrected surrogate was wrong about the requirement",
}


def production_yield(
    surrogate: AnySurrogate,
    requirements: Requirements,
    scatter: Scatter,
    *,
    response: ResponseFunction | None = None,
    runs: int = RUNS,
    accuracy: float = 0.025,
    seed: int = 0,
    store: StoreLike = None,
    executor: ExecutorLike = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Return the share of the parts that meet each requirement, if tolerances scatter.

    The surrogate of the worst case answers without new runs: its intervals are the ranges within
    which the tolerances scatter. A part fails if it violates the bounds at any time, at the output
    times or between them. The share of those that fail is computed as `failure_probability` does,
    with the same statements about its error, and runs of the response correct it likewise.

    Parameters
    ----------
    surrogate : what `expand` returns.
    requirements : a `Requirement`, or several; of several, the share of the parts that
        meet all is given as well. Their criteria have no effect.
    scatter : by names of the intervals, their distributions in production: any bounded
        distribution, such as `Uniform`, `Triangular` or `TruncatedNormal`, or an
        `analysis.Capability`; dependent ones in a `Correlated`. Random inputs scatter as they are
        given.
    response, runs, accuracy, seed, store, executor, progress : as in `failure_probability`.

    Returns
    -------
    Dataset with the dim "limit". `yield` is the share of the parts that meet the requirement,
    `yield_low` and `yield_high` its interval; `failing`, `failing_low` and `failing_high` are those
    of the parts that do not. Rare failures that are only bounded are 0, with the bound in
    `failing_high`; without runs, those of a surrogate that missed its tolerance are NaN. With
    choices, the dim "bound" has the least and the largest of all combinations of options.
    ``attrs["verdict"]`` is a text.

    Raises
    ------
    InputError
        If a tolerance has no distribution, or one that goes beyond its interval; and as
        `failure_probability` does.

    Examples
    --------
    >>> inputs = {"a": fb.Interval(-1.0, 1.0), "b": fb.Interval(-1.0, 1.0)}
    >>> surrogate = fb.expand(lambda a, b: a + b, inputs, fb.PCCI(0, 1))
    >>> uniform = fb.Uniform(-1.0, 1.0)
    >>> requirement = fb.Requirement("response", below=1.0)
    >>> found = fb.production_yield(surrogate, requirement, {"a": uniform, "b": uniform})
    >>> found["failing"].values.round(2)  # 1/8
    array([0.13])
    """
    options = {"runs": runs, "accuracy": accuracy, "seed": seed, "store": store}
    return production_of(
        surrogate, requirements, scatter, response=response, executor=executor,
        progress=progress, **options,
    )  # fmt: skip


def production_of(
    surrogate: AnySurrogate, requirements: Requirements, scatter: Scatter, **options: Any
) -> xr.Dataset:
    """Return what `production_yield` does; `options` are those of `limit_probabilities`."""
    result = limit_probabilities(surrogate, requirements, scatter=scatter, **options)
    data = {f"failing{end}": result[f"between_times{end}"] for end in ("", "_low", "_high")}
    counts = {k: result[k] for k in ("samples", "runs", "disagreements") if k in result}
    production = xr.Dataset(data | counts)
    if "probability_choice" not in result:
        production = production.isel(bound=-1, drop=True)
    production = with_yield(production)
    attrs = {k: v for k, v in result.attrs.items() if k not in ("verdict", "doubts")}
    attrs["scatter"] = ", ".join(
        f"{name}: {distribution!r}" for name, distribution in scatter.items()
    )
    verdict = ". ".join([AnswerRecord.read(production).verdict, *AnswerRecord.read(result).doubts])
    return production.assign_attrs(attrs | {"verdict": verdict})


def with_yield(production: xr.Dataset) -> xr.Dataset:
    """Return shares of parts that fail, with their yield, and a text as ``attrs["verdict"]``."""
    for end, other in (("", ""), ("_low", "_high"), ("_high", "_low")):
        production[f"yield{end}"] = 1 - production[f"failing{other}"]
    for name, words in LONG_NAMES.items():
        if name in production:
            production[name].attrs = {"long_name": words, "units": "1"}
    worst = production if "bound" not in production.dims else production.isel(bound=-1)
    shares = [share_in_words(worst.isel(limit=k)) for k in range(worst.sizes["limit"])]
    words = [f"{limit}: {text}" for limit, text in zip(worst["limit"].values, shares, strict=True)]
    return production.assign_attrs(verdict=". ".join(words))
