"""The force laws of a mechanism as arrays."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexband.mechanics.assembly.stacking import indices, stack, starts
from flexband.mechanics.assembly.structure import Laws
from flexband.mechanics.assembly.tables import Couples, Places, pairs_of
from flexband.mechanics.kernels.forms import TimeFunction
from flexband.mechanics.kernels.laws import AXES
from flexband.mechanics.loads.compiled_laws import compiled_law
from flexband.mechanics.loads.load import LawEntry


class LawTable:
    """The force laws.

    Parameters
    ----------
    laws : the entries.
    angle, position : numbers of the vectors of the first point, its normal and its position.
    groups : the rows of z that each vector depends on.
    """

    def __init__(
        self,
        laws: Sequence[LawEntry],
        angle: int,
        position: int,
        groups: Sequence[Sequence[int]],
    ):
        self.compiled = [compiled_law(e.law, len(e.points), len(e.parameters)) for e in laws]
        self.laws, self.angle, self.position = laws, angle, position
        self.parameters = [parameter for law in laws for parameter in law.parameters]
        self.groups, self.place, point = [], [[0] * len(group) for group in groups], 0
        for law in laws:
            points = range(point, point + len(law.points))
            vectors = [first + p for p in points for first in (angle, position)]
            self.groups.append(sorted({j for a in vectors for j in groups[a]}))
            for a in vectors:
                self.place[a] = [self.groups[-1].index(j) for j in groups[a]]
            point += len(points)

    @property
    def functions(self) -> Sequence[TimeFunction | None]:
        functions = [p for p in self.parameters if callable(p)]
        return [time, *functions] if self.laws else []

    def couples(self) -> Couples:
        return pairs_of(self.groups)

    def structure(self, places: Places) -> Laws:
        return Laws(
            address=indices(law.address for law in self.compiled),
            time=places.functions.get(time, 0),
            parameter_start=starts([law.parameters for law in self.laws]),
            f=indices(places.functions[p if callable(p) else None] for p in self.parameters),
            point_start=starts([law.points for law in self.laws]),
            angle=self.angle,
            position=self.position,
            coordinates=indices(len(group) for group in self.groups),
            place=indices(k for vector_places in self.place for k in vector_places),
            slot=places.square(self.groups),
            memory=max(map(_memory, self.laws, self.groups), default=0),
        )

    def values(self) -> np.ndarray:
        """Return the parameters; those that are functions of time are 1."""
        return stack([1.0 if callable(p) else p for p in self.parameters])


def _memory(law: LawEntry, group: Sequence[int]) -> int:
    """Return how many rows of memory a law needs, see `kernels.laws`."""
    axes = AXES * len(law.points)
    return 1 + len(law.parameters) + axes * (3 + axes + 2 * len(group))


def time(t: float) -> float:
    """Return the time [s]."""
    return t
