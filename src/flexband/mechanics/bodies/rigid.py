"""Rigid bodies as ANCF reference nodes, Eqs. (23)–(25), with r_y written as r_x turned by 90°.

Two of the three rigidity conditions, Eq. (24), state that r_y is r_x turned by 90°. They are linear
and are substituted, so that a body has four coordinates and one condition instead of six and three.
The motion is the same, step by step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from fractions import Fraction
from itertools import chain
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.arguments import frozen
from flexband.basics.checks import (
    check_angle,
    check_finite,
    check_instance,
    check_non_negative,
    check_option,
    check_positive,
    check_same_samples,
)
from flexband.basics.words import value_text
from flexband.errors import InputError
from flexband.mechanics.bodies.body import Body, MassEntries, Point, point
from flexband.mechanics.bodies.plausible import plausible_block
from flexband.mechanics.kernels.forms import Form, PlanarFrame, dot


@frozen(kw_only=True)
class RigidBody(Body):
    """A rigid body whose reference node is its centre of mass, Eqs. (23)–(25).

    `block`, `bar`, `disc` and `polygon` compute mass and inertia from the shape. Every number may
    be an array of shape (n,), one value per sample. `position`, `angle`, `velocity` and `rate`
    describe the start and are guesses: assembly corrects them until the joints are satisfied.

    Parameters
    ----------
    mass : mass [kg]. Both it and the inertia may be zero where joints and the masses of other
        bodies determine the motion, as for a massless rod between two bodies.
    inertia : moment of inertia about the centre of mass [kg m²].
    points : name -> coordinates (x, y) in the body's axes [m]. The point "center", the centre of
        mass, always exists.
    center : the centre of mass in the body's axes [m].
    position : the origin of the body's axes [m].
    angle : from the X axis to the body's x axis [rad].
    velocity : of the origin [m/s].
    rate : rate of the angle [rad/s].

    Raises
    ------
    InputError
        If a number is not finite, or the mass or the inertia is negative.

    Examples
    --------
    >>> bar = fb.RigidBody.bar(length=0.2, height=0.01, width=0.01, density=7800.0)
    >>> [round(float(number), 6) for number in (bar.mass, bar.inertia)]  # [kg], [kg m²]
    [0.156, 0.000521]
    """

    mass: ArrayLike
    inertia: ArrayLike
    points: Mapping[str, Point] = field(default_factory=dict)
    center: Point = (0.0, 0.0)
    position: Point = (0.0, 0.0)
    angle: ArrayLike = 0.0
    velocity: Point = (0.0, 0.0)
    rate: ArrayLike = 0.0

    per_node: ClassVar[int] = 4
    """Those of r and r_x."""

    rigid = True

    def __post_init__(self) -> None:
        check_non_negative("RigidBody mass [kg]", self.mass)
        check_non_negative("RigidBody inertia [kg m²]", self.inertia)
        check_instance(
            "RigidBody points", self.points, Mapping, "a mapping from names to coordinates"
        )
        places = []
        for name, place in self.points.items():
            if not isinstance(name, str) or not name or name == "center":
                raise InputError(
                    f"RigidBody points must have names other than 'center'; got {name!r}"
                )
            places += point(f"RigidBody point {name!r}", place)
        for name in ("center", "position", "velocity"):
            places += point(f"RigidBody {name}", getattr(self, name))
        check_angle("RigidBody angle", self.angle)
        check_finite("RigidBody rate [rad/s]", self.rate)
        check_same_samples("RigidBody", self.mass, self.inertia, self.angle, self.rate, *places)

    @staticmethod
    def block(
        *, length: ArrayLike, height: ArrayLike, width: ArrayLike, density: ArrayLike, **motion: Any
    ) -> RigidBody:
        """Return a homogeneous block of mass m = ρLhw and moment of inertia m (L² + h²)/12.

        Parameters
        ----------
        length, height, width : L along x, h along y, w out of the plane [m].
        density : ρ [kg/m³].
        **motion : `points`, `position`, `angle`, `velocity` and `rate` of the `RigidBody`.

        Raises
        ------
        InputError
            If a size is not positive, or the density is negative.
        """
        a, b, c, rho = _sizes("block", density, length=length, height=height, width=width)
        plausible_block(a, b, c)
        mass = rho * a * b * c
        return RigidBody(mass=mass, inertia=mass * (a**2 + b**2) / 12, **motion)

    @staticmethod
    def disc(
        *, radius: ArrayLike, width: ArrayLike, density: ArrayLike, **motion: Any
    ) -> RigidBody:
        """Return a homogeneous disc of mass m = πρr²w and moment of inertia mr²/2.

        Parameters
        ----------
        radius, width : r, and w out of the plane [m].
        density : ρ [kg/m³].
        **motion : `points`, `position`, `angle`, `velocity` and `rate` of the `RigidBody`.

        Raises
        ------
        InputError
            If a size is not positive, or the density is negative.
        """
        r, w, rho = _sizes("disc", density, radius=radius, width=width)
        mass = rho * np.pi * r**2 * w
        return RigidBody(mass=mass, inertia=mass * r**2 / 2, **motion)

    @staticmethod
    def polygon(
        *, vertices: Sequence[Point], width: ArrayLike, density: ArrayLike, **motion: Any
    ) -> RigidBody:
        """Return a homogeneous plate with this outline, with its mass, centre and inertia.

        Parameters
        ----------
        vertices : corners (x, y) in the body's axes [m], in order, at least three.
        width : out of the plane [m].
        density : kg/m³.
        **motion : `points`, `position`, `angle`, `velocity` and `rate` of the `RigidBody`.

        Raises
        ------
        InputError
            If there are fewer than three vertices, the outline encloses no area, touches or crosses
            itself, the width is not positive, or the density is negative.
        """
        is_sequence = isinstance(vertices, Sequence | np.ndarray) and np.iterable(vertices)
        if not is_sequence or len(vertices) < 3:
            raise InputError(
                f"polygon vertices must be 3 points or more; got {value_text(vertices)}"
            )
        corners = [point(f"polygon vertex {k}", v) for k, v in enumerate(vertices)]
        thickness, rho = _sizes("polygon", density, width=width)
        check_same_samples("polygon", thickness, rho, *chain(*corners))
        x, y = (np.stack(np.broadcast_arrays(*axis)) for axis in zip(*corners, strict=True))
        x2 = np.roll(x, -1, axis=0)
        y2 = np.roll(y, -1, axis=0)
        # Area by the shoelace formula.
        cross_products = x * y2 - x2 * y
        area = cross_products.sum(axis=0) / 2
        turn = np.sign(area)
        per_area = thickness * rho
        check_positive("area enclosed by the polygon vertices [m²]", area * turn)
        # Refuse outlines that cross; doubled corners are left out.
        edge_starts = np.flatnonzero(np.any((x != x2) | (y != y2), axis=tuple(range(1, x.ndim))))
        edge_pair = _touching_edges(*(v[edge_starts].reshape(len(edge_starts), -1) for v in (x, y)))
        if edge_pair is not None:
            edges = " and ".join(f"from vertex {edge_starts[k]}" for k in edge_pair)
            raise InputError(f"polygon vertices must not cross: the edges {edges} meet")
        # Centre of mass, mass and inertia about it.
        cx = ((x + x2) * cross_products).sum(axis=0) / (6 * area)
        cy = ((y + y2) * cross_products).sum(axis=0) / (6 * area)
        squares = x * x + x * x2 + x2 * x2 + y * y + y * y2 + y2 * y2
        mass = area * turn * per_area
        about_origin = turn * per_area * (squares * cross_products).sum(axis=0) / 12
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

        It is a `block` whose position and velocity are given at its start instead of its centre. A
        bar with further points, as a lever with its pivot, is a `block` with these `points`.

        Parameters
        ----------
        length, height, width : along the bar, across it in the plane, and out of the plane [m].
        density : kg/m³.
        start, velocity : position [m] and velocity [m/s] of the point "start".
        angle, rate : from the X axis to the bar's axis [rad], and its rate [rad/s].

        Raises
        ------
        InputError
            If a size is not positive, or the density is negative.
        """
        half = check_positive("bar length [m]", length) / 2
        turn = check_finite("bar angle [rad]", angle)
        spin = check_finite("bar rate [rad/s]", rate)
        x, y = point("bar start", start)
        vx, vy = point("bar velocity", velocity)
        check_same_samples("bar", half, turn, spin, x, y, vx, vy)
        across = half * np.sin(turn)
        along = half * np.cos(turn)
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

    def coordinates(self) -> list[np.ndarray]:  # r and r_x
        angle = np.asarray(self.angle, dtype=float)
        c = np.cos(angle)
        s = np.sin(angle)
        x, y, cx, cy = (np.asarray(p, dtype=float) for p in (*self.position, *self.center))
        return [x + cx * c - cy * s, y + cx * s + cy * c, c, s]

    def angles(self) -> Sequence[ArrayLike]:
        return [self.angle]

    def velocities(self) -> list[np.ndarray]:
        angle, rate = (np.asarray(v, dtype=float) for v in (self.angle, self.rate))
        c = np.cos(angle)
        s = np.sin(angle)
        x, y, cx, cy = (np.asarray(p, dtype=float) for p in (*self.velocity, *self.center))
        return [x - rate * (cx * s + cy * c), y + rate * (cx * c - cy * s), -rate * s, rate * c]

    def mass_entries(self) -> MassEntries:  # kinetic energy ½ m ṙ·ṙ + ½ J ṙ_x·ṙ_x
        diagonal = (self.mass, self.mass, self.inertia, self.inertia)
        return {(i, i): np.asarray(d, dtype=float) for i, d in enumerate(diagonal)}

    def frame(self, name: str, first: int) -> PlanarFrame:
        points = {"center": self.center, **self.points}
        check_option("point", name, points)
        (x, y), (cx, cy) = points[name], self.center
        return PlanarFrame.of_rigid_node(first).translate(np.subtract(x, cx), np.subtract(y, cy))

    def constraints(self, first: int) -> list[Form]:  # Eq. (24): r_x has length one
        x = PlanarFrame.of_rigid_node(first).x
        return [dot(x, x) - Form.constant(1.0)]


def _sizes(shape: str, density: ArrayLike, **sizes: ArrayLike) -> list[np.ndarray]:
    """Return the sizes [m] and the density [kg/m³] of a shape, checked."""
    arrays = [check_positive(f"{shape} {name} [m]", size) for name, size in sizes.items()]
    arrays.append(check_non_negative(f"{shape} density [kg/m³]", density))
    check_same_samples(shape, *arrays)
    return arrays


def _touching_edges(x: np.ndarray, y: np.ndarray) -> tuple[int, int] | None:
    """Return two edges of an outline (corners, n) that meet but at a common corner, or None."""
    count = len(x)
    start = np.stack([x, y])
    end = np.roll(start, -1, axis=1)
    after = np.roll(start, -2, axis=1)
    # Neighbours touch where the outline turns back.
    reversals = _orientation(start, end, after) == 0
    reversals &= _forward(start, end, after) < 0
    if reversals.any():
        k = int(np.argwhere(reversals)[0, 0])
        return k, (k + 1) % count
    # Others touch where each one's ends are not on one side of the other one.
    for k in range(count - 2):
        others = slice(k + 2, count - (k == 0))
        p = start[:, k, None]
        q = end[:, k, None]
        r = start[:, others]
        s = end[:, others]
        disjoint = np.maximum(p, q) < np.minimum(r, s)
        disjoint |= np.maximum(r, s) < np.minimum(p, q)
        contact_mask = ~disjoint.any(axis=0)
        if not contact_mask.any():
            continue
        contact_mask &= _orientation(p, q, r) * _orientation(p, q, s) <= 0
        contact_mask &= _orientation(r, s, p) * _orientation(r, s, q) <= 0
        if contact_mask.any():
            return k, k + 2 + int(np.argwhere(contact_mask)[0, 0])
    return None


def _orientation(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Return the sign of the turn from a over b to c, points of shape (2, …): 1 is to the left."""
    (ax, ay), (bx, by), (cx, cy) = a, b, c
    rounding = 4 * np.finfo(float).eps  # more than that of the difference of both products
    with np.errstate(all="ignore"):
        first_product = (bx - ax) * (cy - ay)
        second_product = (by - ay) * (cx - ax)
        sign = np.sign(first_product - second_product)
        unsure = ~(
            np.abs(first_product - second_product)
            > rounding * (np.abs(first_product) + np.abs(second_product)) + 1e-290
        )
    unsure &= ~(((bx == ax) | (cy == ay)) & ((by == ay) | (cx == ax)))  # 0 − 0
    points = [np.broadcast_to(v, sign.shape)[unsure] for v in (ax, ay, bx, by, cx, cy)]
    sign[unsure] = [_exact(*map(Fraction, numbers)) for numbers in zip(*points, strict=True)]
    return sign


def _exact(ax, ay, bx, by, cx, cy) -> int:
    turn = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    return (turn > 0) - (turn < 0)


def _forward(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Return a number that is negative where c, on the line from a to b, is on a's side of b."""
    return (np.sign(b - a) * np.sign(c - b)).sum(axis=0)
