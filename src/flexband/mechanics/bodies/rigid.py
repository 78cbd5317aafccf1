"""Rigid bodies as ANCF reference nodes: Eqs. (23)–(25), with r_y written as r_x turned by 90°.

Of the three conditions of rigidity, Eq. (24), two say that r_y is r_x turned. That is linear, so
r_y need not be an unknown: a body has four coordinates and one condition, not six and three. The
motion is the same, step by step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from flexband.errors import InputError, finite, known, positive
from flexband.mechanics.forms import Form, Frame, dot, fixed

Point = tuple[ArrayLike, ArrayLike]
"""Coordinates (x, y) [m], each a number or an array of shape (n,)."""

MassEntries = dict[tuple[int, int], np.ndarray]
"""(i, j), i ≤ j, counted from the body's first coordinate -> entry of M, shape () or (n,)."""


def pair(name: str, value: object) -> tuple[ArrayLike, ArrayLike]:
    """Return `value` as two things; raise `InputError` where it is not."""
    try:
        first, second = value  # type: ignore[misc]
    except (TypeError, ValueError):
        raise InputError(f"{name} must be a pair; got {value!r}") from None
    return first, second


def point(name: str, value: object) -> tuple[np.ndarray, np.ndarray]:
    """Return `value` as coordinates [m]; raise `InputError` where they are not finite numbers."""
    x, y = pair(name, value)
    return finite(f"{name} X [m]", x), finite(f"{name} Y [m]", y)


@dataclass(frozen=True, kw_only=True)
class RigidBody:
    """A rigid body; its reference node sits at the centre of mass.

    Every number may be an array of shape (n,), one value a sample.

    Parameters
    ----------
    mass : kg
    inertia : moment of inertia about the centre of mass [kg m²].
    points : name -> coordinates (x, y) in the body's axes [m]. The point "center" is always there:
        the centre of mass.
    center : the centre of mass in the body's axes [m].
    position : where the origin of the body's axes starts [m]. A guess will do: assembly corrects
        it.
    angle : from the X axis to the body's x axis at the start [rad], a guess as well.
    velocity, rate : of the origin [m/s] and of the angle [rad/s] at the start. What the joints do
        not allow is left out.

    Raises
    ------
    InputError
        Where a number is not finite, the mass or the inertia is not positive.
    """

    mass: ArrayLike
    inertia: ArrayLike
    points: Mapping[str, Point] = field(default_factory=dict)
    center: Point = (0.0, 0.0)
    position: Point = (0.0, 0.0)
    angle: ArrayLike = 0.0
    velocity: Point = (0.0, 0.0)
    rate: ArrayLike = 0.0

    def __post_init__(self) -> None:
        positive("RigidBody mass [kg]", self.mass)
        positive("RigidBody inertia [kg m²]", self.inertia)
        for name, place in self.points.items():
            point(f"RigidBody point {name!r}", place)
        point("RigidBody center", self.center)
        point("RigidBody position", self.position)
        finite("RigidBody angle [rad]", self.angle)
        point("RigidBody velocity", self.velocity)
        finite("RigidBody rate [rad/s]", self.rate)

    @staticmethod
    def block(
        *,
        length: ArrayLike,
        height: ArrayLike,
        width: ArrayLike,
        density: ArrayLike,
        **motion: Any,
    ) -> RigidBody:
        """Return a homogeneous block: length along x, height along y, width out of the plane.

        Lengths are in m, the density in kg/m³. Its mass is ρLhw, its moment of inertia
        m (L² + h²)/12. `motion` is passed on: points, position, angle, velocity, rate.

        Raises
        ------
        InputError
            Where a size or the density is not positive.
        """
        a = positive("block length [m]", length)
        b = positive("block height [m]", height)
        c = positive("block width [m]", width)
        mass = positive("block density [kg/m³]", density) * a * b * c
        return RigidBody(
            mass=mass,
            inertia=mass * (a**2 + b**2) / 12,
            **motion,
        )

    @staticmethod
    def disc(
        *, radius: ArrayLike, width: ArrayLike, density: ArrayLike, **motion: Any
    ) -> RigidBody:
        """Return a homogeneous disc [m, kg/m³] of mass m = πρr²w and moment of inertia mr²/2.

        `motion` is passed on: points, position, angle, velocity, rate.

        Raises
        ------
        InputError
            Where a size or the density is not positive.
        """
        r = positive("disc radius [m]", radius)
        w = positive("disc width [m]", width)
        mass = positive("disc density [kg/m³]", density) * np.pi * r**2 * w
        return RigidBody(mass=mass, inertia=mass * r**2 / 2, **motion)

    @staticmethod
    def polygon(
        *, vertices: Sequence[Point], width: ArrayLike, density: ArrayLike, **motion: Any
    ) -> RigidBody:
        """Return a homogeneous plate whose outline has these vertices (x, y) [m], in order.

        They are in the body's axes, like its points; mass, centre and inertia follow. `motion` is
        passed on: points, position, angle, velocity, rate.

        Raises
        ------
        InputError
            Where there are fewer than three vertices, they enclose no area or cross over, or the
            width or the density is not positive.
        """
        if len(vertices) < 3:
            raise InputError(f"polygon vertices must be three or more; got {len(vertices)}")
        corners = [point(f"polygon vertex {k}", v) for k, v in enumerate(vertices)]
        x, y = (np.stack(np.broadcast_arrays(*axis)) for axis in zip(*corners, strict=True))
        x2, y2 = np.roll(x, -1, axis=0), np.roll(y, -1, axis=0)
        doubled = x * y2 - x2 * y
        area = doubled.sum(axis=0) / 2
        turn = np.sign(area)
        thickness = positive("polygon width [m]", width) * positive(
            "polygon density [kg/m³]", density
        )
        positive("area that the polygon's vertices enclose [m²]", area * turn)
        cx = ((x + x2) * doubled).sum(axis=0) / (6 * area)
        cy = ((y + y2) * doubled).sum(axis=0) / (6 * area)
        squares = x * x + x * x2 + x2 * x2 + y * y + y * y2 + y2 * y2
        mass = area * turn * thickness
        about_origin = turn * thickness * (squares * doubled).sum(axis=0) / 12
        inertia = about_origin - mass * (cx**2 + cy**2)
        return RigidBody(mass=mass, inertia=inertia, center=(cx, cy), **motion)

    @staticmethod
    def bar(
        *,
        length: ArrayLike,
        height: ArrayLike,
        width: ArrayLike,
        density: ArrayLike,
        start: Point = (0.0, 0.0),
        angle: ArrayLike = 0.0,
        velocity: Point = (0.0, 0.0),
        rate: ArrayLike = 0.0,
    ) -> RigidBody:
        """Return a homogeneous bar with the points "start" and "end" at the ends of its axis.

        It is a `block` whose place is given by its start [m] and its angle [rad], and its motion by
        the velocity of its start and the rate of its angle.

        Raises
        ------
        InputError
            Where a size or the density is not positive.
        """
        half = positive("bar length [m]", length) / 2
        turn, spin = finite("bar angle [rad]", angle), finite("bar rate [rad/s]", rate)
        x, y = point("bar start", start)
        vx, vy = point("bar velocity", velocity)
        across, along = half * np.sin(turn), half * np.cos(turn)
        return RigidBody.block(
            length=length,
            height=height,
            width=width,
            density=density,
            position=(x + along, y + across),
            angle=angle,
            velocity=(vx - spin * across, vy + spin * along),
            rate=rate,
            points={"start": (-half, 0.0), "end": (half, 0.0)},
        )

    # --- what assembly asks of every body ---------------------------------------------------

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return 4

    @property
    def nodes(self) -> range:
        """Places of the nodes' positions among the coordinates."""
        return range(0, 1)

    def coordinates(self) -> list[np.ndarray]:
        """Return the coordinates [r, r_x] at the start, each of shape () or (n,)."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        x, y, cx, cy = (np.asarray(p, dtype=float) for p in (*self.position, *self.center))
        return [x + cx * c - cy * s, y + cx * s + cy * c, c, s]

    def velocities(self) -> list[np.ndarray]:
        """Return the rates of the coordinates at the start."""
        c, s, rate = np.cos(self.angle), np.sin(self.angle), np.asarray(self.rate, dtype=float)
        x, y, cx, cy = (np.asarray(p, dtype=float) for p in (*self.velocity, *self.center))
        return [x - rate * (cx * s + cy * c), y + rate * (cx * c - cy * s), -rate * s, rate * c]

    def mass_entries(self) -> MassEntries:
        """Return the exact mass matrix: energy ½ m ṙ·ṙ + ½ J ṙ_x·ṙ_x at the centre of mass."""
        diagonal = (self.mass, self.mass, self.inertia, self.inertia)
        return {(i, i): np.asarray(d, dtype=float) for i, d in enumerate(diagonal)}

    def frame(self, name: str, first: int) -> Frame:
        """Return the frame of a named point; the body's coordinates start at z_first."""
        points = {"center": self.center, **self.points}
        known("point", name, points)
        (x, y), (cx, cy) = points[name], self.center
        offset = np.subtract(x, cx), np.subtract(y, cy)
        return Frame.of_rigid_node(first).moved(*offset)

    def constraints(self, first: int) -> list[Form]:
        """Return what is left of the conditions of rigidity, Eq. (24): r_x has length one."""
        x = Frame.of_rigid_node(first).x
        return [dot(x, x) - Form.constant(1.0)]


@dataclass(frozen=True, kw_only=True)
class PointMass:
    """A mass without extent; its only point is "center", whose axes do not turn.

    Parameters
    ----------
    mass : kg, a number or an array of shape (n,).
    position, velocity : at the start [m], [m/s]. Guesses will do: assembly corrects them.

    Raises
    ------
    InputError
        Where the mass is not positive or a number is not finite.
    """

    mass: ArrayLike
    position: Point = (0.0, 0.0)
    velocity: Point = (0.0, 0.0)

    def __post_init__(self) -> None:
        positive("PointMass mass [kg]", self.mass)
        point("PointMass position", self.position)
        point("PointMass velocity", self.velocity)

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return 2

    @property
    def nodes(self) -> range:
        """Places of the nodes' positions among the coordinates."""
        return range(0, 1)

    def coordinates(self) -> list[np.ndarray]:
        """Return r at the start."""
        return [np.asarray(p, dtype=float) for p in self.position]

    def velocities(self) -> list[np.ndarray]:
        """Return the rate of r at the start."""
        return [np.asarray(p, dtype=float) for p in self.velocity]

    def mass_entries(self) -> MassEntries:
        """Return m on the diagonal."""
        return {(i, i): np.asarray(self.mass, dtype=float) for i in range(2)}

    def frame(self, name: str, first: int) -> Frame:
        """Return the frame of "center"."""
        known("point", name, ["center"])
        position = Form.variable(first), Form.variable(first + 1)
        return Frame(position, fixed((1.0, 0.0)), fixed((0.0, 1.0)))

    def constraints(self, first: int) -> list[Form]:
        """Return none."""
        return []
