"""Corridors: where a response must be at every output and time, and the bounds they are made of."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, replace
from types import EllipsisType
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from flexband.errors import InputError, check_finite, check_function, returned

Bound = float | np.ndarray | xr.DataArray | Callable[[np.ndarray], ArrayLike] | None
"""A number or a curve; None where there is none."""


FOR_CONSTANT_OFFSETS = "for constant offsets of pins and guides"


@dataclass(frozen=True, eq=False)
class Corridor:
    """Where a response must be."""

    output: str  # its name; "" if the response has one output only, or for several
    lower: np.ndarray  # shape of the response without its runs; −∞ where nothing is required
    upper: np.ndarray  # the same; ∞ where nothing is required
    where: tuple[int | slice | EllipsisType, ...]  # index of the output in these arrays

    def margin(self, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """Return how far values between `low` and `high` stay inside, (…, *shape); ∞ if free."""
        return np.minimum(low - self.lower, self.upper - high)

    def at_more_times(self, parts: int) -> Corridor:
        """Return the corridor at times that divide each step into parts."""
        lower, upper = (at_more_times(end, parts) for end in (self.lower, self.upper))
        return replace(self, lower=lower, upper=upper)


def at_more_times(values: np.ndarray, parts: int) -> np.ndarray:
    """Return values at times that divide each step into parts: on lines, ∞ beside what is ∞."""
    if parts == 1:
        return values
    steps = values.shape[-1] - 1
    number = np.arange(parts * steps + 1)
    before, part = number // parts, number % parts / parts
    first, last = values[..., before], values[..., np.minimum(before + 1, steps)]
    with np.errstate(invalid="ignore"):
        lines = first + part * (last - first)
    beside = np.where(np.isfinite(first) & (part > 0), last, first)
    return np.where(np.isfinite(lines), lines, beside)


def joint(named_corridors: Mapping[str, Corridor]) -> Corridor:
    """Return the corridor in which all limits are kept."""
    lower = np.max([corridor.lower for corridor in named_corridors.values()], axis=0)
    upper = np.min([corridor.upper for corridor in named_corridors.values()], axis=0)
    if np.any(lower >= upper):
        raise InputError(
            f"limits must leave something between them; got {', '.join(named_corridors)}"
        )
    return Corridor("", lower, upper, (...,))


def check_instantaneous(
    named_corridors: Mapping[str, Corridor], attrs: Mapping[Hashable, Any]
) -> None:
    """Raise `InputError` if bounds of a limited output need offsets that are stated constant."""
    for name, corridor in named_corridors.items():
        if has_constant_offsets(corridor, attrs) and not attrs["offsets_stated"]:
            raise InputError(
                f"{name}: bounds of {corridor.output} are for constant offsets of pins and guides "
                "only, so they decide no requirement. Bounds of positions and angles hold in "
                "general if the motion is prescribed. If loads hold the pins on one side, write "
                "Play(…, constant=True)"
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


def chosen_output(label: str, output: str | None, labels: xr.DataArray) -> tuple[str, int | None]:
    """Return the name of the limited output and its number along dim "output", if there is one."""
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
    if output not in names:
        raise InputError(f"{label} output must be one of {', '.join(names)}; got {output!r}")
    return output, names.index(output)


def within_times(
    label: str, during: tuple[float, float] | None, output_labels: xr.DataArray
) -> np.ndarray:
    """Return which values of an output are limited, of its shape."""
    shape = output_labels.shape[1:]
    if during is None:
        return np.full(shape, True)
    dim, times = _times(f"{label} during", output_labels)
    within = (times >= during[0]) & (times <= during[1])
    if not within.any():
        raise InputError(
            f"{label} during must contain a value of {dim}, which are from {times.min():g} to "
            f"{times.max():g}; got {during}"
        )
    return np.broadcast_to(within, shape)


def curve(name: str, bound: Bound, output_labels: xr.DataArray, free: float) -> np.ndarray:
    """Return a bound at all values of an output, of its shape; `free` if there is none."""
    shape = output_labels.shape[1:]
    if bound is None:
        return np.full(shape, free)
    if isinstance(bound, xr.DataArray):
        return _aligned(name, bound, output_labels)
    if callable(bound):
        _, times = _times(name, output_labels)
        bound = check_finite(name, returned(bound, times, f"the function of {name}"), rank=None)
    if np.shape(bound) not in ((), shape[-1:], shape):
        allowed = " or ".join(str(s) for s in dict.fromkeys([shape[-1:], shape]))
        raise InputError(
            f"{name} must be one number, or numbers of shape {allowed}; got shape {np.shape(bound)}"
        )
    return np.broadcast_to(bound, shape)


def _times(name: str, output_labels: xr.DataArray) -> tuple[Hashable, np.ndarray]:
    dim, coordinates = output_labels.dims[-1], output_labels.coords
    has_dim = output_labels.ndim > 1
    if not has_dim or dim not in coordinates or coordinates[dim].dtype.kind not in "iuf":
        where = f"its last dim {dim!r} has none" if has_dim else "it has no dim"
        raise InputError(f"{name} requires times, which the response must give; {where}")
    return dim, coordinates[dim].values.astype(float)


def _aligned(name: str, bound: xr.DataArray, output_labels: xr.DataArray) -> np.ndarray:
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
    missing = [dim for dim in output_labels.dims[1:] if dim not in bound.dims]
    values = bound.expand_dims(missing).transpose(*output_labels.dims[1:]).values
    return np.broadcast_to(values, output_labels.shape[1:])
