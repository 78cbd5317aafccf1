"""Loads: gravity, forces, moments, distributed loads and springs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from flexband.errors import InputError, finite, non_negative
from flexband.mechanics.bodies.centre_line import Property
from flexband.mechanics.forms import (
    Form,
    Frame,
    GeneralizedForce,
    TimeFunction,
    Vector,
    about,
    add,
    at_point,
    scale,
    subtract,
)
from flexband.mechanics.joints.joints import PointName, Resolve

InTime = ArrayLike | TimeFunction
"""A number, an array of shape (n,), or a function of the time [s] that returns one of these."""


class Model(Protocol):
    """What a load may ask of the mechanism."""

    def frame(self, point: PointName) -> Frame:
        """Return the frame of a point."""
        ...

    def line_load(self, body: str, x: Property, y: Property) -> GeneralizedForce:
        """Return the generalized force of a load [N/m] along a beam."""
        ...


class Load(Protocol):
    """What assembly asks of a load but a `Gravity` or a `Spring`."""

    def forces(self, model: Model) -> GeneralizedForce:
        """Return the generalized forces."""
        ...


def in_time(name: str, value: InTime) -> Form:
    """Return a form; raise `InputError` for what is neither finite nor a function of time."""
    return Form.function(value) if callable(value) else Form.constant(finite(name, value))


@dataclass(frozen=True)
class Gravity:
    """A uniform field of acceleration (X, Y) [m/s²] on every body."""

    x: ArrayLike = 0.0
    y: ArrayLike = -9.81

    def __post_init__(self) -> None:
        finite("Gravity x [m/s²]", self.x)
        finite("Gravity y [m/s²]", self.y)


@dataclass(frozen=True)
class Force:
    """A force at a point.

    Parameters
    ----------
    point : where it acts.
    x, y : components [N], in global axes or, where `following`, in the axes of the point's frame,
        which turns with the body (on a beam, with the section).
    following : which of the two.

    Raises
    ------
    InputError
        Where a component is neither finite nor a function of time.
    """

    point: PointName
    x: InTime = 0.0
    y: InTime = 0.0
    following: bool = False

    def __post_init__(self) -> None:
        for name, value in (("x", self.x), ("y", self.y)):
            in_time(f"Force {name} [N]", value)

    def forces(self, model: Model) -> GeneralizedForce:
        """Return F · ∂r/∂q."""
        frame, x, y = model.frame(self.point), in_time("x", self.x), in_time("y", self.y)
        if self.following:
            return at_point(add(scale(x, frame.normal), scale(y, frame.y)), frame.position)
        return at_point((x, y), frame.position)


@dataclass(frozen=True)
class Moment:
    """A moment at a point of a body.

    On a beam it turns the section: it does work on the rotation of r_y, whose length is taken as
    one; strains across the section make that wrong by a part of their own size.

    Parameters
    ----------
    point : where it acts.
    moment : [N m], positive from X to Y.

    Raises
    ------
    InputError
        Where the moment is neither finite nor a function of time.
    """

    point: PointName
    moment: InTime

    def __post_init__(self) -> None:
        in_time("Moment moment [N m]", self.moment)

    def forces(self, model: Model) -> GeneralizedForce:
        """Return M ∂θ/∂q."""
        return about(in_time("moment", self.moment), model.frame(self.point).normal)


@dataclass(frozen=True)
class DistributedLoad:
    """A load along the axis of a beam, in global axes; it does not follow the beam.

    Parameters
    ----------
    beam : name of the beam.
    x, y : components [N/m]: numbers, arrays of shape (n,), or functions of the position [m].
    factor : what the load is multiplied by, a function of the time [s]; none for a constant load.

    Raises
    ------
    InputError
        Where a component is neither finite nor a function.
    """

    beam: str
    x: Property = 0.0
    y: Property = 0.0
    factor: TimeFunction | None = None

    def __post_init__(self) -> None:
        for name, value in (("x", self.x), ("y", self.y)):
            if not callable(value):
                finite(f"DistributedLoad {name} [N/m]", value)
        if self.factor is not None and not callable(self.factor):
            raise InputError(f"DistributedLoad factor must be a function; got {self.factor!r}")

    def forces(self, model: Model) -> GeneralizedForce:
        """Return ∫ f · ∂r/∂q dx."""
        steady = model.line_load(self.beam, self.x, self.y)
        if self.factor is None:
            return steady
        return {j: force * Form.function(self.factor) for j, force in steady.items()}


@dataclass(frozen=True)
class Spring:
    """A translational spring, damper and actuator between two points.

    It pulls with k (ℓ − ℓ₀) + k₃ (ℓ − ℓ₀)³ + d ℓ̇ + f(t) along its line.

    Parameters
    ----------
    first, second : the points it joins.
    stiffness : k [N/m].
    rest_length : ℓ₀ [m], or None for a spring that is relaxed at the start, once the mechanism
        is assembled.
    cubic : k₃ [N/m³].
    damping : d [N s/m].
    pull : f [N], positive where it draws the points together.

    Raises
    ------
    InputError
        Where stiffness, rest length or damping is negative or a number is not finite.
    """

    first: PointName
    second: PointName
    stiffness: ArrayLike = 0.0
    rest_length: ArrayLike | None = None
    cubic: ArrayLike = 0.0
    damping: ArrayLike = 0.0
    pull: InTime = 0.0

    def __post_init__(self) -> None:
        non_negative("Spring stiffness [N/m]", self.stiffness)
        if self.rest_length is not None:
            non_negative("Spring rest_length [m]", self.rest_length)
        finite("Spring cubic [N/m³]", self.cubic)
        non_negative("Spring damping [N s/m]", self.damping)
        in_time("Spring pull [N]", self.pull)

    def separation(self, frame: Resolve) -> Vector:
        """Return r_first − r_second, whose length is ℓ."""
        return subtract(frame(self.first).position, frame(self.second).position)

    @property
    def actuator(self) -> tuple[np.ndarray, Callable | None]:
        """The pull as a number and a function of time that multiplies it."""
        if callable(self.pull):
            return np.asarray(1.0), self.pull
        return np.asarray(self.pull, dtype=float), None
