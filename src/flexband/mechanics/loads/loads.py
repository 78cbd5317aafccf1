"""Loads: gravity, forces, moments and distributed loads."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_finite, check_flag, check_function
from flexband.errors import InputError
from flexband.mechanics.bodies.properties import Property
from flexband.mechanics.joints.joint import PointName
from flexband.mechanics.kernels.forms import Form, TimeFunction, at_point, moves, section_normal
from flexband.mechanics.kernels.relation_forms import moment
from flexband.mechanics.loads.load import (
    Entries,
    FollowingEntry,
    InTime,
    LoadModel,
    MomentEntry,
    in_time,
)


@frozen()
class Gravity:
    """A uniform field of acceleration (x, y) [m/s²] that acts on every body.

    Parameters
    ----------
    x, y : components [m/s²].
    z : must be 0, since mechanisms are planar.

    Raises
    ------
    InputError
        If a component is not finite, or `z` is not 0.
    """

    x: ArrayLike = 0.0
    y: ArrayLike = -9.81
    z: float = 0.0

    def __post_init__(self) -> None:
        check_finite("Gravity x [m/s²]", self.x)
        check_finite("Gravity y [m/s²]", self.y)
        if np.any(self.z):
            raise InputError(
                "Gravity z must be 0, since mechanisms lie in the plane of x and y; got "
                f"{self.z}. Gravity(0, -9.81) acts along −y"
            )

    @property
    def points(self) -> Sequence[PointName]:
        """None: it acts on every body."""
        return []

    def enters(self, model: LoadModel) -> Entries:
        """Return the weight M g, and its potential −∫ρ g · r dV."""
        weight = model.weight(self.x, self.y)
        energies = (force * Form.variable(j) * -1.0 for j, force in weight.items())
        return Entries(forces=weight, potential=sum(energies, Form({})))


class _PointLoad:
    """A load at a point."""

    point: PointName

    @property
    def points(self) -> Sequence[PointName]:
        return [self.point]


@frozen()
class Force(_PointLoad):
    """A force at a point.

    Parameters
    ----------
    point : where it acts.
    x, y : components [N] in global axes or, if `following`, in axes that turn with the body. On a
        flexible member x is along the normal of the section and y to the left of it, however much
        the member is stretched or sheared.
    following : whether the force turns with the body.

    Raises
    ------
    InputError
        If a component is neither finite nor a function of time.
    """

    point: PointName
    x: InTime = 0.0
    y: InTime = 0.0
    following: bool = False

    def __post_init__(self) -> None:
        for name, value in (("x", self.x), ("y", self.y)):
            in_time(f"Force {name} [N]", value)
        check_flag("Force following", self.following)

    def enters(self, model: LoadModel) -> Entries:
        """Return F · ∂r/∂q."""
        frame = model.frame(self.point)
        x = in_time("x", self.x)
        y = in_time("y", self.y)
        if self.following and not frame.rigid:
            return Entries(following=[FollowingEntry(frame.position, section_normal(frame), x, y)])
        force = frame.direction(x, y) if self.following else (x, y)
        return Entries(forces=at_point(force, frame.position))


@frozen()
class Moment(_PointLoad):
    """A moment at a point of a body.

    On a flexible member it does work on the angle of the section, and on nothing else.

    Parameters
    ----------
    point : where it acts.
    moment : [N m], positive from X to Y.

    Raises
    ------
    InputError
        If the moment is neither finite nor a function of time.
    """

    point: PointName
    moment: InTime

    def __post_init__(self) -> None:
        in_time("Moment moment [N m]", self.moment)

    def enters(self, model: LoadModel) -> Entries:
        """Return M ∂θ/∂q."""
        value = in_time("moment", self.moment)
        frame = model.frame(self.point)
        if not moves(section_normal(frame)):
            raise InputError(f"a Moment acts on a body that rotates; {self.point!r} does not")
        if frame.rigid:
            return Entries(forces=moment(frame, value))
        return Entries(moments=[MomentEntry(section_normal(frame), value)])


@frozen()
class DistributedLoad:
    """A load along the axis of a beam or cable, in global axes; it does not turn with the beam.

    Parameters
    ----------
    beam : name of the beam or cable.
    x, y : components [N/m]: numbers, arrays of shape (n,), or functions of the position [m].
    factor : function of the time [s] that multiplies the load, or None for a constant load.

    Raises
    ------
    InputError
        If a component is neither finite nor a function.
    """

    beam: str
    x: Property = 0.0
    y: Property = 0.0
    factor: TimeFunction | None = None

    def __post_init__(self) -> None:
        for name, value in (("x", self.x), ("y", self.y)):
            if not callable(value):
                check_finite(f"DistributedLoad {name} [N/m]", value)
        if self.factor is not None:
            check_function("DistributedLoad factor", self.factor, " of time")

    @property
    def points(self) -> Sequence[PointName]:
        """The ends of the beam, between which it acts."""
        return [f"{self.beam}.start", f"{self.beam}.end"]

    def enters(self, model: LoadModel) -> Entries:
        """Return ∫ f · ∂r/∂q dx."""
        factor = Form.constant(1.0) if self.factor is None else Form.function(self.factor)
        steady = model.line_load(self.beam, self.x, self.y)
        return Entries(forces={j: force * factor for j, force in steady.items()})
