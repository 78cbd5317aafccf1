"""What a response returns: checked, labelled, and aligned with its first runs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Mapping

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from flexband.basics.words import number_of
from flexband.errors import InputError, RunError
from flexband.uncertainty.inputs.space import Space, error_words

RESERVED = ("bound", "choice", "input", "variable")
"""Dims of results, which a response cannot have."""

OF_BANDS = frozenset((
    "above_between", "above_between_least", "allowed", "bar_width", "below_between",
    "below_between_least", "carriers", "confirmed", "error_bar", "error_bar_at",
    "error_bar_by_choice", "error_bar_choice", "error_bar_discretization_error",
    "error_bar_expansion_error", "error_bar_integration_error", "mean_discretization_error",
    "error_bar_expected_error", "error_bar_lower", "error_bar_upper", "expected_error",
    "implied_error", "least_error", "mean", "mean_at", "mean_by_choice", "mean_choice",
    "mean_expansion_error", "mean_expected_error", "mean_integration_error", "missed",
    "missed_in_run", "missed_most_at", "missed_most_in", "orders", "pointwise_error",
    "relative_expected_error", "run_place", "run_values", "run_weight", "std", "truncation",
    "trusted",
))  # fmt: skip
"""Variables of bands and of what new runs tell of them, which a response cannot have either."""

LARGEST = 1e150
"""Squares of larger values overflow."""


def explain_error(error: Exception, space: Space, xi: np.ndarray, eta: np.ndarray) -> Exception:
    """Return an error of a response, or a `RunError`, that tells inputs of an unusual sign."""
    hint = _of_other_sign(space, xi, eta)
    if not isinstance(error, RunError | InputError | MemoryError):
        text = ". ".join(filter(None, (error_words(error, space.inputs), hint)))
        new_error: Exception = RunError(f"{text}; {inputs_in_words(space, xi, eta)}", {})
    elif not hint or isinstance(error, MemoryError):
        return error
    elif isinstance(error, RunError):
        new_error = type(error)(f"{error}. {hint}", error.failures, error.results)
    else:
        new_error = InputError(f"{error}. {hint}")
    new_error.__cause__ = error
    return new_error


def inputs_in_words(space: Space, xi: np.ndarray, eta: np.ndarray) -> str:
    """Return the inputs of the only run of a call, or the ranges of those of several."""
    inputs = space.numbers_at(xi, eta).items()
    count = len(xi)
    if count == 1:
        return "inputs of the run: " + ", ".join(f"{n} = {v[0]:.9g}" for n, v in inputs)
    ends = [f"{n} from {v.min():.6g} to {v.max():.6g}" for n, v in inputs]
    return f"inputs of the {number_of(count, 'run')} of the call: {', '.join(ends)}"


def extremes_in_words(values: Mapping[str, np.ndarray], run: int, digits: int) -> str:
    """Return the inputs of a run in words, of many those farthest out; values (runs,) by name."""
    max_inputs = 6
    few_inputs = 4  # inputs that are all named in a sentence; of more, so many are
    names = list(values)
    out = []
    for column in values.values():
        spread = np.ptp(column)
        out.append(abs(column[run] - np.median(column)) / spread if spread else 0.0)
    count = len(names) if len(names) <= max_inputs else few_inputs
    which = np.sort(np.argsort(-np.array(out), kind="stable")[:count])
    words = [f"{names[k]} = {float(values[names[k]][run]):.{digits}g}" for k in which]
    unnamed = len(names) - count
    return ", ".join(words) + (f" and {number_of(unnamed, 'other input')}" if unnamed else "")


def _of_other_sign(space: Space, xi: np.ndarray, eta: np.ndarray) -> str:
    """Return which random inputs, or distributions, have a sign that the nominal one has not."""
    values = space.values(xi, eta)
    nominal = space.values(*space.nominal())
    sentences = []
    for name, input_ in space.of_kind(random=True).items():
        middle = nominal[name]
        run_values = values[name]
        if callable(middle) or callable(run_values) or input_.dimension > 1 or not input_.numeric:
            continue
        middle = float(middle[0])
        worst = float(run_values[np.argmin(run_values * np.sign(middle))])
        if middle * worst < 0:
            sign, bound = ("negative", "lower") if middle > 0 else ("positive", "upper")
            other = "A LogNormal or a" if middle > 0 else "A"
            sentences.append(
                f"{name} = {worst:.6g} is a value of {input_!r}. {other} TruncatedNormal with "
                f"{bound}=0 has no {sign} values"
            )
    return "; ".join(sentences)


def coordinates(response: xr.DataArray) -> dict[Hashable, xr.DataArray]:
    """Return the coordinates of a response that do not belong to its runs."""
    return {k: c for k, c in response.coords.items() if "sample" not in c.dims}


def label_result(result: ArrayLike | xr.DataArray, runs: int) -> xr.DataArray:
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
    if array.dtype != float:
        with np.errstate(over="ignore"):  # of numbers with more digits, which are infinite then
            array = array.astype(float)
    if "sample" in array.dims:
        array = array.transpose("sample", ...)
    if array.shape[:1] != (runs,):
        raise InputError(f"the response must return shape ({runs}, ...); got shape {array.shape}")
    if of_samples := [k for k, c in array.coords.items() if array.dims[0] in c.dims]:
        array = array.drop_vars(of_samples)
    if "sample" not in array.dims:
        if "sample" in array.coords:
            array = array.drop_vars("sample")
        array = array.rename({array.dims[0]: "sample"})
    if array.ndim > 2 and array.dims[-1] == "output":  # the last dim is time
        array = array.transpose("sample", "output", ...)
    return array


def _is_masked(result: ArrayLike | xr.DataArray) -> bool:
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
        if name in OF_BANDS:
            raise InputError(
                f"dims and coordinates of the response must have other names than the variables "
                f"of bands; got {name!r}"
            )
    for name, values in part.coords.items():
        if name == "output" and not all(str(label).strip() for label in values.values.flat):
            raise InputError("outputs of the response must have names; one of them is empty")
        if values.dtype.kind == "f" and not np.isfinite(values).all():
            raise InputError(f"coordinate {name!r} of the response must be finite")
    for name, index in part.indexes.items():
        if index.nlevels > 1:
            raise InputError(f"coordinate {name!r} of the response must have one level only")
        twice = [label for label, count in Counter(index).items() if count > 1]
        if twice:
            raise InputError(f"{name} of the response must differ; got {twice[0]!r} twice")


def align_batch(part: xr.DataArray, labels: xr.DataArray) -> xr.DataArray:
    """Return a batch in the order of dims and labels of the first one; refuse other ones."""
    first = labels.dims[1:], labels.shape[1:]
    if set(part.dims) != set(labels.dims):
        raise InputError(
            f"the response must return dims {_dims_text(first[0])} in all runs, "
            f"as in the first ones; got {_dims_text(part.dims[1:])}"
        )
    if part.dims != labels.dims:
        part = part.transpose(*labels.dims)
    if part.shape[1:] != first[1]:
        raise InputError(
            f"the response must return {first[1]} per run, as in the first ones; "
            f"got {part.shape[1:]}"
        )
    for name, index in labels.indexes.items():
        part_index = part.indexes.get(name)
        if (
            part_index is not None
            and part_index.is_unique
            and not part_index.equals(index)
            and set(part_index) == set(index)
        ):
            part = part.isel({name: part_index.get_indexer(index)})
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


def _dims_text(dims: tuple[Hashable, ...]) -> str:
    return f"({', '.join(map(str, dims))})"


def not_finite(
    values: np.ndarray, space: Space, xi: np.ndarray, eta: np.ndarray
) -> tuple[str, str, np.ndarray]:
    """Return which runs are not finite, or too large, why, and the same with a run's inputs."""
    flat = values.reshape(len(values), -1)
    size = np.maximum(flat.max(axis=1), -flat.min(axis=1))  # NaN if one is
    invalid_mask = np.asarray(~(size <= LARGEST))
    if not invalid_mask.any():
        return "", "", invalid_mask
    finite = bool(np.isfinite(size[invalid_mask]).all())
    reason = f"the response is {f'larger than {LARGEST:g}' if finite else 'not finite'}"
    k = int(np.flatnonzero(invalid_mask)[0])
    inputs = space.numbers_at(xi, eta).items()
    inputs_text = ", ".join(f"{n} = {v[k]:.9g}" for n, v in inputs)
    hint = _of_other_sign(space, xi[invalid_mask], eta[invalid_mask])
    text = (
        f"{reason} in {invalid_mask.sum()} of {number_of(len(values), 'run')}, e.g. {inputs_text}"
    )
    if finite:
        hint = (
            f"It reaches {size[invalid_mask].max():.3g}, and its square overflows: choose another "
            "unit"
        )
    return reason, text + (f". {hint}" if hint else ""), invalid_mask
