"""Methods by name, and their options: the numeric fields of their dataclasses."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any, get_args, get_type_hints

from flexband.errors import InputError
from flexband.uncertainty.methods.method import Method


def method_classes(public: Iterable[object]) -> dict[str, Any]:
    """Return the classes with a method `solve`: PhaseResolvedPCCI as "phase-resolved-pcci"."""
    words = r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])"
    return {
        re.sub(words, "-", candidate.__name__).lower(): candidate
        for candidate in public
        if isinstance(candidate, type) and callable(getattr(candidate, "solve", None))
    }


def method_options(methods: Mapping[str, type]) -> dict[str, tuple[type, dict[str, Any]]]:
    """Return every field of the methods that is, or can be, a number, by its name.

    Each has a type, bool, int or float, and the default value of each method that has the field.
    """
    options: dict[str, tuple[type, dict[str, Any]]] = {}
    for name, method in methods.items():
        hints = get_type_hints(method)
        for field in fields(method):
            allowed = get_args(hints[field.name]) or (hints[field.name],)
            for kind in [kind for kind in allowed if kind in (bool, int, float)][:1]:
                options.setdefault(field.name, (kind, {}))[1][name] = field.default
    return options


def with_options(method: Method, values: Mapping[str, object]) -> Method:
    """Return the method with other values of some fields; None keeps the value of the method.

    Raise `InputError` if the method does not have a field of this name.
    """
    new_values = {name: value for name, value in values.items() if value is not None}
    field_names = [field.name for field in fields(method)] if is_dataclass(method) else []
    for name in new_values:
        if name not in field_names:
            allowed, requested = (
                f"--{', --'.join(names)}".replace("_", "-") for names in (field_names, [name])
            )
            raise InputError(
                f"options of {method.name} are {allowed if field_names else 'none'}; "
                f"got {requested}"
            )
    return replace(method, **new_values) if new_values else method  # type: ignore[type-var]
