"""Shapes of bodies."""

from __future__ import annotations

from functools import singledispatch

import numpy as np

from flexband.mechanics.bodies.body import Body
from flexband.mechanics.bodies.centre_line import CentreLine
from flexband.mechanics.bodies.point_mass import PointMass
from flexband.mechanics.bodies.rigid import RigidBody
from flexband.report.shapes.joints import gear_radii
from flexband.report.shapes.scene import body_of, hull
from flexband.report.shapes.shapes import Length, LocalFrame, Stroke, at, in_points
from flexband.report.shapes.sketch import Outline, Sketch, circle, in_metres


@singledispatch
def add_body(body: Body, sketch: Sketch, name: str) -> None:
    """Add a body with its name and its lengths; a body of unknown type is a diamond."""
    sketch.unknown([name], f"body {name!r}")
    _add_center(sketch, name)


@add_body.register
def _(body: PointMass, sketch: Sketch, name: str) -> None:
    place = at(sketch.tracks.point(f"{name}.center"))
    sketch.mark(place, size=11.0, fill="ink", part=f"body {name!r}")
    _add_center(sketch, name)


def _add_center(sketch: Sketch, name: str) -> None:
    """Add the name of a body at its centre, which stands for it in other samples."""
    center = sketch.tracks.point(f"{name}.center")
    sketch.outlines.append(Outline([center]))
    sketch.name(name, at(center), italic=True)


@add_body.register
def _(body: RigidBody, sketch: Sketch, name: str) -> None:
    """Add a link, a plate or, without an extent, a circle; mark the centre of mass."""
    scene = sketch.scene
    tracks = sketch.tracks
    part = f"body {name!r}"
    corners = scene.corners(name)
    frame = LocalFrame(tracks.point(f"{name}.center"), turn=tracks.turn(f"{name}.center"))
    if len(corners) > 1:
        _add_link(sketch, body, name, frame)
    else:
        radius = _disc_radius(sketch, body, name)
        outline = Outline([frame.origin])
        if radius is None:  # a circle of its radius of gyration
            mass, inertia = (scene.start.number(value) for value in (body.mass, body.inertia))
            radius = float(np.sqrt(inertia / mass)) if mass > 0 else 0.0
            sketch.line(in_metres(frame, circle(radius, 60)[:-1]), closed=True, fill="pale",
                        dash=(4, 2), width=0.9, layer=3.0, part=part)  # fmt: skip
            sketch.line(in_metres(frame, [(0, 0), (radius, 0)]), width=0.9, layer=3.1)
        if radius:
            rim = tracks.position(
                lambda model: model.frame(f"{name}.center").translate(radius, 0.0).position,
                ("rim", name),
            )
            outline = Outline([frame.origin, rim], radius=radius)
        sketch.outlines.append(outline)
        sketch.name(name, at(frame.origin), italic=True)
    sketch.mark(at(frame.origin), fill="paper", width=0.8, layer=6.1, part=f"center of {part}")
    quarter = 3.5 * np.vstack([[(0.0, 0.0)], circle(1.0, 32)[:9]])
    for half in (quarter, -quarter):
        sketch.line(in_points(frame, half), closed=True, fill="ink", width=0.0, layer=6.2)


def _add_link(sketch: Sketch, body: RigidBody, name: str, frame: LocalFrame) -> None:
    """Add a plate with rounded corners, or a bar between two corners, and its length."""
    scene = sketch.scene
    corners = scene.corners(name)
    center = scene.at(name)
    points = [f"{name}.{point}" for point in (*body.points, "center")]
    places = np.array([scene.at(point) for point in points])
    numbers = sketch.points(
        [points[int(np.argmin(np.linalg.norm(places - corner, axis=1)))] for corner in corners]
    )
    for color, width, part in (("ink", 8.0, f"body {name!r}"), ("pale", 6.0, "")):
        sketch.line(at(*numbers), closed=True, fill=color, color=color, width=width, layer=3.0,
                    part=part)  # fmt: skip
    around = hull(np.concatenate([corners, center[None]])).tolist()
    if center.tolist() in around and center.tolist() not in corners.tolist():  # it is outside
        first, second = np.argsort(np.linalg.norm(corners - center, axis=1))[:2]
        stays = at(numbers[first], frame.origin, numbers[second])
        sketch.line(stays, color="muted", width=0.9, layer=2.5)
    sketch.outlines.append(Outline(numbers, closed=len(numbers) > 2))
    plate = len(numbers) > 2
    sketch.name(name, at(*numbers) if plate else at(frame.origin), italic=True, inside=plate)
    if not plate:
        length = float(np.linalg.norm(corners[1] - corners[0]))
        sketch.lengths.append(Length(at(*numbers), length))


def _disc_radius(sketch: Sketch, body: RigidBody, name: str) -> float | None:
    """Return the largest radius [m] that joints draw the body with; None if no joint draws it."""
    radii = [
        abs(sketch.scene.start.number(radius))
        for joint in sketch.scene.mechanism.joints.values()
        for point, radius in gear_radii(joint)
        if body_of(point) == name
    ]
    return max(radii, default=None)


@add_body.register
def _(body: CentreLine, sketch: Sketch, name: str) -> None:
    """Add a beam to scale or a cable as a line; mark the nodes."""
    per_element = max(2, -(-sketch.gaps // body.elements))
    places = body.fractions(per_element)
    axis = sketch.points([f"{name}.{place!r}" for place in places.tolist()])
    half = sketch.scene.half_height(name, places)
    last = len(axis) - 1
    frames = [
        LocalFrame(number, ends=(axis[max(k - 1, 0)], axis[min(k + 1, last)]))
        for k, number in enumerate(axis)
    ]
    nodes = slice(None, None, per_element)
    style = {"color": "flexible", "fill": "filled", "part": f"body {name!r}"}
    if half.any():
        vertices = np.zeros((2 * len(axis), 4))
        vertices[:, 1] = np.concatenate([half, -half[::-1]])
        sketch.line(Stroke([*frames, *frames[::-1]], vertices), closed=True, layer=4.0, **style)
        ticks = []
        for frame, size in zip(frames[nodes], half[nodes].tolist(), strict=True):
            y = (size, 0.0) if size > 3.0 * sketch.unit else (0.0, 3.0)
            ends = np.array([(0.0, -y[0], 0.0, -y[1]), (0.0, y[0], 0.0, y[1])])
            ticks.append(Stroke([frame], ends))
        sketch.line(*ticks, color="flexible", width=0.8, layer=4.1, spacing=10.0)
    else:
        sketch.line(at(*axis), width=1.8, layer=4.1, **style | {"fill": ""})
        sketch.mark(at(*axis[nodes]), size=3.5, width=0.0, color="flexible", fill="flexible",
                    layer=4.1, spacing=10.0)  # fmt: skip
    length = sketch.scene.start.number(body.length)
    sketch.lengths.append(Length(at(*axis), length, beside=float(half.max())))
    sketch.outlines.append(Outline(axis[:: max(1, last // 12)]))
    sketch.name(name, at(sketch.tracks.point(f"{name}.center")), italic=True)
