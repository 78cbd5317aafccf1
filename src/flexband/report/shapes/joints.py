"""Shapes of joints and drives."""

from __future__ import annotations

from collections.abc import Sequence
from functools import singledispatch

import numpy as np
from numpy.typing import ArrayLike

from flexband.mechanics.joints.compliant import Compliant
from flexband.mechanics.joints.drives import PrescribedPath, PrescribedRotation, PrescribedTravel
from flexband.mechanics.joints.gears import Gear, Rack
from flexband.mechanics.joints.joint import Joint, PairJoint, PointName
from flexband.mechanics.joints.joints import Distance, Prismatic, Revolute, Slot, Weld
from flexband.mechanics.joints.switched import Switched
from flexband.mechanics.kernels.forms import Vector, add, scale, section_normal, subtract
from flexband.mechanics.sensors.motion import SensorModel
from flexband.report.shapes.contacts import add_pin, enlarged_clearance
from flexband.report.shapes.scene import body_of, pin_between
from flexband.report.shapes.shapes import Length, LocalFrame, Stroke, at, in_points
from flexband.report.shapes.sketch import (
    AXIS,
    TOOTH,
    TOOTH_SPACING,
    Sketch,
    arrow,
    circle,
    in_metres,
    spring,
)
from flexband.report.shapes.tracks import Tracks


@singledispatch
def gear_radii(joint: Joint) -> Sequence[tuple[PointName, ArrayLike]]:
    """Return points whose bodies the joint draws, and the radii [m] of their gears, or zero."""
    return []


@gear_radii.register
def _(joint: Prismatic) -> Sequence[tuple[PointName, ArrayLike]]:
    return [(joint.first, 0.0)]


@gear_radii.register
def _(joint: Gear) -> Sequence[tuple[PointName, ArrayLike]]:
    return list(zip(joint.points, joint.radii, strict=True))


@gear_radii.register
def _(joint: Rack) -> Sequence[tuple[PointName, ArrayLike]]:
    return [(joint.first, joint.radius)]


@gear_radii.register
def _(joint: Compliant) -> Sequence[tuple[PointName, ArrayLike]]:
    return gear_radii(joint.joint)


@singledispatch
def add_joint(joint: Joint, sketch: Sketch, name: str) -> None:
    """Add a joint with its name; a joint of unknown type is a diamond."""
    sketch.unknown(joint.points, f"joint {name!r}")
    sketch.name(name, at(sketch.tracks.point(joint.points[0])) if joint.points else None)


@add_joint.register
def _(joint: Revolute, sketch: Sketch, name: str) -> None:
    if joint.clearance is not None:
        add_pin(sketch, f"joint {name!r}", name, joint, joint.clearance, joint.radius)
    else:
        place = at(sketch.tracks.point(joint.first))
        sketch.mark(place, fill="hole", layer=7.0, part=f"joint {name!r}")
        sketch.name(name, place)
    _add_bearings(sketch, joint)


@add_joint.register
def _(joint: Switched, sketch: Sketch, name: str) -> None:
    """Add the joint in a dashed ring, which says that it comes and goes."""
    add_joint(joint.joint, sketch, name)
    frame = LocalFrame(sketch.tracks.point(joint.first))
    ring = in_points(frame, circle(11.0, 40))
    sketch.line(ring, color="drive", dash=(3, 3), layer=7.5, part=f"joint {name!r}")


@add_joint.register
def _(joint: Compliant, sketch: Sketch, name: str) -> None:
    """Add the joint in a ring of two lines, which says that it gives."""
    add_joint(joint.joint, sketch, name)
    frame = LocalFrame(sketch.tracks.point(joint.first))
    for radius in (9.0, 11.5):
        ring = in_points(frame, circle(radius, 40))
        sketch.line(ring, layer=7.5, part=f"joint {name!r}")


@add_joint.register
def _(joint: Weld, sketch: Sketch, name: str) -> None:
    place = at(sketch.tracks.point(joint.first))
    sketch.mark(place, marker="square", size=6.0, fill="ink", layer=7.0, part=f"joint {name!r}")
    sketch.name(name, place)
    for point in _ground_points(joint):
        body = next(filter(None, map(body_of, joint.points)))
        half = float(sketch.scene.half_height(body, np.linspace(0.0, 1.0, 25)).max())
        frame = LocalFrame(sketch.tracks.point(point), fixed=_outward(sketch, joint, point))
        points, metres = (6.0, half) if half > 10.0 * sketch.unit else (16.0, 0.0)
        sketch.wall(frame, points, metres)


@add_joint.register
def _(joint: Distance, sketch: Sketch, name: str) -> None:
    """Add a rod, or a cylinder if its length is prescribed."""
    first, second = sketch.points(joint.points)
    rod = ends = at(first, second)
    length = joint.length
    color = "ink"
    width = 1.2
    if callable(length):
        length = length(0.0)
        color = "drive"
        width = 1.6
    length = sketch.scene.start.number(length)
    if color == "drive":
        frame = LocalFrame(first, ends=(first, second), shares=True)
        rod, _ = spring(frame, length / sketch.unit, elastic=False, damped=False)
    sketch.line(rod, color=color, width=width, part=f"joint {name!r}")
    sketch.mark(ends, size=5.0, fill="ink", layer=7.0)
    sketch.lengths.append(Length(ends, length))
    sketch.name(name, ends, color=color)
    _add_bearings(sketch, joint)


@add_joint.register
def _(joint: Slot, sketch: Sketch, name: str) -> None:
    place = at(_add_guide(sketch, joint, name).origin)
    sketch.mark(place, fill="hole", layer=7.0, part=f"joint {name!r}")
    sketch.name(name, place)


@add_joint.register
def _(joint: Prismatic, sketch: Sketch, name: str) -> None:
    slider = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    if joint.clearance is None or joint.length is None:
        frame = _add_guide(sketch, joint, name)
        block = in_points(frame, slider * (13, 7))
        said = name
    else:
        half, side = (sketch.scene.start.number(x) / 2 for x in (joint.length, joint.height))
        play, said = enlarged_clearance(sketch, name, joint.clearance)
        frame = _add_guide(sketch, joint, name, (half, side), (12.0, play))
        turn = np.arctan2(joint.axis[1], joint.axis[0]) - sketch.scene.start.number(joint.angle)
        axis = sketch.tracks.axis(joint.first, (float(np.cos(turn)), float(np.sin(turn))))
        block = in_metres(LocalFrame(frame.origin, turn=axis), slider * (half, side))
    sketch.line(block, closed=True, fill="pale", layer=5.5, part=f"joint {name!r}")
    sketch.name(said, at(frame.origin))


def _add_guide(
    sketch: Sketch,
    joint: Slot | Prismatic,
    name: str,
    metres: tuple[float, float] = (0.0, 0.0),
    points: tuple[float, float] = (26.0, 7.0),
) -> LocalFrame:
    """Add rails that reach beyond a slider's middle, in metres and points; return its frame."""
    first, second = sketch.points(joint.points)
    turn = sketch.tracks.axis(joint.second, joint.axis)
    sketch.line(at(first, second), **AXIS)
    sketch.guides[name] = first, second, turn
    low, high = sketch.travel(name, joint, joint.axis)
    rail, (length, height), (overhang, play) = LocalFrame(second, turn=turn), metres, points
    for side in (-1.0, 1.0):
        start = (low - length, height * side, -overhang, play * side)
        end = (high + length, height * side, overhang, play * side)
        if body_of(joint.second):
            sketch.line(Stroke([rail], np.array([start, end])), layer=5.0)
        else:
            ends = (start, end) if side < 0 else (end, start)
            sketch.hatch(rail, *ends, (-4.0 * -side, 4.0 * side))
    return LocalFrame(first, turn=turn)


@add_joint.register
def _(joint: Gear, sketch: Sketch, name: str) -> None:
    numbers = [sketch.scene.start.number(radius) for radius in joint.radii]
    _add_gears(sketch, list(zip(joint.points, numbers, strict=True)), f"joint {name!r}")
    sketch.name(name, at(force_point(joint, sketch.tracks, name)))


@singledispatch
def force_point(joint: Joint, tracks: Tracks, name: str) -> int:
    """Return the number of the place where the force of a joint acts."""
    return tracks.point(joint.points[0])


@force_point.register
def _(gear: Gear, tracks: Tracks, name: str) -> int:
    """Return the number of the place where two gears touch."""

    def vector(model: SensorModel) -> Vector:
        (first, second), place = gear.radii, model.frame(gear.first).position
        centres = subtract(model.frame(gear.second).position, place)
        return add(place, scale(first / (first + second), centres))

    return tracks.position(vector, ("contact", name))


@add_joint.register
def _(joint: Rack, sketch: Sketch, name: str) -> None:
    """Add the pitch circle of a pinion and a rack with teeth on the far side."""
    scene = sketch.scene
    part = f"joint {name!r}"
    radius = scene.start.number(joint.radius)
    _add_gears(sketch, [(joint.first, abs(radius))], f"pinion of {part}")
    line = scene.rack_line(joint)
    ends = _on_rack(sketch, joint, line[0], name), _on_rack(sketch, joint, line[1], name)
    length = float(np.linalg.norm(line[1] - line[0])) / sketch.unit
    vertices = [(0.0, 0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)]
    for x in np.arange(TOOTH_SPACING / 2, length, TOOTH_SPACING) / length:
        vertices += [(np.nan,) * 4, (x, 0.0, 0.0, 0.0), (x, 0.0, 0.0, -np.sign(radius) * TOOTH)]
    frame = LocalFrame(ends[0], ends=ends, shares=True)
    sketch.line(Stroke([frame], np.array(vertices)), width=0.9, layer=2.6, part=part)
    sketch.name(name, at(ends[1]))


def _on_rack(sketch: Sketch, rack: Rack, end: np.ndarray, name: str) -> int:
    """Return the number of the point of a rack's body that is at `end` [m] at the start."""
    frame = sketch.scene.mechanism.model.frame(rack.second)
    offset = end - sketch.scene.at(rack.second)
    x, y = (
        float(offset @ sketch.scene.start.vector(axis)) for axis in (section_normal(frame), frame.y)
    )
    return sketch.tracks.position(
        lambda model: model.frame(rack.second).translate(x, y).position, ("rack", name, x, y)
    )


def _add_gears(sketch: Sketch, gears: list[tuple[PointName, float]], part: str) -> None:
    """Add pitch circles with teeth; those of rings have negative radii."""
    strokes = []
    for point, radius in gears:
        frame = LocalFrame(sketch.tracks.point(point), turn=sketch.tracks.turn(point))
        strokes.append(sketch.gear_circle(frame, radius))
        if radius > 0:
            sketch.line(in_metres(frame, circle(radius, 180)[:-1]), closed=True, fill="pale",
                        alpha=0.5, width=0.0, layer=1.2)  # fmt: skip
            sketch.line(in_metres(frame, [(0, 0), (radius, 0)]), width=0.9, layer=2.6)
    sketch.line(*strokes, width=0.9, layer=2.6, part=part)


@add_joint.register
def _(joint: PrescribedRotation, sketch: Sketch, name: str) -> None:
    sense = sketch.scene.first_sense(joint.angle)
    pivot = sketch.tracks.point(pin_between(sketch.scene, *joint.points) or joint.first)
    frame = LocalFrame(pivot, turn=sketch.tracks.turn(joint.first))
    middle = sketch.add_turn_arrow(
        frame, 0.35 * sense, 1.7 * sense, 24.0, "drive", f"joint {name!r}"
    )
    sketch.name(name, middle, color="drive")


@add_joint.register
def _(joint: PrescribedTravel, sketch: Sketch, name: str) -> None:
    first, second = sketch.points(joint.points)
    sense = sketch.scene.first_sense(joint.travel)
    frame = LocalFrame(first, turn=sketch.tracks.axis(joint.second, joint.axis))
    shaft = in_points(frame, [(0.0, 20.0 * sense), (36.0 * sense, 20.0 * sense)])
    sketch.line(at(first, second), **AXIS)
    sketch.mark(at(first), size=11.0, color="drive", layer=8.0)
    sketch.lines.append(arrow([shaft], color="drive", part=f"joint {name!r}"))
    sketch.name(name, shaft, color="drive")


@add_joint.register
def _(joint: PrescribedPath, sketch: Sketch, name: str) -> None:
    place = sketch.tracks.point(joint.first)
    sketch.mark(at(place), size=11.0, color="drive", layer=8.0)
    x, y = sketch.scene.velocity(joint.first).tolist()
    shaft = in_points(LocalFrame(place, fixed=(x, y)), [(0.0, 0.0), (36.0, 0.0)])
    if x or y:
        part = f"joint {name!r}"
        sketch.lines.append(arrow([shaft], color="drive", part=part, start_only=True))
    sketch.name(name, shaft if x or y else at(place), color="drive")


def _ground_points(joint: Joint) -> list[PointName]:
    return [point for point in joint.points if not body_of(point)]


def _add_bearings(sketch: Sketch, joint: PairJoint) -> None:
    """Add bearings where a joint is fixed to the ground, above a body that hangs from it."""
    for point in _ground_points(joint):
        _, y = up = _outward(sketch, joint, point)
        hanging = y < -0.3 * np.hypot(*up)
        sketch.pedestal(sketch.tracks.point(point), (0.0, -1.0 if hanging else 1.0))


def _outward(sketch: Sketch, joint: Joint, point: PointName) -> tuple[float, float]:
    """Return the direction from a point of the ground to the body that is held there."""
    place = sketch.scene.at(point)
    direction = sketch.scene.at(next(filter(None, map(body_of, joint.points)))) - place
    if np.linalg.norm(direction) <= 1e-9 * (1.0 + np.linalg.norm(place)):  # the body's own centre
        return 0.0, 1.0
    return float(direction[0]), float(direction[1])
