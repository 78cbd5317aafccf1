"""A mechanism at its start on paper: where its points are, and which points its parts name."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexband.mechanics.bodies.beam import Beam
from flexband.mechanics.bodies.centre_line import CentreLine
from flexband.mechanics.bodies.rigid import RigidBody
from flexband.mechanics.configuration import Configuration
from flexband.mechanics.joints.gears import Gear, Rack
from flexband.mechanics.joints.joints import PointName, along
from flexband.mechanics.mechanism import Mechanism

ALONG = 48
"""Points, or a few more, that the axis of a beam is drawn through."""


@dataclass(frozen=True)
class Scene:
    """A mechanism and where one of its samples starts."""

    mechanism: Mechanism
    start: Configuration

    def at(self, point: PointName) -> np.ndarray:
        """Return where a point is [m]."""
        return self.start.vector(self.mechanism.frame(point).position)

    def velocity(self, point: PointName) -> np.ndarray:
        """Return a point's velocity [m/s]."""
        return self.start.vector(self.mechanism.velocity(point).position)

    def pitch_circles(self, part: object) -> list[tuple[np.ndarray, float]]:
        """Return centre and radius [m] of the gears that a joint holds, the radius below zero of a
        ring and of a pinion whose rack is to its left.
        """  # noqa: D205
        if isinstance(part, Gear):
            radii = zip((part.first, part.second), part.radii, strict=True)
        else:
            radii = [(part.first, part.radius)] if isinstance(part, Rack) else []
        return [(self.at(point), self.start.number(radius)) for point, radius in radii]

    def rack_line(self, rack: Rack) -> tuple[np.ndarray, np.ndarray]:
        """Return the ends [m] of a rack's pitch line: as long as the pinion is round, or as far as
        the points of its body are.
        """  # noqa: D205
        ((centre, radius),) = self.pitch_circles(rack)
        x, y = axis = self.start.vector(along(self.mechanism.frame(rack.second), rack.axis))
        points = [self.at(rack.second)]
        if isinstance(rack.second, str):
            points = [*self.corners(rack.second.partition(".")[0])]
        reach = np.pi * abs(radius) / 2
        ways = [-reach, reach, *(axis @ (point - centre) for point in points)]
        touch = centre + radius * np.array([y, -x])
        return touch + min(ways) * axis, touch + max(ways) * axis

    def corners(self, name: str) -> np.ndarray:
        """Return the hull of a body's named points [m], shape (points, 2), with its centre where it
        has but one.
        """  # noqa: D205
        body = self.mechanism.bodies[name]
        points = [*body.points, "center"] if isinstance(body, RigidBody) else ["center"]
        places = np.array([self.at(f"{name}.{point}") for point in points])
        named = hull(places[:-1])
        return named if len(named) > 1 else hull(places)

    def outline(self, name: str) -> np.ndarray:
        """Return points [m] around a body, shape (points, 2).

        Those of a beam are along both its sides; those of a rigid body without an extent on the
        circle of its radius of gyration.
        """
        body = self.mechanism.bodies[name]
        if isinstance(body, CentreLine):
            axis, across = self.axis(name)
            half = self.height(name)[:, None] / 2
            return np.concatenate([axis + half * across, (axis - half * across)[::-1]])
        corners = self.corners(name)
        if len(corners) > 1 or not isinstance(body, RigidBody):
            return corners
        radius = np.sqrt(self.start.number(body.inertia) / self.start.number(body.mass))
        turn = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
        return corners + radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)

    def height(self, name: str, count: int = 0) -> np.ndarray:
        """Return the height of a beam [m] at the points of `axis`, shape (count + 1,).

        That of any other body is zero.
        """
        body = self.mechanism.bodies[name]
        if not isinstance(body, Beam):
            return np.zeros(1)
        x = np.linspace(0.0, self.start.number(body.length), self._count(body, count) + 1)
        return body.profile.across(lambda _, value, check: self.start.along(value, x))

    def axis(self, name: str, count: int = 0) -> tuple[np.ndarray, np.ndarray]:
        """Return points along a beam's axis [m] and the direction of its height there.

        Both have shape (count + 1, 2); where no count is given, nodes are among the points.
        """
        body = self.mechanism.bodies[name]
        assert isinstance(body, CentreLine)
        count = self._count(body, count)
        frames = [self.mechanism.frame(f"{name}.{k / count!r}") for k in range(count + 1)]
        points = np.array([self.start.vector(f.position) for f in frames])
        return points, np.array([self.start.vector(f.y) for f in frames])

    @staticmethod
    def _count(body: CentreLine, count: int) -> int:
        return count or body.elements * max(2, -(-ALONG // body.elements))


def hull(points: np.ndarray) -> np.ndarray:
    """Return the corners of the convex hull, in order; two where all points are on a line."""
    places = sorted({(float(x), float(y)) for x, y in points})
    if len(places) < 3:
        return np.reshape(places, (-1, 2))
    size = np.ptp(places, axis=0).max()

    def side(way: list[tuple[float, float]]) -> list[tuple[float, float]]:
        found: list[tuple[float, float]] = []
        for place in way:
            while len(found) > 1 and _turn(found[-2], found[-1], place) <= 1e-9 * size**2:
                found.pop()
            found.append(place)
        return found[:-1]

    return np.array(side(places) + side(places[::-1]))


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    """Return twice the area of the triangle a, b, c; positive where it turns left."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
