"""The distribution of numbers over sampled parts, what it depends on, and their yield."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from flexband.analysis.labelled_answers import AnswerRecord
from flexband.analysis.limits.production import with_yield
from flexband.analysis.parts.estimates import first_order, needed_samples, quantiles_of, share_of
from flexband.analysis.parts.numbers import Quantities, numbers_of
from flexband.analysis.parts.points import Parts
from flexband.analysis.peaks import TimeAxis, lowest_of_impacts
from flexband.analysis.probability.failure import ANY
from flexband.analysis.verification.expanded_runs import Runs
from flexband.basics.checks import check_finite, check_fraction, check_integer
from flexband.basics.words import value_text
from flexband.errors import InputError
from flexband.requirements.corridors import at_more_times
from flexband.requirements.criteria import Probability, ShareOfParts
from flexband.requirements.requirement import Requirement, by_name
from flexband.requirements.scatter import OF_SAMPLES
from flexband.uncertainty.runs.between import parts_between
from flexband.uncertainty.surrogates.surrogate import Surrogate

LONG_NAMES = {
    "quantile": "number that is not exceeded by this part of the parts",
    "quantile_low": "lower end of its confidence interval",
    "quantile_high": "upper end of its confidence interval",
    "first_order": "part of the variance that is due to the input alone",
    "first_order_error": "half the width of its confidence interval",
}


@dataclass(frozen=True)
class SamplingOptions:
    """What samples of parts are to tell, as in `sample_parts`."""

    probabilities: tuple[float, ...] = (0.05, 0.5, 0.95)
    confidence: float = 0.95
    accuracy: float = 0.5
    samples: int | None = None
    max_samples: int = 10_000
    """Most samples, if their number is not given."""
    at_first: int = 8
    """Samples that check quantities and requirements before more are made."""
    max_values: int = 2**24
    """Values of outputs that are kept at a time."""

    def __post_init__(self) -> None:
        parts = check_finite("probabilities", self.probabilities, rank=None).ravel()
        if not parts.size or (np.diff([0.0, *parts, 1.0]) <= 0).any():
            raise InputError(
                f"probabilities must increase between 0 and 1; got {value_text(self.probabilities)}"
            )
        check_fraction("confidence", self.confidence)
        check_fraction("accuracy", self.accuracy)
        if self.samples is not None:
            check_integer("samples", self.samples, 2)

    def count(self, requirements: Sequence[Requirement]) -> int:
        """Return the number of samples."""
        if self.samples is not None:
            return self.samples
        allowed = [r.criterion.at_most for r in requirements if type(r.criterion) is ShareOfParts]
        parts = np.array(self.probabilities, dtype=float)
        return min(self.max_samples, needed_samples(parts, allowed, self.confidence, self.accuracy))


def distribution(
    run: Runs,
    parts: Parts,
    requirements: Sequence[Requirement],
    quantities: Quantities | None = None,
    *,
    seed: int = 0,
    options: SamplingOptions = SamplingOptions(),
    case: str = "",
    error: np.ndarray | float = 0.0,
    labels: xr.DataArray | None = None,
) -> xr.Dataset:
    """Return what `sample_parts` does, by runs of a combination of options, `case`.

    Their times may divide the steps of the response that `labels` are of. The `error` of its
    discretization, of the shape of a run, makes the intervals of shares wider.
    """
    count = options.count(requirements)
    # Make the runs block by block, and keep only their numbers and margins.
    blocks = list[xr.DataArray]()
    margins = list[np.ndarray]()
    xi, eta = parts.samples(count, seed)
    valid_mask = np.full(count, True)
    first = 0
    at_once = options.at_first
    while first < count:
        end = min(count, first + at_once)
        evaluation = run((xi[first:end], eta[first:end]))
        assert evaluation.values is not None
        valid_mask[[first + k for k in evaluation.failed]] = False
        response = evaluation.values.isel(sample=valid_mask[first:end])
        blocks.append(numbers_of(response, quantities))
        margins.append(margins_of(requirements, response, blocks[-1], case, error, labels))
        first = end
        at_once = max(1, options.max_values // max(1, evaluation.values[0].size))
    # Describe the distribution of the numbers, and the yield.
    numbers = xr.concat(blocks, "sample")
    lost = int(count - valid_mask.sum())
    values = parts.space.numbers_at(xi[valid_mask], eta[valid_mask])
    columns = np.reshape(list(values.values()), (len(values), len(numbers))).T
    probabilities = np.array(options.probabilities, dtype=float)
    arrays = (
        *quantiles_of(numbers.values, probabilities, options.confidence, lost),
        *first_order(columns, numbers.values, options.confidence),
    )
    dims = ["probability"] * 3 + ["input"] * 2
    result = xr.Dataset(
        {
            name: ((dim, "quantity"), array, {"long_name": words})
            for (name, words), dim, array in zip(LONG_NAMES.items(), dims, arrays, strict=True)
        },
        {"probability": probabilities, "input": list(values), **numbers.coords},
        {"confidence": options.confidence},
    )
    if requirements:
        shares = yields(requirements, np.concatenate(margins, axis=2), options.confidence, lost)
        result = result.assign(shares.variables).assign_attrs(shares.attrs)
    attrs = {"samples": len(numbers), "seed": seed, "scatter": parts.scatter}
    return result.assign_attrs(attrs | ({"runs_failed": lost} if lost else {}))


def margins_of(
    requirements: Sequence[Requirement],
    response: xr.DataArray,
    numbers: xr.DataArray,
    case: str,
    error: np.ndarray | float,
    labels: xr.DataArray | None = None,
) -> np.ndarray:
    """Return least margins of outputs, or of numbers by name, (3, requirements, samples).

    The first ones are larger by the error of outputs; the third ones are smaller by it, and between
    the times, where an impact may turn a motion at once. Without labels, they are the response's.
    """
    as_outputs = numbers.rename(quantity="output")
    names = numbers["quantity"].values.tolist()
    margins = []
    for requirement in requirements:
        of_number = (requirement.output or requirement.name) in names
        values, unsure = (as_outputs, 0.0) if of_number else (response, error)
        corridor_labels = values if of_number or labels is None else labels
        parts = parts_between(values, corridor_labels)
        corridor = requirement.corridor(corridor_labels, case).at_more_times(parts)
        unsure = at_more_times(np.broadcast_to(unsure, corridor_labels.shape[1:]), parts)
        inside = corridor.margin(values.values, values.values)
        lowest = inside - unsure
        axis = TimeAxis.from_labels(values, corridor.window)
        if axis is not None:
            all_times = corridor.margin_at_all_times(values.values)
            lowest = lowest_of_impacts(all_times - unsure[corridor.where], axis)
        margin_bounds = inside + unsure, inside, lowest
        margins.append([margin.reshape(len(values), -1).min(axis=1) for margin in margin_bounds])
    return np.reshape(margins, (len(margins), 3, len(numbers))).swapaxes(0, 1)


def yields(
    requirements: Sequence[Requirement], margins: np.ndarray, confidence: float, lost: int
) -> xr.Dataset:
    """Return the variables of `production_yield` of samples, of which some are lost.

    Intervals include what may violate bounds between the times, or by the error of the runs.
    """
    names = list(by_name(requirements))
    if len(names) > 1:
        joint_margins = margins.min(axis=1, keepdims=True)
        margins = np.concatenate([margins, joint_margins], axis=1)
        names = [*names, ANY]
    count = margins.shape[-1]
    hits = (margins < 0).sum(axis=-1).T.tolist()
    shares = [share_of(tuple(of_limit), count, confidence, lost) for of_limit in hits]
    ends = dict(zip(("failing", "failing_low", "failing_high"), np.transpose(shares), strict=True))
    data = {name: ("limit", values) for name, values in ends.items()}
    return with_yield(xr.Dataset(data, {"limit": names}, {"confidence": confidence}))


def samples_decide(requirements: Sequence[Requirement], surrogate: Surrogate) -> bool:
    """Return whether samples of the parts decide a requirement: one on their share.

    The probability of violating bounds is that for the worst intervals, of which they tell nothing.
    They do not decide either where the surrogate corrects an error that they have.
    """
    shares = {ShareOfParts} if surrogate.space.interval_dimension else {ShareOfParts, Probability}
    required = not shares.isdisjoint(type(requirement.criterion) for requirement in requirements)
    return required and "corrected" not in surrogate.diagnostics.attrs


def yield_of(parts: xr.Dataset) -> xr.Dataset:
    """Return the yield of sampled parts, with choices that of the best and the worst of them."""
    of_limits = parts[[name for name in parts if "limit" in parts[name].dims]]
    if "choice" in of_limits.dims:
        failing = of_limits["failing"]
        ends = [of_limits.isel(choice=k("choice")) for k in (failing.argmin, failing.argmax)]
        of_limits = with_yield(xr.concat(ends, xr.Variable("bound", ["lower", "upper"])))
    return of_limits.assign_attrs({OF_SAMPLES: int(bool(AnswerRecord.read(parts).scatter))})
