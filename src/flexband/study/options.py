"""Methods by name, and their options: the numeric fields of their dataclasses."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from typing import Any, get_args, get_type_hints

from flexband.errors import InputError
from flexband.uncertainty.methods import Method


@dataclass
class Option:
    """A number that one or more methods take.

    Attributes
    ----------
    kind : bool, int or float.
    defaults : name of a method -> the default value of this method.
    """

    kind: type
    defaults: dict[str, Any] = field(default_factory=dict)


def method_classes(public: Iterable[object]) -> dict[str, Any]:
    """Return the classes with a method `solve`, by name: PhaseResolvedPCCI as phase-resolved-pcci.

    Parameters
    ----------
    public : classes and other objects.
    """
    words = r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])"
    return {
        re.sub(words, "-", one.__name__).lower(): one
        for one in public
        if isinstance(one, type) and callable(getattr(one, "solve", None))
    }


def method_options(methods: Mapping[str, type]) -> dict[str, Option]:
    """Return every field of the methods that is, or can be, a number.

    Parameters
    ----------
    methods : name -> dataclass.
    """
    options: dict[str, Option] = {}
    for name, method in methods.items():
        hints = get_type_hints(method)
        for one in fields(method):
            allowed = get_args(hints[one.name]) or (hints[one.name],)
            kind = next((kind for kind in allowed if kind in (bool, int, float)), None)
            if kind:
                options.setdefault(one.name, Option(kind)).defaults[name] = one.default
    return options


def with_options(method: Method, values: Mapping[str, object]) -> Method:
    """Return the method with other values of some fields; None keeps the value of the method.

    Raises
    ------
    InputError
        If the method does not have a field of this name.
    """
    given = {name: value for name, value in values.items() if value is not None}
    known = [one.name for one in fields(method)] if is_dataclass(method) else []
    for name in given:
        if name not in known:
            allowed = ", ".join(map(flag, known)) or "none"
            raise InputError(f"options of {method.name} are {allowed}; got {flag(name)}")
    return replace(method, **given) if given else method  # type: ignore[type-var]


def flag(name: str) -> str:
    """Return the name of a field as on the command line: --random-order."""
    return f"--{name.replace('_', '-')}"
