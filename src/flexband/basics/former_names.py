"""Former names of functions and arguments, which work for one release and warn of the new ones."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar

from flexband.basics.arguments import ArgumentError
from flexband.basics.warning import warn
from flexband.errors import FormerNameWarning

Target = TypeVar("Target", bound=Callable)


def warn_of_former_name(former: str, new: str) -> None:
    """Warn that a name has a new one."""
    warn(
        f"{former} is now called {new}; the former name works until the next release",
        FormerNameWarning,
        remarks=(),  # it is about the program, and belongs to no result
    )


def former_arguments(**new_names: str) -> Callable[[Target], Target]:
    """Return a decorator of a function or class whose keyword arguments had other names before.

    Parameters
    ----------
    new_names : the new name of each argument by its former one.
    """

    def decorate(target: Any) -> Any:
        if inspect.isclass(target):
            target.__init__ = _with_former_arguments(  # type: ignore[misc]
                target.__init__, target.__name__, new_names
            )
            return target
        return _with_former_arguments(target, target.__name__, new_names)

    return decorate


def _with_former_arguments(function: Any, label: str, new_names: dict[str, str]) -> Any:
    @wraps(function)
    def call_with_new_names(*positional: Any, **keywords: Any) -> Any:
        for former in new_names.keys() & keywords.keys():
            new = new_names[former]
            if new in keywords:
                raise ArgumentError(
                    f"{label}: {former} is the former name of {new}; give {new} alone"
                )
            warn_of_former_name(f"{label}({former}=…)", f"{label}({new}=…)")
            keywords[new] = keywords.pop(former)
        return function(*positional, **keywords)

    return call_with_new_names
