"""Drawings of joints and drives."""

from __future__ import annotations

import numpy as np

from flexband.errors import InputError
from flexband.mechanics.joints.drives import PrescribedPath, PrescribedRotation, PrescribedTravel
from flexband.mechanics.joints.gears import Gear, Rack
from flexband.mechanics.joints.joint import Joint, PointName, along
from flexband.mechanics.joints.joints import Distance, Prismatic, Revolute, Slot, Weld
from flexband.mechanics.kernels.forms import TimeFunction
from flexband.report.drawing import symbols
from flexband.report.drawing.canvas import Canvas
from flexband.report.drawing.scene import Scene, body_of

DRIVES = "#1b7837"
ARROW_STYLE = {"color": DRIVES, "linewidth": 1.6, "zorder": 8.0}
DRIVE_TIMES = 10.0 ** np.arange(-6, 3)
"""Times [s], in this order, at which a drive may first have moved."""


def draw_joint(scene: Scene, canvas: Canvas, name: str) -> None:
    """Draw a joint with its name; a joint of unknown type is a diamond."""
    joint, gid = scene.mechanism.joints[name], f"joint {name!r}"
    places = [scene.at(point) for point in joint.points]
    named = places[0] if places else None
    match joint:
        case PrescribedRotation() | PrescribedTravel() | PrescribedPath():
            canvas.label(_draw_drive(scene, canvas, joint, gid), name, color=DRIVES)
            return
        case Revolute() | Weld():
            style = symbols.PIN if isinstance(joint, Revolute) else symbols.WELD
            canvas.mark(places[0], gid=gid, **style)
            _draw_ground(scene, canvas, joint)
        case Distance():
            canvas.line(places, linewidth=1.2, zorder=4.0, gid=gid)
            for place in places:
                canvas.mark(place, **symbols.ROD_END)
            canvas.dimension(np.array(places), scene.start.number(joint.length))
            _draw_ground(scene, canvas, joint)
            named = np.mean(places, axis=0)
        case Prismatic() | Slot():
            axis = scene.start.vector(along(scene.mechanism.frame(joint.second), joint.axis))
            canvas.line(places, **symbols.AXIS)
            ground, block = not body_of(joint.second), isinstance(joint, Prismatic)
            symbols.rails(canvas, places[0], axis, ground=ground, block=block, gid=gid)
        case Gear():
            (first, radius), (second, other) = circles = scene.pitch_circles(joint)
            symbols.gears(canvas, circles, gid)
            named = first + radius / (radius + other) * (second - first)  # where they touch
        case Rack():
            (pinion,), (start, named) = scene.pitch_circles(joint), scene.rack_line(joint)
            symbols.rack(canvas, pinion, start, named, gid)
        case _:
            symbols.unknown(canvas, places, gid)
    canvas.label(named, name)


def _draw_ground(scene: Scene, canvas: Canvas, joint: Joint) -> None:
    """Draw the ground at points that are fixed to it: a wall behind a weld, or else a bearing."""
    for place in (scene.at(point) for point in joint.points if not body_of(point)):
        up = upward(scene, joint, place)
        if isinstance(joint, Weld):
            half = scene.half_height(held_body(joint)).max() / canvas.unit
            symbols.hatch(canvas, place, up, max(16.0, half + 6.0))
        else:
            symbols.pedestal(canvas, place, up)


def _draw_drive(
    scene: Scene,
    canvas: Canvas,
    drive: PrescribedRotation | PrescribedTravel | PrescribedPath,
    gid: str,
) -> np.ndarray:
    """Draw an arrow in the direction in which a drive starts; return the place of its name [m]."""
    if isinstance(drive, PrescribedRotation):
        x, y = scene.start.vector(scene.mechanism.frame(drive.first).normal)
        sense, centre = first_sense(scene, drive.angle), scene.at(pivot(scene, drive.first))
        start = np.arctan2(y, x) + 0.35 * sense
        return symbols.turning(canvas, centre, start, 1.7 * sense, 24.0, gid=gid, **ARROW_STYLE)
    place, direction, lift = scene.at(drive.first), scene.velocity(drive.first), 0.0
    if isinstance(drive, PrescribedTravel):
        axis = scene.start.vector(along(scene.mechanism.frame(drive.second), drive.axis))
        direction, lift = first_sense(scene, drive.travel) * axis, 20.0
        canvas.line([place, scene.at(drive.second)], **symbols.AXIS)
    canvas.mark(place, "o", 11.0, color=DRIVES, markerfacecolor="none", zorder=8.0)
    if not np.any(direction):
        return place
    shaft = canvas.local(place, direction, [(0.0, lift), (36.0, lift)])
    canvas.arrow(shaft, gid=gid, **ARROW_STYLE)
    return shaft.mean(axis=0)


def first_sense(scene: Scene, motion: TimeFunction) -> float:
    """Return the sign of the first motion of a drive, which may start from rest.

    It is 1 for a drive that does not move, as far as its function can be evaluated.
    """
    start = scene.start.number(motion(0.0))
    for time in DRIVE_TIMES:
        try:
            moved = scene.start.number(motion(time)) - start
        except InputError:  # after the end of the road
            break
        if abs(moved) > 1e-9 * (1.0 + abs(start)):
            return float(np.sign(moved))
    return 1.0


def pivot(scene: Scene, point: PointName) -> PointName:
    """Return the point where the body of a point is pinned to the ground, or else the point."""
    for joint in scene.mechanism.joints.values():
        if isinstance(joint, Revolute):
            bodies = [body_of(end) for end in joint.points]
            if set(bodies) == {body_of(point), ""}:
                return joint.first if bodies[0] else joint.second
    return point


def held_body(joint: Joint) -> str:
    """Return the body that is held where a joint holds a body to the ground."""
    return next(filter(None, map(body_of, joint.points)))


def upward(scene: Scene, joint: Joint, place: np.ndarray) -> np.ndarray:
    """Return the direction from the ground to what is held at a place of it.

    It is that from a wall to the body if the joint is a weld, and up or down from a bearing.
    """
    held = scene.at(held_body(joint)) - place
    if np.linalg.norm(held) <= 1e-9 * (1.0 + np.linalg.norm(place)):  # the body's own centre
        held = np.array([0.0, 1.0])
    if isinstance(joint, Weld):
        return held
    hanging = held[1] < -0.3 * np.linalg.norm(held)
    return np.array([0.0, -1.0 if hanging else 1.0])
