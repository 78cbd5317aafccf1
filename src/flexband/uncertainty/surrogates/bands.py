"""The result: interval mean and interval error bar as a labelled dataset, and what it says beside.

Users read attributes of datasets. The house reads records, made of the attributes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np
import xarray as xr

from flexband.uncertainty.expansions.expansion import Extremes
from flexband.uncertainty.inputs.evaluation import coordinates
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.surrogates.axes import axes_of

BOUNDS = ["lower", "upper"]

VARIABLES = frozenset(
    ("mean", "error_bar", "error_bar_lower", "error_bar_upper", "mean_at", "error_bar_at")
)
"""Names in the dataset of bands."""


WITHOUT_UNITS = (
    "mean_at", "error_bar_at", "relative_expected_error", "carriers", "trusted", "orders", "bound",
)  # fmt: skip


@dataclass(frozen=True)
class AttributeRecord:
    """Fields that are attributes of a dataset; those that it does not have keep their default."""

    @classmethod
    def read(cls, source: xr.Dataset | Mapping[Any, Any]) -> Self:
        """Return the record of a dataset, or of its attributes."""
        attributes = source.attrs if isinstance(source, xr.Dataset) else source
        names = (f.name for f in fields(cls) if f.name in attributes)
        return cls(**{name: attributes[name] for name in names})


@dataclass(frozen=True)
class BandRecord(AttributeRecord):
    """What bands, and the diagnostics of a surrogate, say beside their numbers.

    Attributes
    ----------
    sigmas : k of the error bar.
    runs, runs_failed, … : numbers of runs; None where the method counts none of a kind.
    method, inputs, versions, discretization : texts.
    tolerance, expected_error : relative to the error bar's width; None without one.
    expected_error_of_runs : that of the intervals that were run, where these are narrowed.
    expansion_error, discretization_error : its parts; a text says if one is not estimated.
    integration_error : what the integration of the moments adds to the expansion's.
    refined, halved : what was made finer: to estimate its error, and to reduce it.
    corrected, not_trusted, not_refined, advice, largest_miss, remark : texts, "" without one.
    impacts : whether bodies may hit each other.
    constant_offsets : outputs whose bounds hold for plays that are constant in each run only.
    offsets_stated : whether all plays are stated to be so.
    beyond_runs : which inputs have values that no run is near, a text; "" without one.
    judged_by : which runs tell the expected error; "" for those of the method.
    """

    sigmas: float = 1.0
    runs: int = 0
    runs_failed: int = 0
    runs_repeated: int = 0
    runs_fitted: int = 0
    runs_checked: int = 0
    runs_generic: int | None = None
    runs_refined: int = 0
    runs_coarser: int = 0
    runs_nominal: int = 0
    method: str = ""
    inputs: str = ""
    versions: str = ""
    discretization: str = ""
    tolerance: float | None = None
    expected_error: float | None = None
    expected_error_of_runs: float | None = None
    expansion_error: float | None = None
    discretization_error: float = 0.0
    integration_error: float = 0.0
    refined: Sequence[str] = ()
    halved: Sequence[str] | None = None
    corrected: str = ""
    not_trusted: str = ""
    not_refined: str = ""
    advice: str = ""
    largest_miss: str = ""
    remark: str = ""
    stop_reason: str = ""
    orders_used: str | None = None
    small_components: str = ""
    same_counts: str = ""
    carrier_frequencies: Sequence[float] = ()
    steps_per_period: Sequence[float] = ()
    impacts: int = 0
    constant_offsets: Sequence[str] = ()
    offsets_stated: int = 0
    beyond_runs: str = ""
    judged_by: str = ""

    @property
    def error_of_runs(self) -> float | None:
        """The expected error of the intervals that were run; None without one."""
        is_missing = self.expected_error is None
        return self.expected_error_of_runs if is_missing else self.expected_error

    @property
    def tolerance_missed(self) -> bool:
        """Whether the expected error of these bands is above the tolerance."""
        tolerance = self.tolerance
        error = self.expected_error
        return tolerance is not None and error is not None and error > tolerance


def attributes_for_inputs(diagnostics: xr.Dataset, inputs: str) -> dict[str, Any]:
    """Return the attributes of diagnostics for narrower inputs, which are given as text.

    Errors as parts of the width of the bands are left out: they are found with the bands.
    """
    record = BandRecord.read(diagnostics)
    attributes = dict(diagnostics.attrs)
    attributes.setdefault("inputs_of_runs", record.inputs)
    if "expected_error" in attributes:
        attributes["expected_error_of_runs"] = record.expected_error
    attributes["inputs"] = inputs
    relative = ("expected_error", "expansion_error", "integration_error", "discretization_error")
    left_out = {name for name in relative if isinstance(attributes.get(name), float)}
    left_out |= {"largest_miss", *(f"{name}_error" for name in record.refined)}
    return {name: value for name, value in attributes.items() if name not in left_out}


def bands(
    space: Space, labels: xr.DataArray, extremes: Sequence[Extremes], sigmas: float
) -> xr.Dataset:
    """Return the dataset of bands with kσ, k = `sigmas`, which `with_names_and_units` completes.

    `labels`, (runs, …), has dims and coordinates; extremes are those of μ, μ − kσ and μ + kσ.
    `mean` is [μ] of Eq. (3), `error_bar` [eb] of Eq. (5), `error_bar_lower` and `error_bar_upper`
    [eb_l] and [eb_u] of Eq. (4), first dim "bound"; `mean_at` and `error_bar_at` are the interval
    inputs there.
    """
    at_once = 4096  # places whose values of the inputs are computed at once
    mean, lower, upper = extremes
    dims, shape = ("bound", *labels.dims[1:]), (2, *labels.shape[1:])

    def variable(values: np.ndarray):
        return dims, values.reshape(shape)

    def places(low: np.ndarray, high: np.ndarray):
        values = np.empty((len(coords["input"]), 2, low[..., 0].size))
        for input_values, bound in zip(np.moveaxis(values, 1, 0), (low, high), strict=True):
            flat = bound.reshape(-1, bound.shape[-1])
            for k in range(0, len(flat), at_once):  # all together take as much as many runs
                eta = flat[k : k + at_once]
                numbers = intervals.numbers_at(np.zeros((len(eta), 0)), eta)
                input_values[:, k : k + at_once] = list(numbers.values())
        return ("input", *dims), values.reshape(-1, *shape)

    data = {
        "mean": variable(mean.values),
        "error_bar": variable(np.stack([lower.values[0], upper.values[1]])),
        "error_bar_lower": variable(lower.values),
        "error_bar_upper": variable(upper.values),
    }
    coords = {k: c.variable for k, c in coordinates(labels).items()}
    coords["bound"] = xr.Variable("bound", BOUNDS)
    intervals = Space(space.of_kind(random=False))
    if intervals.inputs:
        coords["input"] = xr.Variable("input", list(intervals.numbers_at(*intervals.nominal())))
        data["mean_at"] = places(mean.places[0], mean.places[1])
        data["error_bar_at"] = places(lower.places[0], upper.places[1])
    return xr.Dataset(data, coords, {"sigmas": sigmas} | remark(space))


def remark(space: Space) -> dict[str, str]:
    """Return, as an attribute of results, that they are over all values of what is chosen."""
    names = list(space.design_inputs)
    text = f"over all values of {', '.join(names)}; surrogate.narrowed has those of one"
    return {"remark": text} if names else {}


LONG_NAMES = {
    "mean": "interval mean: bounds of μ",
    "error_bar": "interval error bar: lowest μ − {k}σ and highest μ + {k}σ",
    "error_bar_lower": "bounds of μ − {k}σ",
    "error_bar_upper": "bounds of μ + {k}σ",
    "mean_at": "values of the interval inputs at the bounds of the interval mean",
    "error_bar_at": "values of the interval inputs at the bounds of the interval error bar",
    "mean_expected_error": "estimated error of the interval mean",
    "error_bar_expected_error": "estimated error of the interval error bar",
    "pointwise_error": "estimated error of μ ± {k}σ at one time, any values of the intervals",
    "relative_expected_error": "estimated error{averaged}, relative to the error bar's width",
    "mean_expansion_error": "error that is due to the expansion",
    "error_bar_expansion_error": "error that is due to the expansion",
    "mean_integration_error": "error that is due to the integration of the moments",
    "error_bar_integration_error": "error that is due to the integration of the moments",
    "mean_discretization_error": "error that is due to step and elements",
    "error_bar_discretization_error": "error that is due to step and elements",
    "carriers": "number of vibration frequencies that are resolved",
    "trusted": "whether most of the variation in check runs is predicted",
    "orders": "highest order of the expansion",
    "above_between": "largest rise above this value and the next one, between them",
    "above_between_least": "least such rise of some runs",
    "below_between": "largest fall below this value and the next one, between them",
    "below_between_least": "least such fall of some runs",
    "truncation": "indicator of the truncation error",
    "bound": "bound over all values of the interval inputs",
}
"""What the variables of bands are; no dimension or coordinate of a response has such a name."""


def with_names_and_units(result: xr.Dataset) -> xr.Dataset:
    """Give variables a `long_name` and `units`, or the coordinate "unit" where they differ."""
    result, time = result.copy(), axes_of(result["mean"].transpose("bound", ...)).time
    averaged = "" if time is None else f", mean over {time}"
    sigmas = BandRecord.read(result).sigmas
    k = "" if sigmas == 1 else f"{sigmas:g}"
    units = set(np.ravel(result.coords["unit"].values)) if "unit" in result.coords else set()
    for name, words in LONG_NAMES.items():
        if name in result.variables:
            attrs = {"long_name": words.format(k=k, averaged=averaged)}
            if len(units) == 1 and name not in WITHOUT_UNITS:
                attrs["units"] = str(next(iter(units)))
            result[name].attrs.update(attrs)
    return result
