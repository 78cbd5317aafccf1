"""The force laws of a mechanism as arrays."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexband.mechanics.assembly.stacking import indices, stack, starts
from flexband.mechanics.assembly.structure import Laws, LawValues
from flexband.mechanics.assembly.tables import Couples, Places, linear, pairs_of
from flexband.mechanics.forms import TimeFunction
from flexband.mechanics.kernels.laws import AXES
from flexband.mechanics.loads.loads import LawEntry


class LawTable:
    """The force laws.

    Parameters
    ----------
    laws : the entries.
    first_angle : number of the angle of the first point.
    angle_entries : number of coordinates of all angles before that one.
    """

    def __init__(self, laws: Sequence[LawEntry], first_angle: int, angle_entries: int):
        self.laws, self.first_angle, self.angle_entries = laws, first_angle, angle_entries
        self.positions = [[linear(frame.position) for frame in law.points] for law in laws]
        self.normals = [[linear(frame.normal) for frame in law.points] for law in laws]
        self.groups = [
            sorted({j for entries in (*positions, *normals) for j in entries})
            for positions, normals in zip(self.positions, self.normals, strict=True)
        ]
        self.parameters = [parameter for law in laws for parameter in law.parameters]

    @property
    def functions(self) -> Sequence[TimeFunction | None]:
        own = [p for p in self.parameters if callable(p)]
        return [time, *own] if self.laws else []

    def couples(self) -> Couples:
        return pairs_of(self.groups)

    def structure(self, places: Places) -> Laws:
        points = [law.points for law in self.laws]
        sizes = [len(p) * len(group) for p, group in zip(points, self.groups, strict=True)]
        place = [
            group.index(j)
            for group, normals in zip(self.groups, self.normals, strict=True)
            for entries in normals
            for j in entries
        ]
        return Laws(
            address=indices(law.function.address for law in self.laws),
            time=places.functions[time] if self.laws else 0,
            parameter_start=starts([law.parameters for law in self.laws]),
            f=indices(places.functions[p if callable(p) else None] for p in self.parameters),
            point_start=starts(points),
            angle=self.first_angle + np.arange(sum(map(len, points))),
            entry_start=np.cumsum([0, *sizes]),
            coordinate_start=starts(self.groups),
            coordinate=indices(j for group in self.groups for j in group),
            place=indices([0] * self.angle_entries + place),
            slot=places.square(self.groups),
            memory=max(map(_memory, self.laws, self.groups), default=0),
        )

    def values(self) -> LawValues:
        """Return coefficients of the points and parameters; those that are functions are 1."""
        x, y = (
            stack([
                entries[j][axis] if j in entries else 0.0
                for positions, group in zip(self.positions, self.groups, strict=True)
                for entries in positions
                for j in group
            ])
            for axis in range(2)
        )  # fmt: skip
        return LawValues(x, y, stack([1.0 if callable(p) else p for p in self.parameters]))


def _memory(law: LawEntry, group: Sequence[int]) -> int:
    """Return how many rows of memory a law needs, see `kernels.laws`."""
    axes = AXES * len(law.points)
    return 1 + len(law.parameters) + axes * (3 + axes + 2 * len(group))


def time(t: float) -> float:
    """Return the time [s]."""
    return t
