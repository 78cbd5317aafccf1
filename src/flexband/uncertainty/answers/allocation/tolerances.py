"""The tolerances that are allocated, as one vector that a search changes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from flexband.errors import InputError
from flexband.uncertainty.answers.allocation.costs import Cost, cost_of
from flexband.uncertainty.answers.allocation.grades import Grades
from flexband.uncertainty.inputs.constants import Constant, is_number
from flexband.uncertainty.inputs.correlated import Correlated
from flexband.uncertainty.inputs.distribution import Distribution
from flexband.uncertainty.inputs.inputs import Interval
from flexband.uncertainty.inputs.space import Space

LEAST = 1e-4
"""Least tolerance that is considered, in parts of the largest."""

ROUNDING = 1e-9
"""By which a grade may be beyond the largest tolerance."""

STEP = 1e-4
"""Step of differences, of the logarithm of a tolerance."""


@dataclass(frozen=True, eq=False)
class Tolerances:
    """Half widths of intervals and standard deviations of random inputs, by name.

    The search's variables are the logarithms of tolerances in parts of the largest ones.

    Attributes
    ----------
    space : the inputs of the surrogate, with the largest tolerances.
    costs : name -> cost of the tolerance.
    least, largest : the least ones that are considered, and those of the surrogate, (names,).
    columns : number of each interval input's variable η, −1 of random inputs, (names,).
    """

    space: Space
    costs: Mapping[str, Cost]
    least: np.ndarray
    largest: np.ndarray
    columns: np.ndarray

    @staticmethod
    def of(space: Space, costs: Mapping[str, Cost]) -> Tolerances:
        """Return the tolerances of some inputs.

        Raises
        ------
        InputError
            If a name is none of the inputs that have a tolerance: intervals, and distributions with
            a number `std` that are not correlated; or a grade is looser than the surrogate.
        """
        allowed = _with_tolerance(space)
        for name in costs:
            if name not in allowed:
                own = ", ".join(allowed) or "none"
                raise InputError(
                    f"costs must name inputs with a tolerance, intervals or distributions with a "
                    f"std, which are {own}; got {name!r}"
                )
        columns, k = {}, 0
        for name, one in space.of_kind(random=False).items():
            columns[name], k = k, k + one.dimension
        largest = np.array([allowed[name] for name in costs])
        least = LEAST * largest
        for k, (name, cost) in enumerate(costs.items()):
            if isinstance(cost, Grades):
                least[k] = cost.tolerances.min()
                if cost.tolerances.max() > largest[k] * (1 + ROUNDING):
                    raise InputError(
                        f"costs: grades of {name} must have tolerances up to that of the "
                        f"surrogate, {largest[k]:g}; got {cost.tolerances.max():g}"
                    )
        return Tolerances(
            space, costs, least, largest, np.array([columns.get(k, -1) for k in costs])
        )

    @property
    def names(self) -> list[str]:
        """The inputs whose tolerances are allocated."""
        return list(self.costs)

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """The least and the largest values of the search's variables."""
        return np.log(self.least / self.largest), np.zeros(len(self.largest))

    def values(self, x: np.ndarray) -> np.ndarray:
        """Return the tolerances, (…, names)."""
        return self.largest * np.exp(x)

    def cost(self, x: np.ndarray) -> np.ndarray:
        """Return the cost of each tolerance, (names,)."""
        pairs = zip(self.costs.items(), self.values(x), strict=True)
        return np.array([cost_of(name, cost, float(t)) for (name, cost), t in pairs])

    def cost_gradient(self, x: np.ndarray) -> np.ndarray:
        """Return the derivative of the whole cost by the search's variables."""
        return (self.cost(x + STEP) - self.cost(x - STEP)) / (2 * STEP)

    def radius(self, x: np.ndarray) -> np.ndarray:
        """Return the radius of the box in every η, (…, m)."""
        radius = np.ones((*x.shape[:-1], self.space.interval_dimension))
        of_interval = self.columns >= 0
        radius[..., self.columns[of_interval]] = np.exp(x[..., of_interval])
        return radius

    def scatter(self, x: np.ndarray) -> np.ndarray:
        """Return the search's variables of random inputs alone, (…, random names)."""
        return x[..., self.columns < 0]

    def inputs(self, x: np.ndarray, *, random_alone: bool = False) -> dict[str, Any]:
        """Return the narrower inputs, by name."""
        found: dict[str, Any] = {}
        for name, column, t in zip(self.names, self.columns, self.values(x), strict=True):
            one: Any = self.space.inputs[name]
            if column < 0:
                found[name] = replace(one, std=float(t))
            elif not random_alone:
                middle, most = (one.lower + one.upper) / 2, (one.upper - one.lower) / 2
                radius = min(float(t), most)
                found[name] = Interval(middle - radius, middle + radius)
        return found


def _with_tolerance(space: Space) -> dict[str, float]:
    """Return the tolerances of all inputs that have one, by name."""
    groups = [one for one in space.given.values() if isinstance(one, Correlated)]
    correlated = {name for group in groups for name in group.members}
    found: dict[str, float] = {}
    for name, one in space.inputs.items():
        if isinstance(one, Constant) or name in correlated:
            continue
        if isinstance(one, Interval) and one.lower < one.upper:
            found[name] = (one.upper - one.lower) / 2
        elif isinstance(one, Distribution) and not one.intervals:
            std: Any = vars(one).get("std")
            if is_number(std) and std > 0:
                found[name] = float(std)
    return found
