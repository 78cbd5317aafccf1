"""A mechanism: bodies, joints, loads and sensors by name. It is plain data."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any

import numpy as np

from flexband.errors import InputError
from flexband.mechanics.bodies.beam import Beam
from flexband.mechanics.bodies.body import point as ground_point
from flexband.mechanics.bodies.cable import Cable
from flexband.mechanics.bodies.centre_line import Property
from flexband.mechanics.bodies.point_mass import PointMass
from flexband.mechanics.bodies.rigid import RigidBody
from flexband.mechanics.forms import Form, Frame, GeneralizedForce, constraint_force
from flexband.mechanics.joints.gears import Rolling
from flexband.mechanics.joints.joints import Joint, PointName
from flexband.mechanics.loads.force_laws import ForceLaw, TorsionSpring, ViscousFriction
from flexband.mechanics.loads.loads import Gravity, Load, Spring
from flexband.mechanics.sensors.motion import Sensor

Body = RigidBody | PointMass | Beam | Cable
LAWS = (ForceLaw, TorsionSpring, ViscousFriction)


@dataclass(frozen=True, kw_only=True)
class Mechanism:
    """A planar mechanism of rigid bodies and flexible beams.

    Parameters
    ----------
    bodies, joints, loads, sensors : name -> object. A sensor named "F" gives the outputs "F_X"
        and "F_Y".

    Raises
    ------
    InputError
        Where there is no body, or a joint, load or sensor names something the mechanism lacks.
    """

    bodies: Mapping[str, Body]
    joints: Mapping[str, Joint] = field(default_factory=dict)
    loads: Mapping[str, Load] = field(default_factory=dict)
    sensors: Mapping[str, Sensor] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.bodies:
            raise InputError("a Mechanism needs at least one body; got none")
        for name in self.bodies:
            if "." in name or not name:
                raise InputError(f"a body's name must be non-empty and without a dot; got {name!r}")
        for kind, parts, method in (
            ("body", self.bodies, "mass_entries"),
            ("joint", self.joints, "constraints"),
            ("sensor", self.sensors, "rows"),
        ):
            for name, part in parts.items():
                if not callable(getattr(part, method, None)):
                    raise InputError(f"{kind} {name!r} is no {kind}: {part!r}")
        for name, joint in self.joints.items():
            _naming(f"joint {name!r}", partial(self._check_joint, joint))
        for name, load in self.loads.items():
            _naming(f"load {name!r}", partial(self._check_load, load))
        for name, sensor in self.sensors.items():
            _naming(f"sensor {name!r}", partial(sensor.rows, self))

    def _check_joint(self, joint: Joint) -> None:
        for row in joint.constraints(self.frame):
            moved = any(j > 0 and np.any(c != 0) for (_, j, _), c in row.terms.items())
            if not moved and not row.angles:
                raise InputError(
                    "it joins the ground or a body with itself, or holds the angle of what has none"
                )

    def _check_load(self, load: Any) -> None:
        if isinstance(load, Spring):
            load.separation(self.frame)
        elif isinstance(load, LAWS):
            for point in load.force_law().points:
                self.frame(point)
        elif callable(getattr(load, "forces", None)):
            load.forces(self)
        elif not isinstance(load, Gravity):
            raise InputError(f"it is no load: {load!r}")

    @property
    def coordinates(self) -> int:
        """Number of coordinates q."""
        return sum(body.size for body in self.bodies.values())

    def first_coordinates(self) -> dict[str, int]:
        """Return where in z the coordinates of each body start; z₀ is the constant one."""
        first, places = 1, {}
        for name, body in self.bodies.items():
            places[name] = first
            first += body.size
        return places

    def frame(self, point: PointName) -> Frame:
        """Return the frame of a point.

        Raises
        ------
        InputError
            Where the mechanism has no such body or the body no such point.
        """
        if not isinstance(point, str):
            return Frame.ground(ground_point("ground point", point))
        body, _, name = point.partition(".")
        _within("body", body, self.bodies)
        return self.bodies[body].frame(name or "center", self.first_coordinates()[body])

    def velocity(self, point: PointName) -> Frame:
        """Return the rates of a point's frame."""
        return self.frame(point).shifted(self.velocity_row)

    def acceleration(self, point: PointName) -> Frame:
        """Return the second rates of a point's frame."""
        return self.frame(point).shifted(self.velocity_row + 1 + self.coordinates)

    @property
    def velocity_row(self) -> int:
        """Row of z where [0, v] starts: behind [1, q, λ, θ]."""
        angles = sum(len(row.angles) for _, row in self.constraints)
        angles += sum(len(law.points) for law in self.force_laws.values())
        return 1 + self.coordinates + len(self.constraints) + angles

    @cached_property
    def force_laws(self) -> dict[str, ForceLaw]:
        """The loads that are laws, by name."""
        return {k: load.force_law() for k, load in self.loads.items() if isinstance(load, LAWS)}

    @cached_property
    def constraints(self) -> list[tuple[str, Form]]:
        """The rows of Φ, each with the name of what it belongs to."""
        first = self.first_coordinates()
        return [
            (f"rigidity of body {name!r}", row)
            for name, body in self.bodies.items()
            for row in body.constraints(first[name])
        ] + [
            (f"joint {name!r}", row - row.at(self.guess) if isinstance(joint, Rolling) else row)
            for name, joint in self.joints.items()
            for row in joint.constraints(self.frame)
        ]

    @cached_property
    def guess(self) -> list[np.ndarray]:
        """The guess [1, q] for the start."""
        return [np.ones(()), *(c for body in self.bodies.values() for c in body.coordinates())]

    def joint(self, name: str) -> tuple[Joint, list[Form]]:
        """Return a joint and its multipliers.

        Raises
        ------
        InputError
            Where the mechanism has no such joint.
        """
        _within("joint", name, self.joints)
        owners = [owner for owner, _ in self.constraints]
        first = 1 + self.coordinates + owners.index(f"joint {name!r}")
        count = owners.count(f"joint {name!r}")
        return self.joints[name], [Form.variable(first + k) for k in range(count)]

    def spring(self, name: str) -> Spring:
        """Return a spring.

        Raises
        ------
        InputError
            Where the mechanism has no such spring.
        """
        springs = {k: load for k, load in self.loads.items() if isinstance(load, Spring)}
        _within("spring", name, springs)
        return springs[name]

    def mass_entries(self) -> dict[tuple[int, int], np.ndarray]:
        """Return the entries (i, j), i ≤ j, of the mass matrix, counted as in z."""
        first = self.first_coordinates()
        return {
            (first[name] + i, first[name] + j): value
            for name, body in self.bodies.items()
            for (i, j), value in body.mass_entries().items()
        }

    def kinetic_energy(self) -> Form:
        """Return ½ vᵀ M v."""
        row = self.velocity_row
        return Form(
            {
                (row + i, row + j, None): value * (0.5 if i == j else 1.0)
                for (i, j), value in self.mass_entries().items()
            }
        )

    @property
    def energy_row(self) -> int:
        """Row of z for the elastic energy: behind the accelerations."""
        return self.velocity_row + 2 * (1 + self.coordinates)

    def elastic_energy(self) -> Form:
        """Return the energy of beams, cables and springs."""
        return Form.variable(self.energy_row)

    def generalized_force(self, part: str) -> GeneralizedForce:
        """Return the generalized force of a joint, −Φ_qᵀλ, or of a load that is a form.

        Raises
        ------
        InputError
            Where there is no such part, or it is a spring or a force law.
        """
        if part in self.joints:
            joint, multipliers = self.joint(part)
            return constraint_force(joint.constraints(self.frame), multipliers)
        _within("joint or load", part, {**self.joints, **self.loads})
        load = self.loads[part]
        if isinstance(load, Gravity):
            return self.weight(load)
        if not callable(getattr(load, "forces", None)):
            raise InputError(f"the work of a {type(load).__name__} is not known: load {part!r}")
        return load.forces(self)

    def load(self, name: str) -> Load | None:
        """Return a load, None where there is none of the name."""
        return self.loads.get(name)

    def torsion_springs(self) -> list[str]:
        """Return the names of the torsion springs."""
        return [name for name, load in self.loads.items() if isinstance(load, TorsionSpring)]

    def potential_energy(self) -> Form:
        """Return −∫ρ g · r dV of all fields of gravity."""
        weights = [self.weight(load) for load in self.loads.values() if isinstance(load, Gravity)]
        return sum(
            (force * Form.variable(j) * -1.0 for weight in weights for j, force in weight.items()),
            Form({}),
        )

    def weight(self, field: Gravity) -> GeneralizedForce:
        """Return M g, g being the field in the nodes' positions."""
        first = self.first_coordinates()
        nodes = {first[name] + k for name, body in self.bodies.items() for k in body.nodes}
        g = {n + axis: Form.constant(a) for n in nodes for axis, a in enumerate((field.x, field.y))}
        force: GeneralizedForce = {}
        for (i, j), value in self.mass_entries().items():
            for to, of in {(i, j), (j, i)}:
                if of in g:
                    force[to] = force.get(to, Form({})) + g[of] * value
        return force

    def member(self, name: str) -> tuple[Beam | Cable, int]:
        """Return a beam or cable and where in z its coordinates start.

        Raises
        ------
        InputError
            Where the mechanism has no such beam or cable.
        """
        members = {k: body for k, body in self.bodies.items() if isinstance(body, Beam | Cable)}
        _within("beam", name, members)
        return members[name], self.first_coordinates()[name]

    def line_load(self, body: str, x: Property, y: Property) -> GeneralizedForce:
        """Return the generalized force of a load [N/m] along a beam or cable.

        Raises
        ------
        InputError
            Where the mechanism has no such beam or cable.
        """
        member, first = self.member(body)
        return {first + j: Form.constant(force) for j, force in member.line_load(x, y).items()}


def _within(kind: str, name: str, parts: Mapping[str, object]) -> None:
    if name not in parts:
        there = ", ".join(parts) or "none"
        raise InputError(f"{kind} {name!r} is not in the mechanism; there is {there}")


def _naming(place: str, action: Callable[[], object]) -> None:
    try:
        action()
    except InputError as error:
        raise InputError(f"{place}: {error}") from None
