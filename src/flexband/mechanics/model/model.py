"""What sensors read: points, angles, forces of joints and loads, as forms in the state z."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

from flexband.mechanics.joints.joint import Joint, PointName
from flexband.mechanics.kernels.forms import Form, Frame, constraint_force, section_normal
from flexband.mechanics.kernels.laws.forces import AXES
from flexband.mechanics.kernels.state import friction_rows, reaction_rows
from flexband.mechanics.model.equations import EquationForms
from flexband.mechanics.model.frames import within
from flexband.mechanics.sensors.motion import FrictionRows
from flexband.mechanics.sensors.sensor_extremes import OverSteps


class Watched(NamedTuple):
    """A form of which a sensor wants an extreme or the integral in a window of time [s]."""

    form: Form
    kind: int
    times: tuple[float, float]
    sensor: OverSteps


class Model(EquationForms):
    """A mechanism as forms in the state z, which loads enter and sensors read."""

    @cached_property
    def outputs(self) -> dict[str, list[tuple[str, str]]]:
        """The name and the unit of each output of each sensor."""
        return {
            name: [(name + suffix, unit) for suffix, unit in sensor.outputs(self)]
            for name, sensor in self.sensors.items()
        }

    def angle(self, point: PointName) -> Form:
        """Return the angle of a point that is among the `turning_points` of a sensor."""
        section_normal(self.frame(point))  # refuses bodies of space
        return Form.variable(self.state.sensor_angle + self.sensor_points.index(point))

    def velocity(self, point: PointName) -> Frame:
        """Return the rates of a point's frame."""
        return self.frame(point).shift(self.state.velocity)

    def acceleration(self, point: PointName) -> Frame:
        """Return the second rates of a point's frame."""
        return self.frame(point).shift(self.state.acceleration)

    def joint(self, name: str) -> tuple[Joint, list[Form]]:
        """Return a joint and its multipliers: of springs, their tensions.

        Those of contacts are −1 times their force and moment.
        """
        within("joint", name, self.joints)
        if name in self.entries and self.joints[name].contacts(self.frame):
            rows = self._law_rows(name)
            force = ([Form.variable(row + axis) * -1.0 for row in rows] for axis in range(AXES))
            return self.joints[name], [sum(parts, Form({})) for parts in force]
        if springs := self._springs_of(name):
            return self.joints[name], [self._spring_forms(k)[0] for k in springs]
        frictions = [k for k, (part, _) in enumerate(self.frictions) if part == name]
        rows = [self.state.multiplier + k for k in self._rows_of(name)]
        rows += [self.state.friction + k for k in frictions]
        return self.joints[name], [Form.variable(row) for row in rows]

    def frictions_of(self, part: str) -> list[FrictionRows]:
        """Return what sticks and slides of a joint or load."""
        owners = [name for name, _ in self.frictions]
        within("part with friction", part, dict.fromkeys(owners))
        speeds = self.state.sliding + 2 * len(owners)
        rows = []
        for k in (k for k, owner in enumerate(owners) if owner == part):
            multiplier, speed = map(Form.variable, (self.state.friction + k, speeds + k))
            rows.append(FrictionRows(multiplier, speed, self.frictions[k][1].angular))
        return rows

    def over_steps(self, sensor: OverSteps) -> list[Form]:
        """Return what the engine makes of the outputs of a sensor over its steps."""
        rows = [k for k, entry in enumerate(self.watch_list) if entry.sensor is sensor]
        return [Form.variable(self.state.extreme + k) for k in rows]

    def generalized_force(self, part: str) -> list[tuple[Form, Form]]:
        """Return the forces of a joint or load, each with the variable of z that it does work on.

        They are −Φ_qᵀλ of a joint, −T on the elongation of a spring, and the forces and moments of
        a law on the positions and angles of its points, with those of friction in contacts.
        """
        within("joint or load", part, {**self.joints, **self.loads})
        frictions = enumerate(self.frictions)
        alone = [k for k, (owner, f) in frictions if owner == part and not f.sliding.action]
        travels = [self.travel_forms[k] for k in alone]
        # A joint: its constraints, friction and springs.
        if part in self.joints and not self.joints[part].contacts(self.frame):
            rows = [self.constraint_forms[k] for k in self._rows_of(part)] + travels
            rows += [self._elongation_form(k) for k in self._springs_of(part)]
            force = constraint_force(rows, self.joint(part)[1])
            return [(form, Form.variable(j)) for j, form in force.items()]
        # A load: forces on coordinates, and friction.
        multipliers = [Form.variable(self.state.friction + k) for k in alone]
        forces = self.forces(part), constraint_force(travels, multipliers)
        pairs = [(form, Form.variable(j)) for force in forces for j, form in force.items()]
        # Its springs.
        for k, (owner, _) in enumerate(self.springs):
            if owner == part:
                tension, elongation = self._spring_forms(k)
                pairs.append((-tension, elongation))
        # Its laws, on places and angles of points.
        first = sum(len(law.points) for law in self.laws[: self._before(part, "laws")])
        frames = [frame for law in self.entries[part].laws for frame in law.points]
        points = sum(len(law.points) for law in self.laws)
        angle = self.state.sensor_angle - len(self.moments) - points
        for p, frame in enumerate(frames, start=first):
            displacement = (*frame.position, Form.variable(angle + p))
            row = self.state.law + AXES * p
            pairs += [(Form.variable(row + axis), form) for axis, form in enumerate(displacement)]
        return [(force, displacement) for force, displacement in pairs if displacement.terms]

    def switching_losses(self, joint: str) -> list[Form]:
        """Return the energies that the rows of a joint that switches have taken so far."""
        count = len(self.frictions)
        owners = [name for name, f in self.frictions if f.active]
        within("joint that switches", joint, dict.fromkeys(owners))
        rows = [k for k, (name, f) in enumerate(self.frictions) if f.active and name == joint]
        return [Form.variable(self.state.sliding + 4 * count + k) for k in rows]

    def works_of_impulses(self, part: str) -> list[Form]:
        """Return the works that the impulses of a joint or load have done so far [J].

        There are none without friction, where impulses are rounds of a run.
        """
        owners = [owner for owner, _ in self.frictions]
        if not owners:
            return []
        rows = [reaction_rows.py_func(self.state).work + k for k in self._rows_of(part)]
        first = friction_rows.py_func(self.state).work
        rows += [first + k for k, owner in enumerate(owners) if owner == part]
        return [Form.variable(row) for row in rows]

    @cached_property
    def watch_list(self) -> list[Watched]:
        """The forms whose extremes and integrals sensors need, as the engine numbers them."""
        sensors = [s for s in self.sensors.values() if isinstance(s, OverSteps)]
        return [Watched(*form, s.times, s) for s in sensors for form in s.step_forms(self)]
