"""Drawings of bodies."""

from __future__ import annotations

import numpy as np

from flexband.mechanics.bodies.centre_line import CentreLine
from flexband.mechanics.bodies.point_mass import PointMass
from flexband.mechanics.bodies.rigid import RigidBody
from flexband.mechanics.joints.gears import Gear, Rack
from flexband.mechanics.joints.joints import Prismatic
from flexband.report.drawing import symbols
from flexband.report.drawing.canvas import DARK, GREY, PALE, Canvas
from flexband.report.drawing.scene import Scene, body_of, hull

FLEXIBLE_EDGE, FLEXIBLE_FILL = "#1f78b4", "#c6dbef"
MIN_TICK = 3.0
"""Least length [pt] of the mark of a node to each side of the axis of a beam."""


def draw_body(scene: Scene, canvas: Canvas, name: str) -> None:
    """Draw a body with its name and its lengths; a body of unknown type is a diamond."""
    body, gid = scene.mechanism.bodies[name], f"body {name!r}"
    center, corners = scene.at(name), scene.corners(name)
    match body:
        case CentreLine():
            _draw_line(scene, canvas, body, name, gid)
        case PointMass():
            canvas.mark(center, "o", 11.0, markerfacecolor=DARK, zorder=4.0, gid=gid)
        case RigidBody():
            _draw_rigid(scene, canvas, name, gid)
        case _:
            symbols.unknown(canvas, [center], gid)
    plate = len(corners) > 2
    canvas.label(corners.mean(axis=0) if plate else center, name, inside=plate, style="italic")


def _draw_rigid(scene: Scene, canvas: Canvas, name: str, gid: str) -> None:
    """Draw a link, a plate or, without an extent, a circle; mark the centre of mass."""
    center, corners = scene.at(name), scene.corners(name)
    if len(corners) > 1:
        symbols.link(canvas, corners, gid)
        around = hull(np.concatenate([corners, center[None]])).tolist()
        if center.tolist() in around and center.tolist() not in corners.tolist():  # it is outside
            nearest = np.argsort(np.linalg.norm(corners - center, axis=1))[:2]
            first, second = corners[nearest]
            canvas.line([first, center, second], color=GREY, linewidth=0.9, zorder=2.5)
    elif not drawn_by_a_joint(scene, name):
        canvas.area(scene.outline(name), facecolor=PALE, linestyle="--", linewidth=0.9,
                    zorder=3.0, gid=gid)  # fmt: skip
    symbols.center_of_mass(canvas, center, f"center of {gid}")
    if len(corners) == 2:
        canvas.dimension(corners, np.linalg.norm(corners[1] - corners[0]))


def _draw_line(scene: Scene, canvas: Canvas, body: CentreLine, name: str, gid: str) -> None:
    """Draw a beam to scale or a cable as a line; mark the nodes."""
    axis, across = scene.axis(name)
    half = scene.half_height(name)
    nodes = slice(None, None, (len(axis) - 1) // body.elements)
    style = {"color": FLEXIBLE_EDGE, "zorder": 4.1}
    if half.any():
        canvas.area(scene.outline(name), facecolor=FLEXIBLE_FILL, edgecolor=FLEXIBLE_EDGE,
                    linewidth=1.0, zorder=4.0, gid=gid)  # fmt: skip
        reach = np.maximum(half, MIN_TICK * canvas.unit)[nodes] * across[nodes]
        pen_up = np.full_like(reach, np.nan)
        ticks = np.stack([axis[nodes] - reach, axis[nodes] + reach, pen_up], axis=1)
        canvas.line(ticks.reshape(-1, 2), linewidth=0.8, **style)
    else:
        canvas.line(axis, linewidth=1.8, gid=gid, **style)
        canvas.line(axis[nodes], linewidth=0.0, marker="o", markersize=3.5, **style)
    canvas.dimension(axis, scene.start.number(body.length), beside=half.max())


def drawn_by_a_joint(scene: Scene, name: str) -> bool:
    """Return whether a joint draws the body, as the block of a guide or as a gear."""
    joints = scene.mechanism.joints.values()
    drawn = [j.first for j in joints if isinstance(j, Prismatic | Gear | Rack)]
    drawn += [j.second for j in joints if isinstance(j, Gear)]
    return name in map(body_of, drawn)
