"""Arguments of public classes: where one is misspelled, the error names the nearest one.

Mappings among them are kept as `Fixed` ones, so that what was checked stays as it is.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import wraps
from typing import Any, TypeVar, dataclass_transform

from flexband.errors import InputError

Class = TypeVar("Class", bound=type)
Value = TypeVar("Value")


class ArgumentError(InputError, TypeError):
    """A name that is none of the arguments; the message states the nearest one, or all."""


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def frozen(**options: Any) -> Callable[[Class], Class]:
    """Return a decorator that makes a frozen dataclass whose `arguments_checked`.

    The options are those of `dataclasses.dataclass`.
    """

    def decorate(cls: Class) -> Class:
        return arguments_checked(dataclass(frozen=True, **options)(cls))

    return decorate


def arguments_checked(cls: Class) -> Class:
    """Have a class, and its functions, name the nearest argument where one is misspelled."""
    for name, member in list(vars(cls).items()):
        if name == "__init__":
            setattr(cls, name, _check_arguments(member, cls.__name__))
        elif isinstance(member, classmethod | staticmethod) and not name.startswith("_"):
            label = f"{cls.__name__}.{name}"
            setattr(cls, name, type(member)(_check_arguments(member.__func__, label)))
    return cls


def _check_arguments(function: Any, label: str) -> Callable:
    """Wrap a function so that arguments that it does not have raise `ArgumentError`."""
    code = function.__code__
    count = code.co_argcount + code.co_kwonlyargcount
    names = set(code.co_varnames[:count])
    passes_on = bool(code.co_flags & inspect.CO_VARKEYWORDS)

    @wraps(function)
    def check_and_call(*positional: Any, **keywords: Any) -> Any:
        for name in keywords.keys() - names:
            possible = _names(function, only_needed=passes_on)
            matches = get_close_matches(
                name, [candidate for candidate in possible if candidate not in keywords], 1
            )
            if matches or not passes_on:
                hint = (
                    f"did you mean {matches[0]!r}?"
                    if matches
                    else f"there are {', '.join(possible)}"
                )
                raise ArgumentError(f"{label} has no argument {name!r}; {hint}")
        return function(*positional, **keywords)

    return check_and_call


def _names(function: Callable, *, only_needed: bool) -> list[str]:
    """Return the arguments of a function, or the keyword arguments without a default."""
    parameters = inspect.signature(function).parameters.values()
    if only_needed:
        return [p.name for p in parameters if p.kind is p.KEYWORD_ONLY and p.default is p.empty]
    return [p.name for p in parameters if p.name not in ("self", "cls")]


class Fixed(Mapping[str, Value]):
    """A mapping that cannot be changed."""

    def __init__(self, values: Mapping[str, Value]):
        self._values = dict(values)

    def __getitem__(self, name: str) -> Value:
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __repr__(self) -> str:
        return repr(self._values)
