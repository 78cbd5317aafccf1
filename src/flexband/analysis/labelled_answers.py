"""Answers as labelled datasets, with the errors that are expected of the surrogate."""

from __future__ import annotations

from collections.abc import Container, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from flexband.errors import InputError
from flexband.remarks.collection import CollectedRemark, merge_remarks, remarks_of
from flexband.remarks.remark import RemarkKind
from flexband.uncertainty.inputs.evaluation import coordinates
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.surrogates.bands import BOUNDS, AttributeRecord, BandRecord, remark
from flexband.uncertainty.surrogates.sigmas import growth
from flexband.uncertainty.surrogates.surrogate import Surrogate
from flexband.uncertainty.surrogates.verification_verdict import (
    Confirmation,
    VerificationRecord,
    in_percent,
)

ERRORS = ("error_bar_expected_error",)
"""Diagnostics that tell the error of the error bar, the best first: what runs have judged.

The `truncation` of methods with given orders is none: whole classes of responses, such as even ones
at an odd order, do not show in it.
"""

NOT_JUDGED = "not judged by runs"
"""Error of a surrogate that no runs have judged."""

POINTWISE_ERRORS = ("pointwise_error", *ERRORS)
"""Diagnostics that tell the error of μ ± σ wherever it is evaluated, the best first."""

CARRIED = (
    "expected_error", "not_trusted", "runs", "method", "tolerance", "stopped", "corrected",
)  # fmt: skip
"""Attributes of the surrogate that answers have as well."""

WITHOUT_UNITS = ("_at", "_choice")
"""Endings of variables that are no values of the outputs."""


@dataclass(frozen=True)
class AnswerRecord(AttributeRecord):
    """What answers say beside their numbers, each some of it.

    Attributes
    ----------
    samples : number of samples.
    scatter : how tolerances scatter, in words.
    verdict, outcome, doubts : the answer in words, and what is doubtful about it.
    changes : which inputs were narrowed, in words.
    surrogate_not_reliable : why the surrogate is not reliable; "" if it is.
    undefined : number of times at which a variance vanishes.
    made : of what a quantity was made.
    standard_deviations : half the width of the box of the random variables.
    """

    samples: int = 0
    scatter: str = ""
    verdict: str = ""
    outcome: str = ""
    doubts: Sequence[str] = ()
    changes: str = ""
    surrogate_not_reliable: str = ""
    undefined: int = 0
    made: str = ""
    standard_deviations: float = 0.0


Dims = Hashable | Sequence[Hashable]
Variables = dict[str, tuple[Dims, ArrayLike] | xr.Variable | ArrayLike]
"""Name of a variable -> its dims and values."""


def check_free(labels: xr.DataArray, *names: str) -> None:
    """Raise `InputError` if a response has a dimension or coordinate that an answer adds."""
    for name in names:
        if name in labels.dims or name in labels.coords:
            raise InputError(f"the response must have no dimension or coordinate {name!r}")


def error_of(
    diagnostics: xr.Dataset, labels: xr.DataArray, names: Sequence[str] = ERRORS
) -> tuple[str, np.ndarray]:
    """Return the first of these that diagnostics have, "" if none, and its values, or zeros.

    The values have the shape of the response, (outputs …, times).
    """
    for name in names:
        if name in diagnostics:
            return name, diagnostics[name].transpose(*labels.dims[1:]).values
    return "", np.zeros(labels.shape[1:])


def beyond_neighbours(diagnostics: xr.Dataset, labels: xr.DataArray) -> np.ndarray:
    """Return by how much values go below and above two neighbouring ones, from each to the next.

    It is the least and the most of some runs, (2, 2, outputs …, times), zero where it is not known.
    """
    kinds = [[f"{side}_between{kind}" for side in ("below", "above")] for kind in ("_least", "")]
    return np.array([[error_of(diagnostics, labels, [k])[1] for k in names] for names in kinds])


def expected_error(surrogate: Surrogate, sigmas: float) -> np.ndarray | None:
    """Return the error expected of μ ± kσ of every output and time, None if there is no estimate.

    It is that at any values of the inputs, not where bounds rest. The diagnostics have that of
    μ ± σ.
    """
    name, error = error_of(surrogate.diagnostics, surrogate.labels, POINTWISE_ERRORS)
    if not name:
        return None
    has_discretization = (
        "error_bar_discretization_error" in surrogate.diagnostics
    )  # of bands: if σ alone moves
    return error * (max(growth(sigmas), sigmas) if has_discretization else growth(sigmas))


def places(
    name: str, space: Space, eta: np.ndarray, dims: Sequence[Hashable], shape: Sequence[int]
) -> Variables:
    """Return a variable with the values of the interval inputs at η, if there are any.

    Its first dim is "input"; `dims` and `shape` are those of the places η, (…, m).
    """
    values = interval_values(space, eta)
    if not values:
        return {}
    stacked = np.reshape(list(values.values()), (-1, *shape))
    return {name: (("input", *dims), stacked), "input": ("input", list(values))}


def interval_values(space: Space, eta: np.ndarray) -> dict[str, np.ndarray]:
    """Return the numbers of the interval inputs at η, (…, m), by name, flat."""
    intervals = Space(space.of_kind(random=False))
    if not intervals.inputs:
        return {}
    flat = eta.reshape(-1, eta.shape[-1])
    return intervals.numbers_at(np.zeros((len(flat), 0)), flat)


def is_judged(surrogate: Surrogate) -> bool:
    """Return whether runs that were not fitted tell the error of a surrogate."""
    return any(name in surrogate.diagnostics for name in ERRORS)


def missed_tolerance(surrogate: Surrogate) -> bool:
    """Return whether the error of a surrogate, as its method judged it, is above its tolerance."""
    record = BandRecord.read(surrogate.diagnostics)
    error = record.error_of_runs
    tolerance = record.tolerance
    return isinstance(error, float) and tolerance is not None and error > tolerance


def doubts_of(surrogate: Surrogate, *, corrected: bool = False) -> list[str]:
    """Return why a surrogate is not reliable, whose errors may be `corrected` by runs."""
    record = BandRecord.read(surrogate.diagnostics)
    doubts = [text for text in (record.not_trusted, record.beyond_runs) if text]
    if not corrected and not is_judged(surrogate):
        doubts.append(f"the surrogate is {NOT_JUDGED}; `verify` judges it")
    if surrogate.verification is not None and not corrected:
        verification = VerificationRecord.read(surrogate.verification)
        if verification.confirmed == Confirmation.REFUTED:
            doubts.append("verification runs do not confirm the error that its method expected")
    if missed_tolerance(surrogate) and not corrected:
        error = record.error_of_runs or 0.0
        tolerance = record.tolerance or 0.0
        doubts.append(
            f"the error expected of the surrogate is {in_percent(error)} of the error bar's width, "
            f"above the tolerance of {100 * tolerance:g} %"
        )
    return doubts


def remarks_on(
    surrogate: Surrogate, runs: Iterable[CollectedRemark] = ()
) -> Iterator[CollectedRemark]:
    """Yield the remarks on the runs of a surrogate, and on further `runs`.

    Where the error of step and elements is part of the expected error, that of a coarse step is 0.
    """
    judged = "error_bar_discretization_error" in surrogate.diagnostics
    for topic_remark in (*remarks_of(surrogate.diagnostics.attrs), *runs):
        included = judged and topic_remark.worst.kind is RemarkKind.COARSE_STEP
        worst = replace(topic_remark.worst, error=0.0) if included else topic_remark.worst
        yield replace(topic_remark, worst=worst)


def answer(
    surrogate: Surrogate,
    data: Variables,
    coords: Variables,
    attrs: Mapping[str, Any],
    long_names: Mapping[str, str],
    labels: xr.DataArray | None = None,
    unitless: Container[str] = (),
) -> xr.Dataset:
    """Return the dataset of an answer, with the coordinates of the response, units and names.

    `labels` is what has the coordinates instead of the response, first dim "sample".
    """
    result = xr.Dataset(dict(data))
    response_coords = coordinates(surrogate.labels if labels is None else labels)
    shared_coords = {k: c for k, c in response_coords.items() if set(c.dims) <= set(result.dims)}
    result = result.assign_coords({**shared_coords, "bound": BOUNDS, **coords})
    if "input" in result.data_vars:
        result = result.set_coords("input")
    result = with_names_and_units(result, long_names, unitless)
    diagnostic_attrs = surrogate.diagnostics.attrs
    carried = {f"surrogate_{k}": diagnostic_attrs[k] for k in CARRIED if k in diagnostic_attrs}
    if doubts := doubts_of(surrogate):
        carried["surrogate_not_reliable"] = "; ".join(doubts)
    if not is_judged(surrogate):
        carried["surrogate_expected_error"] = NOT_JUDGED
    remarks = merge_remarks(diagnostic_attrs)
    return result.assign_attrs({**remark(surrogate.space), **attrs, **carried, **remarks})


def with_names_and_units(
    result: xr.Dataset, long_names: Mapping[str, str], unitless: Container[str] = ()
) -> xr.Dataset:
    """Give variables a `long_name`, and numbers `units` where all outputs have the same."""
    units = set(np.ravel(result.coords["unit"].values)) if "unit" in result.coords else set()
    for name, words in long_names.items():
        if name in result.variables:
            result[name].attrs["long_name"] = words
            of_output = name in result.data_vars and result[name].dtype.kind == "f"
            of_output &= name not in unitless and not name.endswith(WITHOUT_UNITS)
            if len(units) == 1 and of_output:
                result[name].attrs["units"] = str(next(iter(units)))
    return result
