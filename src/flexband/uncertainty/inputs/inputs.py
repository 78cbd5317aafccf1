"""Uncertain inputs: numbers of which an interval or a distribution is known.

Every input is a function of standard variables: ξ of random inputs, distributed as the family of
polynomials requires in which the response is expanded, and η ∈ [−1, 1] of interval inputs.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import Field, fields, replace
from typing import Any, ClassVar

import numpy as np

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_non_negative, check_numbers, check_spread
from flexband.errors import InputError
from flexband.uncertainty.expansions.families import HERMITE, Family

FunctionOfPosition = Callable[[np.ndarray], np.ndarray]

Numbers = float | np.ndarray
"""A number, or one per sample, shape (n,)."""


class Input(ABC):
    """An uncertain parameter of a response.

    A subclass is a frozen dataclass with the two functions `value` and `standard`. Fields that are
    annotated as `float` must be finite numbers. Surrogates of a subclass can be saved if its fields
    are numbers, texts, tuples, inputs, correlation functions or None; its class must be defined
    before they are loaded.

    Attributes
    ----------
    random : whether the standard variables are ξ (a distribution) or η (an interval).
    family : the polynomials of ξ, which determine its distribution: `HERMITE` for standard normal
        variables, `LEGENDRE` for uniform ones on [−1, 1]. The more linear `value` is, the lower are
        the orders that a response requires.
    numeric : whether values are numbers.
    kinds : all subclasses by name.
    """

    random: ClassVar[bool] = True
    numeric: ClassVar[bool] = True
    kinds: ClassVar[dict[str, type[Input]]] = {}
    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    def __init_subclass__(cls) -> None:
        module = Input.kinds.get(cls.__name__, cls).__module__
        if module != cls.__module__ and module.startswith("flexband."):
            raise InputError(f"{cls.__name__} is an input of flexband; give yours another name")
        Input.kinds[cls.__name__] = cls

    def __post_init__(self) -> None:
        for field in fields(self):
            if field.type in ("float", float):
                value = check_numbers(
                    f"{type(self).__name__} {field.name}", getattr(self, field.name)
                )
                object.__setattr__(self, field.name, float(value))

    @property
    def family(self) -> Family:
        """The polynomials of ξ; `HERMITE` unless a subclass has another family."""
        return HERMITE

    @property
    def dimension(self) -> int:
        """Number of standard variables."""
        return 1

    @property
    def intervals(self) -> dict[str, Interval]:
        """Parameters of which only an interval is known, by name."""
        return {}

    def at(self, parameters: Mapping[str, Numbers]) -> Input:
        """Return the input with numbers, or one per sample, for parameters that are intervals."""
        return self

    def with_parameters(self, parameters: Mapping[str, float | Input]) -> Input:
        """Return the input with other numbers or intervals as parameters."""
        return replace(self, **parameters)

    def with_tolerance(self, tolerance: float) -> Input:
        """Return the input with another `tolerance_or_std`, about the same middle."""
        return self.with_parameters({"std": tolerance})

    @abstractmethod
    def value(self, standard: np.ndarray) -> np.ndarray | FunctionOfPosition:
        """Return the input, shape (n,), at standard variables of shape (n, dimension)."""

    def as_numbers(self, name: str, standard: np.ndarray) -> dict[str, np.ndarray]:
        """Return the values as arrays of shape (n,), by names for results."""
        return {name: np.asarray(self.value(standard))}

    def run_numbers(self, name: str, standard: np.ndarray) -> dict[str, np.ndarray]:
        """Return the numbers that identify runs: values, or the variables of what has none."""
        numbers = self.as_numbers(name, standard)
        return numbers or {f"{name}[{k}]": column for k, column in enumerate(standard.T)}

    @property
    def tolerance_or_std(self) -> float:
        """Half the width of an interval, or a standard deviation; 0 if it has none as a number."""
        return 0.0

    def mean_or_midpoint(self) -> Numbers:
        """Return the mean or the midpoint, as `standard` takes values."""
        return np.asarray(self.value(np.zeros((1, self.dimension))))

    @abstractmethod
    def standard(self, value: np.ndarray) -> np.ndarray:
        """Return the standard variables of values of shape (n,) or (): the inverse of `value`.

        Their shape is that of the values or (n, dimension).

        Raises
        ------
        InputError
            If a value is impossible.
        """


@frozen()
class Interval(Input):
    """A number of which only two bounds are known.

    Raises
    ------
    InputError
        If a bound is not finite or the lower bound is above the upper.

    Examples
    --------
    >>> fb.Interval.around(10.0, percent=5)
    Interval(lower=9.5, upper=10.5)
    >>> fb.Interval.around(10.0, plus=0.1, minus=0.0)
    Interval(lower=10.0, upper=10.1)
    """

    lower: float
    upper: float

    random = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.lower > self.upper:
            raise InputError(
                f"Interval lower {self.lower:g} must not be above upper {self.upper:g}"
            )
        if self.lower < self.upper:
            check_spread("width of the Interval", self.upper - self.lower, self.upper)

    @classmethod
    def around(
        cls,
        nominal: float,
        *,
        percent: float | None = None,
        tolerance: float | None = None,
        plus: float | None = None,
        minus: float | None = None,
    ) -> Interval:
        """Return the interval around a nominal value, as drawings and data sheets tell it.

        ``around(10, percent=5)`` and ``around(10, tolerance=0.5)`` are 10 ± 0.5, and
        ``around(10, plus=0.1, minus=0)`` is 10 +0.1/−0. `minus` is how far below, without sign.

        Raises
        ------
        InputError
            If a number is negative, or not exactly one of percent, tolerance, and plus with minus
            is given.
        """
        nominal = float(check_numbers("Interval nominal", nominal))
        deviations = {"percent": percent, "tolerance": tolerance, "plus": plus, "minus": minus}
        deviations = {name: value for name, value in deviations.items() if value is not None}
        if list(deviations) not in (["percent"], ["tolerance"], ["plus", "minus"]):
            raise InputError(
                "Interval.around must have either percent, or tolerance, or plus and minus; "
                f"got {', '.join(deviations) or 'none'}"
            )
        sizes = [
            float(check_non_negative(f"Interval {name}", check_numbers(f"Interval {name}", value)))
            for name, value in deviations.items()
        ]
        if percent is not None:
            if nominal == 0:
                raise InputError("Interval percent must be given as tolerance around 0")
            sizes = [abs(nominal) * sizes[0] / 100]
        return cls(nominal - sizes[-1], nominal + sizes[0])

    def value(self, standard: np.ndarray) -> np.ndarray:
        """Return midpoint + radius η; exactly the bounds at η = −1 and 1."""
        return number_between(self.lower, self.upper, standard[:, 0])

    @property
    def tolerance_or_std(self) -> float:
        return (self.upper - self.lower) / 2

    def with_tolerance(self, tolerance: float) -> Interval:
        return Interval.around((self.lower + self.upper) / 2, tolerance=tolerance)

    def standard(self, value: np.ndarray) -> np.ndarray:
        """Return η of values, within rounding of the bounds; 0 if the bounds are equal."""
        return place_between(self.lower, self.upper, value)


def number_between(lower: float, upper: float, x: np.ndarray) -> np.ndarray:
    """Return the number at x of −1 … 1 between two bounds."""
    return 0.5 * ((1 - x) * lower + (1 + x) * upper)


def place_between(lower: float, upper: float, value: np.ndarray) -> np.ndarray:
    """Return where values are between two bounds, −1 … 1; 0 if the bounds are equal."""
    middle = (lower + upper) / 2
    radius = (upper - lower) / 2
    x = (value - middle) / (radius or 1.0)
    if np.any(np.abs(x) > 1 + 1e-9):
        worst = np.ravel(value)[np.abs(x).argmax()]
        raise InputError(f"values must be from {lower:g} to {upper:g}; got {worst:g}")
    return np.clip(x, -1.0, 1.0)
