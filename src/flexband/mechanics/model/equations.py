"""The equations of motion as forms in the state z: rows of Φ, travels, forces and angles."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from flexband.errors import InputError
from flexband.mechanics.contact.friction import Activity
from flexband.mechanics.kernels.forms import (
    Form,
    GeneralizedForce,
    Polar,
    Vector,
    add,
    at_point,
    scale,
    section_normal,
)
from flexband.mechanics.kernels.laws.forces import AXES
from flexband.mechanics.kernels.state import FRICTION_ROWS, rows_of_gaps
from flexband.mechanics.model.frames import within
from flexband.mechanics.model.part_rows import PartRows
from flexband.mechanics.model.parts import name_errors
from flexband.mechanics.sensors.motion import ContactRows


class EquationForms(PartRows):
    """The forms of the equations of motion, with variables of z in place of their angles."""

    @cached_property
    def sensor_directions(self) -> list[Vector]:
        """The vectors whose angles sensors alone read."""
        return [section_normal(self.frame(point)) for point in self.sensor_points]

    @cached_property
    def drawn_angles(self) -> list[ArrayLike]:
        """The angles θ near which those in z are at the start, see `turns`; 0 for lengths."""
        polars = (self.polars[row][0] for row in range(self.state.angle, self.state.velocity))
        return [0.0 if polar.length else self.drawn(polar.vector) for polar in polars]

    @cached_property
    def turn_axes(self) -> list[tuple[str, list[Vector]]]:
        """The axes that turn with each body, and the rods of joints, with the part's name."""
        parts = []
        for name, (axes, *_) in self.axes.items():
            if len(axes):
                vectors = [tuple(map(Form.variable, axis)) for axis in axes.tolist()]
                parts.append((f"body {name!r}", vectors))
        for name, joint in self.joints.items():
            parts += [(f"joint {name!r}", [rod]) for rod in joint.rods(self.frame)]
        return parts

    @cached_property
    def _rows_of_variables(self) -> list[Form]:
        """The rows of Φ and the travels of frictions, with variables of z as angles."""
        variables = itertools.count(self.state.angle)
        return [row.with_variables(variables) for row in self.rows_with_multipliers]

    @property
    def constraint_forms(self) -> list[Form]:
        """The rows of Φ with variables of z in place of the angles."""
        return self._rows_of_variables[: len(self.constraints)]

    @property
    def travel_forms(self) -> list[Form]:
        """The travels of frictions with variables of z in place of the angles."""
        return self._rows_of_variables[len(self.constraints) :]

    @cached_property
    def normal_forces(self) -> list[Sequence[Vector]]:
        """Of each friction, the vectors whose lengths add up to its normal force."""
        normals = []
        for name, friction in self.frictions:
            owners = [owner for owner, _ in self.contact_laws]
            forces = [c.force for c in self.contacts(name)] if name in owners else []
            if name in self.joints and not forces:
                first_row = self.state.sliding + FRICTION_ROWS * len(self.frictions)
                forces = [Form.variable(first_row + k) for k in self._rows_of(name)]
            normal = friction.normal(forces)
            if friction.active:
                normal = [
                    (name_errors(f"joint {name!r}", self._activity, friction.active), Form({}))
                ]
            normals.append(normal)
        return normals

    def _activity(self, active: Activity) -> Form:
        """Return what is positive where a joint that switches is active."""
        if not isinstance(active, tuple):
            return Form.function(active) - 0.5
        first = rows_of_gaps.py_func(self.state).mode
        return Form.variable(first + self._number_in_laws("event", *active)) * -1.0

    def forces(self, load: str) -> GeneralizedForce:
        """Return the generalized forces of a load, on coordinates and, of moments, on angles.

        Those of springs and force laws are left out. Raise `InputError` if one acts on anything
        else.
        """
        entries = self.entries[load]
        state = self.state
        for j in entries.forces:
            if not (0 < j <= state.coordinates or state.angle <= j < state.sensor_angle):
                raise InputError(
                    f"load {load!r}: forces must act on coordinates, rows 1 to {state.coordinates} "
                    f"of z, or on angles; got a force on row {j}"
                )
        force = dict(entries.forces)
        before = self._before(load, "moments")
        first = state.sensor_angle - len(self.moments) + before
        for k, entry in enumerate(entries.moments):
            force[first + k] = force.get(first + k, Form({})) + entry.moment
        first = state.direction + self.dimension * self._before(load, "following")
        for k, entry in enumerate(entries.following):
            x, y = (Form.variable(first + self.dimension * k + axis) for axis in range(2))
            vector = add(scale(entry.along, (x, y)), scale(entry.across, (-y, x)))
            for j, part in at_point(vector, entry.position).items():
                force[j] = force.get(j, Form({})) + part
        return force

    def _law_rows(self, part: str) -> list[int]:
        """Return the row of z with the first force of each law of a part."""
        before = self._before(part, "laws")
        laws = self.entries[part].laws
        points = itertools.accumulate((len(law.points) for law in laws), initial=0)
        row = self.state.law + AXES * sum(len(law.points) for law in self.laws[:before])
        return [row + AXES * point for point in points][: len(laws)]

    @cached_property
    def rubbed_rows(self) -> dict[int, int]:
        """Of each friction of a contact, the row of z with the force of the contact."""
        return self._by_contact(self._law_rows)

    @cached_property
    def rubbed_gaps(self) -> dict[int, int]:
        """Of each friction of a contact, the number of the gap of the contact."""
        return self._by_contact(self._gaps_of)

    def _by_contact(self, numbers_of: Callable[[str], list[int]]) -> dict[int, int]:
        """Return for each friction of a contact its own of the numbers of its part."""
        numbers = {name: iter(numbers_of(name)) for name in self.entries}
        frictions = enumerate(self.frictions)
        return {k: next(numbers[name]) for k, (name, f) in frictions if f.sliding.action}

    def _gaps_of(self, part: str) -> list[int]:
        """Return the numbers of the gaps of a load or joint."""
        before = sum(len(law.events) for law in self.laws[: self._before(part, "laws")])
        number = sum(len(law.events) for law in self.entries[part].laws)
        return list(range(before, before + number))

    def contacts(self, part: str) -> list[ContactRows]:
        """Return the contacts of a load or joint."""
        owners = [name for name, _ in self.contact_laws]
        within("part with contacts", part, dict.fromkeys(owners))
        number = owners.count(part)
        law = self._before(part, "laws")
        rows = rows_of_gaps.py_func(self.state)
        gaps = self._gaps_of(part)
        return [
            ContactRows(
                *(Form.variable(first + gaps[n]) for first in rows[1:6]),
                angular=self.laws[law + n].is_angular,
            )
            for n in range(number)
        ]

    @cached_property
    def polars(self) -> dict[int, list[Polar]]:
        """The terms of each row of z that is an angle or an elongation, which is their sum."""
        rows = self.rows_with_multipliers
        unit = np.asarray(1.0)
        angles = [polar._replace(c=unit, f=None) for row in rows for polar in row.polar]
        turns = [[angle.vector for angle in spring.angles] for _, spring in self.springs]
        turns += [[section_normal(frame) for frame in law.points] for law in self.laws]
        turns += [[moment.direction] for moment in self.moments]
        turns += [self.sensor_directions]
        angles += [Polar(vector, unit) for vectors in turns for vector in vectors]
        polars = {self.state.angle + k: [angle] for k, angle in enumerate(angles)}
        for k, (_, spring) in enumerate(self.springs):
            polars[self.state.elongation + k] = list(spring.elongation.polar)
        return polars
