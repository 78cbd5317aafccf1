"""What tolerances cost: functions of the tolerance, or grades with a price each."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from flexband.analysis.allocation.grades import Grades
from flexband.basics.arguments import frozen
from flexband.basics.checks import (
    check_function,
    check_instance,
    check_non_negative,
    check_numbers,
    check_positive,
)
from flexband.basics.user_functions import evaluate_function
from flexband.basics.words import value_text
from flexband.errors import InputError


@frozen()
class ReciprocalCost:
    """The cost A + B/tᵏ of a tolerance t (Chase and Greenwood, 1988).

    Parameters
    ----------
    factor : B, the cost of the tolerance 1, positive.
    exponent : k, positive.
    fixed : A, not negative.

    Raises
    ------
    InputError
        If a number is not in its range.
    """

    factor: float = 1.0
    exponent: float = 1.0
    fixed: float = 0.0

    def __post_init__(self) -> None:
        for name in ("factor", "exponent", "fixed"):
            check = check_positive
            label = f"ReciprocalCost {name}"
            if name == "fixed":
                check = check_non_negative
            number = check(label, check_numbers(label, getattr(self, name)))
            object.__setattr__(self, name, float(number))

    def __call__(self, tolerance: float) -> float:
        return self.fixed + self.factor / tolerance**self.exponent


Cost = Callable[[float], float]


def checked_costs(costs: Mapping[str, Cost | float]) -> dict[str, Cost]:
    """Return costs as functions, B/t for a number B; raise `InputError` if they are none."""
    check_instance("costs", costs, Mapping, "a mapping from names of inputs to costs")
    if not costs:
        raise InputError("costs must name at least one input; got {}")
    functions: dict[str, Cost] = {}
    for name, cost in costs.items():
        check_instance("costs: a name", name, str)
        if callable(cost):
            check_function(f"costs: {name}", cost, " of the tolerance")
            functions[name] = cost
        else:
            factor = check_positive(f"costs: {name}", check_numbers(name, cost))
            functions[name] = ReciprocalCost(float(factor))
    graded = [isinstance(cost_function, Grades) for cost_function in functions.values()]
    if any(graded) and not all(graded):
        raise InputError("costs must be Grades for all inputs or for none")
    return functions


def cost_of(name: str, cost: Cost, tolerance: float) -> float:
    """Return a cost; raise `InputError` if it is no finite number."""
    value = evaluate_function(cost, tolerance, f"costs: {name}")
    if np.size(value) != 1 or not np.isfinite(value).all():
        raise InputError(
            f"costs: {name} must be a finite number at {tolerance:g}; got {value_text(value)}"
        )
    return np.asarray(value).item()
