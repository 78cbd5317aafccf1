"""A mechanism at its start: positions, outlines and heights in metres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull

from flexband.mechanics.assembly.mechanism import Mechanism
from flexband.mechanics.bodies.beam import Beam
from flexband.mechanics.bodies.centre_line import CentreLine
from flexband.mechanics.bodies.rigid import RigidBody
from flexband.mechanics.configuration import Configuration
from flexband.mechanics.joints.gears import Gear, Rack
from flexband.mechanics.joints.joint import PointName, along
from flexband.report.drawing.symbols import circle

AXIS_GAPS = 48
"""Least number of gaps between the points that the axis of a beam is drawn through."""


def body_of(point: PointName) -> str:
    """Return the name of the body of a point; empty for a point of the ground."""
    return point.partition(".")[0] if isinstance(point, str) else ""


@dataclass(frozen=True)
class Scene:
    """A mechanism and the configuration in which one of its samples starts."""

    mechanism: Mechanism
    start: Configuration

    def at(self, point: PointName) -> np.ndarray:
        """Return the position of a point [m]."""
        return self.start.vector(self.mechanism.frame(point).position)

    def velocity(self, point: PointName) -> np.ndarray:
        """Return the velocity of a point [m/s]."""
        return self.start.vector(self.mechanism.velocity(point).position)

    def pitch_circles(self, part: object) -> list[tuple[np.ndarray, float]]:
        """Return centre and radius [m] of the gears in a joint.

        The radius of a ring, and of a pinion on the right of its rack, is negative.
        """
        if not isinstance(part, Gear | Rack):
            return []
        pairs = zip(part.points, pitch_radii(part), strict=False)
        return [(self.at(point), self.start.number(radius)) for point, radius in pairs]

    def rack_line(self, rack: Rack) -> tuple[np.ndarray, np.ndarray]:
        """Return the ends [m] of the pitch line of a rack.

        It spans the points of the rack's body and half the circumference of the pinion.
        """
        ((centre, radius),) = self.pitch_circles(rack)
        x, y = axis = self.start.vector(along(self.mechanism.frame(rack.second), rack.axis))
        body = body_of(rack.second)
        points = self.corners(body) if body else [self.at(rack.second)]
        reach = np.pi * abs(radius) / 2
        ends = [-reach, reach, *(axis @ (point - centre) for point in points)]
        touch = centre + radius * np.array([y, -x])
        return touch + min(ends) * axis, touch + max(ends) * axis

    def corners(self, name: str) -> np.ndarray:
        """Return the hull of a body's named points [m], shape (points, 2).

        The hull of a single point includes the centre.
        """
        body = self.mechanism.bodies[name]
        points = [*body.points, "center"] if isinstance(body, RigidBody) else ["center"]
        places = np.array([self.at(f"{name}.{point}") for point in points])
        named = hull(places[:-1])
        return named if len(named) > 1 else hull(places)

    def outline(self, name: str) -> np.ndarray:
        """Return points [m] around a body, shape (points, 2).

        The outline of a beam follows both its sides; that of a rigid body with a single point is
        the circle of its radius of gyration.
        """
        body = self.mechanism.bodies[name]
        if isinstance(body, CentreLine):
            axis, across = self.axis(name)
            half = self.half_height(name)
            return np.concatenate([axis + half * across, (axis - half * across)[::-1]])
        corners = self.corners(name)
        if len(corners) > 1 or not isinstance(body, RigidBody):
            return corners
        mass = self.start.number(body.mass)
        radius = np.sqrt(self.start.number(body.inertia) / mass) if mass > 0 else 0.0
        return circle(corners, radius, 60)[:-1]

    def half_height(self, name: str, places: np.ndarray | None = None) -> np.ndarray:
        """Return half the height [m] of a beam at the points of `axis`, shape (places, 1).

        That of any other body is zero, shape (1, 1).
        """
        body = self.mechanism.bodies[name]
        if not isinstance(body, Beam):
            return np.zeros((1, 1))
        x = self.start.number(body.length) * (_places(body) if places is None else places)
        height = body.profile.across(lambda _, value, check: self.start.along(value, x))
        return height[:, None] / 2

    def axis(self, name: str, places: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Return points along the axis of a beam [m] and the direction of its height there.

        Both have shape (places, 2). `places` are fractions of the length; without them, there are
        equally many points in each element, and the nodes are among them.
        """
        body = self.mechanism.bodies[name]
        assert isinstance(body, CentreLine)
        places = _places(body) if places is None else places
        frames = [self.mechanism.frame(f"{name}.{place!r}") for place in places.tolist()]
        points = np.array([self.start.vector(f.position) for f in frames])
        return points, np.array([self.start.vector(f.y) for f in frames])


def pitch_radii(part: Gear | Rack) -> Sequence[ArrayLike]:
    """Return the radii [m] of the gears at the points of a joint: of a rack only the pinion's."""
    return part.radii if isinstance(part, Gear) else [part.radius]


def _places(body: CentreLine) -> np.ndarray:
    return body.fractions(max(2, -(-AXIS_GAPS // body.elements)))


def hull(points: np.ndarray) -> np.ndarray:
    """Return the corners of the convex hull in order; two corners if all points are on a line."""
    places = np.unique(points, axis=0)
    if len(places) < 3:
        return places
    size = np.ptp(places, axis=0).max()
    if np.linalg.matrix_rank(places - places[0], tol=1e-9 * size) < 2:
        return places[[0, -1]]
    corners = ConvexHull((places - places[0]) / size).vertices
    return places[np.roll(corners, -corners.argmin())]
