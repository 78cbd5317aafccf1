"""Sensors of forces: of joints, drives and springs, and of what force laws remember."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_instance, check_option
from flexband.errors import InputError
from flexband.mechanics.joints.joint import Couple
from flexband.mechanics.kernels.forms import Form, section_normal
from flexband.mechanics.sensors.motion import Sensor, SensorModel, VectorSensor


@frozen()
class Reaction(VectorSensor):
    """The force that a joint exerts on its first body [N]: outputs "_X" and "_Y".

    Parameters
    ----------
    joint : its name.
    axes : "global", or "body" for the axes of the joint's first point. The outputs are then "_x"
        and "_y".

    Raises
    ------
    InputError
        If `axes` is neither of these, or the joint exerts no force.

    Examples
    --------
    >>> weight = fb.Mechanism(
    ...     bodies={"weight": fb.PointMass(mass=2.0, position=(0.0, 0.0))},
    ...     joints={"hook": fb.Revolute("weight", (0.0, 0.0))},
    ...     loads={"gravity": fb.Gravity()},
    ...     sensors={"hook": fb.Reaction("hook")},
    ... )
    >>> float(fb.equilibrium(weight).sel(output="hook_Y").round(2))  # [N]
    19.62
    """

    joint: str
    axes: str = "global"
    unit = "N"
    impulsive = True
    in_place = "that of the Reaction in global axes"

    def __post_init__(self) -> None:
        check_option("axes", self.axes, ["global", "body"])

    def outputs(self, model: SensorModel) -> list[tuple[str, str]]:
        if self.axes == "body":
            return [("_x", "N"), ("_y", "N")]
        return super().outputs(model)

    def rows(self, model: SensorModel) -> Sequence[Form]:
        joint, multipliers = model.joint(self.joint)
        force = joint.force(model.frame, multipliers)
        if force is None:
            raise InputError(f"joint {self.joint!r} exerts a moment and no force")
        return (
            force if self.axes == "global" else [*force, *section_normal(model.frame(joint.first))]
        )

    def derives(self, model: SensorModel) -> bool:
        return self.axes == "body"

    def derive(self, rows: np.ndarray, model: SensorModel) -> np.ndarray:
        if self.axes == "global":
            return rows
        fx, fy, nx, ny = rows
        size = np.hypot(nx, ny)
        return np.stack([(fx * nx + fy * ny) / size, (fy * nx - fx * ny) / size])


@frozen()
class ReactionMoment(Sensor):
    """The moment that a joint or drive exerts on its first body [N m].

    On a flexible member it is the moment on the angle of the section.

    Raises
    ------
    InputError
        If the joint exerts no moment.
    """

    joint: str
    units = (("", "N m"),)
    impulsive = True

    def rows(self, model: SensorModel) -> Sequence[Form]:
        moments = self._moments(model)
        if not self.derives(model):
            return [sum((moment for moment, _ in moments), Form({}))]
        return [
            form
            for moment, vectors in moments
            for form in (moment, *itertools.chain.from_iterable(vectors))
        ]

    def derives(self, model: SensorModel) -> bool:
        return any(vectors for _, vectors in self._moments(model))

    def _moments(self, model: SensorModel) -> Sequence[Couple]:
        joint, multipliers = model.joint(self.joint)
        moments = joint.moments(model.frame, multipliers)
        if not moments:
            raise InputError(f"joint {self.joint!r} exerts no moment")
        return moments

    def derive(self, rows: np.ndarray, model: SensorModel) -> np.ndarray:
        if len(rows) == 1:  # of rigid bodies
            return rows
        row_iterator = iter(rows)
        terms = [
            next(row_iterator)
            * np.prod([np.hypot(next(row_iterator), next(row_iterator)) for _ in vectors], axis=0)
            for _, vectors in self._moments(model)
        ]
        return np.sum(terms, axis=0)[None]


@frozen()
class SpringForce(Sensor):
    """The tension k x + k₃ x³ + d ℓ̇ + f of a `Spring` [N], and its length ℓ [m]: "_F" and "_l"."""

    spring: str
    units = (("_F", "N"), ("_l", "m"))

    def rows(self, model: SensorModel) -> Sequence[Form]:
        return model.spring(self.spring, torsion=False)


@frozen()
class LawForce(Sensor):
    """The force and the moment of a `ForceLaw` or `Bushing` on its first point.

    They are in global axes: outputs "_X" and "_Y" [N], "_M" [N m].

    Raises
    ------
    InputError
        If the load is not one of these.
    """

    load: str
    units = (("_X", "N"), ("_Y", "N"), ("_M", "N m"))

    def __post_init__(self) -> None:
        check_instance("LawForce load", self.load, str, "the name of a load")

    def rows(self, model: SensorModel) -> Sequence[Form]:
        laws = {name: entries.laws for name, entries in model.entries.items() if entries.laws}
        if self.load not in laws:
            raise InputError(f"load must be one of {', '.join(laws) or 'none'}; got {self.load!r}")
        count = sum(3 * len(law.points) for law in laws[self.load])
        pairs = model.generalized_force(self.load)
        return [force for force, _ in pairs[len(pairs) - count :][:3]]


@frozen()
class LawState(Sensor):
    """A first-order state of a `ForceLaw`, such as a pressure.

    Parameters
    ----------
    load : name of the load.
    state : name of the state.
    unit : of the state, for labels.

    Raises
    ------
    InputError
        If the unit is not text, or the load has no state of that name.
    """

    load: str
    state: str
    unit: str = ""

    def __post_init__(self) -> None:
        check_instance("LawState unit", self.unit, str, "text")

    def outputs(self, model: SensorModel) -> list[tuple[str, str]]:
        return [("", self.unit)]

    def rows(self, model: SensorModel) -> Sequence[Form]:
        return [model.law_state(self.load, self.state)]


@frozen()
class SpringMoment(Sensor):
    """The moment of a `TorsionSpring` on its first body [N m], and φ [rad]: "_M" and "_angle".

    The moment is −(k (φ − φ₀) + k₃ (φ − φ₀)³ + d φ̇) + T.
    """

    spring: str
    units = (("_M", "N m"), ("_angle", "rad"))

    def rows(self, model: SensorModel) -> Sequence[Form]:
        tension, angle = model.spring(self.spring, torsion=True)
        return [-tension, angle]
