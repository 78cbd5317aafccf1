"""A mechanism at its start: positions and heights in metres."""

from __future__ import annotations

from dataclasses import dataclass
from functools import singledispatch

import numpy as np
import scipy

from flexband.errors import InputError
from flexband.mechanics.bodies.beam import Beam
from flexband.mechanics.bodies.body import Body
from flexband.mechanics.bodies.rigid import RigidBody
from flexband.mechanics.configuration import Configuration
from flexband.mechanics.joints.gears import Rack
from flexband.mechanics.joints.joint import PointName
from flexband.mechanics.joints.joints import Revolute
from flexband.mechanics.kernels.forms import TimeFunction
from flexband.mechanics.kernels.relation_forms import along
from flexband.mechanics.model.mechanism import Mechanism


def body_of(point: PointName) -> str:
    """Return the name of the body of a point; empty for a point of the ground."""
    return point.partition(".")[0] if isinstance(point, str) else ""


def pin_between(scene: Scene, first: PointName, second: PointName = (0.0, 0.0)) -> PointName | None:
    """Return the point where the bodies of two points are pinned together, None without a pin."""
    for joint in scene.mechanism.joints.values():
        if isinstance(joint, Revolute):
            bodies = [body_of(end) for end in joint.points]
            if set(bodies) == {body_of(first), body_of(second)}:
                return joint.first if bodies[0] else joint.second
    return None


@dataclass(frozen=True)
class Scene:
    """A mechanism and the configuration in which one of its samples starts."""

    mechanism: Mechanism
    start: Configuration

    def at(self, point: PointName) -> np.ndarray:
        """Return the position of a point [m]."""
        return self.start.vector(self.mechanism.model.frame(point).position)

    def velocity(self, point: PointName) -> np.ndarray:
        """Return the velocity of a point [m/s]."""
        return self.start.vector(self.mechanism.model.velocity(point).position)

    def corners(self, name: str) -> np.ndarray:
        """Return the hull of a body's named points [m], (points, 2); of one, and the centre."""
        points = named_points(self.mechanism.bodies[name])
        places = np.array([self.at(f"{name}.{point}") for point in points])
        outline = hull(places[:-1])
        return outline if len(outline) > 1 else hull(places)

    def rack_line(self, rack: Rack) -> tuple[np.ndarray, np.ndarray]:
        """Return the ends [m] of a rack's pitch line, over its points and half the pinion."""
        centre = self.at(rack.first)
        radius = self.start.number(rack.radius)
        x, y = axis = self.start.vector(along(self.mechanism.model.frame(rack.second), rack.axis))
        body = body_of(rack.second)
        points = self.corners(body) if body else [self.at(rack.second)]
        reach = np.pi * abs(radius) / 2
        ends = [-reach, reach, *(axis @ (point - centre) for point in points)]
        touch = centre + radius * np.array([y, -x])
        return touch + min(ends) * axis, touch + max(ends) * axis

    def half_height(self, name: str, places: np.ndarray) -> np.ndarray:
        """Return half the height [m] of a body at parts of its length: zeros but for a beam."""
        return half_height(self.mechanism.bodies[name], self.start, places)

    def first_sense(self, motion: TimeFunction) -> float:
        """Return the sign of the first motion of a drive, 1 if it does not move."""
        start = self.start.number(motion(0.0))
        for time in 10.0 ** np.arange(-6, 3):
            try:
                moved = self.start.number(motion(time)) - start
            except InputError:  # after the end of the road
                break
            if abs(moved) > 1e-9 * (1.0 + abs(start)):
                return float(np.sign(moved))
        return 1.0


@singledispatch
def named_points(body: Body) -> list[str]:
    """Return the names of the points that a body is drawn through; the last is its centre."""
    return ["center"]


@named_points.register
def _(body: RigidBody) -> list[str]:
    return [*body.points, "center"]


@singledispatch
def half_height(body: Body, start: Configuration, places: np.ndarray) -> np.ndarray:
    """Return half the height [m] of a body at parts of its length, shape (places,)."""
    return np.zeros(len(places))


@half_height.register
def _(body: Beam, start: Configuration, places: np.ndarray) -> np.ndarray:
    x = start.number(body.length) * places
    return body.profile.across(lambda _, value, check: start.along(value, x)) / 2


def hull(points: np.ndarray) -> np.ndarray:
    """Return the corners of the convex hull in order; two corners if all points are on a line."""
    places = np.unique(points, axis=0)
    if len(places) < 3:
        return places
    size = np.ptp(places, axis=0).max()
    if np.linalg.matrix_rank(places - places[0], tol=1e-9 * size) < 2:
        return places[[0, -1]]
    corners = scipy.spatial.ConvexHull((places - places[0]) / size).vertices
    return places[np.roll(corners, -corners.argmin())]
