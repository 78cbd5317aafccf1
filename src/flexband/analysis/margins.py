"""Whether limits are kept for all tolerances, and by how much."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import xarray as xr

from flexband.analysis.allocation.adjustment import Adjusted, compensators, limited
from flexband.analysis.limits import Corridor, Limits, corridors, joint
from flexband.analysis.peaks import drops, spacing
from flexband.analysis.results import ERRORS, Variables, check_free
from flexband.analysis.selection import AnySurrogate, check_surrogate, labels_of, surrogates_of
from flexband.errors import InputError
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.surrogates.axes import axes_of


class LimitVerdict(StrEnum):
    """Whether a limit is kept for all values of the interval inputs."""

    KEPT = "kept"
    NOT_KEPT = "not kept"
    UNDECIDED = "undecided"


@dataclass(frozen=True)
class LeastMargin:
    """A verdict on a limit with its numbers, of which all texts are made.

    Attributes
    ----------
    limit : the limit in words.
    verdict : whether it is kept.
    margin, error, unit : the least margin, its expected error, and their unit.
    dim, dim_unit : the last dimension of the output, such as time; "" if there is none.
    place : where the least margin is, along this dimension.
    between, place_before : the least margin between the times, and the time before it.
    inputs : values of the inputs there, in words.
    """

    limit: str
    verdict: LimitVerdict
    margin: float
    error: float
    unit: str
    dim: str
    dim_unit: str
    place: float | str
    between: float
    place_before: float | str
    inputs: list[str]

    @staticmethod
    def of(result: xr.Dataset) -> LeastMargin:
        """Return that of one limit, of what `check_limits` returns."""
        dim, places = "", ("", "")
        if "least_margin_at" in result:
            dim = str(result["margin"].dims[-1])
            both = result["least_margin_at"], result["margin_between_after"]
            is_number = both[0].dtype.kind in "iuf"
            places = tuple(float(k) if is_number else str(k.values) for k in both)
        unit = str(result["unit"].values) if "unit" in result.coords else ""
        inputs = [str(result["worst_choice"].values)] if "worst_choice" in result else []
        if "worst_inputs" in result:
            pairs = zip(result["input"].values, result["worst_inputs"].values, strict=True)
            inputs += [f"{name} = {value:.6g}" for name, value in pairs]
        return LeastMargin(
            str(result["limit"].values),
            LimitVerdict(str(result["verdict"].values)),
            float(result["least_margin"]),
            float(result["least_margin_error"]),
            unit,
            dim,
            result[dim].attrs.get("units", "") if dim in result.coords else "",
            places[0],
            float(result["margin_between"]),
            places[1],
            inputs,
        )

    @property
    def decided_between(self) -> bool:
        """Whether it is the least margin between the times that may be below zero."""
        return bool(self.dim) and self.between - self.error < 0 <= self.margin

    def in_words(
        self, number: Callable[[float], str] = "{:.4g}".format, *, with_error: bool = False
    ) -> str:
        """Return the least margin, and where it is: "least margin 0.2 N at time 0.1 s"."""
        error = f" ± {self.error:.2g}" if self.error and with_error else ""
        unit = f" {self.unit}" if self.unit else ""
        text = f"least margin {number(self.margin)}{error}{unit}"
        if not self.dim:
            return text
        places = [
            f"{k if isinstance(k, str) else number(k)} {self.dim_unit}".rstrip()
            for k in (self.place, self.place_before)
        ]
        text += f" at {self.dim} {places[0]}"
        if self.decided_between:
            where = "output times" if self.dim == "time" else f"values of {self.dim}"
            text += f"; {self.between:.4g}{unit} between the {where}, after {places[1]}"
        return text


def error_of(
    diagnostics: xr.Dataset, labels: xr.DataArray, names: Sequence[str] = ERRORS
) -> tuple[str, np.ndarray]:
    """Return which variable tells the error of bands, and its values, (outputs …, times).

    Without one of these names the name is "" and the values are zero.
    """
    for name in names:
        if name in diagnostics:
            return name, diagnostics[name].transpose(*labels.dims[1:]).values
    return "", np.zeros(labels.shape[1:])


def check_limits(surrogate: AnySurrogate, limits: Limits, *, sigmas: float = 3.0) -> xr.Dataset:
    """Return whether each limit is kept for all values of the interval inputs, and its margin.

    The margin of a limit is how far it is from the error bar μ ± kσ, or, if there are no random
    inputs, from the range of the response. No runs are made.

    Parameters
    ----------
    surrogate : what `expand` returns.
    limits : a `Limit`, or several.
    sigmas : k of the error bar.

    Returns
    -------
    Dataset with the dim "limit". `margin` is the margin at every time, NaN where nothing is
    limited; `expected_error` that of the error bar; `above` and `below` are the limits.
    `least_margin`, `least_margin_error` and `least_margin_at` are the least margin, its expected
    error and the value of the last dim where it is; `margin_between` is the least margin between
    the times, and `margin_between_after` the time before it; `side` tells whether it is the limit
    "below" or "above" which is nearest; `worst_inputs`, dims (input, limit), are the values of the
    interval inputs there, and `worst_choice` the options. `grid_error` is by how much the margin
    may be less between the times, by parabolas, and by what the outputs do there in the runs in
    which that was looked at (`above_between` of `propagate`). `verdict` is "kept" if the margin is
    more than its errors everywhere, "not kept" if it is below zero by more than the expected error
    somewhere, at a time or, in all these runs, between two, else "undecided".
    ``attrs["verdict"]`` says this in words, and ``attrs["error"]`` what the expected error is:
    "error_bar_expected_error", "truncation" (an indicator), or "not estimated" (then it is zero).

    Raises
    ------
    InputError
        If `surrogate` is none, a limit does not fit its outputs, or `sigmas` is not positive.

    Examples
    --------
    >>> inputs = {"length": fb.Interval(0.8, 1.2), "play": fb.Normal(0.0, 0.05)}
    >>> surrogate = fb.expand(lambda length, play: length + play, inputs, fb.PCCI(2, 2))
    >>> result = fb.analysis.check_limits(surrogate, fb.Limit(below=1.5))
    >>> result["least_margin"].values.round(4)  # 1.5 − 1.2 − 3σ
    array([0.15])
    >>> result["verdict"].values.tolist()
    ['kept']
    """
    check_surrogate(surrogate)
    labels = labels_of(surrogate)
    for name in ("limit", "side", "verdict", "worst_inputs", "worst_choice", "above", "below"):
        check_free(name, labels)
    named_corridors = corridors(limits, labels)
    bands = _bands(surrogate, named_corridors, sigmas)
    source, error = error_of(bands, labels)
    results = [_checked(corridor, bands, labels, error) for corridor in named_corridors.values()]
    result = xr.concat(results, "limit").assign_coords(limit=list(named_corridors))
    verdicts = [LeastMargin.of(result.isel(limit=k)) for k in range(len(named_corridors))]
    words = [
        f"{verdict.limit}: {verdict.verdict}, {verdict.in_words(with_error=True)}"
        + f", with {', '.join(verdict.inputs)}" * bool(verdict.inputs)
        for verdict in verdicts
    ]
    attrs = {
        "sigmas": bands.attrs["sigmas"],
        "error": source or "not estimated",
        "verdict": ". ".join(words) + ("" if source else ". The error of this is not estimated"),
    }
    kept = {verdict.verdict for verdict in verdicts}
    worst_first = LimitVerdict.NOT_KEPT, LimitVerdict.UNDECIDED, LimitVerdict.KEPT
    worst = next(verdict for verdict in worst_first if verdict in kept)
    attrs |= {"kept": worst.value, "inputs": bands.attrs.get("inputs", "")}
    return _described(result.assign_attrs(attrs))


def _bands(surrogate: AnySurrogate, limits: Mapping[str, Corridor], sigmas: float) -> xr.Dataset:
    """Return bands; with compensators, where margins are least after these are adjusted."""
    bands = surrogate.bands(sigmas)
    cases = surrogates_of(surrogate)
    if "" not in cases:
        if any(compensators(case.space) for case in cases.values()):
            raise InputError("surrogate must have no Choice where it has a Compensator")
        return bands
    case = cases[""]
    space, dims = case.space, case.labels.dims[1:]
    columns = compensators(space)
    if not columns:
        return bands
    corridor = joint(limits)
    expansions, numbers, bounds = limited(case, corridor.lower, corridor.upper)
    bar = bands["error_bar"].transpose("bound", *dims).values.copy()
    width = np.broadcast_to((bar[1] - bar[0]).mean(axis=-1, keepdims=True), bar[1].shape).ravel()
    scale = np.maximum(width[numbers], 1e-9 * np.abs(bar).max() + 1e-300)
    k, m = sigmas if space.random_dimension else 0.0, space.interval_dimension
    adjusted = Adjusted(expansions, bounds, scale, k, list(columns.values()), m)
    *ends, eta = adjusted.worst()
    bar.reshape(2, -1)[:, numbers] = ends
    at = bands["error_bar_at"].transpose("input", "bound", *dims).values.copy()
    input_values = Space(space.of_kind(random=False)).numbers_at(
        np.zeros((eta.size // m, 0)), eta.reshape(-1, m)
    )
    at.reshape(len(at), 2, -1)[..., numbers] = np.reshape(
        list(input_values.values()), (len(at), 2, -1)
    )
    if "pointwise_error" in case.diagnostics:  # bounds after the adjustment rest anywhere
        bands["error_bar_expected_error"] = bands["pointwise_error"]
    return bands.assign(
        error_bar=(("bound", *dims), bar), error_bar_at=(("input", "bound", *dims), at)
    )


def _checked(
    corridor: Corridor, bands: xr.Dataset, labels: xr.DataArray, error: np.ndarray
) -> xr.Dataset:
    where = corridor.where
    bar = bands["error_bar"].transpose("bound", *labels.dims[1:]).drop_vars("bound")
    low, high = (np.asarray(end)[where] for end in bar.values)
    lower, upper = corridor.lower[where], corridor.upper[where]
    margins = np.stack([low - lower, upper - high])
    margin, error = margins.min(axis=0), np.asarray(error[where])
    limited = np.isfinite(margin)
    at = np.unravel_index(int(np.argmin(margin)), margin.shape)
    side = int(np.argmin(margins[(slice(None), *at)]))
    nearest_end = bar.isel(bound=side)[where][at]
    after, surely = _between(margins, bands, labels, corridor)
    drop = drops(margin, spacing(labels))
    between = np.minimum(np.where(limited, margin - drop, np.inf), after)
    lowest = np.unravel_index(int(np.argmin(between)), between.shape)
    trusted = "trusted" not in bands or bool(np.all(_of_output(bands["trusted"], labels, corridor)))
    verdict = LimitVerdict.UNDECIDED
    if trusted and np.any(np.minimum(margin, surely)[limited] + error[limited] < 0):
        verdict = LimitVerdict.NOT_KEPT
    elif trusted and np.all(between[limited] - error[limited] >= 0):
        verdict = LimitVerdict.KEPT
    dims = bar[0][where].dims
    coords = {k: c for k, c in bar[0][where].coords.items() if set(c.dims) <= set(dims)}
    data: Variables = {
        "margin": (dims, np.where(limited, margin, np.nan)),
        "expected_error": (dims, np.where(limited, error, np.nan)),
        "above": (dims, np.where(np.isfinite(lower), lower, np.nan)),
        "below": (dims, np.where(np.isfinite(upper), upper, np.nan)),
        "least_margin": margin[at],
        "least_margin_error": error[at],
        "margin_between": between[lowest],
        "grid_error": margin[at] - between[lowest],
        "side": ("above", "below")[side],
        "verdict": verdict.value,
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


def _between(
    margins: np.ndarray, bands: xr.Dataset, labels: xr.DataArray, corridor: Corridor
) -> tuple[np.ndarray, np.ndarray]:
    """Return the least margin from each time to the next, and how large it is at most in all runs.

    Parameters
    ----------
    margins : to the limits above and below, shape (2, …, times).
    """
    where, between = corridor.where, np.full((2, *margins.shape[1:]), np.inf)
    if "above_between" not in bands:
        return between[0], between[1]
    ends = np.where(np.isfinite(margins), margins, np.nan)
    ends = np.minimum(ends[..., :-1], ends[..., 1:])
    for k, kind in enumerate(("", "_least")):
        beyond = [
            bands[f"{side}_between{kind}"].transpose(*labels.dims[1:]).values[where][..., :-1]
            for side in ("below", "above")
        ]
        remaining = ends - np.stack(beyond)
        between[k, ..., :-1] = np.where(np.isnan(remaining), np.inf, remaining).min(axis=0)
    return between[0], between[1]


def _of_output(values: xr.DataArray, labels: xr.DataArray, corridor: Corridor) -> np.ndarray:
    """Return the values of an output, of values without the last dim."""
    if "output" in values.dims and "output" in labels.dims:
        number = corridor.where[-1]
        return values.isel(output=number).values
    return values.values


LONG_NAMES = {
    "margin": "distance of μ ± {k}σ from the limit, for all values of the interval inputs",
    "expected_error": "error expected of the margin",
    "above": "limit above which the output must stay",
    "below": "limit below which the output must stay",
    "least_margin": "least margin",
    "least_margin_error": "error expected of the least margin",
    "least_margin_at": "where the least margin is",
    "margin_between": "least margin between the times",
    "margin_between_after": "last time before it",
    "worst_inputs": "values of the interval inputs at the least margin",
    "worst_choice": "options at the least margin",
    "grid_error": "by how much the margin may be less between the times",
    "side": "which side of the limit is nearest",
    "verdict": "whether the limit is kept for all values of the interval inputs",
}


def _described(result: xr.Dataset) -> xr.Dataset:
    """Give every variable a `long_name`, and `units` where all limits have the same."""
    k = "" if result.attrs["sigmas"] == 1 else f"{result.attrs['sigmas']:g}"
    units = set(np.ravel(result["unit"].values).tolist()) if "unit" in result.coords else set()
    for name, words in LONG_NAMES.items():
        if name in result:
            result[name].attrs["long_name"] = words.format(k=k)
            if len(units) == 1 and result[name].dtype.kind == "f" and name != "worst_inputs":
                result[name].attrs["units"] = str(next(iter(units)))
    for name in ("least_margin_at", "margin_between_after"):
        if name in result:
            result[name].attrs.pop("units", None)
    return result
