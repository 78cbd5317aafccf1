"""Misspelled arguments of public classes: the error tells the nearest name."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from difflib import get_close_matches
from functools import wraps
from typing import Any

from flexband.errors import InputError


class ArgumentError(InputError, TypeError):
    """A name that is none of the arguments; the message states the nearest one, or all."""


def tell_nearest_arguments(cls: type) -> None:
    """Have a class, and its functions, tell the nearest name where an argument is misspelled.

    Parameters
    ----------
    cls : which is changed; an exception is not.
    """
    if issubclass(cls, BaseException):
        return
    for name, one in list(vars(cls).items()):
        if name == "__init__" and inspect.isfunction(one):
            setattr(cls, name, _telling(one, cls.__name__))
        elif isinstance(one, classmethod | staticmethod) and not name.startswith("_"):
            setattr(cls, name, type(one)(_telling(one.__func__, f"{cls.__name__}.{name}")))


def _telling(function: Callable, label: str) -> Callable:
    """Return a function that raises `ArgumentError` where it does not have an argument."""
    parameters = inspect.signature(function).parameters.values()
    names = [one.name for one in parameters if one.name not in ("self", "cls")]
    passes_on = any(one.kind is one.VAR_KEYWORD for one in parameters)
    needed = [
        one.name for one in parameters if one.kind is one.KEYWORD_ONLY and one.default is one.empty
    ]

    @wraps(function)
    def telling(*given: Any, **named: Any) -> Any:
        for name in (one for one in named if one not in names):
            possible = [own for own in (needed if passes_on else names) if own not in named]
            near = get_close_matches(name, possible, 1)
            if near or not passes_on:
                hint = f"did you mean {near[0]!r}?" if near else f"there are {', '.join(names)}"
                raise ArgumentError(f"{label} has no argument {name!r}; {hint}")
        return function(*given, **named)

    return telling
