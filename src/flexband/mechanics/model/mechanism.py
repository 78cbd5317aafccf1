"""A mechanism: bodies, joints, loads and sensors by name. It is plain data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.arguments import Fixed, frozen
from flexband.basics.checks import check_finite, check_instance, check_integer
from flexband.basics.warning import warn
from flexband.basics.words import value_text, with_article
from flexband.errors import InputError
from flexband.mechanics.bodies.body import Body
from flexband.mechanics.joints.joint import Joint, body_and_point
from flexband.mechanics.loads.load import Load
from flexband.mechanics.model.frames import within
from flexband.mechanics.model.model import Model
from flexband.mechanics.model.parts import (
    check_body,
    check_entries,
    check_forms,
    check_outputs,
    name_errors,
    owned_parts,
)
from flexband.mechanics.sensors.motion import Sensor


@frozen(kw_only=True)
class Mechanism:
    """A planar mechanism of rigid bodies, point masses, beams and cables.

    Parameters
    ----------
    bodies, joints, loads, sensors : name -> object. A sensor named "F" gives outputs such as "F_X"
        and "F_Y". The mechanism keeps copies, so that changing a mapping or an array later does
        not change it.
    branches : body name -> angle [rad] from which the turns of its angle are counted, in place of
        the given one. Studies pass what they know of the nominal inputs.

    Raises
    ------
    InputError
        If there is no body, two outputs have one name, or a joint, load or sensor names something
        that the mechanism lacks. So does all that looks up a name in `model`.
    """

    bodies: Mapping[str, Body]
    joints: Mapping[str, Joint] = field(default_factory=dict)
    loads: Mapping[str, Load] = field(default_factory=dict)
    sensors: Mapping[str, Sensor] = field(default_factory=dict)
    branches: Mapping[str, ArrayLike] = field(default_factory=dict)

    @cached_property
    def model(self) -> Model:
        """The forms of the mechanism, which loads enter and sensors read."""
        return Model(self.bodies, self.joints, self.loads, self.sensors, self.branches)

    def __post_init__(self) -> None:
        # Own copies of the parts, checked one by one.
        kinds = ("body", Body), ("joint", Joint), ("load", Load), ("sensor", Sensor)
        for name, (kind, base) in zip(("bodies", "joints", "loads", "sensors"), kinds, strict=True):
            object.__setattr__(self, name, owned_parts(name, kind, base, getattr(self, name)))
        if not self.bodies:
            raise InputError("a Mechanism needs at least one body; got none")
        for name, body in self.bodies.items():
            name_errors(f"body {name!r}", check_body, body)
        # Bodies are divided where something acts on them.
        object.__setattr__(self, "bodies", Fixed(self._divide_bodies()))
        (first, dimension), *others = ((k, body.dimension) for k, body in self.bodies.items())
        for name, other in others:
            if other != dimension:
                raise InputError(
                    f"bodies must all have vectors of as many components; those of {first!r} have "
                    f"{dimension} and those of {name!r} {other}"
                )
        check_instance("branches", self.branches, Mapping, "a mapping from names to angles")
        object.__setattr__(self, "branches", Fixed(self.branches))
        for name, angle in self.branches.items():
            within("body", name, self.bodies)
            check_finite(f"branches[{name!r}] [rad]", angle)
        # Check what parts enter into the equations.
        for name, joint in self.joints.items():
            name_errors(f"joint {name!r}", self._check_joint, joint)
        model = self.model
        for name in self.loads:
            name_errors(f"load {name!r}", check_entries, model.entries[name], model.state)
            model.forces(name)
        check_outputs(model.outputs)
        for name, sensor in self.sensors.items():
            rows = name_errors(f"sensor {name!r}", sensor.rows, model)
            count = len(model.watch_list)
            name_errors(f"sensor {name!r}", check_forms, "rows", rows, model.state.rows + count)

    def _divide_bodies(self) -> dict[str, Body]:
        """Divide the bodies at the points where joints and loads act."""
        points: dict[str, list[str]] = {name: [] for name in self.bodies}
        for part in (*self.joints.values(), *self.loads.values()):
            for body, point in map(body_and_point, part.points):
                if body in points:
                    points[body].append(point)
        return {name: body.divide_at(points[name]) for name, body in self.bodies.items()}

    def _check_joint(self, joint: Joint) -> None:
        rows = joint.constraints(self.model.frame)
        check_forms("constraints", rows, 1 + sum(body.size for body in self.bodies.values()))
        self._check_points(joint)
        kind = with_article(type(joint).__name__)
        for row in (*rows, *(spring.travel for spring in joint.compliances(self.model.frame))):
            has_motion = any(j > 0 and np.any(c != 0) for (_, j, _), c in row.terms.items())
            if not has_motion and not row.polar:
                raise InputError(
                    f"{kind} must hold something that moves: only bodies that rotate have an "
                    "angle, and a point mass does not"
                )

    def _check_points(self, joint: Joint) -> None:
        """Raise `InputError` if a joint is between points that cannot move against each other."""
        points = list(joint.points)
        owners = {body for body, _ in map(body_and_point, points)}
        if len(points) < 2 or len(owners) > 1:
            return
        (owner,) = owners
        body = self.bodies.get(owner)
        text = " and ".join(map(value_text, points))
        kind = with_article(type(joint).__name__)
        if not owner:
            raise InputError(f"its points {text} are both of the ground; one must be of a body")
        if body is not None and (len(body.nodes) == 1 or len(set(points)) == 1):
            raise InputError(
                f"its points {text} are both of body {owner!r}; {kind} is between two bodies, or a "
                "body and the ground, whose points are pairs (X, Y)"
            )

    def refined(self, parts: int = 2) -> Mechanism:
        """Return the mechanism with this many elements in place of each of every flexible member.

        Points keep their names and places, "node 2" included, and so do joints, loads and sensors.
        A mechanism without elements is returned as it is.

        Raises
        ------
        InputError
            If `parts` is not a whole number, 1 or more, or a member gets too many elements.
        """
        check_integer("parts", parts, 1)
        bodies = {
            name: name_errors(f"body {name!r}", body.refine_mesh, parts)
            for name, body in self.bodies.items()
        }
        if all(bodies[name] is body for name, body in self.bodies.items()):
            return self
        return replace(self, bodies=bodies)

    @property
    def elements(self) -> dict[str, int]:
        """The number of elements of each flexible member."""
        return {name: body.elements for name, body in self.bodies.items() if body.elements}

    @property
    def without_elements(self) -> list[str]:
        """The flexible members whose number of elements was left out."""
        return [name for name, body in self.bodies.items() if body.elements_left_out]

    def check_sensors(self) -> None:
        """Raise `InputError` if there are no sensors, without which nothing is returned."""
        if not self.sensors:
            raise InputError(
                "the mechanism has no sensors, so it has no outputs; add what is to be known, such "
                "as Mechanism(..., sensors={'tip': fb.Position('arm.end')})"
            )

    def at_rest(self) -> Mechanism:
        """Return the mechanism for statics and modes, without sensors that are of a motion.

        Joints that switch are as at the start.
        """
        joints = {name: joint.at_rest() for name, joint in self.joints.items()}
        sensors = {name: sensor for name, sensor in self.sensors.items() if sensor.in_equilibrium}
        if len(sensors) == len(self.sensors) and not self.switches:
            return self
        return replace(self, joints=joints, sensors=sensors)

    @property
    def switches(self) -> bool:
        """Whether a joint of it becomes active or inactive."""
        return any(joint.at_rest() is not joint for joint in self.joints.values())

    def left_out_at_rest(self) -> dict[str, list[str]]:
        """Return the attribute that lists sensors which statics and modes leave out; warn of it."""
        names = [name for name, sensor in self.sensors.items() if not sensor.in_equilibrium]
        if not names:
            return {}
        warn(
            f"left out: {', '.join(map(repr, names))}, since what these sensors return is of a "
            "motion, and there is none"
        )
        return {"left_out": names}
