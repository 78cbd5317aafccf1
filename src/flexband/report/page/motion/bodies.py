"""Bodies of an animated mechanism: what is drawn of each, in points that are tracked."""

from __future__ import annotations

from typing import Any

import numpy as np

from flexband.mechanics.bodies.centre_line import CentreLine
from flexband.mechanics.bodies.point_mass import PointMass
from flexband.mechanics.bodies.rigid import RigidBody
from flexband.mechanics.joints.gears import Gear, Rack
from flexband.mechanics.kernels.forms import Vector, add, scale
from flexband.mechanics.sensors.motion import SensorModel
from flexband.report.drawing.bodies import drawn_by_a_joint
from flexband.report.drawing.scene import Scene, body_of, hull, pitch_radii
from flexband.report.page.motion.tracks import Tracks

GAPS = 24
"""Least number of gaps between the points that the axis of a beam is drawn through."""

OUTLINE_GAPS = 12
"""Least number of gaps of the same in other samples."""

Item = dict[str, Any]


def body_item(scene: Scene, tracks: Tracks, name: str) -> Item:
    """Return what is drawn of a body.

    Returns
    -------
    `kind` and `name`, and numbers of points: `axis` of a "beam" or a "cable" with `nodes`, the
    number of gaps between two nodes, and `half`, half the heights [m]; `corners` of a "link" and
    `stays`, the corners that a centre of mass outside is joined to; the `center` of all others, a
    "mass", a "disc", a "center" whose body a joint draws, or an "unknown". Discs and gears have a
    `radius` [m] and a point `rim`, rigid bodies a direction `turn`.
    """
    body = scene.mechanism.bodies[name]
    shape: Item = {"name": name, "kind": "unknown"}
    if isinstance(body, CentreLine):
        return shape | _line(scene, tracks, name, body)
    shape["center"] = tracks.point(f"{name}.center")
    if isinstance(body, PointMass):
        shape["kind"] = "mass"
    elif isinstance(body, RigidBody):
        shape |= {"turn": tracks.turn(f"{name}.center"), **_rigid(scene, tracks, name, body)}
    return shape


def outline(shape: Item) -> Item:
    """Return what is drawn of a body in other samples.

    Returns
    -------
    Numbers of `points`, and whether the line through them is `closed`; with a `radius`, a circle
    about the first.
    """
    axis = shape.get("axis")
    if axis is not None:
        return {"points": axis[:: max(1, (len(axis) - 1) // OUTLINE_GAPS)], "closed": False}
    if "radius" in shape:
        points = [shape["center"], shape["rim"]]
        return {"points": points, "closed": False, "radius": shape["radius"]}
    corners = shape.get("corners", [shape["center"]])
    return {"points": corners, "closed": len(corners) > 2}


def _line(scene: Scene, tracks: Tracks, name: str, body: CentreLine) -> Item:
    each = -(-GAPS // body.elements)
    places = body.fractions(each)
    half = scene.half_height(name, places).ravel()
    return {
        "kind": "beam" if half.any() else "cable",
        "axis": [tracks.point(f"{name}.{place!r}") for place in places.tolist()],
        "nodes": each,
        "half": [float(f"{value:.5g}") for value in half],
    }


def _rigid(scene: Scene, tracks: Tracks, name: str, body: RigidBody) -> Item:
    corners, center = scene.corners(name), scene.at(name)
    points = [f"{name}.{point}" for point in (*body.points, "center")]
    if len(corners) > 1:
        places = np.array([scene.at(point) for point in points])
        numbers = [
            tracks.point(points[int(np.argmin(np.linalg.norm(places - corner, axis=1)))])
            for corner in corners
        ]
        shape: Item = {"kind": "link", "corners": numbers, "stays": []}
        around = hull(np.concatenate([corners, center[None]])).tolist()
        if center.tolist() in around and center.tolist() not in corners.tolist():  # it is outside
            nearest = np.argsort(np.linalg.norm(corners - center, axis=1))[:2]
            shape["stays"] = [numbers[k] for k in nearest]
        return shape
    drawn = drawn_by_a_joint(scene, name)
    radius = _pitch_radius(scene, name)
    if not drawn:  # a circle of its radius of gyration
        square = scene.start.number(body.inertia) / scene.start.number(body.mass)
        radius = float(np.sqrt(square))
    if radius:
        shape = {"radius": radius, "rim": tracks.position(lambda model: _rim(model, name, radius))}
    else:
        shape = {}
    return shape | {"kind": "center" if drawn else "disc"}


def _pitch_radius(scene: Scene, name: str) -> float:
    """Return the largest radius of a body's gears [m], 0 without any."""
    radii = [
        abs(scene.start.number(radius))
        for joint in scene.mechanism.joints.values()
        if isinstance(joint, Gear | Rack)
        for point, radius in zip(joint.points, pitch_radii(joint), strict=False)
        if body_of(point) == name
    ]
    return max(radii, default=0.0)


def _rim(model: SensorModel, name: str, radius: float) -> Vector:
    """Return the point of a body at a radius on its x axis."""
    frame = model.frame(f"{name}.center")
    return add(frame.position, scale(radius, frame.normal))
