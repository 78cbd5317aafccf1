"""Inputs that are chosen: one of several options, a nominal size, or what is adjusted."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_finite, check_non_negative, check_positive, check_spread
from flexband.basics.words import number_of, value_text
from flexband.errors import InputError
from flexband.uncertainty.inputs.constants import is_number
from flexband.uncertainty.inputs.inputs import Input, Interval


@frozen(init=False)
class Choice:
    """One of several options, whose probabilities are known or not.

    The response gets an array of shape (n,) of one option. Without probabilities, every combination
    of options has an expansion of its own, and bands are those over all of them. With
    probabilities, it is a random input: moments include the scatter between the options.

    Parameters
    ----------
    options : two or more, all texts or all numbers.
    probabilities : that of each option, which are positive and add up to 1; None if not known.

    Raises
    ------
    InputError
        If there are fewer, two are equal, one is neither text nor number, or probabilities are not
        as many, not positive, or do not add up to 1.

    Examples
    --------
    >>> inputs = {"gear": fb.Choice("short", "long"), "speed": fb.Interval(9.0, 11.0)}
    >>> def force(gear, speed):
    ...     return speed / (2.0 if gear[0] == "long" else 1.0)
    ...
    >>> fb.propagate(force, inputs, fb.PCCI(0, 1))["mean"].values.round(4)
    array([ 4.5, 11. ])
    """

    options: tuple[str | float, ...]
    probabilities: tuple[float, ...] | None

    def __init__(self, *options: str | float, probabilities: Sequence[float] | None = None):
        texts = all(isinstance(option, str) for option in options)
        if len(options) < 2 or not (texts or all(map(is_number, options))):
            raise InputError(
                f"Choice options must be two or more texts, or numbers; got {value_text(options)}"
            )
        if len(set(options)) < len(options):
            raise InputError(f"Choice options must differ; got {value_text(options)}")
        object.__setattr__(self, "options", tuple(options))
        object.__setattr__(self, "probabilities", _check_probabilities(options, probabilities))

    def __repr__(self) -> str:
        arguments = [repr(option) for option in self.options]
        if self.probabilities is not None:
            arguments.append(f"probabilities={self.probabilities}")
        return f"Choice({', '.join(arguments)})"


def _check_probabilities(
    options: Sequence[Any], probabilities: Sequence[float] | None
) -> tuple[float, ...] | None:
    """Return the probabilities of options, which add up to 1; raise `InputError` for others."""
    if probabilities is None:
        return None
    name = "Choice probabilities"
    tolerance = 1e-6
    values = np.atleast_1d(check_positive(name, check_finite(name, probabilities, rank=None)))
    if values.shape != (len(options),):
        raise InputError(
            f"{name} must have a number for each of {number_of(len(options), 'option')}; "
            f"got {value_text(probabilities)}"
        )
    if abs(values.sum() - 1) > tolerance:
        raise InputError(
            f"{name} must add up to 1; got {value_text(probabilities)}, which are {values.sum():g}"
        )
    return tuple((values / values.sum()).tolist())


class Chosen(Input):
    """A number that is chosen, and not uncertain.

    Runs cover all its values, and bands of a surrogate are those over all of them;
    ``surrogate.narrowed(name=…)`` has those of one.
    """

    random = False
    lower: float
    upper: float

    def __post_init__(self) -> None:
        super().__post_init__()
        name = type(self).__name__
        if self.lower >= self.upper:
            raise InputError(f"{name} lower {self.lower:g} must be below upper {self.upper:g}")
        check_spread(f"width of the {name}", self.upper - self.lower, self.upper)

    @property
    @abstractmethod
    def full_interval(self) -> Interval:
        """The interval of all values that the number can have."""

    def value(self, standard: np.ndarray) -> np.ndarray:
        return self.full_interval.value(standard)

    def standard(self, value: np.ndarray) -> np.ndarray:
        return self.full_interval.standard(value)


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
        check_non_negative("Sizing tolerance", np.array(self.tolerance))

    @property
    def tolerance_or_std(self) -> float:
        return self.tolerance

    @property
    def full_interval(self) -> Interval:
        """The interval of all values that the size can have with its tolerance."""
        return Interval(self.lower - self.tolerance, self.upper + self.tolerance)


@frozen()
class Compensator(Chosen):
    """A number that is adjusted after assembly, such as the thickness of a shim.

    `check_requirements` and `allocate` adjust it once for all values of the interval inputs, for
    the whole motion: requirements are met if one of its values meets them. Bands of a surrogate are
    those over all of them; ``surrogate.narrowed(name=…)`` has those of one.

    Raises
    ------
    InputError
        If a number is not finite, or the lower bound is not below the upper.
    """

    lower: float
    upper: float

    @property
    def full_interval(self) -> Interval:
        return Interval(self.lower, self.upper)
