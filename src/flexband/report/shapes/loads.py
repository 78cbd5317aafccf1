"""Shapes of loads."""

from __future__ import annotations

from functools import singledispatch
from typing import Any

import numpy as np

from flexband.mechanics.kernels.forms import section_normal
from flexband.mechanics.loads.brakes import Brake, OneWayClutch
from flexband.mechanics.loads.bushings import Bushing
from flexband.mechanics.loads.characteristic import Characteristic
from flexband.mechanics.loads.contacts import AngularStop, Contact, Stop
from flexband.mechanics.loads.force_laws import ForceLaw, ViscousFriction
from flexband.mechanics.loads.free_strain import FreeCurvature, FreeStrain
from flexband.mechanics.loads.load import InTime, Load
from flexband.mechanics.loads.loads import DistributedLoad, Force, Gravity, Moment
from flexband.mechanics.loads.springs import Spring, TorsionSpring
from flexband.report.shapes.contacts import add_angular_stop, add_geometry, add_stop
from flexband.report.shapes.scene import Scene, body_of
from flexband.report.shapes.shapes import FieldArrow, LocalFrame, Stroke, at, in_points
from flexband.report.shapes.sketch import Sketch, arc, arrow, circle, spring, torsion

ARROW = 36.0
"""Length of an arrow [pt]."""


@singledispatch
def add_load(load: Load, sketch: Sketch, name: str) -> None:
    """Add a load with its name; a load of unknown type is a diamond."""
    sketch.unknown(load.points, f"load {name!r}", "load")
    place = at(sketch.tracks.point(load.points[0])) if load.points else None
    sketch.name(name, place, color="load")


@add_load.register
def _(load: Gravity, sketch: Sketch, name: str) -> None:
    field = sketch.scene.start.number(load.x), sketch.scene.start.number(load.y)
    sketch.fields.append(FieldArrow(name, f"load {name!r}", field))


@add_load.register(Spring)
@add_load.register(ViscousFriction)
def _(load: Spring | ViscousFriction, sketch: Sketch, name: str) -> None:
    """Add a spring or a dashpot, and a wall at an end on the ground."""
    first, second = ends = sketch.points(load.points)
    for point, place, other in zip(load.points, ends, ends[::-1], strict=True):
        if not body_of(point):
            sketch.wall(LocalFrame(place, ends=(place, other)))
    frame = LocalFrame(first, ends=(first, second), shares=True)
    start, end = (sketch.scene.at(point) for point in load.points)
    length = float(np.linalg.norm(end - start)) / sketch.unit
    coils, lift = spring(frame, length, **elements_of(sketch.scene, load))
    sketch.line(coils, layer=6.0, part=f"load {name!r}")
    sketch.mark(at(first, second), size=3.0, fill="ink", layer=7.1)
    sketch.name(name, Stroke([frame], np.array([[0.5, 0.0, 0.0, lift]])))


@add_load.register
def _(load: TorsionSpring, sketch: Sketch, name: str) -> None:
    """Add a torsion spring about its first point, and an arrow if it has a torque."""
    place = sketch.tracks.point(load.first)
    elements = elements_of(sketch.scene, load)
    frame = LocalFrame(place)
    part = f"load {name!r}"
    motor = not any(elements.values())
    if not motor:
        sketch.line(torsion(frame, **elements), layer=6.0, part=part)
    drive: Any = load.torque
    if isinstance(drive, Characteristic):
        motor = motor or drive.place is None
        drive = drive.factor
    if motor or callable(drive) or sketch.scene.start.number(drive):
        sense = _sense(sketch.scene, drive)
        start = np.pi * (0.5 - 0.75 * sense)
        sweep = 1.5 * np.pi * sense
        sketch.add_turn_arrow(frame, start, sweep, 24.0, "load", part if motor else "")
    sketch.name(name, at(place), color="load")


@add_load.register
def _(load: Bushing, sketch: Sketch, name: str) -> None:
    """Add a ring of rubber about the first point."""
    place = sketch.tracks.point(load.first)
    for size in (22.0, 8.0):
        sketch.mark(at(place), size=size, fill="paper", layer=6.5, part=f"load {name!r}")
    rubber = in_points(LocalFrame(place), circle(7.5, 24))
    sketch.line(rubber, width=3.0, dash=(1, 1), layer=6.6)
    sketch.name(name, at(place), color="load")


@add_load.register(FreeStrain)
@add_load.register(FreeCurvature)
def _(load: FreeStrain | FreeCurvature, sketch: Sketch, name: str) -> None:
    """Add a dashed line along the member."""
    axis = at(*sketch.points([f"{load.member}.{place}" for place in np.linspace(0, 1, 13)]))
    sketch.line(axis, color="load", width=2.0, dash=(2, 3), layer=8.0, part=f"load {name!r}")
    middle = at(sketch.tracks.point(f"{load.member}.middle"))
    sketch.name(name, middle, color="load")


@add_load.register
def _(load: Brake, sketch: Sketch, name: str) -> None:
    """Add the two shoes of a brake or clutch around its first point."""
    place = sketch.tracks.point(load.first)
    for middle in (np.pi / 2, -np.pi / 2):
        turn = middle + np.linspace(-0.6, 0.6, 20)
        edge = np.concatenate([arc(turn, 14.0), arc(turn[::-1], 19.0)])
        shoe = in_points(LocalFrame(place), edge)
        sketch.line(shoe, closed=True, fill="paper", layer=6.0, part=f"load {name!r}")
    sketch.name(name, at(place))


@add_load.register
def _(load: OneWayClutch, sketch: Sketch, name: str) -> None:
    """Add an arrow in the sense in which the first body is free to turn."""
    place = sketch.tracks.point(load.first)
    sweep = 1.5 * np.pi * load.sense
    frame = LocalFrame(place)
    part = f"load {name!r}"
    sketch.add_turn_arrow(frame, np.pi / 2 - sweep / 2, sweep, 16.0, "ink", part)
    sketch.name(name, at(place))


def elements_of(scene: Scene, load: Spring | ViscousFriction | TorsionSpring) -> dict[str, bool]:
    """Return whether a load is elastic and whether it is damped."""
    laws = [vars(load).get(name, 0.0) for name in ("stiffness", "cubic")]
    elastic = any(scene.start.number(law) for law in laws)
    return {"elastic": elastic, "damped": bool(scene.start.number(load.damping))}


@add_load.register
def _(load: Contact, sketch: Sketch, name: str) -> None:
    add_geometry(load.geometry, sketch, load, name)


add_load.register(Stop, add_stop)
add_load.register(AngularStop, add_angular_stop)


@add_load.register
def _(load: Moment, sketch: Sketch, name: str) -> None:
    frame = LocalFrame(sketch.tracks.point(load.points[0]))
    sense = _sense(sketch.scene, load.moment)
    start = np.pi * (-0.5 - 0.25 * sense)
    sweep = 1.5 * np.pi * sense
    middle = sketch.add_turn_arrow(frame, start, sweep, 15.0, "load", f"load {name!r}")
    sketch.name(name, middle, color="load")


@add_load.register
def _(load: Force, sketch: Sketch, name: str) -> None:
    """Add an arrow to or from a point, where it covers less."""
    scene = sketch.scene
    section = sketch.scene.mechanism.model.frame(load.point)
    force = np.array([_value(scene, load.x), _value(scene, load.y)])
    if load.following:
        force = force @ [scene.start.vector(section_normal(section)), scene.start.vector(section.y)]
    x, y = force.tolist() if np.any(force) else (1.0, 0.0)
    frame = LocalFrame(sketch.tracks.point(load.point), fixed=(x, y))
    middle = sketch.freest(
        [in_points(frame, [(side * (5.0 + ARROW / 2), 0.0)]) for side in (1, -1)]
    )
    shaft = Stroke([frame], middle.vertices + ARROW * np.array([[0, 0, -0.5, 0], [0, 0, 0.5, 0]]))
    part = f"load {name!r}"
    sketch.lines.append(arrow([shaft], color="load", part=part, start_only=True))
    sketch.name(name, middle, color="load")


@add_load.register
def _(load: DistributedLoad, sketch: Sketch, name: str) -> None:
    """Add arrows on a beam in proportion to the load at the start."""
    scene = sketch.scene
    gaps = 10
    places = np.arange(gaps + 1) / gaps
    half = scene.half_height(load.beam, places)
    axis = sketch.points([f"{load.beam}.{place!r}" for place in places.tolist()])
    length = vars(scene.mechanism.bodies[load.beam]).get("length", 0.0)
    x = np.linspace(0.0, scene.start.number(length), gaps + 1)
    force = np.stack([scene.start.along(part, x) for part in (load.x, load.y)], axis=1)
    shares = np.hypot(*force.T) / (np.hypot(*force.T).max() or 1.0)
    frames = [
        LocalFrame(number, fixed=(fx, fy))
        for number, (fx, fy) in zip(axis, force.tolist(), strict=True)
    ]
    tails = np.zeros((gaps + 1, 4))
    tails[:, 0] = -half
    tails[:, 2] = -0.8 * ARROW * shares
    heads = tails * [1.0, 0.0, 0.0, 0.0]
    for frame, tail, head, share in zip(frames, tails, heads, shares.tolist(), strict=True):
        if share > 0.15:
            stroke = Stroke([frame], np.array([tail, head]))
            size = min(6.0, 20.0 * share)
            sketch.lines.append(arrow([stroke], color="load", width=1.0, head=size))
    edge = Stroke(frames, tails)
    sketch.line(edge, color="load", layer=8.0, part=f"load {name!r}")
    sketch.name(name, Stroke([frames[gaps // 2]], tails[gaps // 2][None]), color="load")


@add_load.register
def _(load: ForceLaw, sketch: Sketch, name: str) -> None:
    """Add an f in a circle, between two places or beside the first."""
    points = sketch.points(load.points)
    places = [sketch.scene.at(point) for point in load.points[:2]]
    spots = [in_points(LocalFrame(points[0]), [way]) for way in circle(18.0, 8)]
    if any(np.linalg.norm(place - places[0]) > 30.0 * sketch.unit for place in places):
        connection = LocalFrame(points[0], ends=(points[0], points[1]), shares=True)
        spots = [Stroke([connection], np.array([[0.5, 0.0, 0.0, 0.0]]))]
    spot = sketch.freest(spots)
    for point in points:
        ends = Stroke([LocalFrame(point), *spot.frames], np.vstack([np.zeros(4), spot.vertices]))
        sketch.line(ends, color="load", width=0.8, dash=(4, 3), layer=2.5)
    part = f"load {name!r}"
    sketch.mark(spot, size=12.0, color="load", fill="paper", layer=8.0, part=part)
    sketch.mark(spot, marker="f", color="load", fill="load", width=0.3, layer=8.1)
    sketch.name(name, spot, color="load")


def _sense(scene: Scene, moment: Any) -> float:
    """Return 1 for a moment that turns counterclockwise at time zero, or else −1."""
    return 1.0 if _value(scene, moment) >= 0 else -1.0


def _value(scene: Scene, value: InTime) -> float:
    """Return a component at time zero, or 1 for a function of time that vanishes there."""
    return scene.start.number(value) or float(callable(value))
