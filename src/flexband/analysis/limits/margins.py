"""Whether requirements are met for all tolerances, and by which margin."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from flexband.analysis.allocation.adjustment import Adjusted, compensators, series_with_limits
from flexband.analysis.labelled_answers import (
    NOT_JUDGED,
    Variables,
    beyond_neighbours,
    check_free,
    error_of,
    interval_values,
    remarks_on,
    with_names_and_units,
)
from flexband.analysis.limits.least_margin import (
    WORST_FIRST,
    LimitVerdict,
    margins_in_words,
)
from flexband.analysis.peaks import TimeAxis, least_between
from flexband.analysis.selection import AnySurrogate, labels_of, surrogates_of
from flexband.basics.former_names import former_arguments
from flexband.errors import InputError
from flexband.remarks.collection import as_attribute
from flexband.requirements.corridors import (
    Corridor,
    check_instantaneous,
    has_constant_offsets,
    joint,
)
from flexband.requirements.criteria import Probability, ShareOfParts, WorstCase
from flexband.requirements.requirement import Requirement, Requirements, by_name
from flexband.uncertainty.inputs.space import check_no_play
from flexband.uncertainty.surrogates.axes import axes_of
from flexband.uncertainty.surrogates.bands import BandRecord
from flexband.uncertainty.surrogates.sigmas import AT_ONE_TIME, checked_sigmas, relative_errors


@former_arguments(limits="requirements")
def check_requirements(
    surrogate: AnySurrogate, requirements: Requirements, *, sigmas: float | None = None
) -> xr.Dataset:
    """Return whether each requirement is met for all values of the interval inputs, and its margin.

    The margin is the distance from the error bar μ ± kσ to the limit, or, if there are no random
    inputs, from the range of the response. No runs are made.

    Parameters
    ----------
    surrogate : what `expand` returns.
    requirements : a `Requirement`, or several.
    sigmas : k of the error bar; unless given, that of each requirement's `WorstCase`, or 3.

    Returns
    -------
    Dataset with the dim "limit". `margin` is the margin at every time, NaN where nothing is
    limited; `expected_error` is the error of the error bar that few times exceed, three times the
    expected mean; `above` and `below` are the limits.
    `least_margin`, `least_margin_error` and `least_margin_at` are the least margin, its expected
    error and the value of the last dim where it is; `margin_between` is the least margin between
    the times, and `margin_between_after` the time before it; `margin_at_most` is an upper bound of
    it; `side` is the nearest limit, "below" or "above"; `worst_inputs`, dims (input, limit), are
    the values of the interval inputs there, and `worst_choice` the options. `grid_error` is by how
    much the margin may be less between the times, by cubics and parabolas through the nearest ones,
    and by what the outputs do there in the runs in which that was looked at (`above_between` of
    `propagate`); the ends of `during` count as times. `verdict` is "kept" (met) if the margin is
    more than its errors everywhere, "not kept" (violated) if it is below zero by more than the
    expected error somewhere, at a time or, by all these rules or in all these runs, between two,
    else "undecided"; `run_required` tells whether runs must agree with the verdict, since the
    expansion of the output is less accurate than its method was to make it, or impacts turn the
    motion, and there are no random inputs or another output misses that accuracy.
    ``attrs["verdict"]`` says this in words. ``attrs["error"]`` is the source of the expected error:
    "error_bar_expected_error", or "not judged by runs": then it is zero, and every verdict is
    "undecided". `verify` judges a surrogate whose method does not. `requirement`, `identifier`,
    `source`, `bounds`, `criterion`, `at_most`, `deviations` (k), `stated_unit` and `stated_scale`
    (this unit in units of the output) are those of the requirements.

    Raises
    ------
    InputError
        If `surrogate` is not a surrogate, a requirement does not fit its outputs, or `sigmas` is
        not positive.

    Examples
    --------
    >>> inputs = {"length": fb.Interval(0.8, 1.2), "play": fb.Normal(0.0, 0.05)}
    >>> surrogate = fb.expand(lambda length, play: length + play, inputs, fb.AdaptivePCCI())
    >>> result = fb.analysis.check_requirements(surrogate, fb.Requirement("response", below=1.5))
    >>> result["least_margin"].values.round(4)  # 1.5 − 1.2 − 3σ
    array([0.15])
    >>> result["verdict"].values.tolist()
    ['kept']
    """
    labels = labels_of(surrogate)
    requirement_by_name = by_name(requirements)
    check_free(labels, "limit", *LONG_NAMES)
    deviations = {
        name: checked_sigmas(sigmas) if sigmas is not None else _sigmas_of(requirement)
        for name, requirement in requirement_by_name.items()
    }
    if len(set(deviations.values())) > 1 and any(
        compensators(case.space) for case in surrogates_of(surrogate).values()
    ):
        raise InputError("requirements must all have the same sigmas where there is a Compensator")
    # Check the requirements with the bands of each k.
    results = {}
    source = ""
    inputs = ""
    for k in dict.fromkeys(deviations.values()):
        check = _Checked(surrogate, requirement_by_name, k)
        results |= {
            name: check.result(name).assign(_about(requirement, labels, k))
            for name, requirement in requirement_by_name.items()
            if deviations[name] == k
        }
        source = check.source
        inputs = check.inputs
    result = xr.concat([results[name] for name in requirement_by_name], "limit")
    result = result.assign_coords(limit=list(requirement_by_name))
    # Put the verdicts and what they rest on into words.
    attrs: dict[str, Any] = {"error": source or NOT_JUDGED}
    attrs["verdict"] = margins_in_words(result.assign_attrs(attrs))
    worst = min(map(LimitVerdict, result["verdict"].values.tolist()), key=WORST_FIRST.index)
    remarks = [r for case in surrogates_of(surrogate).values() for r in remarks_on(case)]
    attrs |= {"kept": worst.value, "inputs": inputs, **as_attribute(remarks)}
    k = "k"
    if len(set(deviations.values())) == 1:
        attrs["sigmas"] = sigmas = next(iter(deviations.values()))
        k = "" if sigmas == 1.0 else f"{sigmas:g}"
    long_names = {name: words.format(k=k) for name, words in LONG_NAMES.items()}
    return with_names_and_units(result.assign_attrs(attrs), long_names, UNITLESS)


def _sigmas_of(requirement: Requirement) -> float:
    """Return k of the error bar that tells the margin of a requirement."""
    criterion = requirement.criterion
    return criterion.sigmas if isinstance(criterion, WorstCase) else WorstCase().sigmas


def _about(requirement: Requirement, labels: xr.DataArray, sigmas: float) -> dict[str, Any]:
    criterion = requirement.criterion
    number = requirement.output_in(labels)[1]
    of_output = labels if number is None else labels.isel(output=number)
    shares = isinstance(criterion, Probability | ShareOfParts)
    return {
        "requirement": requirement.name,
        "identifier": requirement.identifier,
        "source": requirement.source,
        "bounds": requirement.bounds,
        "criterion": type(criterion).__name__,
        "at_most": criterion.at_most if shares else np.nan,
        "deviations": sigmas,
        "stated_unit": requirement.unit,
        "stated_scale": requirement.scale(of_output),
    }


class _Checked:
    """The margins of requirements by bands of one k.

    `source` names the variable that tells the error of the bands, "" if none does; `inputs` are
    those of the bands, in words.
    """

    def __init__(
        self, surrogate: AnySurrogate, requirements: Mapping[str, Requirement], sigmas: float
    ) -> None:
        self.surrogate = surrogate
        self.requirements = requirements
        self.sigmas = sigmas
        self.labels = labels_of(surrogate)
        self.cases = surrogates_of(surrogate)
        self.bands: dict[str, xr.Dataset] = {}
        self.source = self.inputs = ""

    def result(self, name: str) -> xr.Dataset:
        """Return the result for one requirement; with choices, that of the worst combination."""
        requirement = self.requirements[name]
        if requirement.nominal is None or "" in self.cases:
            return self._of_case("", requirement)
        results = [
            self._of_case(label, requirement).assign(worst_choice=label) for label in self.cases
        ]

        def rank(result: xr.Dataset) -> tuple[int, float]:
            verdict_rank = WORST_FIRST.index(LimitVerdict(str(result["verdict"].values)))
            return verdict_rank, float(result["margin_between"] - result["least_margin_error"])

        return min(results, key=rank)

    def _of_case(
        self, label: str, requirement: Requirement, *, max_relative_error: float = 0.1
    ) -> xr.Dataset:
        """Return the result of one combination.

        After impacts, expansions with an error above `max_relative_error`, relative to the width,
        decide nothing.
        """
        if label not in self.bands:
            self.bands[label] = (
                with_errors_at_one_time(self.cases[label].bands(self.sigmas))
                if label
                else _bands(self.surrogate, self.requirements, self.sigmas)
            )
        bands = self.bands[label]
        self.source, error = error_of(bands, self.labels)
        self.inputs = BandRecord.read(bands).inputs
        corridor = requirement.corridor(self.labels, label)
        check_instantaneous({str(requirement): corridor}, bands.attrs)
        relative = _relative_errors(bands, self.labels)
        of_output = float(np.max(_of_output(relative, self.labels, corridor)))
        record = BandRecord.read(bands)
        tolerance = np.inf if record.tolerance is None else record.tolerance
        impacts = bool(record.impacts)
        refuted = False
        verification = self.cases[label].verification if label in self.cases else None
        if verification is not None and "confirmed" in verification:
            refuted = not np.all(_of_output(verification["confirmed"], self.labels, corridor))
        result = _check_margins(
            corridor,
            bands,
            self.labels,
            error,
            trusted=bool(self.source)
            and not refuted
            and (not impacts or of_output < max_relative_error),
        )
        random = any(case.space.random_dimension for case in self.cases.values())
        turning = impacts and (not random or float(relative.max()) > tolerance)
        return result.assign(
            constant_offsets=has_constant_offsets(corridor, bands.attrs),
            run_required=turning or of_output > tolerance,
        )


def with_errors_at_one_time(bands: xr.Dataset) -> xr.Dataset:
    """Return bands with the error that few times exceed: a verdict rests on one.

    Errors of bands are right in the mean over time. Where the margin is least, the error is more
    likely one of the larger ones; few are above twice that of one time.
    """
    error_factor = 2 * AT_ONE_TIME
    name = "error_bar_expected_error"
    if name not in bands or axes_of(bands["error_bar"].transpose("bound", ...)).times < 2:
        return bands
    return bands.assign({name: error_factor * bands[name]})


def _bands(
    surrogate: AnySurrogate, requirements: Mapping[str, Requirement], sigmas: float
) -> xr.Dataset:
    """Return bands; with compensators, where margins are least after these are adjusted."""
    bands = surrogate.bands(sigmas)
    cases = surrogates_of(surrogate)
    if not any(compensators(case.space) for case in cases.values()):
        return with_errors_at_one_time(bands)
    if "" not in cases:
        raise InputError("surrogate must have no Choice where it has a Compensator")
    case = cases[""]
    space = case.space
    dims = case.labels.dims[1:]
    check_no_play(space, "check_requirements with a Compensator")
    # Adjust compensators for the least margins, and put the adjusted ends into the bands.
    corridor = joint({k: r.corridor(case.labels) for k, r in requirements.items()})
    expansions, numbers, bounds = series_with_limits(case, corridor)
    bar = bands["error_bar"].transpose("bound", *dims).values.copy()
    width = np.broadcast_to((bar[1] - bar[0]).mean(axis=-1, keepdims=True), bar[1].shape).ravel()
    scale = np.maximum(width[numbers], 1e-9 * np.abs(bar).max() + 1e-300)
    k = sigmas if space.random_dimension else 0.0
    m = space.interval_dimension
    columns = list(compensators(space).values())
    *ends, eta = Adjusted(expansions, bounds, scale, k, columns, m).worst()
    bar.reshape(2, -1)[:, numbers] = ends
    at = bands["error_bar_at"].transpose("input", "bound", *dims).values.copy()
    values = list(interval_values(space, eta).values())
    at.reshape(len(at), 2, -1)[..., numbers] = np.reshape(values, (len(at), 2, -1))
    if "pointwise_error" in case.diagnostics:  # bounds after the adjustment rest anywhere
        bands["error_bar_expected_error"] = bands["pointwise_error"]
    return bands.assign(
        error_bar=(("bound", *dims), bar), error_bar_at=(("input", "bound", *dims), at)
    )


def _check_margins(
    corridor: Corridor,
    bands: xr.Dataset,
    labels: xr.DataArray,
    error: np.ndarray,
    *,
    trusted: bool,
) -> xr.Dataset:
    where = corridor.where
    bar = bands["error_bar"].transpose("bound", *labels.dims[1:]).drop_vars("bound")
    low, high = (np.asarray(end)[where] for end in bar.values)
    lower = corridor.lower[where]
    upper = corridor.upper[where]
    margins = np.stack([low - lower, upper - high])
    margin = margins.min(axis=0)
    error = np.asarray(error[where])
    limited = np.isfinite(margin)
    at = np.unravel_index(int(np.argmin(margin)), margin.shape)
    side = int(np.argmin(margins[(slice(None), *at)]))
    nearest_end = bar.isel(bound=side)[where][at]
    # Allow for what may happen between the times, and judge the limit by all margins.
    after, surely = _margins_between_times(np.stack([low, high]), bands, labels, corridor)
    error_after = error
    if error.ndim:
        next_error = np.concatenate([error[..., 1:], error[..., -1:]], axis=-1)
        error_after = np.maximum(error, next_error)
    margin_between = np.minimum(margin, after)
    lowest = np.unravel_index(int(np.argmin(margin_between)), margin_between.shape)
    if "trusted" in bands:
        trusted &= bool(np.all(_of_output(bands["trusted"], labels, corridor)))
    verdict = LimitVerdict.UNDECIDED
    if trusted and np.any([margin + error < 0, surely + error_after < 0]):
        verdict = LimitVerdict.NOT_KEPT
    elif trusted and np.all([margin - error >= 0, after - error_after >= 0]):
        verdict = LimitVerdict.KEPT
    # Make the dataset, with the places of the least margins.
    dims = bar[0][where].dims
    coords = {k: c for k, c in bar[0][where].coords.items() if set(c.dims) <= set(dims)}
    data: Variables = {
        "margin": (dims, np.where(limited, margin, np.nan)),
        "expected_error": (dims, np.where(limited, error, np.nan)),
        "above": (dims, np.where(np.isfinite(lower), lower, np.nan)),
        "below": (dims, np.where(np.isfinite(upper), upper, np.nan)),
        "least_margin": margin[at],
        "least_margin_error": error[at],
        "margin_between": margin_between[lowest],
        "margin_at_most": min(margin[at], surely.min()),
        "grid_error": margin[at] - margin_between[lowest],
        "side": ("above", "below")[side],
        "verdict": verdict.value,
        "extent": np.nanmax(high) - np.nanmin(low),
    }
    last = axes_of(labels).time
    if last in nearest_end.coords:
        data["least_margin_at"] = nearest_end[last].values
        data["margin_between_after"] = bar[0][where][lowest][last].values
    at_bound = bands.get("error_bar_at")
    if at_bound is not None:
        places = at_bound.transpose("input", *bar.dims).isel(bound=side)
        data["worst_inputs"] = "input", places.values[(slice(None), *where)][(slice(None), *at)]
        coords["input"] = at_bound["input"].values
    if "error_bar_choice" in bands:
        choice = bands["error_bar_choice"].transpose(*bar.dims).isel(bound=side)
        data["worst_choice"] = str(choice.values[where][at])
    return xr.Dataset(data, coords)


def _relative_errors(bands: xr.Dataset, labels: xr.DataArray) -> xr.DataArray:
    """Return the error of the expansion of each output relative to its width, 0 if not known."""
    relative = np.zeros(axes_of(labels).shape)
    if "error_bar_expansion_error" in bands:
        relative = relative_errors(bands, "expansion_error", bands["error_bar"])
    return xr.DataArray(relative, dims=axes_of(labels).dims)


def _margins_between_times(
    bar: np.ndarray, bands: xr.Dataset, labels: xr.DataArray, corridor: Corridor
) -> tuple[np.ndarray, np.ndarray]:
    """Return the least margins from each time to the next: how low they may be, and at most are.

    The bar has a lower and an upper end, (2, …, times). Curves between the times tell, by rules of
    which the lowest and the highest count, and what the outputs do there in some runs.
    """
    lowest, highest = np.full(bar.shape, np.inf)
    axis = TimeAxis.from_labels(labels, corridor.window)
    if axis is None:
        return lowest, highest
    lower, upper = corridor.curves[:, *corridor.where]
    margins = np.stack([bar[0] - lower, upper - bar[1]])
    limited_mask = np.isfinite(margins).all(axis=-1)
    impacts = bool(BandRecord.read(bands).impacts)
    curves = least_between(margins[limited_mask], axis, impacts=impacts)
    beyond = beyond_neighbours(bands, labels)[:, :, *corridor.where][:, limited_mask, :-1]
    by_runs = curves.ends - beyond
    bounds = np.full((2, *margins[..., :-1].shape), np.inf)
    bounds[0, limited_mask] = np.minimum(curves.lowest, by_runs[1])
    bounds[1, limited_mask] = by_runs[0] if impacts or "above_between" in bands else curves.at_most
    lowest[..., :-1], highest[..., :-1] = bounds.min(axis=1)
    return lowest, highest


def _of_output(values: xr.DataArray, labels: xr.DataArray, corridor: Corridor) -> np.ndarray:
    """Return the values of an output, of values without the last dim."""
    if "output" in values.dims and "output" in labels.dims:
        number = corridor.where[-1]
        return values.isel(output=number).values
    return values.values


LONG_NAMES = {
    "margin": "distance of μ ± {k}σ from the limit, for all values of the interval inputs",
    "expected_error": "expected error of the margin",
    "above": "limit above which the output must stay",
    "below": "limit below which the output must stay",
    "least_margin": "least margin",
    "least_margin_error": "expected error of the least margin",
    "least_margin_at": "where the least margin is",
    "margin_between": "least margin between the times",
    "margin_between_after": "last time before it",
    "margin_at_most": "least margin at and between the times, at most",
    "worst_inputs": "values of the interval inputs at the least margin",
    "worst_choice": "options at the least margin",
    "grid_error": "by how much the margin may be less between the times",
    "constant_offsets": "whether the margin is for constant offsets of pins and guides",
    "run_required": "whether runs must agree with the verdict",
    "run_margin": "margin of a run that violates the limit by more than its error",
    "recorded_margin": "least margin of the runs that were looked at",
    "run_value": "value of a run that is nearest to the limit, or farthest beyond it",
    "run_bound": "the limit there",
    "run_extreme": "whether this value is the largest or the smallest of the runs",
    "extent": "range of the output over all its bands",
    "side": "which side of the limit is nearest",
    "verdict": "whether the requirement is met for all values of the interval inputs",
    "requirement": "name of the requirement",
    "identifier": "identifier of the requirement",
    "source": "where the requirement is from",
    "bounds": "bounds of the output",
    "criterion": "what it takes to meet the requirement",
    "at_most": "largest probability or share of parts that is allowed",
    "deviations": "k of μ ± kσ",
    "stated_unit": "unit in which the requirement is stated",
    "stated_scale": "this unit in units of the output",
}


UNITLESS = (
    "worst_inputs", "at_most", "deviations", "stated_scale", "least_margin_at",
    "margin_between_after",
)  # fmt: skip
