"""From inputs as a user gives them to inputs that have variables of their own."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexband.errors import InputError, shown
from flexband.uncertainty.inputs.constants import Constant, is_number
from flexband.uncertainty.inputs.correlated import Correlated
from flexband.uncertainty.inputs.distribution import Distribution
from flexband.uncertainty.inputs.distributions.scipy_distribution import as_input
from flexband.uncertainty.inputs.inputs import Input
from flexband.uncertainty.inputs.pbox import PBox


def unfolded(given: Mapping[str, Any]) -> dict[str, Input]:
    """Return all inputs in the order of their names.

    Correlated inputs come one by one, an interval that is a parameter as ``input.parameter``, and a
    number is a constant.

    Raises
    ------
    InputError
        If one is of another kind, or two have the same name.
    """
    if not isinstance(given, Mapping):
        raise InputError(f"inputs must be a dict of names and inputs; got {shown(given)}")
    inputs: dict[str, Input] = {}

    def add(name: str, input_: Input) -> None:
        if name in inputs:
            raise InputError(f"two inputs have the name {name!r}")
        inputs[name] = input_
        for parameter, interval in input_.intervals.items():
            add(f"{name}.{parameter}", interval)

    for name, value in given.items():
        if not isinstance(name, str):
            raise InputError(f"the name of an input must be text; got {name!r}")
        members = value.members if isinstance(value, Correlated) else {name: _as_input(name, value)}
        for member, input_ in members.items():
            add(member, input_)
    return dict(sorted(inputs.items()))


def _as_input(name: str, value: Any) -> Input:
    """Return an input, or a number as a constant."""
    try:
        value = as_input(value)
    except InputError as error:
        raise InputError(f"input {name!r}: {error}") from None
    if is_number(value):
        return Constant(value)
    if not isinstance(value, Input):
        raise InputError(
            f"input {name!r} must be a number, an Interval, a Normal or another distribution, a "
            f"RandomField, Correlated inputs or another Input; got {value!r}"
        )
    return PBox(value) if isinstance(value, Distribution) and value.intervals else value


def in_words(given: Mapping[str, Any]) -> str:
    """Return inputs as a text, in the order of their names."""
    return "; ".join(f"{name} = {value!r}" for name, value in sorted(given.items()))
