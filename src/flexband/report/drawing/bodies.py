"""How bodies are drawn."""

from __future__ import annotations

import numpy as np

from flexband.mechanics.bodies.centre_line import CentreLine
from flexband.mechanics.bodies.point_mass import PointMass
from flexband.mechanics.bodies.rigid import RigidBody
from flexband.mechanics.joints.gears import Gear, Rack
from flexband.mechanics.joints.joints import Prismatic
from flexband.report.drawing import symbols
from flexband.report.drawing.canvas import DARK, GREY, PALE, Canvas
from flexband.report.drawing.scene import Scene, hull

FLEXIBLE, FILLED = "#1f78b4", "#c6dbef"


def draw_body(scene: Scene, canvas: Canvas, name: str) -> None:
    """Draw a body with its name and its lengths; one of a kind not known here as a diamond."""
    body, gid = scene.mechanism.bodies[name], f"body {name!r}"
    center, corners = scene.at(name), scene.corners(name)
    if isinstance(body, CentreLine):
        _draw_line(scene, canvas, body, name)
    elif isinstance(body, PointMass):
        canvas.mark(center, "o", 11.0, markerfacecolor=DARK, zorder=4.0, gid=gid)
    elif not isinstance(body, RigidBody):
        symbols.unknown(canvas, [center], name, gid)
        return
    else:
        if len(corners) > 1:
            symbols.link(canvas, corners, gid)
            _draw_arms(canvas, corners, center)
        elif not _is_drawn(scene, name):
            canvas.area(scene.outline(name), facecolor=PALE, linestyle="--", linewidth=0.9,
                        zorder=3.0, gid=gid)  # fmt: skip
        symbols.center_of_mass(canvas, center, f"center of {gid}")
        if len(corners) == 2:
            canvas.dimension(corners, length_text(np.linalg.norm(corners[1] - corners[0])))
    plate = len(corners) > 2
    canvas.label(corners.mean(axis=0) if plate else center, name, inside=plate, style="italic")


def _draw_line(scene: Scene, canvas: Canvas, body: CentreLine, name: str) -> None:
    """Draw a beam as a band as high as it is, a cable as a line; mark the nodes."""
    axis, across = scene.axis(name)
    half = scene.height(name)[:, None] / 2
    nodes = slice(None, None, (len(axis) - 1) // body.elements)
    look, gid = {"color": FLEXIBLE, "zorder": 4.1}, f"body {name!r}"
    if half.any():
        canvas.area(scene.outline(name), facecolor=FILLED, edgecolor=FLEXIBLE, linewidth=1.0,
                    zorder=4.0, gid=gid)  # fmt: skip
        reach = np.maximum(half, 3.0 * canvas.unit)[nodes] * across[nodes]
        pen_up = np.full_like(reach, np.nan)
        ticks = np.stack([axis[nodes] - reach, axis[nodes] + reach, pen_up], axis=1)
        canvas.line(ticks.reshape(-1, 2), linewidth=0.8, **look)
    else:
        canvas.line(axis, linewidth=1.8, gid=gid, **look)
        canvas.line(axis[nodes], linewidth=0.0, marker="o", markersize=3.5, **look)
    canvas.dimension(axis, length_text(scene.start.number(body.length)), beside=half.max())


def _draw_arms(canvas: Canvas, corners: np.ndarray, center: np.ndarray) -> None:
    """Draw lines to a centre of mass outside the corners from the two next to it."""
    around = hull(np.concatenate([corners, center[None]]))
    if (around == center).all(axis=1).any() and not (corners == center).all(axis=1).any():
        nearest = np.argsort(np.linalg.norm(corners - center, axis=1))[:2]
        first, second = corners[nearest]
        canvas.line([first, center, second], color=GREY, linewidth=0.9, zorder=2.5)


def _is_drawn(scene: Scene, name: str) -> bool:
    """Return whether a joint draws the body, as the block that it guides or as a gear."""
    joints = scene.mechanism.joints.values()
    drawn = [j.first for j in joints if isinstance(j, Prismatic | Gear | Rack)]
    drawn += [j.second for j in joints if isinstance(j, Gear)]
    return any(isinstance(p, str) and p.partition(".")[0] == name for p in drawn)


def length_text(length: float | np.floating) -> str:
    """Return a length with its unit."""
    return f"{length:.4g} m"
