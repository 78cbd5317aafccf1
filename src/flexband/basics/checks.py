"""Checks that refuse bad input where it enters, by its name and value."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.warning import warn
from flexband.basics.words import number_of, number_text, value_text, with_article
from flexband.errors import InputError

SMALL_SPREAD = 1e-9
"""Relative spread of an input below which runs show rounding only."""


def check_finite(
    name: str, value: ArrayLike, allowed: str = "finite numbers", *, rank: int | None = 1
) -> np.ndarray:
    """Return `value` as an array of floats; raise `InputError` if it is not finite real numbers.

    Text, bytes, dates, booleans, complex and masked numbers and objects are none. The message says
    what the value is, `name`, and must be, `allowed`. The rank is 1 for a number or one number per
    sample, shape (n,); 2 for (n, points) as well; None for numbers of any shape, which may also be
    lists.
    """
    array = as_floats(name, value, allowed, lists=rank is None)
    if array.size == 0:
        raise InputError(f"{name} must be {allowed}; got an array without numbers")
    if rank is not None and array.ndim > rank:
        shapes = "a number or one number per sample, shape (n,)"
        raise InputError(f"{name} must be {shapes}; got shape {array.shape}")
    _refuse(name, array, ~np.isfinite(array), allowed)
    return array


def check_each_finite(name: str, values: Iterable[ArrayLike]) -> None:
    """Raise `InputError` as `check_finite` does for one of many values."""
    all_values = list(values)
    usual = all(
        type(v) is np.ndarray and v.dtype == float and v.size and v.ndim < 2 for v in all_values
    )
    if not (
        usual and all_values and np.isfinite(np.concatenate([*map(np.ravel, all_values)])).all()
    ):
        for value in all_values:
            check_finite(name, value)


def check_numbers(name: str, value: ArrayLike, count: int = 1) -> np.ndarray:
    """Return `count` finite numbers, shape (count,) or () if one; else raise `InputError`."""
    array = check_finite(name, value, rank=None)
    if array.shape != (() if count == 1 else (count,)):
        raise InputError(f"{name} must be {number_of(count, 'number')}; got {number_text(value)}")
    return array


def check_fraction(name: str, value: ArrayLike) -> float:
    """Return a number between 0 and 1, ends excluded; else raise `InputError`."""
    fraction = float(check_numbers(name, value))
    if not 0 < fraction < 1:
        raise InputError(f"{name} must be above 0 and below 1; got {fraction:g}")
    return fraction


def check_pair(name: str, value: object) -> list | tuple:
    """Return a list or a tuple of two; else raise `InputError`."""
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise InputError(f"{name} must be a pair; got {value_text(value)}")
    return value


def check_positive(name: str, value: ArrayLike, *, rank: int | None = 1) -> np.ndarray:
    """Return `value` as an array of floats; raise `InputError` if one is not positive."""
    return _within(name, value, "positive", lambda x: x <= 0, rank)


def check_non_negative(name: str, value: ArrayLike, *, rank: int | None = 1) -> np.ndarray:
    """Return `value` as an array of floats; raise `InputError` if one is negative."""
    return _within(name, value, "zero or positive", lambda x: x < 0, rank)


def check_poissons_ratio(name: str, value: ArrayLike, *, rank: int | None = 1) -> np.ndarray:
    """Return `value` as an array of floats; raise `InputError` if one is outside (−1, 0.5)."""
    return _within(name, value, "above -1 and below 0.5", lambda x: (x <= -1) | (x >= 0.5), rank)


def check_angle(name: str, value: ArrayLike, turns: float = 2.0) -> np.ndarray:
    """Return finite numbers; warn if they are so many `turns` or more that they may be degrees."""
    array = check_finite(f"{name} [rad]", value)
    largest = float(np.abs(array).max())
    if largest > 2 * np.pi * turns * (1 + 1e-9):
        warn(
            f"{name} is {largest:g} rad, which is {largest / (2 * np.pi):.3g} turns; is it degrees?"
        )
    return array


def check_spread(name: str, spread: float, size: float) -> None:
    """Warn if a spread is so small, compared with the value, that runs do not resolve it."""
    if spread < SMALL_SPREAD * abs(size):
        warn(f"{name} is {spread:g}, which is {spread / abs(size):.1g} of the value {size:g}")


def check_integer(
    name: str, value: object, minimum: int, maximum: int | None = None, *, or_zero: bool = False
) -> int:
    """Return `value` as an int; raise `InputError` if it is not a whole number in this range.

    `or_zero` is whether 0 is allowed besides, for none.
    """
    allowed = f"{('0, or ' if or_zero else '')}{minimum} or more"
    if isinstance(value, bool | np.timedelta64) or not isinstance(value, int | np.integer):
        raise InputError(f"{name} must be a whole number, {allowed}; got {number_text(value)}")
    if value < minimum and not (or_zero and value == 0):
        raise InputError(f"{name} must be {allowed}; got {value_text(value)}")
    if maximum is not None and value > maximum:
        raise InputError(f"{name} must be {maximum} or less; got {value_text(value)}")
    return int(value)


def check_same_samples(name: str, *values: ArrayLike) -> None:
    """Raise `InputError` if checked numbers, each one or one per sample, are not equally many."""
    counts = sorted({int(np.size(value)) for value in values} - {1})
    if len(counts) > 1:
        raise InputError(f"{name}: parameters have different numbers of samples: {counts}")


def check_flag(name: str, value: object) -> bool:
    """Return `value` as a bool; raise `InputError` if it is neither True nor False."""
    if not isinstance(value, bool | np.bool_):
        raise InputError(f"{name} must be True or False; got {value_text(value)}")
    return bool(value)


def check_option(name: str, value: object, allowed: Iterable[str]) -> None:
    """Raise `InputError` if `value` is not one of the names `allowed`."""
    allowed = list(allowed)
    if not isinstance(value, str) or value not in allowed:
        quoted = [repr(option) for option in allowed]
        options = [", ".join(quoted[:-1]), quoted[-1]] if len(quoted) > 1 else quoted or ["nothing"]
        raise InputError(f"{name} must be {' or '.join(options)}; got {value_text(value)}")


def check_instance(name: str, value: object, kind: Any, example: str = "") -> None:
    """Raise `InputError` if `value` is not of a class."""
    if not isinstance(value, kind):
        allowed = example or with_article(kind.__name__)
        raise InputError(f"{name} must be {allowed}; got {value_text(value)}")


def check_function(name: str, value: object, of: str = "") -> None:
    """Raise `InputError` if `value` cannot be called, or is a class."""
    if not callable(value) or isinstance(value, type):
        raise InputError(f"{name} must be a function{of}; got {value_text(value)}")


def check_arguments(name: str, function: Callable, *arguments: str) -> None:
    """Raise `InputError` if a value is no function of these arguments, as far as that is known."""
    check_function(name, function)
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):  # some functions of C state none
        return
    try:
        signature.bind(*arguments)
    except TypeError:
        call = f"{name}({', '.join(arguments)})"
        raise InputError(f"{name} is called as {call}; got {value_text(function)}") from None


def check_affordable(name: str, count: float) -> None:
    """Raise `InputError` if so many numbers do not fit into the memory that is free."""
    memory = 8.0 * count
    available_memory = free_memory()
    if memory > available_memory:
        raise InputError(
            f"{name} would take {memory / 1e9:.3g} GB of memory; "
            f"{available_memory / 1e9:.3g} GB are free"
        )


def free_memory() -> float:
    """Return the memory that this process may still take [bytes], as far as it can be known."""
    limits = [64e9]  # where the system does not tell
    with suppress(OSError, ValueError, StopIteration):
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        line = next(line for line in lines if line.startswith("MemAvailable:"))
        limits.append(1024.0 * int(line.split()[1]))
    with suppress(OSError, ValueError):
        group = Path("/sys/fs/cgroup")
        limit, usage = (
            float((group / name).read_text(encoding="ascii"))
            for name in ("memory.max", "memory.current")
        )
        limits.append(limit - usage)
    return max(0.0, min(limits))


def as_floats(name: str, value: ArrayLike, allowed: str, *, lists: bool) -> np.ndarray:
    """Return `value` as an array of floats, which may be infinite or NaN."""
    if isinstance(value, float):
        return np.asarray(float(value))
    if type(value) is np.ndarray and value.dtype == float:
        return value.copy()
    if callable(value):
        raise InputError(f"{name} must be {allowed}; got a function")
    if isinstance(value, list | tuple) and not lists:
        raise InputError(
            f"{name} must be {allowed}; got the {type(value).__name__} {value_text(value)}. "
            "Several "
            "values, one per sample, are given as np.array([...])"
        )
    if isinstance(value, np.ma.MaskedArray):
        raise InputError(f"{name} must be {allowed}; got a masked array")
    try:
        plain = float(value) if type(value) is int else value
        array = np.asarray(plain)
        if array.dtype.kind not in "iuf":
            raise TypeError
        return array.astype(float)
    except Exception:  # whatever an object raises that is asked for its numbers
        raise InputError(f"{name} must be {allowed}; got {number_text(value)}") from None


def _within(
    name: str,
    value: ArrayLike,
    allowed: str,
    bad: Callable[[np.ndarray], np.ndarray],
    rank: int | None,
) -> np.ndarray:
    array = check_finite(name, value, allowed, rank=rank)
    _refuse(name, array, bad(array), allowed)
    return array


def _refuse(name: str, array: np.ndarray, bad: np.ndarray, allowed: str) -> None:
    if bad.any():
        first = np.argwhere(bad)[0]
        where = f" (sample {first[0]})" if array.ndim else ""
        raise InputError(f"{name} must be {allowed}; got {array[tuple(first)]:g}{where}")
