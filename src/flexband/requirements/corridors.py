"""Corridors: where a response must be at every output and time, and the bounds they are made of."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from types import EllipsisType
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from flexband.basics.checks import check_finite, check_function
from flexband.basics.user_functions import evaluate_function
from flexband.errors import InputError

Bound = float | np.ndarray | xr.DataArray | Callable[[np.ndarray], ArrayLike] | None
"""A number or a curve; None where there is none."""


FOR_CONSTANT_OFFSETS = "for constant offsets of pins and guides"

ONE_SIDED = "If loads keep each pin on one side of its hole, write Play(…, one_sided=True)"
"""What decides such requirements."""


Window = tuple[float, float]
"""First and last time at which bounds hold."""

ALWAYS: Window = (-math.inf, math.inf)
"""The window of a whole motion."""


@dataclass(frozen=True, eq=False)
class Corridor:
    """Where a response must be.

    Attributes
    ----------
    output : its name; "" if the response has one output only, or for several.
    curves : lower and upper bound at all times, whether they are in the window or not, (2, …) with
        the shape of the response without its runs; infinite where nothing is required.
    where : index of the output in arrays of this shape.
    window : first and last time at which they hold.
    times : of the last dim; None where all of it is limited.
    """

    output: str
    curves: np.ndarray
    where: tuple[int | slice | EllipsisType, ...]
    window: Window = ALWAYS
    times: np.ndarray | None = None

    @cached_property
    def inside(self) -> np.ndarray | bool:
        """Which values of the last dim are in the window."""
        if self.times is None:
            return True
        return (self.times >= self.window[0]) & (self.times <= self.window[1])

    @cached_property
    def lower(self) -> np.ndarray:
        """The lower bound, −∞ outside of the window."""
        return np.where(self.inside, self.curves[0], -np.inf)

    @cached_property
    def upper(self) -> np.ndarray:
        """The upper bound, ∞ outside of the window."""
        return np.where(self.inside, self.curves[1], np.inf)

    def margin(self, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """Return how far values between `low` and `high` stay inside, (…, *shape); ∞ if free."""
        return np.minimum(low - self.lower, self.upper - high)

    def margin_at_all_times(self, runs: np.ndarray) -> np.ndarray:
        """Return how far an output of runs is inside, (runs, …), as if it were always limited."""
        (lower, upper), of_output = self.curves[:, *self.where], runs[:, *self.where]
        return np.minimum(of_output - lower, upper - of_output)

    def at_more_times(self, parts: int) -> Corridor:
        """Return the corridor at times that divide each step into parts."""
        times = None if self.times is None else at_more_times(self.times, parts)
        return replace(self, curves=at_more_times(self.curves, parts), times=times)


def at_more_times(values: np.ndarray, parts: int) -> np.ndarray:
    """Return values at times that divide each step into parts: on lines between those known."""
    if parts == 1:
        return values
    steps = values.shape[-1] - 1
    number = np.arange(parts * steps + 1)
    before = number // parts
    part = number % parts / parts
    first = values[..., before]
    last = values[..., np.minimum(before + 1, steps)]
    same = first == last  # as infinite ones are
    return first + part * np.subtract(last, first, out=np.zeros(first.shape), where=~same)


def joint(named_corridors: Mapping[str, Corridor]) -> Corridor:
    """Return the corridor in which all requirements are met."""
    corridors = named_corridors.values()
    lower = np.max([corridor.lower for corridor in corridors], axis=0)
    upper = np.min([corridor.upper for corridor in corridors], axis=0)
    if np.any(lower >= upper):
        raise InputError(
            f"requirements must leave something between them; got {', '.join(named_corridors)}"
        )
    return Corridor("", np.stack([lower, upper]), (...,))


def check_instantaneous(
    named_corridors: Mapping[str, Corridor], attrs: Mapping[Hashable, Any]
) -> None:
    """Raise `InputError` if bounds of a limited output need offsets that are stated constant."""
    for name, corridor in named_corridors.items():
        if has_constant_offsets(corridor, attrs) and not attrs["offsets_stated"]:
            raise InputError(
                f"{name}: bounds of {corridor.output} are for constant offsets of pins and guides "
                f"only, so they decide no requirement. {ONE_SIDED}"
            )


def has_constant_offsets(corridor: Corridor, attrs: Mapping[Hashable, Any]) -> bool:
    """Return whether the bounds of a limited output are for constant offsets."""
    return corridor.output in np.atleast_1d(attrs.get("constant_offsets", []))


def offsets_in_words(
    named_corridors: Mapping[str, Corridor], attrs: Mapping[Hashable, Any]
) -> list[str]:
    """Return the sentence of a verdict on bounds that are for constant offsets, if any are."""
    constant = any(has_constant_offsets(corridor, attrs) for corridor in named_corridors.values())
    return [FOR_CONSTANT_OFFSETS.capitalize()] * constant


def checked_bound(name: str, bound: Bound) -> Bound:
    """Return a bound as a float, an array, a DataArray, a function, or None."""
    if bound is None:
        return None
    if isinstance(bound, xr.DataArray):
        check_finite(name, bound.values, rank=None)
        return bound.astype(float)
    if callable(bound):
        check_function(name, bound)
        return bound
    values = check_finite(name, bound, "a number, finite numbers, or a function of time", rank=None)
    return float(values) if values.ndim == 0 else values


def chosen_output(
    label: str, output: str | None, labels: xr.DataArray, requirement: str = ""
) -> tuple[str, int | None]:
    """Return the name of the limited output and its number along dim "output", if there is one.

    Of several outputs it is the one with the name of the requirement, unless `output` is given.
    """
    if "output" not in labels.dims:
        if output is not None and output != labels.name:
            alternative = "" if labels.name is None else f" or {labels.name!r}"
            raise InputError(
                f"{label} output must be None{alternative}, since the response has one output; "
                f"got {output!r}"
            )
        return str(labels.name or ""), None
    names = list(map(str, labels["output"].values))  # numbers where the dim has no labels
    if output is None and len(names) == 1:
        return names[0], 0
    if output is None and requirement in names:
        output = requirement
    if output not in names:
        raise InputError(f"{label} output must be one of {', '.join(names)}; got {output!r}")
    return output, names.index(output)


def times_of_window(
    label: str, during: tuple[float, float], output_labels: xr.DataArray
) -> np.ndarray:
    """Return the times of an output; raise `InputError` if none is in a window."""
    dim, times = _times(f"{label} during", output_labels)
    if not ((times >= during[0]) & (times <= during[1])).any():
        raise InputError(
            f"{label} during must contain a value of {dim}, which are from {times.min():g} to "
            f"{times.max():g}; got {during}"
        )
    return times


def curve(name: str, bound: Bound, output_labels: xr.DataArray, fill_value: float) -> np.ndarray:
    """Return a bound at all values of an output, of its shape; `fill_value` if there is none."""
    shape = output_labels.shape[1:]
    if bound is None:
        return np.full(shape, fill_value)
    if isinstance(bound, xr.DataArray):
        return _align_curve(name, bound, output_labels)
    if callable(bound):
        _, times = _times(name, output_labels)
        bound = check_finite(
            name, evaluate_function(bound, times, f"the function of {name}"), rank=None
        )
    if np.shape(bound) not in ((), shape[-1:], shape):
        allowed = " or ".join(str(s) for s in dict.fromkeys([shape[-1:], shape]))
        raise InputError(
            f"{name} must be one number, or numbers of shape {allowed}; got shape {np.shape(bound)}"
        )
    return np.broadcast_to(bound, shape)


def _times(name: str, output_labels: xr.DataArray) -> tuple[Hashable, np.ndarray]:
    dim = output_labels.dims[-1]
    coordinates = output_labels.coords
    has_dim = output_labels.ndim > 1
    if not has_dim or dim not in coordinates or coordinates[dim].dtype.kind not in "iuf":
        where = f"its last dim {dim!r} has none" if has_dim else "it has no dim"
        raise InputError(f"{name} requires times, which the response must give; {where}")
    return dim, coordinates[dim].values.astype(float)


def _align_curve(name: str, bound: xr.DataArray, output_labels: xr.DataArray) -> np.ndarray:
    """Return a curve with dims of an output at all its values."""
    for dim in bound.dims:
        if dim not in output_labels.dims[1:]:
            allowed = ", ".join(map(str, output_labels.dims[1:])) or "none"
            raise InputError(f"{name} must have dims of the output ({allowed}); got {dim!r}")
        same = bound.sizes[dim] == output_labels.sizes[dim]
        if same and dim in bound.coords and dim in output_labels.coords:
            pair = output_labels[dim].values, bound[dim].values
            same = np.array_equal(*pair)
            if all(values.dtype.kind in "iuf" for values in pair):
                same = np.allclose(*pair, rtol=0, atol=1e-9 * np.abs(pair[0]).max(initial=0))
        if not same:
            raise InputError(f"{name} must have the values of {dim!r} that the output has")
    missing_dims = [dim for dim in output_labels.dims[1:] if dim not in bound.dims]
    values = bound.expand_dims(missing_dims).transpose(*output_labels.dims[1:]).values
    return np.broadcast_to(values, output_labels.shape[1:])
