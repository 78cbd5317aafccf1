"""Rigid bodies as ANCF reference nodes: Eqs. (23)–(25)."""

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
    second_moments : (∫x² dm, ∫y² dm) about the centre of mass, along the body's axes [kg m²].
        Their sum is the moment of inertia.
    points : name -> coordinates (x, y) in the body's axes, from the centre of mass [m].
        The point "center" is always there.
    position : where the centre of mass starts [m]. A guess will do: assembly corrects it.
    angle : from the X axis to the body's x axis at the start [rad], a guess as well.

    Raises
    ------
    InputError
        Where a number is not finite, the mass or a second moment is not positive.
    """

    mass: ArrayLike
    second_moments: tuple[ArrayLike, ArrayLike]
    points: Mapping[str, Point] = field(default_factory=dict)
    position: Point = (0.0, 0.0)
    angle: ArrayLike = 0.0

    def __post_init__(self) -> None:
        positive("RigidBody mass [kg]", self.mass)
        for moment in pair("RigidBody second_moments", self.second_moments):
            positive("RigidBody second_moments [kg m²]", moment)
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

        Lengths are in m, the density in kg/m³. Its mass is ρLhw, its second moments are mL²/12
        and mh²/12.

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
            second_moments=(mass * a**2 / 12, mass * b**2 / 12),
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
    def nodes(self) -> int:
        """Number of nodes, of six coordinates each."""
        return 1

    def coordinates(self) -> list[np.ndarray]:
        """Return the six coordinates [r, r_x, r_y] at the start, each of shape () or (n,)."""
        turn = np.asarray(self.angle, dtype=float)
        x, y = (np.asarray(p, dtype=float) for p in self.position)
        return [x, y, np.cos(turn), np.sin(turn), -np.sin(turn), np.cos(turn)]

    def mass_entries(self) -> MassEntries:
        """Return the exact mass matrix, diagonal at the centre of mass."""
        diagonal = (self.mass, *self.second_moments)
        return {(i, i): np.asarray(diagonal[i // 2], dtype=float) for i in range(6)}

    def frame(self, name: str, first: int) -> Frame:
        """Return the frame of a named point; the body's coordinates start at z_first."""
        points = {"center": (0.0, 0.0), **self.points}
        known("point", name, points)
        return Frame.of_node(first).moved(*points[name])

    def constraints(self, first: int) -> list[Form]:
        """Return the conditions of rigidity, Eq. (24)."""
        node = Frame.of_node(first)
        one = Form.constant(1.0)
        return [dot(node.x, node.x) - one, dot(node.y, node.y) - one, dot(node.x, node.y)]
