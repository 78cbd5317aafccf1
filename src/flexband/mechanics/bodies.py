"""Rigid bodies as ANCF reference nodes: Eqs. (23)–(25), with r_y written as r_x turned by 90°.

Of the three conditions of rigidity, Eq. (24), two say that r_y is r_x turned. That is linear, so
r_y need not be an unknown: a body has four coordinates and one condition, not six and three. The
motion is the same, step by step.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from flexband.errors import InputError, finite, known, positive
from flexband.mechanics.forms import Form, Frame, dot

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
    points : name -> coordinates (x, y) in the body's axes, from the centre of mass [m].
        The point "center" is always there.
    position : where the centre of mass starts [m]. A guess will do: assembly corrects it.
    angle : from the X axis to the body's x axis at the start [rad], a guess as well.

    Raises
    ------
    InputError
        Where a number is not finite, the mass or the inertia is not positive.
    """

    mass: ArrayLike
    inertia: ArrayLike
    points: Mapping[str, Point] = field(default_factory=dict)
    position: Point = (0.0, 0.0)
    angle: ArrayLike = 0.0

    def __post_init__(self) -> None:
        positive("RigidBody mass [kg]", self.mass)
        positive("RigidBody inertia [kg m²]", self.inertia)
        for name, place in self.points.items():
            point(f"RigidBody point {name!r}", place)
        point("RigidBody position", self.position)
        finite("RigidBody angle [rad]", self.angle)

    @staticmethod
    def block(
        *,
        length: ArrayLike,
        height: ArrayLike,
        width: ArrayLike,
        density: ArrayLike,
        position: Point = (0.0, 0.0),
        angle: ArrayLike = 0.0,
        points: Mapping[str, Point] | None = None,
    ) -> RigidBody:
        """Return a homogeneous block: length along x, height along y, width out of the plane.

        Lengths are in m, the density in kg/m³. Its mass is ρLhw, its moment of inertia
        m (L² + h²)/12.

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
            points=points or {},
            position=position,
            angle=angle,
        )

    @staticmethod
    def bar(
        *,
        length: ArrayLike,
        height: ArrayLike,
        width: ArrayLike,
        density: ArrayLike,
        start: Point = (0.0, 0.0),
        angle: ArrayLike = 0.0,
    ) -> RigidBody:
        """Return a homogeneous bar with the points "start" and "end" at the ends of its axis.

        It is a `block` whose place is given by its start [m] and its angle [rad].

        Raises
        ------
        InputError
            Where a size or the density is not positive.
        """
        half = positive("bar length [m]", length) / 2
        turn = finite("bar angle [rad]", angle)
        x, y = point("bar start", start)
        center = (x + half * np.cos(turn), y + half * np.sin(turn))
        return RigidBody.block(
            length=length,
            height=height,
            width=width,
            density=density,
            position=center,
            angle=angle,
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
        turn = np.asarray(self.angle, dtype=float)
        x, y = (np.asarray(p, dtype=float) for p in self.position)
        return [x, y, np.cos(turn), np.sin(turn)]

    def mass_entries(self) -> MassEntries:
        """Return the exact mass matrix: energy ½ m ṙ·ṙ + ½ J ṙ_x·ṙ_x at the centre of mass."""
        diagonal = (self.mass, self.mass, self.inertia, self.inertia)
        return {(i, i): np.asarray(d, dtype=float) for i, d in enumerate(diagonal)}

    def frame(self, name: str, first: int) -> Frame:
        """Return the frame of a named point; the body's coordinates start at z_first."""
        points = {"center": (0.0, 0.0), **self.points}
        known("point", name, points)
        return Frame.of_rigid_node(first).moved(*points[name])

    def constraints(self, first: int) -> list[Form]:
        """Return what is left of the conditions of rigidity, Eq. (24): r_x has length one."""
        x = Frame.of_rigid_node(first).x
        return [dot(x, x) - Form.constant(1.0)]
