"""Inputs that are chosen: one of several options, a nominal size, or what is adjusted."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from itertools import product
from typing import Any

import numpy as np

from flexband.arguments import frozen
from flexband.errors import InputError, check_non_negative, check_spread, shown
from flexband.uncertainty.inputs.constants import Constant, is_number
from flexband.uncertainty.inputs.inputs import Input, Interval
from flexband.words import number_of


@frozen(init=False)
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

    Examples
    --------
    >>> inputs = {"gear": fb.Choice("short", "long"), "speed": fb.Interval(9.0, 11.0)}
    >>> def force(gear, speed):
    ...     return speed / (2.0 if gear[0] == "long" else 1.0)
    ...
    >>> fb.propagate(force, inputs, fb.PCCI(0, 1))["mean"].values.round(4)
    array([ 4.5, 11. ])
    """

    options: tuple[Any, ...]

    def __init__(self, *options: Any):
        texts = all(isinstance(option, str) for option in options)
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


class Chosen(Input):
    """A number that is chosen, and not uncertain.

    Runs cover all its values, and bands of a surrogate are those over all of them;
    ``surrogate.narrowed(name=…)`` has those of one.
    """

    random = False

    @property
    @abstractmethod
    def covered(self) -> Interval:
        """All values that the number can have."""

    def value(self, standard: np.ndarray) -> np.ndarray:
        """Return values of η."""
        return self.covered.value(standard)

    def standard(self, value: np.ndarray) -> np.ndarray:
        """Return η of values."""
        return self.covered.standard(value)


@frozen()
class Sizing(Chosen):
    """A nominal size that is free within a range, with a tolerance around it.

    `allocate` chooses the size. All values from lower − tolerance to upper + tolerance are covered
    by runs, and bands of a surrogate are those over all of them; ``surrogate.narrowed(name=…)``
    has those of one size.

    Parameters
    ----------
    lower, upper : least and largest nominal size.
    tolerance : the largest deviation from the nominal size that is considered.

    Raises
    ------
    InputError
        If a number is not finite, the lower bound is not below the upper, or the tolerance is
        negative.
    """

    lower: float
    upper: float
    tolerance: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.lower >= self.upper:
            raise InputError(f"Sizing lower {self.lower:g} must be below upper {self.upper:g}")
        check_non_negative("Sizing tolerance", np.array(self.tolerance))
        check_spread("width of the Sizing", self.upper - self.lower, self.upper)

    @property
    def covered(self) -> Interval:
        """All values that the size can have with its tolerance."""
        return Interval(self.lower - self.tolerance, self.upper + self.tolerance)


@frozen()
class Compensator(Chosen):
    """A number that is adjusted after assembly, such as the thickness of a shim.

    `check_limits` and `allocate` adjust it once for all values of the interval inputs, for the
    whole motion: limits are kept if one of its values keeps them. Bands of a surrogate are those
    over all of them; ``surrogate.narrowed(name=…)`` has those of one.

    Raises
    ------
    InputError
        If a number is not finite, or the lower bound is not below the upper.
    """

    lower: float
    upper: float

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.lower >= self.upper:
            raise InputError(f"Compensator lower {self.lower:g} must be below upper {self.upper:g}")
        check_spread("width of the Compensator", self.upper - self.lower, self.upper)

    @property
    def covered(self) -> Interval:
        """All values to which it can be adjusted."""
        return Interval(self.lower, self.upper)


def cases(inputs: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the inputs of every combination of options, which are constants in them.

    Returns
    -------
    Label of the combination, such as ``"steel"`` or ``"steel, 3"`` -> inputs; one entry with an
    empty label if there is no choice.
    """
    max_cases = 1000  # combinations of options, each of which has an expansion of its own
    if not isinstance(inputs, Mapping):
        raise InputError(f"inputs must be a dict of names and inputs; got {shown(inputs)}")
    choices = {
        name: choice.options for name, choice in inputs.items() if isinstance(choice, Choice)
    }
    names, inputs_by_label = sorted(choices, key=str), {}
    combined = list(product(*(choices[name] for name in names)))
    if len(combined) > max_cases:
        raise InputError(
            f"choices must have {number_of(max_cases, 'combination')} or fewer; got {len(combined)}"
        )
    for options in combined:
        fixed = {name: Constant(option) for name, option in zip(names, options, strict=True)}
        inputs_by_label[", ".join(map(str, options))] = {**inputs, **fixed}
    if len(inputs_by_label) < len(combined):
        raise InputError("options must differ also as texts that are joined by commas")
    return inputs_by_label


def first_case(inputs: Mapping[str, Any]) -> dict[str, Any]:
    """Return the inputs with every choice as its first option."""
    return next(iter(cases(inputs).values()))
