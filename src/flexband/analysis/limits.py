"""Limits of outputs, and what they leave of a response: a corridor at every time."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from types import EllipsisType

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from flexband.arguments import frozen
from flexband.errors import (
    InputError,
    check_finite,
    check_function,
    check_instance,
    check_numbers,
    returned,
    shown,
)

Bound = float | np.ndarray | xr.DataArray | Callable[[np.ndarray], ArrayLike] | None
"""A number or a curve; None where there is none."""


@frozen(eq=False)
class Limit:
    """What an output must stay below, above, or between.

    Parameters
    ----------
    output : name of the output; None if the response has one output only.
    below, above : a number; an array, one per value of the last dim (time) or of the shape of the
        output; a DataArray with dims and coordinates of the output; or a function of the times,
        shape (times,), which returns as many numbers, or one.
    during : first and last time, or value of the last dim, between which the limit holds, ends
        included; always unless given.

    Raises
    ------
    InputError
        If neither `below` nor `above` is given, or one of them is not real and finite.

    Examples
    --------
    >>> fb.Limit("F_X", above=-1600.0, below=1600.0)
    Limit(output='F_X', below=1600.0, above=-1600.0, during=None)
    >>> gap = fb.Limit("gap", above=lambda t: 0.01 + 0.1 * t, during=(0.0, 0.5))  # [m]
    """

    output: str | None = None
    below: Bound = None
    above: Bound = None
    during: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if self.output is not None:
            check_instance("Limit output", self.output, str, "the name of an output")
        if self.below is None and self.above is None:
            raise InputError("Limit must have below, above or both; got none")
        for name in ("below", "above"):
            object.__setattr__(self, name, _checked(f"Limit {name}", getattr(self, name)))
        if not any(isinstance(end, xr.DataArray) or callable(end) for end in self._ends):
            self._check_ends(*(np.asarray(np.nan if e is None else e) for e in self._ends))
        if self.during is not None:
            first, last = map(float, check_numbers("Limit during", self.during, 2))
            if first > last:
                raise InputError(f"Limit during must be first and last time; got {self.during}")
            object.__setattr__(self, "during", (first, last))

    @property
    def _ends(self) -> tuple[Bound, Bound]:
        return self.above, self.below

    def _check_ends(self, low: np.ndarray, high: np.ndarray) -> None:
        """Raise `InputError` if nothing is left between two ends, where both have a value."""
        if low.shape and high.shape and low.shape != high.shape:
            return  # which one of them fits is known with the response
        wrong = np.atleast_1d(low >= high)
        if wrong.any():
            place = np.unravel_index(wrong.argmax(), wrong.shape)
            above, below = (np.broadcast_to(end, wrong.shape)[place] for end in (low, high))
            raise InputError(
                "Limit above, which the output must stay above, must be less than below; got "
                f"above={above:g} and below={below:g}"
            )

    def __str__(self) -> str:
        """Return the limit in words: F between -5 and 5 from 0.1 to 0.2."""
        low, high = map(_in_words, (self.above, self.below))
        if low and high:
            text = f"between {low} and {high}".replace("a curve and a curve", "two curves")
        else:
            text = f"below {high}" if high else f"above {low}"
        if self.during is not None:
            text += f" from {self.during[0]:g} to {self.during[1]:g}"
        return f"{self.output or 'response'} {text}"

    def corridor(self, labels: xr.DataArray) -> Corridor:
        """Return where the response must be, at every output and time.

        Parameters
        ----------
        labels : a response of shape (runs, …), for its dims and coordinates.

        Raises
        ------
        InputError
            If the response has no such output, a curve does not fit it, no time is within
            `during`, or `above` is not less than `below` somewhere.
        """
        name, chosen = _chosen(self.output, labels)
        output_labels = labels.isel({"output": chosen} if chosen is not None else {})
        at_times = _during(self.during, output_labels)
        low = _curve("Limit above", self.above, output_labels, -np.inf)
        high = _curve("Limit below", self.below, output_labels, np.inf)
        self._check_ends(np.where(at_times, low, -np.inf), np.where(at_times, high, np.inf))
        place = (slice(None),) * (labels.dims.index("output") - 1) if chosen is not None else ()
        lower, upper = np.full(labels.shape[1:], -np.inf), np.full(labels.shape[1:], np.inf)
        where = (*place, chosen) if chosen is not None else (...,)
        lower[where], upper[where] = (
            np.where(at_times, low, -np.inf),
            np.where(at_times, high, np.inf),
        )
        return Corridor(name, lower, upper, where)


Limits = Limit | Sequence[Limit]


@dataclass(frozen=True, eq=False)
class Corridor:
    """Where a response must be.

    Attributes
    ----------
    output : name of the output; "" if the response has one only, or for several outputs.
    lower, upper : shape of the response without its runs; ∓∞ where nothing is required.
    where : index of the output in these arrays.
    """

    output: str
    lower: np.ndarray
    upper: np.ndarray
    where: tuple[int | slice | EllipsisType, ...]

    def margin(self, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """Return how far values between `low` and `high` stay inside, (…, *shape); ∞ if free."""
        return np.minimum(low - self.lower, self.upper - high)


def several(limits: Limits) -> tuple[Limit, ...]:
    """Return a limit, or several, as a tuple; raise `InputError` if `limits` are none."""
    sequence = [limits] if isinstance(limits, Limit) else limits
    if not isinstance(sequence, Sequence) or not all(
        isinstance(limit, Limit) for limit in sequence
    ):
        raise InputError(f"limits must be a Limit or a list of them; got {shown(limits)}")
    return tuple(sequence)


def corridors(limits: Limits, labels: xr.DataArray) -> dict[str, Corridor]:
    """Return the corridor of each limit, by the limit in words.

    Raises
    ------
    InputError
        If `limits` is neither a `Limit` nor several, or one does not fit the response.
    """
    named_corridors: dict[str, Corridor] = {}
    all_limits = several(limits)
    if not all_limits:
        raise InputError(f"limits must be a Limit or a list of them; got {shown(limits)}")
    for limit in all_limits:
        name, count = str(limit), 2
        while name in named_corridors:
            name, count = f"{limit} ({count})", count + 1
        named_corridors[name] = limit.corridor(labels)
    return named_corridors


def joint(named_corridors: Mapping[str, Corridor]) -> Corridor:
    """Return the corridor in which all limits are kept."""
    lower = np.max([corridor.lower for corridor in named_corridors.values()], axis=0)
    upper = np.min([corridor.upper for corridor in named_corridors.values()], axis=0)
    if np.any(lower >= upper):
        raise InputError(
            f"limits must leave something between them; got {', '.join(named_corridors)}"
        )
    return Corridor("", lower, upper, (...,))


def _checked(name: str, bound: Bound) -> Bound:
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


def _in_words(bound: Bound) -> str:
    if bound is None:
        return ""
    return f"{bound:g}" if isinstance(bound, float) else "a curve"


def _chosen(output: str | None, labels: xr.DataArray) -> tuple[str, int | None]:
    """Return the name of the limited output and its number along dim "output", if there is one."""
    if "output" not in labels.dims:
        if output is not None and output != labels.name:
            alternative = "" if labels.name is None else f" or {labels.name!r}"
            raise InputError(
                f"Limit output must be None{alternative}, since the response has one output; "
                f"got {output!r}"
            )
        return str(labels.name or ""), None
    count = labels.sizes["output"]
    names = [
        str(v) for v in (labels["output"].values if "output" in labels.coords else range(count))
    ]
    if output is None and count == 1:
        return names[0], 0
    if output not in names:
        raise InputError(f"Limit output must be one of {', '.join(names)}; got {output!r}")
    return output, names.index(output)


def _during(during: tuple[float, float] | None, output_labels: xr.DataArray) -> np.ndarray:
    """Return which values of an output are limited, of its shape."""
    shape = output_labels.shape[1:]
    if during is None:
        return np.full(shape, True)
    dim, times = _times("Limit during", output_labels)
    within = (times >= during[0]) & (times <= during[1])
    if not within.any():
        raise InputError(
            f"Limit during must contain a value of {dim}, which are from {times.min():g} to "
            f"{times.max():g}; got {during}"
        )
    return np.broadcast_to(within, shape)


def _curve(name: str, bound: Bound, output_labels: xr.DataArray, free: float) -> np.ndarray:
    """Return a bound at all values of an output, of its shape; `free` if there is none."""
    shape = output_labels.shape[1:]
    if bound is None:
        return np.full(shape, free)
    if isinstance(bound, xr.DataArray):
        return _aligned(name, bound, output_labels)
    if callable(bound):
        _, times = _times(name, output_labels)
        bound = check_finite(name, returned(bound, times, f"the function of {name}"), rank=None)
    fits = np.shape(bound) in ((), shape[-1:], shape)
    if not fits:
        allowed = " or ".join(str(s) for s in dict.fromkeys([shape[-1:], shape]))
        raise InputError(
            f"{name} must be one number, or numbers of shape {allowed}; got shape {np.shape(bound)}"
        )
    return np.broadcast_to(bound, shape)


def _times(name: str, output_labels: xr.DataArray) -> tuple[Hashable, np.ndarray]:
    dim = output_labels.dims[-1]
    if (
        output_labels.ndim < 2
        or dim not in output_labels.coords
        or output_labels[dim].dtype.kind not in "iuf"
    ):
        where = f"its last dim {dim!r} has none" if output_labels.ndim > 1 else "it has no dim"
        raise InputError(f"{name} requires times, which the response must give; {where}")
    return dim, output_labels[dim].values.astype(float)


def _aligned(name: str, bound: xr.DataArray, output_labels: xr.DataArray) -> np.ndarray:
    """Return a curve with dims of an output at all its values."""
    for dim in bound.dims:
        if dim not in output_labels.dims[1:]:
            allowed = ", ".join(map(str, output_labels.dims[1:])) or "none"
            raise InputError(f"{name} must have dims of the output ({allowed}); got {dim!r}")
        same = bound.sizes[dim] == output_labels.sizes[dim]
        if same and dim in bound.coords and dim in output_labels.coords:
            ours, theirs = output_labels[dim].values, bound[dim].values
            numeric = ours.dtype.kind in "iuf" and theirs.dtype.kind in "iuf"
            size = np.abs(ours).max(initial=0) if numeric else 0.0
            same = (
                np.allclose(ours, theirs, rtol=0, atol=1e-9 * size)
                if numeric
                else np.array_equal(ours, theirs)
            )
        if not same:
            raise InputError(f"{name} must have the values of {dim!r} that the output has")
    dims = [dim for dim in output_labels.dims[1:] if dim in bound.dims]
    values = bound.transpose(*dims).values
    index = tuple(slice(None) if dim in dims else None for dim in output_labels.dims[1:])
    return np.broadcast_to(values[index], output_labels.shape[1:])
