"""The tolerances and sizes that are allocated, as one vector that a search changes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexband.analysis.allocation.adjustment import compensators
from flexband.analysis.allocation.costs import Cost, cost_of
from flexband.analysis.allocation.grades import Grades
from flexband.errors import InputError
from flexband.uncertainty.inputs.choices import Sizing
from flexband.uncertainty.inputs.inputs import Input, Interval
from flexband.uncertainty.inputs.space import Space, check_no_play

STEP = 1e-4
"""Step of differences, of the logarithm of a tolerance."""


@dataclass(frozen=True, eq=False)
class Tolerances:
    """Half widths of intervals and standard deviations of random inputs, and nominal sizes.

    The search's variables are the logarithms of tolerances relative to the largest ones, and then η
    of the sizes.
    """

    space: Space  # the inputs of the surrogate, with the largest tolerances
    costs: Mapping[str, Cost]  # by name
    smallest: np.ndarray  # tolerances, 1e-4 of the largest unless there are grades, (names,)
    largest: np.ndarray  # those of the surrogate, (names,)
    columns: np.ndarray  # number of each interval's variable η, −1 of random inputs, (names,)
    sizes: Mapping[str, int]  # number of the variable η of each `Sizing`, by name
    compensators: Mapping[str, int]  # that of each `Compensator`

    @staticmethod
    def from_costs(space: Space, costs: Mapping[str, Cost]) -> Tolerances:
        """Return the tolerances of some inputs.

        Raise `InputError` if a name is none of the inputs that have a tolerance: intervals, and
        distributions with a number `std` that are not correlated; or if a grade is looser than the
        surrogate.
        """
        allowed = with_tolerance(space)
        for name in costs:
            if name not in allowed:
                raise InputError(
                    "costs must name intervals, plays, or distributions with a std, which are "
                    f"{', '.join(allowed) or 'none'}; got {name!r}"
                )
        columns = space.columns(random=False)
        largest = np.array([allowed[name] for name in costs])
        smallest = 1e-4 * largest
        for k, (name, cost) in enumerate(costs.items()):
            if isinstance(cost, Grades):
                smallest[k] = cost.tolerances.min()
                if cost.tolerances.max() > largest[k] * (1 + 1e-9):
                    raise InputError(
                        f"costs: grades of {name} must have tolerances up to that of the "
                        f"surrogate, {largest[k]:g}; got {cost.tolerances.max():g}"
                    )
        sizes = {
            k: columns[k] for k, size in space.design_inputs.items() if isinstance(size, Sizing)
        }
        if space.design_inputs and any(isinstance(cost, Grades) for cost in costs.values()):
            raise InputError(
                f"costs must not be Grades where inputs are chosen, a Sizing or a Compensator; "
                f"these are {', '.join(space.design_inputs)}"
            )
        adjusted = compensators(space)
        if adjusted:
            check_no_play(space, "allocate with a Compensator")
        numbers = np.array([columns.get(k, -1) for k in costs])
        return Tolerances(space, costs, smallest, largest, numbers, sizes, adjusted)

    @property
    def grades(self) -> list[Grades]:
        """The grades of all tolerances; none if these are not graded."""
        return [cost for cost in self.costs.values() if isinstance(cost, Grades)]

    @cached_property
    def dimensions(self) -> np.ndarray:
        """The number of standard variables of each input, (names,)."""
        return np.array([self.space.inputs[name].dimension for name in self.costs], dtype=int)

    @property
    def names(self) -> list[str]:
        """The inputs whose tolerances are allocated."""
        return list(self.costs)

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """The least and the largest values of the search's variables."""
        reach = (1.0 - self._all_radii)[list(self.sizes.values())]
        low = np.log(self.smallest / self.largest)
        high = np.zeros(len(self.largest))
        return np.concatenate([low, -reach]), np.concatenate([high, reach])

    def tighter(self, x: np.ndarray, by: float | np.ndarray) -> np.ndarray:
        """Return the variables with smaller logarithms of tolerances, not below the least."""
        low = self.bounds[0]
        count = len(self.largest)
        narrow_x = np.maximum(x - by, low)
        return np.where(np.arange(len(low)) < count, narrow_x, x)

    def looser(self, x: np.ndarray) -> np.ndarray:
        """Return the variables with the largest tolerances."""
        return np.where(np.arange(len(x)) < len(self.largest), 0.0, x)

    @cached_property
    def _sizings(self) -> dict[str, Sizing]:
        inputs = self.space.inputs
        return {k: size for k in self.sizes if isinstance(size := inputs[k], Sizing)}

    @cached_property
    def _all_radii(self) -> np.ndarray:
        radius = np.ones(self.space.interval_dimension)
        for name, column in self.sizes.items():
            sizing = self._sizings[name]
            radius[column] = (
                2 * sizing.tolerance / (sizing.full_interval.upper - sizing.full_interval.lower)
            )
        return radius

    def values(self, x: np.ndarray) -> np.ndarray:
        """Return the tolerances, (…, names)."""
        return self.largest * np.exp(x[..., : len(self.largest)])

    def cost(self, x: np.ndarray) -> np.ndarray:
        """Return the cost of each tolerance, (names,)."""
        pairs = zip(self.costs.items(), self.values(x), strict=True)
        return np.array([cost_of(name, cost, float(t)) for (name, cost), t in pairs])

    def cost_gradient(self, x: np.ndarray) -> np.ndarray:
        """Return the derivative of the whole cost by the search's variables."""
        by_tolerance = (self.cost(x + STEP) - self.cost(x - STEP)) / (2 * STEP)
        return np.concatenate([by_tolerance, np.zeros(len(self.sizes))])

    def center(self, x: np.ndarray) -> np.ndarray:
        """Return the middle of the box in every η, (…, m)."""
        center = np.zeros((*x.shape[:-1], self.space.interval_dimension))
        center[..., list(self.sizes.values())] = x[..., len(self.largest) :]
        return center

    def radius(self, x: np.ndarray) -> np.ndarray:
        """Return the radius of the box in every η, (…, m)."""
        radius = np.broadcast_to(self._all_radii, self.center(x).shape).copy()
        of_interval = self.columns >= 0
        parts = np.exp(x[..., : len(self.largest)][..., of_interval])
        for second in (0, 1):  # of the variables of a pair
            columns = self.columns[of_interval] + second
            present = self.dimensions[of_interval] > second
            radius[..., columns[present]] *= parts[..., present]
        return radius

    def nominal(self, x: np.ndarray) -> dict[str, float]:
        """Return the sizes, by name."""
        eta = self.center(x)[list(self.sizes.values())]
        pairs = zip(self.sizes, eta, strict=True)
        return {k: float(self._sizings[k].value(np.array([[z]]))[0]) for k, z in pairs}

    def scatter(self, x: np.ndarray) -> np.ndarray:
        """Return the search's variables of random inputs alone, (…, random names)."""
        return x[..., : len(self.largest)][..., self.columns < 0]

    def inputs(self, x: np.ndarray, *, random_alone: bool = False) -> dict[str, Input]:
        """Return the narrower inputs, by name."""
        inputs: dict[str, Input] = {}
        middles = self.nominal(x)
        radii = {k: size.tolerance for k, size in self._sizings.items()}
        for name, column, t in zip(self.names, self.columns, self.values(x), strict=True):
            if column < 0 or (name in self.space.plays and not random_alone):
                inputs[name] = self.space.inputs[name].with_tolerance(float(t))
            elif name not in self.space.plays:
                radii[name] = float(t)
        for name, radius in radii.items() if not random_alone else ():
            values = self.space.inputs[name].value(np.array([[-1.0], [0.0], [1.0]]))
            lower_end, middle, upper_end = map(float, np.asarray(values))
            middle = middles.get(name, middle)
            low = middle - radius
            high = middle + radius
            inputs[name] = Interval(max(low, lower_end), min(high, upper_end))
        return inputs


def with_tolerance(space: Space) -> dict[str, float]:
    """Return the tolerances of all inputs that have one, by name."""
    tolerances = {
        name: input_.tolerance_or_std
        for name, input_ in space.uncertain.items()
        if name not in space.dependent_names
    }
    return {name: tolerance for name, tolerance in tolerances.items() if tolerance > 0}
