"""Springs, angles and force laws as arrays: what each depends on, its indices and its numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import combinations_with_replacement

import numpy as np
from numpy.typing import ArrayLike

from flexband.mechanics.assembly.stacking import indices
from flexband.mechanics.assembly.structure import Angles, Laws, Springs
from flexband.mechanics.forms import Frame, TimeFunction, Vector
from flexband.mechanics.joints.joints import Resolve
from flexband.mechanics.kernels.laws import AXES
from flexband.mechanics.loads.force_laws import ForceLaw, compiled_law
from flexband.mechanics.loads.loads import Spring

Slot = Callable[[int, int], int]
"""Finds the row of the matrix for (i, j)."""

RELAXED = -1.0
"""Rest length of a spring that is relaxed at the start."""


def linear(vector: Vector) -> dict[int, list[ArrayLike]]:
    """Return coordinate -> its coefficients in X and Y of a linear vector."""
    entries: dict[int, list[ArrayLike]] = {}
    for axis, form in enumerate(vector):
        for (_, j, _), c in form.terms.items():
            entries.setdefault(j, [0.0, 0.0])[axis] = c
    return dict(sorted(entries.items()))


def _column(parts: Sequence[dict[int, list[ArrayLike]]], axis: int) -> list[ArrayLike]:
    """Return the coefficients in X or Y, part by part."""
    return [c[axis] for entries in parts for c in entries.values()]


def couples(groups: Sequence[Sequence[int]]) -> Iterator[tuple[int, int]]:
    """Return the pairs of coordinates that share a group."""
    for group in groups:
        yield from combinations_with_replacement(group, 2)


def square_slots(groups: Sequence[Sequence[int]], slot: Slot, nowhere: int) -> np.ndarray:
    """Return the matrix rows of the pairs of each group, (groups, longest, longest)."""
    longest = max(map(len, groups), default=0)
    slots = np.full((len(groups), longest, longest), nowhere)
    for s, group in enumerate(groups):
        slots[s, : len(group), : len(group)] = [[slot(i, j) for j in group] for i in group]
    return slots


class SpringParts:
    """The springs of a mechanism."""

    def __init__(self, springs: Sequence[Spring], frame: Resolve):
        self.springs = springs
        self.entries = [linear(spring.separation(frame)) for spring in springs]
        self.groups = [list(entries) for entries in self.entries]

    @property
    def functions(self) -> list[TimeFunction | None]:
        """The functions of time that multiply the pulls."""
        return [spring.actuator[1] for spring in self.springs]

    def structure(self, numbers: dict, slot: Slot, nowhere: int) -> Springs:
        """Return their indices."""
        return Springs(
            start=np.cumsum([0] + [len(group) for group in self.groups]),
            coordinate=indices(i for group in self.groups for i in group),
            f=indices(numbers[f] for f in self.functions),
            slot=square_slots(self.groups, slot, nowhere),
        )

    def rows(self) -> dict[str, Sequence[ArrayLike]]:
        """Return their numbers, named as in `Values`."""
        springs = self.springs
        return {
            "springs.x": _column(self.entries, 0),
            "springs.y": _column(self.entries, 1),
            "springs.stiffness": [s.stiffness for s in springs],
            "springs.cubic": [s.cubic for s in springs],
            "springs.damping": [s.damping for s in springs],
            "springs.pull": [s.actuator[0] for s in springs],
            "springs.rest_length": [
                RELAXED if s.rest_length is None else s.rest_length for s in springs
            ],
        }


@dataclass
class AngleParts:
    """The angles of a mechanism, those of the constraints first.

    Parameters
    ----------
    vectors : the directions.
    multipliers : of the constraints, for each angle that one has.
    """

    vectors: Sequence[Vector]
    multipliers: Sequence[int]
    entries: list[dict[int, list[ArrayLike]]] = field(init=False)

    def __post_init__(self) -> None:
        self.entries = [linear(vector) for vector in self.vectors]

    @property
    def groups(self) -> list[list[int]]:
        """The coordinates of each."""
        return [list(entries) for entries in self.entries]

    def couples(self) -> Iterator[tuple[int, int]]:
        """Return the non-zeros that they need."""
        yield from couples(self.groups)
        for k, group in zip(self.multipliers, self.groups, strict=False):
            yield from ((k, i) for i in group)

    def structure(self, first: int, moment: int, slot: Slot, nowhere: int) -> Angles:
        """Return their indices; z has them from row `first`, their moments from row `moment`."""
        own = self.groups[: len(self.multipliers)]
        multiplier_slot = np.full((len(own), max(map(len, own), default=0)), nowhere)
        for row, (k, group) in enumerate(zip(self.multipliers, own, strict=True)):
            multiplier_slot[row, : len(group)] = [slot(k, i) for i in group]
        return Angles(
            first=first,
            moment=moment,
            start=np.cumsum([0] + [len(group) for group in self.groups]),
            coordinate=indices(i for group in self.groups for i in group),
            slot=square_slots(self.groups, slot, nowhere),
            multiplier_slot=multiplier_slot,
        )

    def rows(self) -> dict[str, Sequence[ArrayLike]]:
        """Return the coefficients of the directions, named as in `Values`."""
        return {f"angles.{name}": _column(self.entries, axis) for axis, name in enumerate("xy")}


class LawParts:
    """The force laws of a mechanism, whose angles follow the first `angles` ones."""

    def __init__(self, laws: Sequence[ForceLaw], frame: Resolve, angles: int):
        self.laws = laws
        self.first_angle = angles
        self.frames: list[list[Frame]] = [[frame(point) for point in law.points] for law in laws]
        self.entries = [[linear(frame.position) for frame in frames] for frames in self.frames]
        self.directions = [[linear(frame.normal) for frame in frames] for frames in self.frames]
        self.groups = [
            sorted({j for parts in (*own, *turned) for j in parts})
            for own, turned in zip(self.entries, self.directions, strict=True)
        ]

    @property
    def functions(self) -> list[TimeFunction]:
        """The functions of time in use."""
        own = [p for law in self.laws for p in law.parameters if callable(p)]
        return [time, *own] if self.laws else []

    def structure(
        self, numbers: dict, rest: Sequence[bool], slot: Slot, nowhere: int, angle_places: int
    ) -> Laws:
        """Return their indices; the last parameter of those of `rest` is an angle at rest."""
        points = [len(law.points) for law in self.laws]
        parameters = np.cumsum([0] + [len(law.parameters) for law in self.laws])
        sizes = [p * len(group) for p, group in zip(points, self.groups, strict=True)]
        places = [
            group.index(j)
            for group, turned in zip(self.groups, self.directions, strict=True)
            for direction in turned
            for j in direction
        ]
        return Laws(
            address=indices(
                compiled_law(law.law, len(law.points), len(law.parameters)).address
                for law in self.laws
            ),
            time=numbers[time] if self.laws else 0,
            parameter_start=parameters,
            f=indices(
                numbers[p if callable(p) else None] for law in self.laws for p in law.parameters
            ),
            rest=np.where(rest, parameters[1:] - 1, -1),
            point_start=np.cumsum([0, *points]),
            angle=self.first_angle + np.arange(sum(points)),
            entry_start=np.cumsum([0, *sizes]),
            coordinate_start=np.cumsum([0] + [len(group) for group in self.groups]),
            coordinate=indices(j for group in self.groups for j in group),
            place=indices([0] * angle_places + places),
            slot=square_slots(self.groups, slot, nowhere),
            memory=max(
                (
                    1 + len(law.parameters) + AXES * p * (3 + AXES * p + 2 * len(group))
                    for law, p, group in zip(self.laws, points, self.groups, strict=True)
                ),
                default=0,
            ),
        )

    def rows(self) -> dict[str, Sequence[ArrayLike]]:
        """Return coefficients of the points and parameters, named as in `Values`.

        A parameter that is a function of time is 1 here.
        """
        parameters = [1.0 if callable(p) else p for law in self.laws for p in law.parameters]
        return {"laws.x": self._points(0), "laws.y": self._points(1), "laws.parameter": parameters}

    def _points(self, axis: int) -> list[ArrayLike]:
        return [
            entries[j][axis] if j in entries else 0.0
            for own, group in zip(self.entries, self.groups, strict=True)
            for entries in own
            for j in group
        ]


def time(t: float) -> float:
    """Return the time [s]."""
    return t
