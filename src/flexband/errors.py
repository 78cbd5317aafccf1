"""What can go wrong, and the checks that refuse bad input where it enters."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import ArrayLike


class InputError(ValueError):
    """A value that makes no sense; the message names it, gives it and says what is allowed."""


class RunError(RuntimeError):
    """Runs that failed; the message gives the inputs, the time and the reason of each.

    Attributes
    ----------
    failures : dict
        Sample number in the batch -> (time [s], reason).
    """

    def __init__(self, message: str, failures: dict[int, tuple[float, str]]):
        super().__init__(message)
        self.failures = failures


class AssemblyError(RunError):
    """A mechanism whose constraints cannot be met or do not determine their multipliers."""


class SimulationError(RunError):
    """Runs that diverged on the way."""


def finite(name: str, value: ArrayLike, allowed: str = "finite numbers") -> np.ndarray:
    """Return `value` as floats; raise `InputError` where it is not a finite number."""
    if callable(value):
        raise InputError(f"{name} must be {allowed}; got a function")
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{name} must be {allowed}; got {value!r}") from None
    _refuse(name, array, ~np.isfinite(array), allowed)
    return array


def numbers(name: str, value: ArrayLike, count: int = 1) -> np.ndarray:
    """Return exactly `count` finite numbers; raise `InputError` for any other shape."""
    array = finite(name, value)
    if array.shape != (() if count == 1 else (count,)):
        raise InputError(f"{name} must be {count} number{'s' * (count > 1)}; got {value!r}")
    return array


def positive(name: str, value: ArrayLike) -> np.ndarray:
    """Return `value` as floats; raise `InputError` where it is not above zero."""
    return _within(name, value, "positive", lambda x: x <= 0)


def non_negative(name: str, value: ArrayLike) -> np.ndarray:
    """Return `value` as floats; raise `InputError` where it is below zero."""
    return _within(name, value, "zero or positive", lambda x: x < 0)


def poissons_ratio(name: str, value: ArrayLike) -> np.ndarray:
    """Return `value` as floats; raise `InputError` outside the open interval (−1, 0.5)."""
    return _within(name, value, "above -1 and below 0.5", lambda x: (x <= -1) | (x >= 0.5))


def whole(name: str, value: object, least: int, most: int | None = None) -> int:
    """Return `value` as an int; raise `InputError` where it is no whole number in this range."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | np.integer):
        raise InputError(f"{name} must be a whole number, {least} or more; got {value!r}")
    if value < least:
        raise InputError(f"{name} must be {least} or more; got {value}")
    if most is not None and value > most:
        raise InputError(f"{name} must be {most} or less; got {value}")
    return int(value)


def known(name: str, value: str, allowed: Iterable[str]) -> None:
    """Raise `InputError` where `value` is not one of the names `allowed`."""
    allowed = list(allowed)
    if value not in allowed:
        raise InputError(f"{name} {value!r} is unknown; there is {', '.join(allowed) or 'none'}")


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
