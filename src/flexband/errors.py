"""Exceptions, warnings, and checks that refuse bad input where it enters."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike


class InputError(ValueError):
    """An invalid argument; the message states its name, its value and what is allowed."""


class FlexbandWarning(UserWarning):
    """A result or an input that is likely not what was meant; the message states why."""


class RunError(RuntimeError):
    """Some runs failed; the message states the inputs, the time and the reason of each.

    Attributes
    ----------
    failures : dict
        Number of the sample in the batch -> (time [s], reason).
    """

    def __init__(self, message: str, failures: dict[int, tuple[float, str]]):
        super().__init__(message)
        self.failures = failures


class AssemblyError(RunError):
    """The constraints cannot be satisfied, or do not determine their multipliers."""


class SimulationError(RunError):
    """Some runs diverged during the integration."""


def warn(message: str) -> None:
    """Issue a `FlexbandWarning` that points to the line of the caller outside this package."""
    package = str(Path(__file__).parent)
    frame, level = sys._getframe(1), 2
    while frame.f_back is not None and frame.f_code.co_filename.startswith(package):
        frame, level = frame.f_back, level + 1
    warnings.warn(message, FlexbandWarning, stacklevel=level)


def finite(name: str, value: ArrayLike, allowed: str = "finite numbers") -> np.ndarray:
    """Return `value` as an array of floats; raise `InputError` if one is not finite."""
    if callable(value):
        raise InputError(f"{name} must be {allowed}; got a function")
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{name} must be {allowed}; got {value!r}") from None
    _refuse(name, array, ~np.isfinite(array), allowed)
    return array


def numbers(name: str, value: ArrayLike, count: int = 1) -> np.ndarray:
    """Return `count` finite numbers, shape (count,) or () if one; else raise `InputError`."""
    array = finite(name, value)
    if array.shape != (() if count == 1 else (count,)):
        raise InputError(f"{name} must be {count} number{'s' * (count > 1)}; got {value!r}")
    return array


def positive(name: str, value: ArrayLike) -> np.ndarray:
    """Return `value` as an array of floats; raise `InputError` if one is not positive."""
    return _within(name, value, "positive", lambda x: x <= 0)


def non_negative(name: str, value: ArrayLike) -> np.ndarray:
    """Return `value` as an array of floats; raise `InputError` if one is negative."""
    return _within(name, value, "zero or positive", lambda x: x < 0)


def poissons_ratio(name: str, value: ArrayLike) -> np.ndarray:
    """Return `value` as an array of floats; raise `InputError` if one is outside (−1, 0.5)."""
    return _within(name, value, "above -1 and below 0.5", lambda x: (x <= -1) | (x >= 0.5))


def whole(name: str, value: object, least: int, most: int | None = None) -> int:
    """Return `value` as an int; raise `InputError` if it is not a whole number in this range."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | np.integer):
        raise InputError(f"{name} must be a whole number, {least} or more; got {value!r}")
    if value < least:
        raise InputError(f"{name} must be {least} or more; got {value}")
    if most is not None and value > most:
        raise InputError(f"{name} must be {most} or less; got {value}")
    return int(value)


def known(name: str, value: str, allowed: Iterable[str]) -> None:
    """Raise `InputError` if `value` is not one of the names `allowed`."""
    allowed = list(allowed)
    if value not in allowed:
        quoted = [repr(option) for option in allowed]
        options = [", ".join(quoted[:-1]), quoted[-1]] if len(quoted) > 1 else quoted or ["nothing"]
        raise InputError(f"{name} must be {' or '.join(options)}; got {value!r}")


def _within(
    name: str, value: ArrayLike, allowed: str, bad: Callable[[np.ndarray], np.ndarray]
) -> np.ndarray:
    array = finite(name, value, allowed)
    _refuse(name, array, bad(array), allowed)
    return array


def _refuse(name: str, array: np.ndarray, bad: np.ndarray, allowed: str) -> None:
    if np.any(bad):
        first = np.argwhere(bad)[0]
        where = f" (sample {first[0]})" if array.ndim else ""
        raise InputError(f"{name} must be {allowed}; got {array[tuple(first)]:g}{where}")
