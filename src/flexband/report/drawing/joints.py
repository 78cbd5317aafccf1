"""How joints and drives are drawn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexband.mechanics.forms import TimeFunction
from flexband.mechanics.joints.drives import PrescribedPath, PrescribedRotation, PrescribedTravel
from flexband.mechanics.joints.gears import Gear, Rack
from flexband.mechanics.joints.joints import (
    Distance,
    PointName,
    Prismatic,
    Revolute,
    Slot,
    Weld,
    along,
)
from flexband.report.drawing import round_symbols, symbols
from flexband.report.drawing.bodies import length_text
from flexband.report.drawing.canvas import Canvas
from flexband.report.drawing.scene import Scene

DRIVES = "#1b7837"
STARTS = 10.0 ** np.arange(-6, 3)
"""Times [s] at which a drive is asked which way it goes."""


def draw_joint(scene: Scene, canvas: Canvas, name: str) -> None:
    """Draw a joint with its name; one of a kind not known here as a diamond."""
    joint, gid = scene.mechanism.joints[name], f"joint {name!r}"
    points = joint.points
    places = [scene.at(point) for point in points]
    match joint:
        case PrescribedRotation() | PrescribedTravel() | PrescribedPath():
            _draw_drive(scene, canvas, joint, name)
            return
        case Revolute():
            symbols.pin(canvas, places[0], gid)
        case Weld():
            symbols.weld(canvas, places[0], gid)
        case Distance():
            symbols.rod(canvas, places[0], places[1], gid)
            canvas.dimension(places, length_text(scene.start.number(joint.length)))
        case Prismatic() | Slot():
            axis = scene.start.vector(along(scene.mechanism.frame(joint.second), joint.axis))
            symbols.axis_line(canvas, places[0], places[1])
            ground, block = not isinstance(joint.second, str), isinstance(joint, Prismatic)
            symbols.rails(canvas, places[0], axis, ground=ground, block=block, gid=gid)
        case Gear():
            first, second = pitch = scene.pitch_circles(joint)
            round_symbols.gears(canvas, pitch, gid)
            share = first[1] / (first[1] + second[1])
            places = [first[0] + share * (second[0] - first[0])]  # where the circles touch
        case Rack():
            (pinion,), (start, end) = scene.pitch_circles(joint), scene.rack_line(joint)
            round_symbols.rack(canvas, pinion, start, end, gid)
            places = [end]
        case _:
            symbols.unknown(canvas, places, name, gid)
            return
    if isinstance(joint, Revolute | Distance | Weld):
        draw_ground(scene, canvas, points, clamped=isinstance(joint, Weld))
    canvas.label(np.mean(places, axis=0) if isinstance(joint, Distance) else places[0], name)


def draw_ground(
    scene: Scene, canvas: Canvas, points: Sequence[PointName], *, clamped: bool
) -> None:
    """Draw the ground where points are on it: a wall across what it holds, or a bearing."""
    bodies = [point.partition(".")[0] for point in points if isinstance(point, str)]
    for point in points:
        if isinstance(point, str):
            continue
        place = scene.at(point)
        held = scene.at(bodies[0]) - place
        if not np.any(held):
            held = np.array([0.0, 1.0])
        if clamped:
            wide = max(scene.height(b).max() / 2 / canvas.unit + 6.0 for b in bodies)
            symbols.hatch(canvas, place, held, max(16.0, wide))
        else:
            hanging = held[1] < -0.3 * np.linalg.norm(held)
            symbols.pedestal(canvas, place, np.array([0.0, -1.0 if hanging else 1.0]))


def _draw_drive(
    scene: Scene,
    canvas: Canvas,
    drive: PrescribedRotation | PrescribedTravel | PrescribedPath,
    name: str,
) -> None:
    """Draw an arrow the way that a drive moves its body at the start."""
    look = {"color": DRIVES, "linewidth": 1.6, "zorder": 8.0, "gid": f"joint {name!r}"}
    velocity, place = scene.velocity(drive.first), scene.at(drive.first)
    if isinstance(drive, PrescribedRotation):
        place = _pivot(scene, drive.first)
        x, y = scene.start.vector(scene.mechanism.frame(drive.first).normal)
        sense = _sense(scene, drive.angle)
        first = np.arctan2(y, x) + 0.35 * sense
        middle = symbols.turning(canvas, place, first, 1.7 * sense, 24.0, **look)
    else:
        direction, lift = velocity, 0.0
        if isinstance(drive, PrescribedTravel):
            axis = scene.start.vector(along(scene.mechanism.frame(drive.second), drive.axis))
            direction, lift = _sense(scene, drive.travel) * axis, 20.0
            symbols.axis_line(canvas, place, scene.at(drive.second))
        canvas.mark(place, "o", 11.0, color=DRIVES, markerfacecolor="none", zorder=8.0)
        middle = place
        if np.any(direction):
            shaft = canvas.local(place, direction, [(0.0, lift), (36.0, lift)])
            canvas.arrow(shaft, **look)
            middle = shaft.mean(axis=0)
    canvas.label(middle, name, color=DRIVES)


def _sense(scene: Scene, motion: TimeFunction) -> float:
    """Return the sign of the way that a drive goes first; it may start from rest."""
    first = scene.start.number(motion(0.0))
    for time in STARTS:
        moved = scene.start.number(motion(time)) - first
        if abs(moved) > 1e-9 * (1.0 + abs(first)):
            return float(np.sign(moved))
    return 1.0


def _pivot(scene: Scene, point: PointName) -> np.ndarray:
    """Return where the body of a point is pinned to the ground, or else the point [m]."""
    body = point.partition(".")[0] if isinstance(point, str) else ""
    for joint in scene.mechanism.joints.values():
        if isinstance(joint, Revolute):
            ends = [joint.first, joint.second]
            own = [p for p in ends if isinstance(p, str)]
            if len(own) == 1 and own[0].partition(".")[0] == body:
                return scene.at(own[0])
    return scene.at(point)
