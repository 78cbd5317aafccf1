"""Which rows of the state z, and which numbers, the parts of a mechanism have."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from flexband.errors import InputError
from flexband.mechanics.bodies.body import Body
from flexband.mechanics.contact.friction import FrictionEntry
from flexband.mechanics.joints.joint import Joint, PointName
from flexband.mechanics.joints.placement import place_bodies
from flexband.mechanics.kernels.forms import Form, moves
from flexband.mechanics.kernels.laws.forces import AXES
from flexband.mechanics.kernels.state import State
from flexband.mechanics.loads.load import (
    Entries,
    FollowingEntry,
    LawEntry,
    Load,
    MomentEntry,
    SpringEntry,
)
from flexband.mechanics.model.entries import entries_of
from flexband.mechanics.model.frames import Frames, within
from flexband.mechanics.model.turns import nearest
from flexband.mechanics.sensors.motion import Sensor


class PartRows(Frames):
    """Constraints, frictions and what loads enter, in the order of the engine."""

    def __init__(
        self,
        bodies: Mapping[str, Body],
        joints: Mapping[str, Joint],
        loads: Mapping[str, Load],
        sensors: Mapping[str, Sensor],
        branches: Mapping[str, ArrayLike],
    ):
        super().__init__(bodies, branches)
        self.joints = joints
        self.loads = loads
        self.sensors = sensors

    @cached_property
    def state(self) -> State:
        """The rows of the state z before those of extremes, which may depend on all of them."""
        coordinates = sum(body.size for body in self.bodies.values())
        angles = sum(len(row.polar) for row in self.rows_with_multipliers)
        angles += sum(len(spring.angles) for _, spring in self.springs)
        points = sum(len(law.points) for law in self.laws)
        angles += points + len(self.moments)
        return State.from_counts(
            coordinates=coordinates,
            multipliers=len(self.constraints),
            frictions=len(self.frictions),
            angles=angles,
            sensor_angles=len(self.sensor_points),
            springs=len(self.springs),
            directions=self.dimension * len(self.following_forces),
            poses=AXES * points,
            law_states=sum(len(law.states) for law in self.laws),
            components=sum(2 * friction.normals for _, friction in self.frictions),
            gaps=sum(len(law.events) for law in self.laws),
        )

    @cached_property
    def sensor_points(self) -> list[PointName]:
        """The points whose angles sensors read."""
        points = [point for sensor in self.sensors.values() for point in sensor.turning_points]
        return list(dict.fromkeys(points))

    def at_guess(self, form: Form) -> np.ndarray:
        """Return the value of a form in the guess, with angles on the turn that is drawn."""
        guess = list(self.guess)
        turns = []
        for polar in form.polar:
            x, y = (part.at(guess) for part in polar.vector)
            angle = nearest(np.arctan2(y, x), self.drawn(polar.vector))
            turns.append(np.hypot(x, y) if polar.length else angle)
        return form.with_variables(itertools.count(len(guess))).at([*guess, *turns])

    @cached_property
    def guess(self) -> list[np.ndarray]:
        """The guess with each body at its angle, moved to where the joints meet if possible."""
        bodies = [vectors[:, 0].tolist() for vectors in self.node_vectors.values()]
        joints = [joint for joint in self.joints.values() if not joint.holds_start]
        return place_bodies(
            self.initial_guess,
            bodies,
            [row for joint in joints for row in joint.constraints(self.frame)],
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
                condition = row - self.at_guess(row) if joint.holds_start else row
                rows.append((f"joint {name!r}", condition))
        return rows

    @cached_property
    def frictions(self) -> list[tuple[str, FrictionEntry]]:
        """What sticks and slides as the engine numbers it, each with the name of its part."""
        joints = self.joints.items()
        groups = [(name, joint.frictions(self.frame)) for name, joint in joints]
        groups += [(name, entries.frictions) for name, entries in self.entries.items()]
        frictions = [(name, friction) for name, group in groups for friction in group]
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
    def entries(self) -> dict[str, Entries]:
        """What each load, and each joint with contacts, enters in the equations of motion."""
        return entries_of(self.joints, self.loads, self)

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
    def following_forces(self) -> list[FollowingEntry]:
        """The following forces on flexible members, as the engine numbers them."""
        return [force for entries in self.entries.values() for force in entries.following]

    def _before(self, load: str, kind: str) -> int:
        """Return how many entries of a kind belong to loads before this one."""
        others = itertools.takewhile(lambda name: name != load, self.entries)
        return sum(len(getattr(self.entries[name], kind)) for name in others)

    def _rows_of(self, joint: str) -> list[int]:
        """Return the numbers of the rows of Φ that belong to a joint."""
        return [k for k, (owner, _) in enumerate(self.constraints) if owner == f"joint {joint!r}"]

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
