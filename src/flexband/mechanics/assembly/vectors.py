"""Vectors as arrays, at most quadratic in the coordinates, and the springs and laws with them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexband.compilation.functions import Deferred
from flexband.mechanics.assembly.entry_tables import Couples, Places, pairs_of
from flexband.mechanics.assembly.stacking import indices, stack, starts
from flexband.mechanics.assembly.structure import Laws, Springs, SpringValues, Vectors, VectorValues
from flexband.mechanics.kernels.forms import Form, TimeFunction, Vector, section_normal
from flexband.mechanics.kernels.laws.forces import AXES, GAP, GAP_MEMORY
from flexband.mechanics.kernels.laws.states import MARK
from flexband.mechanics.kernels.springs import RELAXED
from flexband.mechanics.loads.load import LawEntry, SpringEntry
from flexband.mechanics.model.model import Model

compiled_laws = Deferred("flexband.mechanics.loads.compiled_laws")


def entries_of(vector: Vector) -> dict[tuple[int, int], list[ArrayLike]]:
    """Return (row of z, its partner's or 0) -> the coefficients in X, Y and Z of a vector."""
    entries: dict[tuple[int, int], list[ArrayLike]] = {}
    for axis, form in enumerate(vector):
        for (i, j, _), c in form.terms.items():
            for pair in {(j, i), (i, j)} if i > 0 else {(j, 0)}:
                coefficients = entries.setdefault(pair, [0.0, 0.0, 0.0])
                coefficients[axis] = 2.0 * c if i == j > 0 else c
    return dict(sorted(entries.items()))


class VectorTable:
    """The vectors, those with `angles` or lengths first.

    The first ones belong to constraints whose multipliers are these rows of z, and `lengths` tells
    which are lengths; those of following forces begin at `direction`, those whose angles sensors
    alone read at `sensor_angle`, and those of each part that turns at `turning`.
    """

    functions = ()

    def __init__(
        self,
        vectors: Sequence[Vector],
        angles: int,
        multipliers: Sequence[int],
        lengths: Sequence[bool],
        direction: int,
        sensor_angle: int,
        turning: np.ndarray,
    ):
        self.vectors = [entries_of(vector) for vector in vectors]
        self.groups = [[row for row, _ in entries] for entries in self.vectors]
        self.components = max(map(len, vectors), default=2)
        self.angle_groups = self.groups[:angles]
        self.multipliers = multipliers
        self.lengths = lengths
        self.direction = direction
        self.sensor_angle = sensor_angle
        self.turning = turning

    def couples(self) -> Couples:
        yield from pairs_of(self.angle_groups)
        for k, group in zip(self.multipliers, self.angle_groups, strict=False):
            yield from ((k, i) for i in group)

    def structure(self, places: Places) -> Vectors:
        groups = self.angle_groups[: len(self.multipliers)]
        multiplier_slot = np.full((len(groups), max(map(len, groups), default=0)), places.nowhere)
        for row, k, group in zip(multiplier_slot, self.multipliers, groups, strict=True):
            row[: len(group)] = [places.slot(k, i) for i in group]
        return Vectors(
            start=starts(self.groups),
            coordinate=indices(i for group in self.groups for i in group),
            partner=indices(i for entries in self.vectors for _, i in entries),
            partner_slot=indices(
                places.slot(*pair) if pair[1] else places.nowhere
                for entries in self.vectors
                for pair in entries
            ),
            spatial=int(self.components > 2),
            length=np.array(
                [*self.lengths, *[False] * (len(self.angle_groups) - len(groups))], dtype=bool
            ),
            direction=self.direction,
            sensor_angle=self.sensor_angle,
            turning=self.turning,
            slot=places.square(self.angle_groups),
            multiplier_slot=multiplier_slot,
        )

    def values(self) -> VectorValues:
        entries = [entry for vector in self.vectors for entry in vector.values()]
        x, y, z = (stack([entry[axis] for entry in entries]) for axis in range(3))
        return VectorValues(x, y, z if self.components > 2 else z[:0])


class SpringTable:
    """The springs, translational ones first.

    The first of them has the vector `vector`; the angles of the others start at `angle`. `groups`
    are the coordinates of all vectors.
    """

    def __init__(
        self,
        springs: Sequence[SpringEntry],
        vector: int,
        angle: int,
        groups: Sequence[Sequence[int]],
    ):
        self.springs = springs
        self.vector = vector
        self.angles = angle + starts([spring.angles for spring in springs])
        self.groups = [
            [i for a in (vector + s, *range(*self.angles[s : s + 2])) for i in groups[a]]
            for s in range(len(springs))
        ]
        self.pulls = []
        self.functions = []
        self.tables = [s.table.rows if s.table else ([], 0, 0) for s in springs]
        for spring in springs:
            (((_, _, f), c),) = spring.pull.terms.items() or [((0, 0, None), 0.0)]
            self.pulls.append(c)
            self.functions.append(f)

    def couples(self) -> Couples:
        return pairs_of(self.groups)

    def structure(self, places: Places) -> Springs:
        return Springs(
            translational=sum(spring.line is not None for spring in self.springs),
            f=indices(places.functions[f] for f in self.functions),
            table=starts([rows for rows, _, _ in self.tables])[:-1],
            places=indices(count for _, count, _ in self.tables),
            rates=indices(count for _, _, count in self.tables),
            vector=self.vector + np.arange(len(self.springs)),
            angle_start=self.angles - self.angles[0],
            angle=np.arange(self.angles[0], self.angles[-1]),
            slot=places.square(self.groups),
        )

    def values(self) -> SpringValues:
        return SpringValues(
            stiffness=stack([s.stiffness for s in self.springs]),
            rest=stack([RELAXED if s.rest is None else s.rest for s in self.springs]),
            cubic=stack([s.cubic for s in self.springs]),
            damping=stack([s.damping for s in self.springs]),
            pull=stack(self.pulls),
            table=stack([row for rows, _, _ in self.tables for row in rows]),
            weight=stack([angle.c for spring in self.springs for angle in spring.angles]),
        )


class LawTable:
    """The force laws; `angle` and `position` number the vectors of the first point of each."""

    def __init__(
        self,
        laws: Sequence[LawEntry],
        angle: int,
        position: int,
        groups: Sequence[Sequence[int]],
        margins: int,
    ):
        self.margins = margins
        self.compiled = [compiled_laws.compiled_law(entry.law, entry.shape) for entry in laws]
        self.laws = laws
        self.angle = angle
        self.position = position
        self.parameters = [parameter for law in laws for parameter in law.parameters]
        self.groups = []
        self.place = [[0] * len(group) for group in groups]
        point = 0
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
        gap_kinds = [law.gap_kind for law in self.laws for _ in law.events]
        return Laws(
            address=indices(law.address for law in self.compiled),
            time=places.functions.get(time, 0),
            parameter_start=starts([law.parameters for law in self.laws]),
            f=indices(places.functions[p if callable(p) else None] for p in self.parameters),
            point_start=starts([law.points for law in self.laws]),
            state_start=starts([[*law.states] for law in self.laws]),
            gap_start=starts([law.events for law in self.laws]),
            gap_kind=indices([*gap_kinds, *[GAP.margin] * self.margins]),
            gap_law=indices(s for s, law in enumerate(self.laws) for _ in law.events),
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

    def starting_states(self) -> np.ndarray:
        """Return the states at the start, `MARK.steady` where their rates vanish."""
        state_values = [value for law in self.laws for value in law.states.values()]
        return stack([MARK.steady if isinstance(value, str) else value for value in state_values])


def _memory(law: LawEntry, group: Sequence[int]) -> int:
    """Return how many rows of memory a law needs, see `kernels.laws.forces`."""
    axes = AXES * len(law.points)
    input_rows = 1 + len(law.parameters) + 4 * len(law.states) + GAP_MEMORY * len(law.events)
    return input_rows + 1 + axes * (5 + axes + 2 * len(group))


def time(t: float) -> float:
    """Return the time [s]."""
    return t


class VectorTables(NamedTuple):
    """The tables of all vectors, and of the springs and laws that use them."""

    vectors: VectorTable
    springs: SpringTable
    laws: LawTable
    actions: int  # number of the first vector of contacts that have friction

    @staticmethod
    def from_model(model: Model) -> VectorTables:
        """Return the tables of a model, vectors with angles first.

        These are those of constraints and of friction, of springs, of points of laws and of
        moments. Springs, positions of points of laws, directions of following forces, friction in
        contacts, what sensors read, and what turns with bodies and rods follow.
        """
        owned = [
            (model.state.multiplier + k, polar)
            for k, row in enumerate(model.rows_with_multipliers)
            for polar in row.polar
        ]
        springs = [spring for _, spring in model.springs]
        points = [frame for law in model.laws for frame in law.points]
        parts = [
            [polar.vector for _, polar in owned],
            [angle.vector for spring in springs for angle in spring.angles],
            [section_normal(frame) for frame in points],
            [moment.direction for moment in model.moments],
            [spring.line or (spring.polynomial, Form({})) for spring in springs],
            [frame.position for frame in points],
            [force.direction for force in model.following_forces],
            [v for _, f in model.frictions if f.sliding.action for v in f.sliding.action[:3]],
            model.sensor_directions,
            [axis for _, axes in model.turn_axes for axis in axes],
        ]
        firsts = starts(parts).tolist()
        _, angle, normal, _, elongation, position, direction, actions, *others = firsts
        sensor_angle, turning, _ = others
        vectors = VectorTable(
            [v for part in parts for v in part],
            elongation,
            [k for k, _ in owned],
            [polar.length for _, polar in owned],
            direction,
            sensor_angle,
            turning + starts([axes for _, axes in model.turn_axes]),
        )
        return VectorTables(
            vectors,
            SpringTable(springs, elongation, angle, vectors.groups),
            LawTable(model.laws, normal, position, vectors.groups, len(model.frictions)),
            actions,
        )
