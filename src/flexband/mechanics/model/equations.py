"""The rows of the equations of motion: constraints, frictions, and what loads enter."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from flexband.errors import InputError
from flexband.mechanics.bodies.body import Body
from flexband.mechanics.contact.friction import Activity, FrictionEntry
from flexband.mechanics.joints.joint import Joint, PointName
from flexband.mechanics.joints.placement import placed
from flexband.mechanics.kernels.forms import (
    Form,
    GeneralizedForce,
    Polar,
    Vector,
    add,
    at_point,
    moves,
    scale,
)
from flexband.mechanics.kernels.state import FRICTION_ROWS, State, rows_of_gaps
from flexband.mechanics.loads.contacts import contact_entries
from flexband.mechanics.loads.load import (
    Entries,
    FollowingEntry,
    LawEntry,
    Load,
    MomentEntry,
    SpringEntry,
)
from flexband.mechanics.loads.springs import spring_entries
from flexband.mechanics.model.frames import Frames, within
from flexband.mechanics.model.parts import entered, naming
from flexband.mechanics.model.turns import nearest
from flexband.mechanics.sensors.motion import ContactRows, Sensor


class Equations(Frames):
    """The forms of a mechanism as the engine numbers them, and the rows of z that they take."""

    def __init__(
        self,
        bodies: Mapping[str, Body],
        joints: Mapping[str, Joint],
        loads: Mapping[str, Load],
        sensors: Mapping[str, Sensor],
        branches: Mapping[str, ArrayLike],
    ):
        super().__init__(bodies, branches)
        self.joints, self.loads, self.sensors = joints, loads, sensors

    @cached_property
    def state(self) -> State:
        """The rows of the state z before those of extremes, which may depend on all of them."""
        coordinates = sum(body.size for body in self.bodies.values())
        angles = sum(len(row.polar) for row in self.rows_with_multipliers)
        angles += sum(len(spring.angles) for _, spring in self.springs)
        points = sum(len(law.points) for law in self.laws)
        angles += points + len(self.moments)
        return State.of(
            coordinates, len(self.constraints), len(self.frictions), angles,
            len(self.sensor_points), len(self.springs), len(self.following), points,
            sum(len(law.states) for law in self.laws),
            sum(2 * friction.normals for _, friction in self.frictions),
            sum(len(law.events) for law in self.laws),
        )  # fmt: skip

    @cached_property
    def sensor_points(self) -> list[PointName]:
        """The points whose angles sensors read."""
        points = [point for sensor in self.sensors.values() for point in sensor.turning_points]
        return list(dict.fromkeys(points))

    @cached_property
    def sensor_directions(self) -> list[Vector]:
        """The vectors whose angles sensors alone read."""
        return [self.frame(point).normal for point in self.sensor_points]

    @cached_property
    def drawn_angles(self) -> list[ArrayLike]:
        """The angles θ near which those in z are at the start, see `turns`; 0 for lengths."""
        polars = (self.polars[row][0] for row in range(self.state.angle, self.state.velocity))
        return [0.0 if polar.length else self.drawn(polar.vector) for polar in polars]

    def at_guess(self, form: Form) -> np.ndarray:
        """Return the value of a form in the guess, with angles on the turn that is drawn."""
        guess, turns = list(self.guess), []
        for polar in form.polar:
            x, y = (part.at(guess) for part in polar.vector)
            angle = nearest(np.arctan2(y, x), self.drawn(polar.vector))
            turns.append(np.hypot(x, y) if polar.length else angle)
        return form.with_variables(itertools.count(len(guess))).at([*guess, *turns])

    @cached_property
    def turning(self) -> list[tuple[str, list[Vector]]]:
        """The axes that turn with each body, and the rods of joints, with the part's name."""
        parts = []
        for name, body in self.bodies.items():
            first = self.first_coordinates[name]
            if body.axes:
                axes = [tuple(Form.variable(first + k) for k in axis) for axis in body.axes]
                parts.append((f"body {name!r}", axes))
        for name, joint in self.joints.items():
            parts += [(f"joint {name!r}", [rod]) for rod in joint.rods(self.frame)]
        return parts

    @cached_property
    def guess(self) -> list[np.ndarray]:
        """The guess with each body at its angle, moved to where the joints meet if possible."""
        bodies = [
            [self.first_coordinates[name] + k for k in body.nodes]
            for name, body in self.bodies.items()
        ]
        joints = [joint for joint in self.joints.values() if not joint.holds_start]
        return placed(
            self.given, bodies, [row for joint in joints for row in joint.constraints(self.frame)]
        )

    @cached_property
    def constraints(self) -> list[tuple[str, Form]]:
        """The rows of Φ, each with the name of the part that it belongs to."""
        rows = [
            (f"rigidity of body {name!r}", row)
            for name, body in self.bodies.items()
            for row in body.constraints(self.first_coordinates[name])
        ]
        for name, joint in self.joints.items():
            for row in joint.constraints(self.frame):
                held = row - self.at_guess(row) if joint.holds_start else row
                rows.append((f"joint {name!r}", held))
        return rows

    @cached_property
    def frictions(self) -> list[tuple[str, FrictionEntry]]:
        """What sticks and slides as the engine numbers it, each with the name of its part."""
        joints = self.joints.items()
        entered = [(name, joint.frictions(self.frame)) for name, joint in joints]
        entered += [(name, entries.frictions) for name, entries in self.entries.items()]
        frictions = [(name, friction) for name, group in entered for friction in group]
        for name, friction in frictions:
            travel = friction.whole_travel
            if not (travel.terms or any(moves(polar.vector) for polar in travel.polar)):
                raise InputError(
                    f"friction of {name!r} must be against something that moves: only bodies that "
                    "rotate have an angle, and a point mass does not"
                )
        return frictions

    @property
    def rows_with_multipliers(self) -> list[Form]:
        """The rows of Φ, then the travels of frictions."""
        rows = [row for _, row in self.constraints]
        return rows + [friction.whole_travel for _, friction in self.frictions]

    @cached_property
    def _rows_of_variables(self) -> list[Form]:
        """The same with variables of z in place of the angles."""
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
                carried = self.state.sliding + FRICTION_ROWS * len(self.frictions)
                forces = [Form.variable(carried + k) for k in self._rows_of(name)]
            normal = friction.normal(forces)
            if friction.active:
                normal = [(naming(f"joint {name!r}", self._activity, friction.active), Form({}))]
            normals.append(normal)
        return normals

    def _activity(self, active: Activity) -> Form:
        """Return what is positive where a joint that switches is active."""
        if not isinstance(active, tuple):
            return Form.function(active) - 0.5
        first = rows_of_gaps.py_func(self.state).mode
        return Form.variable(first + self._number_in_laws("event", *active)) * -1.0

    @cached_property
    def entries(self) -> dict[str, Entries]:
        """What each load, and each joint with contacts, enters in the equations of motion."""
        entries = {
            name: naming(f"load {name!r}", entered, load, self) for name, load in self.loads.items()
        }
        for name, joint in self.joints.items():
            contacts, compliances = joint.contacts(self.frame), joint.compliances(self.frame)
            if name in entries and (contacts or compliances or entries[name].frictions):
                raise InputError(
                    f"joint {name!r} must not have the name of a load, since one of them has "
                    "contacts, springs or friction"
                )
            if compliances:
                entries[name] = naming(f"joint {name!r}", spring_entries, compliances)
            if contacts:
                first, second = map(self.frame, joint.points)
                entries[name] = contact_entries(contacts, first, second, closed_at_start=False)
        return entries

    @cached_property
    def springs(self) -> list[tuple[str, SpringEntry]]:
        """The springs as the engine numbers them, each with the name of its load."""
        springs = [(name, entry) for name, e in self.entries.items() for entry in e.springs]
        return sorted(springs, key=lambda spring: spring[1].line is None)

    @cached_property
    def laws(self) -> list[LawEntry]:
        """The force laws as the engine numbers them."""
        return [law for entries in self.entries.values() for law in entries.laws]

    @cached_property
    def contact_laws(self) -> list[tuple[str, LawEntry]]:
        """The laws of contacts as the engine numbers them, each with the name of its part."""
        laws = [(name, law) for name, entries in self.entries.items() for law in entries.laws]
        return [(name, law) for name, law in laws if law.is_contact]

    @cached_property
    def moments(self) -> list[MomentEntry]:
        """The moments on angles as the engine numbers them."""
        return [moment for entries in self.entries.values() for moment in entries.moments]

    @cached_property
    def following(self) -> list[FollowingEntry]:
        """The forces along directions of flexible members as the engine numbers them."""
        return [force for entries in self.entries.values() for force in entries.following]

    def forces(self, load: str) -> GeneralizedForce:
        """Return the generalized forces of a load, on coordinates and, of moments, on angles.

        Those of springs and force laws are left out. Raise `InputError` if one acts on anything
        else.
        """
        entries, state = self.entries[load], self.state
        for j in entries.forces:
            if not (0 < j <= state.coordinates or state.angle <= j < state.sensor_angle):
                raise InputError(
                    f"load {load!r}: forces must act on coordinates, rows 1 to {state.coordinates} "
                    f"of z, or on angles; got a force on row {j}"
                )
        force, before = dict(entries.forces), self._before(load, "moments")
        first = state.sensor_angle - len(self.moments) + before
        for k, entry in enumerate(entries.moments):
            force[first + k] = force.get(first + k, Form({})) + entry.moment
        first = state.direction + 2 * self._before(load, "following")
        for k, entry in enumerate(entries.following):
            x, y = (Form.variable(first + 2 * k + axis) for axis in range(2))
            vector = add(scale(entry.along, (x, y)), scale(entry.across, (-y, x)))
            for j, part in at_point(vector, entry.position).items():
                force[j] = force.get(j, Form({})) + part
        return force

    def _before(self, load: str, kind: str) -> int:
        """Return how many entries of a kind belong to loads before this one."""
        others = itertools.takewhile(lambda name: name != load, self.entries)
        return sum(len(getattr(self.entries[name], kind)) for name in others)

    def _rows_of(self, joint: str) -> list[int]:
        """Return the numbers of the rows of Φ that belong to a joint."""
        return [k for k, (owner, _) in enumerate(self.constraints) if owner == f"joint {joint!r}"]

    def _law_rows(self, part: str) -> list[int]:
        """Return the row of z with the first force of each law of a part."""
        before, laws = self._before(part, "laws"), self.entries[part].laws
        points = itertools.accumulate((len(law.points) for law in laws), initial=0)
        row = self.state.law + 3 * sum(len(law.points) for law in self.laws[:before])
        return [row + 3 * point for point in points][: len(laws)]

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

    def spring(self, name: str, *, torsion: bool) -> tuple[Form, Form]:
        """Return the tension and the elongation of a translational or a torsion spring."""
        rows = {}
        for k, (owner, spring) in enumerate(self.springs):
            if spring.angular == torsion and owner in self.loads:
                rows.setdefault(owner, self._spring_forms(k))
        within("torsion spring" if torsion else "spring", name, rows)
        return rows[name]

    def _springs_of(self, joint: str) -> list[int]:
        """Return the numbers of the springs of a joint that gives."""
        if joint not in self.joints or not self.joints[joint].compliances(self.frame):
            return []
        return [k for k, (owner, _) in enumerate(self.springs) if owner == joint]

    def _elongation_form(self, number: int) -> Form:
        """Return the elongation of a spring with variables of z in place of its angles."""
        first = sum(len(row.polar) for row in self.rows_with_multipliers)
        first += sum(len(spring.angles) for _, spring in self.springs[:number])
        variables = itertools.count(self.state.angle + first)
        return self.springs[number][1].elongation.with_variables(variables)

    def _spring_forms(self, number: int) -> tuple[Form, Form]:
        rows = (self.state.tension + number, self.state.elongation + number)
        return Form.variable(rows[0]), Form.variable(rows[1])

    def law_state(self, load: str, name: str) -> Form:
        """Return a first-order state of a force law."""
        return Form.variable(self.state.law_state + self._number_in_laws("state", load, name))

    def _number_in_laws(self, kind: str, load: str, name: str) -> int:
        """Return the number of a state or an event of a load among those of all laws."""
        names = {
            part: [n for law in entries.laws for n in getattr(law, f"{kind}s")]
            for part, entries in self.entries.items()
        }
        within(f"load with {kind}s", load, {part: group for part, group in names.items() if group})
        within(f"{kind} of load {load!r}", name, dict.fromkeys(names[load]))
        others = itertools.takewhile(lambda part: part != load, names)
        return sum(len(names[part]) for part in others) + names[load].index(name)

    def contacts(self, part: str) -> list[ContactRows]:
        """Return the contacts of a load or joint."""
        owners = [name for name, _ in self.contact_laws]
        within("part with contacts", part, dict.fromkeys(owners))
        number, law = owners.count(part), self._before(part, "laws")
        rows, gaps = rows_of_gaps.py_func(self.state), self._gaps_of(part)
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
        rows, unit = self.rows_with_multipliers, np.asarray(1.0)
        angles = [polar._replace(c=unit, f=None) for row in rows for polar in row.polar]
        turns = [[angle.vector for angle in spring.angles] for _, spring in self.springs]
        turns += [[frame.normal for frame in law.points] for law in self.laws]
        turns += [[moment.direction] for moment in self.moments]
        turns += [self.sensor_directions]
        angles += [Polar(vector, unit) for vectors in turns for vector in vectors]
        polars = {self.state.angle + k: [angle] for k, angle in enumerate(angles)}
        for k, (_, spring) in enumerate(self.springs):
            polars[self.state.elongation + k] = list(spring.elongation.polar)
        return polars
