"""Variables of an FMU: which can be set and recorded, and to which values."""

from __future__ import annotations

from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

import numpy as np

from flexband.basics.words import value_text
from flexband.errors import InputError

if TYPE_CHECKING:
    from fmpy import model_description as fmi  # pyright: ignore[reportMissingImports]

    Assignments = dict[str, tuple[fmi.ScalarVariable, float | str]]

NOT_SCALAR = ("Binary", "Clock")
"""Types of variables that are neither numbers nor texts."""


def recorded_variables(
    description: fmi.ModelDescription, names: list[str] | None
) -> list[fmi.ScalarVariable]:
    """Return the scalar numbers of these names, or all outputs; raise `InputError` for others."""
    possible = {v.name: v for v in description.modelVariables if _is_number(v)}
    if names is None:
        names = [name for name, v in possible.items() if v.causality == "output"]
    if not names or len(set(names)) < len(names):
        raise InputError(
            f"FMU outputs must be one or more different variables; got {value_text(names)}"
        )
    return [_find_variable(possible, name, "outputs must be numbers of the FMU") for name in names]


def assigned_variables(description: fmi.ModelDescription, values: dict[str, Any]) -> Assignments:
    """Return the variables to be set and their values; raise `InputError` if they cannot be."""
    possible = {v.name: v for v in description.modelVariables if _refusal(v) == ""}
    all_variables = {v.name: v for v in description.modelVariables}
    assignments: Assignments = {}
    for name, value in values.items():
        if name in all_variables and name not in possible:
            raise InputError(
                f"{name} cannot be set in this FMU: it is {_refusal(all_variables[name])}"
            )
        variable = _find_variable(
            possible, name, "inputs must be variables of the FMU that can be set"
        )
        for other, (earlier_variable, _) in assignments.items():
            if (earlier_variable.valueReference, earlier_variable.type) == (
                variable.valueReference,
                variable.type,
            ):
                raise InputError(f"{other} and {name} are the same variable of the FMU")
        assignments[name] = variable, _convert(variable, value)
    return assignments


def access(description: fmi.ModelDescription, variable: fmi.ScalarVariable) -> str:
    """Return the name of the type in FMPy's functions that get and set a variable."""
    if variable.type == "Enumeration":
        return "Integer" if description.fmiVersion == "2.0" else "Int64"
    return variable.type


def unit(variable: fmi.ScalarVariable) -> str:
    """Return the unit of a variable; "" if it has none."""
    declared = getattr(variable.declaredType, "unit", None)
    return variable.unit or declared or ""


def differs(value: float | str, actual_value: Any, rounding: float = 1e-6) -> bool:
    """Return whether a value is not that given, beyond rounding of single precision."""
    if isinstance(value, str):
        return value != (actual_value.decode() if isinstance(actual_value, bytes) else actual_value)
    return abs(actual_value - value) > rounding * abs(value)


def _find_variable(
    possible: dict[str, fmi.ScalarVariable], name: str, rule: str, max_names: int = 20
) -> fmi.ScalarVariable:
    if name in possible:
        return possible[name]
    close = get_close_matches(str(name), possible, n=3)
    names = [*close, *(candidate for candidate in possible if candidate not in close)]
    remainder = f" and {len(names) - max_names} more" if len(names) > max_names else ""
    listed = ", ".join(names[:max_names]) or "nothing"
    raise InputError(f"{rule}: {listed}{remainder}; got {name!r}")


def _is_number(variable: fmi.ScalarVariable) -> bool:
    return not variable.shape and variable.type not in ("String", *NOT_SCALAR)


def _refusal(variable: fmi.ScalarVariable) -> str:
    """Return why a variable cannot be set before the simulation; "" if it can."""
    if variable.shape or variable.type in NOT_SCALAR:
        return "an array" if variable.shape else f"a {variable.type}"
    if variable.variability == "constant":
        return "a constant"
    if variable.causality in ("calculatedParameter", "independent", "structuralParameter"):
        return f"of causality {variable.causality}"
    if variable.causality != "input" and variable.initial not in ("exact", "approx"):
        return f"a variable of causality {variable.causality} whose start is calculated"
    return ""


def _convert(variable: fmi.ScalarVariable, value: Any) -> float | str:
    """Return a value as a variable's type needs it."""
    name = variable.name
    if callable(value):
        raise InputError(f"{name} must be a number for an FMU; got a function of position")
    if variable.type == "String":
        if not isinstance(value, str):
            raise InputError(f"{name} must be a text for this FMU; got {value_text(value)}")
        return value
    if isinstance(value, str) or not np.isfinite(value):
        raise InputError(f"{name} must be a finite number for this FMU; got {value_text(value)}")
    if variable.type == "Boolean":
        if value not in (0, 1):
            raise InputError(f"{name} must be 0 or 1 for this FMU; got {value_text(value)}")
        return bool(value)
    # Numbers must be within the limits that the FMU states.
    for limit, outside in (("min", value.__lt__), ("max", value.__gt__)):
        bound = getattr(variable, limit)
        if bound is not None and outside(float(bound)) is True:
            raise InputError(f"{name} has the {limit} {bound} in this FMU; got {value_text(value)}")
    if variable.type in ("Real", "Float64", "Float32"):
        return float(value)
    if value != int(value):
        raise InputError(f"{name} must be a whole number for this FMU; got {value_text(value)}")
    return int(value)
