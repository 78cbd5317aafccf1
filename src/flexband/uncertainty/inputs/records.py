"""Inputs as records of text and numbers, as a file keeps them.

A record names classes and functions; what it names is looked up among the registered ones.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from flexband.errors import InputError
from flexband.uncertainty.inputs.fields import RandomField
from flexband.uncertainty.inputs.inputs import Input


def recorded(value: Any) -> Any:
    """Return an input, or the value of one of its fields, as a record."""
    if isinstance(value, Input):
        named = {f.name: getattr(value, f.name) for f in fields(value)}  # pyright: ignore[reportArgumentType]
        kind, module = type(value).__name__, type(value).__module__
        return {"input": kind, "module": module, "fields": recorded(tuple(named.items()))}
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, tuple | list):
        return [recorded(one) for one in value]
    if value is None or isinstance(value, str | int | float):
        return value
    for name, correlation in RandomField.correlations.items():
        if value is correlation:
            return {"correlation": name}
    raise InputError(
        f"{value!r} cannot be saved; fields of inputs may be numbers, texts, tuples, inputs, None "
        f"and the correlations {', '.join(RandomField.correlations)}"
    )


def restored(record: Any) -> Any:
    """Return the value of a record; lists become tuples."""
    if isinstance(record, list):
        return tuple(restored(one) for one in record)
    if not isinstance(record, Mapping):
        return record
    if "correlation" in record:
        name = record["correlation"]
        if name not in RandomField.correlations:
            raise InputError(f"the correlation {name!r} must be in RandomField.correlations first")
        return RandomField.correlations[name]
    if record["input"] not in Input.kinds:
        raise InputError(
            f"the input {record['input']} must be defined first; import it from {record['module']}"
        )
    return Input.kinds[record["input"]](**dict(restored(record["fields"])))
