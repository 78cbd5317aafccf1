"""Responses that compute one sample after another."""

from __future__ import annotations

import inspect
from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from flexband.basics.checks import check_function
from flexband.basics.response import Response
from flexband.basics.words import number_of, value_text
from flexband.errors import InputError


class OneByOne(Response):
    """A response that is made of the results of single samples.

    A subclass is a frozen dataclass that holds nothing but what describes the model, so that it can
    be sent to other processes. Results are recorded, and distributed to processes, sample by sample
    (`one_by_one`).
    """

    one_by_one = True

    @abstractmethod
    def sample(self, **values: Any) -> Any:
        """Return the result of one sample: a number, an array or a `xarray.DataArray`.

        Every input is a number, a text, or a function of position that returns one value per
        position.
        """

    def __call__(self, **values: Any) -> np.ndarray | xr.DataArray:
        """Return the results of all samples by their inputs, shape (n, ...), dims (sample, ...).

        Raise `InputError` if a sample returns no real numbers, or not the shape and the labels of
        the first one, or if the values are not equally many.
        """
        rows = _Rows(values)
        results: list[np.ndarray | xr.DataArray] = []
        while len(results) < rows.count:
            k = len(results)
            arguments = rows.row(k)
            try:
                result = result_of_one(self.sample(**arguments))
                results.append(_like_first(result, results[0]) if results else result)
            except Exception as error:
                if rows.count > 1:
                    numbers = ", ".join(
                        f"{n} = {v}" for n, v in arguments.items() if not callable(v)
                    )
                    error.add_note(f"in sample {k}: {numbers}")
                raise
        stack = np.stack([np.asarray(result) for result in results])
        first = results[0]
        if isinstance(first, xr.DataArray):
            return xr.DataArray(stack, dims=("sample", *first.dims), coords=first.coords)
        return stack


class _Rows:
    """Values of several samples by sample; functions of position tell their number when called."""

    def __init__(self, values: Mapping[str, Any]):
        self.values = {k: v if callable(v) else np.atleast_1d(v) for k, v in values.items()}
        self.count = 1
        for name, value in self.values.items():
            if not callable(value):
                self._grow(name, value.shape[-1])

    def _grow(self, name: str, count: int) -> None:
        if count != self.count and 1 not in (count, self.count):
            raise InputError(f"{name} has {number_of(count, 'sample')}; others have {self.count}")
        self.count = max(count, self.count)

    def row(self, k: int) -> dict[str, Any]:
        """Return the values of sample k: Python's own numbers and texts, and functions."""
        return {
            name: self._function(name, value, k) if callable(value) else _row_of(value.T, k)
            for name, value in self.values.items()
        }

    def _function(self, name: str, function: Callable, k: int) -> Callable:
        def of_one(x: Any) -> Any:
            values = np.asarray(function(x))
            self._grow(name, len(values))
            return _row_of(values, k)

        return of_one


def _row_of(rows: np.ndarray, k: int) -> Any:
    """Return row `k`, or the only one; a single value as a number or text of Python."""
    row = rows[k if len(rows) > 1 else 0]
    return row.item() if np.ndim(row) == 0 else row


def result_of_one(result: Any) -> np.ndarray | xr.DataArray:
    """Return the result of one sample as an array; raise `InputError` if it is none."""
    allowed = "the function of one sample must return a number, an array or a DataArray"
    if isinstance(result, np.ma.MaskedArray):
        raise InputError(f"{allowed}; got a masked array: fill it first")
    if result is None or callable(result) or isinstance(result, xr.Dataset | Mapping | set | str):
        raise InputError(f"{allowed}; got {value_text(result)}")
    if isinstance(result, xr.DataArray) and "sample" in result.dims:
        if result.sizes["sample"] != 1:
            raise InputError(
                f"{allowed} of this sample; got {number_of(result.sizes['sample'], 'sample')}"
            )
        result = result.isel(sample=0, drop=True)
    try:
        array = result if isinstance(result, xr.DataArray) else np.asarray(result)
    except ValueError as error:
        raise InputError(f"{allowed}; got {value_text(result)}: {error}") from None
    if array.dtype.kind not in "biuf":
        raise InputError(f"{allowed} of real numbers; got {value_text(result)}")
    return array


def _like_first(
    result: np.ndarray | xr.DataArray, first: np.ndarray | xr.DataArray
) -> np.ndarray | xr.DataArray:
    """Return a result in the order of the dims of the first one; refuse other dims and labels."""
    if isinstance(result, xr.DataArray) != isinstance(first, xr.DataArray):
        raise InputError("the samples must return either arrays or DataArrays; got both")
    if isinstance(result, xr.DataArray) and isinstance(first, xr.DataArray):
        if set(result.dims) != set(first.dims):
            raise InputError(
                f"all samples must have the dims of the first one, {first.dims}; got {result.dims}"
            )
        result = result.transpose(*first.dims)
    if result.shape != first.shape:
        raise InputError(
            f"all samples must have the shape of the first one, {first.shape}; got {result.shape}"
        )
    if isinstance(result, xr.DataArray) and isinstance(first, xr.DataArray):
        for name in dict.fromkeys([*first.coords, *result.coords]):
            is_common = name in first.coords and name in result.coords
            if not is_common or not result.coords[name].variable.equals(
                first.coords[name].variable
            ):
                raise InputError(f"coordinate {name!r} must be the same in all samples")
    return result


@dataclass(frozen=True)
class Samplewise(OneByOne):
    """``response(**values)``: call a function once per sample and stack what it returns."""

    function: Callable[..., Any]

    @property
    def __wrapped__(self) -> Callable[..., Any]:
        """The function that reads the arguments."""
        return self.function

    @property
    def __signature__(self) -> inspect.Signature:
        return inspect.signature(self.function)

    def sample(self, **values: Any) -> Any:
        return self.function(**values)


def samplewise(function_of_one: Callable[..., Any]) -> Samplewise:
    """Return a function of one sample as a response, which is called once per sample.

    Parameters
    ----------
    function_of_one : function that takes every input by name, as a plain number or text, or, for a
        field, as a function of positions of shape (points,) that returns as many values. It returns
        a number, an array or a `xarray.DataArray`, of the same shape and with the same labels for
        all samples.

    Raises
    ------
    InputError
        If it is no function.

    Examples
    --------
    >>> import math
    >>> import flexband as fb
    >>> response = fb.models.samplewise(lambda x: math.sin(x) if x > 0 else 0.0)
    >>> response(x=[0.0, math.pi / 2])
    array([0., 1.])
    """
    check_function("function_of_one", function_of_one)
    return Samplewise(function_of_one)
