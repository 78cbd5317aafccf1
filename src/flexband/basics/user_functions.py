"""What functions of a user return, and what messages call these functions."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from flexband.basics.checks import as_floats
from flexband.basics.words import value_text
from flexband.errors import InputError


def function_text(function: Callable) -> str:
    """Return how messages name a user's function."""
    return f"the function {function_name(function)!r}"


def function_name(function: Callable) -> str:
    """Return the name of a function, or the class of an object that can be called."""
    return getattr(function, "__qualname__", type(function).__name__)


def evaluate_function(function: Callable, argument: Any, name: str = "") -> Any:
    """Return the numbers that a user's function returns, see `evaluate_function_each`."""
    return evaluate_function_each(function, [argument], name)[0]


def evaluate_function_each(
    function: Callable, arguments: Iterable[Any], name: str = ""
) -> list[Any]:
    """Return the numbers that a user's function returns for each of many arguments.

    They may be infinite or NaN. `name` is that of the function's values, for messages. Raise
    `InputError` if the function raises an error.
    """
    values = []
    for argument in arguments:
        try:
            value = function(argument)
        except InputError:
            raise
        except Exception as error:
            where = f"at {value_text(argument)}: {type(error).__name__}: {error}"
            raise InputError(
                f"{name or function_text(function)} raised an error {where}"
            ) from error
        values.append(
            value if isinstance(value, float) else _numbers(value, function, argument, name)
        )
    return values


def _numbers(value: Any, function: Callable, argument: Any, name: str) -> np.ndarray:
    if type(value) is np.ndarray and value.dtype == float:
        return value.copy()  # at once: the text of the argument may take long
    return as_floats(
        f"{name or function_text(function)} at {value_text(argument)}",
        value,
        "numbers",
        lists=False,
    )
