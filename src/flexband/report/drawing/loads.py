"""Drawings of loads."""

from __future__ import annotations

from itertools import product

import numpy as np

from flexband.mechanics.loads.force_laws import ForceLaw, ViscousFriction
from flexband.mechanics.loads.load import InTime
from flexband.mechanics.loads.loads import DistributedLoad, Force, Gravity, Moment
from flexband.mechanics.loads.springs import Spring, TorsionSpring
from flexband.report.drawing import symbols
from flexband.report.drawing.canvas import Canvas
from flexband.report.drawing.scene import Scene, body_of

LOADS = "#d95f02"
ARROW_STYLE = {"color": LOADS, "linewidth": 1.6, "zorder": 8.0}
ARROW = 36.0
"""Length of an arrow [pt]."""
GAPS = 10
"""Number of gaps between the arrows of a distributed load."""
MIN_ARROW_SHARE = 0.15
"""Arrows of a distributed load that are shorter than this share of the longest are left out."""


def draw_load(scene: Scene, canvas: Canvas, name: str) -> None:
    """Draw a load with its name; a load of unknown type is a diamond."""
    load, gid = scene.mechanism.loads[name], f"load {name!r}"
    places = [scene.at(point) for point in load.points]
    named = places[0] if places else None
    match load:
        case Gravity():
            named = _draw_gravity(scene, canvas, load, gid)
        case Spring() | ViscousFriction():
            canvas.label(_draw_spring(scene, canvas, load, gid), name)
            return
        case TorsionSpring():
            _draw_torsion(scene, canvas, load, gid)
        case Force():
            named = _draw_force(scene, canvas, load, gid)
        case Moment():
            sense = sense_of(scene, load.moment)
            start, sweep = np.pi * (-0.5 - 0.25 * sense), 1.5 * np.pi * sense
            named = symbols.turning(canvas, places[0], start, sweep, 15.0, gid=gid, **ARROW_STYLE)
        case DistributedLoad():
            named = _draw_distributed(scene, canvas, load, gid)
        case ForceLaw():
            named = symbols.law(canvas, places, gid, LOADS)
        case _:
            symbols.unknown(canvas, places, gid, LOADS)
    canvas.label(named, name, color=LOADS)


def _draw_gravity(scene: Scene, canvas: Canvas, load: Gravity, gid: str) -> np.ndarray:
    """Draw the field in the emptiest corner; return the middle of the arrow [m]."""
    field = np.array([scene.start.number(load.x), scene.start.number(load.y)])
    inset = 0.75 * ARROW * canvas.unit
    (left, bottom), (right, top) = canvas.box[0] + inset, canvas.box[1] - inset
    corners = [np.array(corner) for corner in product((right, left), (top, bottom))]
    place = min(corners, key=lambda corner: canvas.covered(corner, ARROW))
    if np.any(field):
        half = ARROW / 2
        canvas.arrow(canvas.local(place, field, [(-half, 0), (half, 0)]), gid=gid, **ARROW_STYLE)
    else:
        canvas.mark(place, "o", 4.0, color=LOADS, gid=gid)
    return place


def _draw_spring(
    scene: Scene, canvas: Canvas, load: Spring | ViscousFriction, gid: str
) -> np.ndarray:
    """Draw a spring or a dashpot, and a wall at an end on the ground; return its middle [m]."""
    start, end = ends = [scene.at(point) for point in load.points]
    for point, place, other in zip(load.points, ends, ends[::-1], strict=True):
        if not body_of(point) and np.any(place != other):
            symbols.hatch(canvas, place, other - place, 12.0)
    return symbols.spring(canvas, start, end, gid=gid, **elements_of(scene, load))


def _draw_torsion(scene: Scene, canvas: Canvas, load: TorsionSpring, gid: str) -> None:
    """Draw a torsion spring about its first point, and an arrow if it has a torque."""
    place, elements = scene.at(load.first), elements_of(scene, load)
    motor = not any(elements.values())
    if not motor:
        symbols.torsion(canvas, place, gid=gid, **elements)
    if motor or callable(load.torque) or scene.start.number(load.torque):
        sense = sense_of(scene, load.torque)
        start, sweep = np.pi * (0.5 - 0.75 * sense), 1.5 * np.pi * sense
        style = ARROW_STYLE | ({"gid": gid} if motor else {})
        symbols.turning(canvas, place, start, sweep, 24.0, **style)


def elements_of(scene: Scene, load: Spring | ViscousFriction | TorsionSpring) -> dict[str, bool]:
    """Return whether a load is elastic and whether it is damped."""
    laws = () if isinstance(load, ViscousFriction) else (load.stiffness, load.cubic)
    elastic = any(scene.start.number(law) for law in laws)
    return {"elastic": elastic, "damped": bool(scene.start.number(load.damping))}


def _draw_force(scene: Scene, canvas: Canvas, load: Force, gid: str) -> np.ndarray:
    """Draw an arrow to or from a point, where it covers less; return its middle [m]."""
    frame, place = scene.mechanism.frame(load.point), scene.at(load.point)
    force = np.array([_value(scene, load.x), _value(scene, load.y)])
    if load.following:
        force = force @ [scene.start.vector(frame.normal), scene.start.vector(frame.y)]
    if not np.any(force):
        force = np.array([1.0, 0.0])
    spans = (-ARROW - 5.0, -5.0), (5.0, ARROW + 5.0)
    shafts = [canvas.local(place, force, [(a, 0.0), (b, 0.0)]) for a, b in spans]
    shaft = min(shafts, key=lambda ends: canvas.covered(ends.mean(axis=0), ARROW / 3))
    canvas.arrow(shaft, gid=gid, **ARROW_STYLE)
    return shaft.mean(axis=0)


def _draw_distributed(scene: Scene, canvas: Canvas, load: DistributedLoad, gid: str) -> np.ndarray:
    """Draw arrows on a beam in proportion to the load; return the middle [m]."""
    places = np.arange(GAPS + 1) / GAPS
    axis, _ = scene.axis(load.beam, places)
    half = scene.half_height(load.beam, places)
    length = getattr(scene.mechanism.bodies[load.beam], "length", 0.0)
    x = np.linspace(0.0, scene.start.number(length), GAPS + 1)
    force = np.stack([scene.start.along(part, x) for part in (load.x, load.y)], axis=1)
    size = np.hypot(*force.T)
    share = force / (size.max() or 1.0)
    heads = axis - half * force / np.maximum(size, 1e-300)[:, None]
    tails = heads - 0.8 * ARROW * canvas.unit * share
    style = ARROW_STYLE | {"linewidth": 1.0}
    for head, tail, part in zip(heads, tails, np.hypot(*share.T), strict=True):
        if part > MIN_ARROW_SHARE:
            canvas.arrow([tail, head], head=min(6.0, 20.0 * part), **style)
    canvas.line(tails, gid=gid, **style)
    return tails[GAPS // 2]


def sense_of(scene: Scene, moment: InTime) -> float:
    """Return 1 for a moment that turns counterclockwise at time zero, or else −1."""
    return 1.0 if _value(scene, moment) >= 0 else -1.0


def _value(scene: Scene, value: InTime) -> float:
    """Return a component at time zero, or 1 for a function of time that vanishes there."""
    return scene.start.number(value) or float(callable(value))
