"""Functions of one sample that are given as responses by mistake: recognized, with what helps."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from flexband.basics.progress import RunListener, add_listener
from flexband.basics.response import Response
from flexband.basics.warning import without_warnings
from flexband.errors import InputError, RunError
from flexband.uncertainty.inputs.inputs import FunctionOfPosition

Arguments = Mapping[str, np.ndarray | FunctionOfPosition]
Plain = float | str | np.ndarray
Sample = Plain | FunctionOfPosition | Callable[[np.ndarray], Plain]

COPIES = 5
"""Samples of a call that a vectorized response returns as many values for."""


def of_one_sample(response: Response, arguments: Arguments, error: Exception) -> InputError | None:
    """Return an error with the line that helps if a response is a function of one sample.

    It is one if it fails with arrays of several equal samples, or does not return as many values,
    and returns numbers for the plain numbers of one of them. `error` is what a call with these
    arguments raised, or what is wrong with its values.
    """
    if response.one_by_one or not _of_response(error):
        return None
    counts = [np.shape(value)[-1] for value in arguments.values() if not callable(value)]
    middle = max(counts, default=1) // 2
    shape = _shape_of_result(response, {k: _copies(v, middle) for k, v in arguments.items()})
    if shape and shape[0] == COPIES:
        return None
    if (
        _shape_of_result(response, {k: _select_sample(v, middle) for k, v in arguments.items()})
        is None
    ):
        return None
    reason = str(error) if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
    input_error = InputError(
        "the response must take arrays of shape (n,), one value per sample. This one takes the "
        f"numbers of one sample only (with arrays: {reason}). To call it once per sample, write\n"
        "    response = fb.models.samplewise(response)"
    )
    input_error.__cause__ = error
    return input_error


def _of_response(error: Exception) -> bool:
    """Return whether a response raised an error itself, so that it ended in time and by itself."""
    if isinstance(error, RunError | TimeoutError):
        return False
    has_traceback = error.__traceback__ is not None or "__notes__" in vars(error)
    return has_traceback or isinstance(error, InputError)


def _shape_of_result(response: Response, arguments: Mapping[str, Sample]) -> tuple[int, ...] | None:
    """Return the shape of what a response returns; None if it fails or returns no real numbers."""
    try:
        with warnings.catch_warnings(), without_warnings(), add_listener(RunListener()):
            warnings.simplefilter("ignore")
            result = response(**arguments)
            if result is None or isinstance(result, Mapping | xr.Dataset):
                return None
            array = np.asarray(result)
    except (Exception, SystemExit):  # whatever a user's function raises
        return None
    return array.shape if array.dtype.kind in "biuf" else None


def _copies(value: np.ndarray | FunctionOfPosition, k: int) -> np.ndarray | FunctionOfPosition:
    if callable(value):  # at positions of each copy, which are equal, or of all of them
        return lambda x: np.repeat(_row(value(x[:1] if np.ndim(x) == 2 else x), k)[None], COPIES, 0)
    return np.repeat(value[..., k : k + 1], COPIES, axis=-1)


def _select_sample(value: np.ndarray | FunctionOfPosition, k: int) -> Sample:
    """Select sample k: a number or text of Python, or a function of positions."""
    if callable(value):
        return lambda x: _plain(_row(value(x), k))
    return _plain(value[..., k])


def _row(values: ArrayLike, k: int) -> np.ndarray:
    rows = np.asarray(values)
    return rows[min(k, len(rows) - 1)]


def _plain(value: np.ndarray) -> Plain:
    return value.item() if np.ndim(value) == 0 else value
