"""What a response returns: checked, labelled, and aligned with its first runs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable
from typing import Any

import numpy as np
import xarray as xr

from flexband.errors import InputError, RunError
from flexband.uncertainty.inputs.space import Space, explain_fields

RESERVED = ("bound", "choice", "input", "variable")
"""Dims of results, which a response cannot have."""

LARGEST = 1e150
"""Squares of larger values overflow."""


def explained(error: Exception, space: Space, xi: np.ndarray, eta: np.ndarray) -> Exception:
    """Return an error of a response, which tells inputs whose values have the other sign."""
    explain_fields(error, space.inputs)
    hint = _of_other_sign(space, xi, eta)
    if not hint:
        return error
    if isinstance(error, RunError):
        found: Exception = type(error)(f"{error}. {hint}", error.failures, error.results)
    elif isinstance(error, InputError):
        found = InputError(f"{error}. {hint}")
    else:
        error.add_note(hint)
        return error
    found.__cause__ = error
    return found


def _of_other_sign(space: Space, xi: np.ndarray, eta: np.ndarray) -> str:
    """Return which random inputs have values whose sign is not that of the nominal one, if any.

    It names distributions that have none.
    """
    values, nominal = space.values(xi, eta), space.values(*space.nominal())
    found = []
    for name, one in space.of_kind(random=True).items():
        middle, own = nominal[name], values[name]
        if callable(middle) or callable(own) or one.dimension > 1:
            continue
        middle = float(middle[0])
        worst = float(own[np.argmin(own * np.sign(middle))])
        if middle * worst < 0:
            sign, bound = ("negative", "lower") if middle > 0 else ("positive", "upper")
            other = "A LogNormal or a" if middle > 0 else "A"
            found.append(
                f"{name} = {worst:.6g} is a value of {one!r}. {other} TruncatedNormal with "
                f"{bound}=0 has no {sign} values"
            )
    return "; ".join(found)


def coordinates(response: xr.DataArray) -> dict[Hashable, xr.DataArray]:
    """Return the coordinates of a response that do not belong to its runs."""
    return {k: c for k, c in response.coords.items() if "sample" not in c.dims}


def labelled(result: Any, runs: int) -> xr.DataArray:
    """Return a response as a `DataArray` of real numbers with first dim "sample"."""
    kind = type(result).__name__
    if _is_masked(result):
        raise InputError("the response must return plain arrays; got a masked one: fill it first")
    if isinstance(result, xr.Dataset | dict | set) or callable(result):
        raise InputError(f"the response must return an array; got a {kind}")
    try:
        array = xr.DataArray(result)
    except (TypeError, ValueError) as error:
        raise InputError(f"the response must return an array; got a {kind}: {error}") from None
    if array.dtype.kind not in "biuf":
        raise InputError(f"the response must return real numbers; got {kind} of {array.dtype}")
    if "sample" in array.dims:
        array = array.transpose("sample", ...)
    if array.shape[:1] != (runs,):
        raise InputError(f"the response must return shape ({runs}, ...); got shape {array.shape}")
    array = array.drop_vars([k for k, c in array.coords.items() if array.dims[0] in c.dims])
    if "sample" not in array.dims:
        array = array.drop_vars("sample", errors="ignore").rename({array.dims[0]: "sample"})
    if array.ndim > 2 and array.dims[-1] == "output":  # the last dim is time
        array = array.transpose("sample", "output", ...)
    return array


def _is_masked(result: Any) -> bool:
    """Return whether an array, or one in a list, is masked."""
    if isinstance(result, list | tuple):
        return any(map(_is_masked, result))
    return isinstance(result, np.ma.MaskedArray)


def check_labels(part: xr.DataArray) -> None:
    """Raise `InputError` if results cannot have the dims and coordinates of a response."""
    if 0 in part.shape[1:]:
        raise InputError(f"the response must return a number per run; got shape {part.shape}")
    for name in (*part.dims[1:], *part.coords):
        if name in RESERVED or not isinstance(name, str) or "/" in name or not name:
            raise InputError(
                f"dims and coordinates of the response must have names without '/' other than "
                f"{', '.join(RESERVED)}; got {name!r}"
            )
    for name, values in part.coords.items():
        if values.dtype.kind == "f" and not np.isfinite(values).all():
            raise InputError(f"coordinate {name!r} of the response must be finite")
    for name, index in part.indexes.items():
        if index.nlevels > 1:
            raise InputError(f"coordinate {name!r} of the response must have one level only")
        twice = [label for label, count in Counter(index).items() if count > 1]
        if twice:
            raise InputError(f"{name} of the response must differ; got {twice[0]!r} twice")


def aligned(part: xr.DataArray, labels: xr.DataArray) -> xr.DataArray:
    """Return a batch with the order of dims and of labels of the first one.

    Raises
    ------
    InputError
        If it has other dims, labels or coordinates.
    """
    first = labels.dims[1:], labels.shape[1:]
    if set(part.dims) != set(labels.dims):
        raise InputError(
            f"the response must return dims {_shown(first[0])} in all runs, as in the first ones; "
            f"got {_shown(part.dims[1:])}"
        )
    part = part.transpose(*labels.dims)
    if part.shape[1:] != first[1]:
        raise InputError(
            f"the response must return {first[1]} per run, as in the first ones; "
            f"got {part.shape[1:]}"
        )
    for name, index in labels.indexes.items():
        own = part.indexes.get(name)
        if own is not None and own.is_unique and not own.equals(index) and set(own) == set(index):
            part = part.isel({name: own.get_indexer(index)})
    for name in dict.fromkeys([*labels.coords, *part.coords]):
        if name not in part.coords or name not in labels.coords:
            raise InputError(
                f"coordinate {name!r} of the response must be given in all runs or in none"
            )
        if not part.coords[name].variable.equals(labels.coords[name].variable):
            raise InputError(
                f"coordinate {name!r} of the response must be the same in all runs; got\n"
                f"{part.coords[name].values} and before\n{labels.coords[name].values}"
            )
    return part


def _shown(dims: tuple[Hashable, ...]) -> str:
    """Return dims as text."""
    return f"({', '.join(map(str, dims))})"


def not_finite(
    values: np.ndarray, space: Space, xi: np.ndarray, eta: np.ndarray
) -> tuple[str, np.ndarray]:
    """Return in words, with the inputs of one, which runs have values that are not finite.

    The text is "" if all are finite.
    """
    bad = np.asarray(~(np.abs(values.reshape(len(values), -1)) <= LARGEST).all(axis=1))
    if not bad.any():
        return "", bad
    k = int(np.flatnonzero(bad)[0])
    inputs = space.numbers_at(xi, eta).items()
    shown = ", ".join(f"{n} = {v[k]:.9g}" for n, v in inputs)
    hint = _of_other_sign(space, xi[bad], eta[bad])
    text = f"the response is not finite in {bad.sum()} of {len(values)} runs, e.g. {shown}"
    return text + (f". {hint}" if hint else ""), bad
