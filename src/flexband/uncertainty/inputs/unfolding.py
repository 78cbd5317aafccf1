"""From inputs as a user gives them to inputs that have variables of their own."""

from __future__ import annotations

import re
from collections.abc import Mapping
from itertools import product

import numpy as np

from flexband.basics.checks import check_instance
from flexband.basics.words import number_of, value_text
from flexband.errors import InputError
from flexband.uncertainty.inputs.choices import Choice
from flexband.uncertainty.inputs.constants import Constant, is_number
from flexband.uncertainty.inputs.correlated import Correlated
from flexband.uncertainty.inputs.distribution import Distribution, FrozenDistribution
from flexband.uncertainty.inputs.distributions.random_option import RandomOption
from flexband.uncertainty.inputs.distributions.scipy_distribution import as_input
from flexband.uncertainty.inputs.inputs import Input
from flexband.uncertainty.inputs.pbox import PBox

GivenInput = Input | Choice | Correlated | FrozenDistribution | float | np.number
"""What stands among the inputs of a study; a number is a constant."""

GivenInputs = Mapping[str, GivenInput]


def unfold(user_inputs: GivenInputs) -> dict[str, Input]:
    """Return all inputs by name: correlated ones one by one, intervals as ``input.parameter``.

    A number is a constant. Raise `InputError` for other kinds, and for a name that stands twice.
    """
    check_instance("inputs", user_inputs, Mapping, "a dict of names and inputs")
    inputs: dict[str, Input] = {}

    def add(name: str, input_: Input) -> None:
        if name in inputs:
            raise InputError(f"two inputs have the name {name!r}")
        inputs[name] = input_
        for parameter, interval in input_.intervals.items():
            add(f"{name}.{parameter}", interval)

    for name, value in user_inputs.items():
        check_instance("the name of an input", name, str, "text")
        members = value.members if isinstance(value, Correlated) else {name: _as_input(name, value)}
        for member, input_ in members.items():
            add(member, input_)
    return dict(sorted(inputs.items()))


def _as_input(name: str, value: GivenInput) -> Input:
    """Return an input that has variables of its own."""
    if isinstance(value, Choice) and value.probabilities is not None:
        return RandomOption(value.options, value.probabilities)
    allowed = (
        "a number, an Interval, a Normal or another distribution, a RandomField, Correlated inputs "
        "or another Input"
    )
    input_ = checked_input(f"input {name!r}", value, allowed)
    return PBox(input_) if isinstance(input_, Distribution) and input_.intervals else input_


def checked_input(label: str, value: GivenInput, allowed: str) -> Input:
    """Return an input, or a number as a constant; raise `InputError` if it is neither."""
    try:
        input_ = as_input(value)
    except InputError as error:
        raise InputError(f"{label}: {error}") from None
    if is_number(input_):
        return Constant(input_)
    if not isinstance(input_, Input):
        raise InputError(f"{label} must be {allowed}; got {value_text(value)}")
    return input_


def cases(inputs: GivenInputs) -> dict[str, dict[str, GivenInput]]:
    """Return the inputs of every combination of options by its label, such as ``"steel, 3"``."""
    max_cases = 1000  # combinations of options, each of which has an expansion of its own
    check_instance("inputs", inputs, Mapping, "a dict of names and inputs")
    choices = choices_of(inputs)
    inputs_by_label = {}
    combinations = list(product(*(choice.options for choice in choices.values())))
    if len(combinations) > max_cases:
        raise InputError(
            f"choices must have {number_of(max_cases, 'combination')} or fewer; "
            f"got {len(combinations)}"
        )
    for options in combinations:
        constants = {name: Constant(option) for name, option in zip(choices, options, strict=True)}
        inputs_by_label[", ".join(map(str, options))] = {**inputs, **constants}
    if len(inputs_by_label) < len(combinations):
        raise InputError("options must differ also as texts that are joined by commas")
    return inputs_by_label


def choices_of(inputs: GivenInputs) -> dict[str, Choice]:
    """Return the choices without probabilities, in the order of their names."""
    choices = {
        name: choice
        for name, choice in inputs.items()
        if isinstance(choice, Choice) and choice.probabilities is None
    }
    return {name: choices[name] for name in sorted(choices, key=str)}


def first_case(inputs: GivenInputs) -> dict[str, GivenInput]:
    """Return the inputs with every choice as its first option."""
    return next(iter(cases(inputs).values()))


def in_words(inputs: GivenInputs) -> str:
    """Return inputs as a text, in the order of their names; functions by name, without address."""
    text = "; ".join(f"{name} = {value!r}" for name, value in sorted(inputs.items()))
    return re.sub(r" at 0x[0-9a-f]+", "", re.sub(r"<function (.+?) at 0x[0-9a-f]+>", r"\1", text))
