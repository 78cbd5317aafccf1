"""How loads are drawn."""

from __future__ import annotations

from itertools import product

import numpy as np

from flexband.mechanics.loads.force_laws import ForceLaw, ViscousFriction
from flexband.mechanics.loads.loads import DistributedLoad, Force, Gravity, InTime, Moment
from flexband.mechanics.loads.springs import Spring, TorsionSpring
from flexband.report.drawing import round_symbols, symbols
from flexband.report.drawing.canvas import Canvas
from flexband.report.drawing.scene import Scene

LOADS = "#d95f02"
LOOK = {"color": LOADS, "linewidth": 1.6, "zorder": 8.0}
ARROW = 36.0
"""Length of an arrow [pt]."""
ROW = 10
"""Gaps between the arrows of a distributed load."""


def draw_load(scene: Scene, canvas: Canvas, name: str) -> None:
    """Draw a load with its name; one of a kind not known here as a diamond."""
    load, gid = scene.mechanism.loads[name], f"load {name!r}"
    match load:
        case Gravity():
            field = np.array([scene.start.number(load.x), scene.start.number(load.y)])
            named = _draw_gravity(canvas, field, gid)
        case Spring() | ViscousFriction():
            _draw_spring(scene, canvas, load, name)
            return
        case Force():
            shaft = _shaft(scene, canvas, load)
            canvas.arrow(shaft, gid=gid, **LOOK)
            named = shaft.mean(axis=0)
        case Moment():
            sense = _sign(scene, load.moment)
            way = (-0.75 * np.pi, 1.5 * np.pi) if sense >= 0 else (-0.25 * np.pi, -1.5 * np.pi)
            named = symbols.turning(canvas, scene.at(load.point), *way, 15.0, gid=gid, **LOOK)
        case TorsionSpring():
            named = _draw_torsion(scene, canvas, load, gid)
        case ForceLaw():
            places = [scene.at(point) for point in load.points]
            named = round_symbols.law(canvas, places, gid, LOADS)
        case DistributedLoad():
            named = _draw_row(scene, canvas, load, gid)
        case _:
            places = [scene.at(point) for point in load.points]
            symbols.unknown(canvas, places, name, gid, LOADS)
            return
    canvas.label(named, name, color=LOADS)


def _draw_gravity(canvas: Canvas, field: np.ndarray, gid: str) -> np.ndarray:
    """Draw the field in the corner with most room; return the middle of the arrow [m]."""
    inset = 0.75 * ARROW * canvas.unit
    (left, bottom), (right, top) = canvas.box[0] + inset, canvas.box[1] - inset
    corners = [np.array(corner) for corner in product((right, left), (top, bottom))]
    place = min(corners, key=lambda corner: canvas.covered(corner, ARROW))
    if np.any(field):
        canvas.arrow(
            canvas.local(place, field, [(-ARROW / 2, 0.0), (ARROW / 2, 0.0)]), gid=gid, **LOOK
        )
    else:
        canvas.mark(place, "o", 4.0, color=LOADS, gid=gid)
    return place


def _draw_spring(scene: Scene, canvas: Canvas, load: Spring | ViscousFriction, name: str) -> None:
    """Draw a spring or a dashpot, and a wall where it is held by the ground."""
    points = (load.first, load.second)
    start, end = (scene.at(point) for point in points)
    kinds = _kinds(scene, load)
    named = symbols.spring(canvas, start, end, gid=f"load {name!r}", **kinds)
    for point, own, other in zip(points, (start, end), (end, start), strict=True):
        if not isinstance(point, str) and np.any(own != other):
            symbols.hatch(canvas, own, other - own, 12.0)
    canvas.label(named, name)


def _kinds(scene: Scene, load: Spring | ViscousFriction | TorsionSpring) -> dict[str, bool]:
    """Return whether a load has a spring and a damper."""
    number, elastic = scene.start.number, False
    if not isinstance(load, ViscousFriction):
        elastic = bool(number(load.stiffness) or number(load.cubic))
    return {"elastic": elastic, "damped": bool(number(load.damping))}


def _draw_torsion(scene: Scene, canvas: Canvas, load: TorsionSpring, gid: str) -> np.ndarray:
    """Draw a torsion spring about its first point, and an arrow where it is a motor."""
    place, kinds = scene.at(load.first), _kinds(scene, load)
    if any(kinds.values()):
        round_symbols.torsion(canvas, place, gid=gid, **kinds)
    if callable(load.torque) or scene.start.number(load.torque) or not any(kinds.values()):
        sense = 1.0 if _sign(scene, load.torque) >= 0 else -1.0
        own = {} if any(kinds.values()) else {"gid": gid}
        symbols.turning(canvas, place, np.pi * (0.5 - 0.75 * sense), 1.5 * np.pi * sense, 24.0,
                        **own, **LOOK)  # fmt: skip
    return place


def _sign(scene: Scene, value: InTime) -> float:
    """Return a component at time zero; 1 for a function of time that vanishes there."""
    return scene.start.number(value) or float(callable(value))


def _shaft(scene: Scene, canvas: Canvas, load: Force) -> np.ndarray:
    """Return the ends of a force's arrow [m], before its point or behind it."""
    frame, place = scene.mechanism.frame(load.point), scene.at(load.point)
    force = np.array([_sign(scene, load.x), _sign(scene, load.y)])
    if load.following:
        force = force @ [scene.start.vector(frame.normal), scene.start.vector(frame.y)]
    if not np.any(force):
        force = np.array([1.0, 0.0])
    ways = [canvas.local(place, force, [(a, 0.0), (a + ARROW, 0.0)]) for a in (-ARROW - 5.0, 5.0)]
    return min(ways, key=lambda ends: canvas.covered(ends.mean(axis=0), ARROW / 3))


def _draw_row(scene: Scene, canvas: Canvas, load: DistributedLoad, gid: str) -> np.ndarray:
    """Draw a row of arrows on a beam, as long as the load is large there; return its middle [m]."""
    axis, _ = scene.axis(load.beam, ROW)
    half = scene.height(load.beam, ROW)[:, None] / 2
    length = getattr(scene.mechanism.bodies[load.beam], "length", 0.0)
    x = np.linspace(0.0, scene.start.number(length), ROW + 1)
    force = np.stack([scene.start.along(part, x) for part in (load.x, load.y)], axis=1)
    size = np.hypot(*force.T)
    part = force / (size.max() or 1.0)
    heads = axis - half * force / np.maximum(size, 1e-300)[:, None]
    tails = heads - 0.8 * ARROW * canvas.unit * part
    for head, tail, share in zip(heads, tails, np.hypot(*part.T), strict=True):
        if share > 0.15:
            canvas.arrow([tail, head], head=min(6.0, 20.0 * share), **LOOK | {"linewidth": 1.0})
    canvas.line(tails, gid=gid, **LOOK | {"linewidth": 1.0})
    return tails[ROW // 2]
