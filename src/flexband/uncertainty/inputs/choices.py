"""Discrete inputs: one of several options, such as a material or a supplier."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

from flexband.errors import InputError, shown
from flexband.uncertainty.inputs.constants import Constant, is_number

MOST_CASES = 1000
"""Combinations of options, each of which has an expansion of its own."""


@dataclass(frozen=True, init=False)
class Choice:
    """One of several options, none of which is more likely than another.

    The response gets an array of shape (n,) of one option. Every combination of options has an
    expansion of its own. Bands are those over all of them.

    Parameters
    ----------
    options : two or more, all texts or all numbers.

    Raises
    ------
    InputError
        If there are fewer, two are equal, or one is neither text nor number.
    """

    options: tuple[Any, ...]

    def __init__(self, *options: Any):
        texts = all(isinstance(one, str) for one in options)
        if len(options) < 2 or not (texts or all(map(is_number, options))):
            raise InputError(
                f"Choice options must be two or more texts, or numbers; got {shown(options)}"
            )
        if len(set(options)) < len(options):
            raise InputError(f"Choice options must differ; got {shown(options)}")
        object.__setattr__(self, "options", tuple(options))

    def __repr__(self) -> str:
        """Return it as it is written."""
        return f"Choice({', '.join(map(repr, self.options))})"


def cases(inputs: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the inputs of every combination of options, which are constants in them.

    Returns
    -------
    Label of the combination, such as ``"steel"`` or ``"steel, 3"`` -> inputs; one entry with an
    empty label if there is no choice.
    """
    if not isinstance(inputs, Mapping):
        raise InputError(f"inputs must be a dict of names and inputs; got {shown(inputs)}")
    choices = {name: one.options for name, one in inputs.items() if isinstance(one, Choice)}
    names, found = sorted(choices, key=str), {}
    combined = list(product(*(choices[name] for name in names)))
    if len(combined) > MOST_CASES:
        raise InputError(
            f"choices must have {MOST_CASES} combinations or fewer; got {len(combined)}"
        )
    for options in combined:
        fixed = {name: Constant(one) for name, one in zip(names, options, strict=True)}
        found[", ".join(map(str, options))] = {**inputs, **fixed}
    if len(found) < len(combined):
        raise InputError("options must differ also as texts that are joined by commas")
    return found


def first_case(inputs: Mapping[str, Any]) -> dict[str, Any]:
    """Return the inputs with every choice as its first option."""
    return next(iter(cases(inputs).values()))
