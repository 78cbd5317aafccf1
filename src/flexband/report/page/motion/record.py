"""Shapes, arrows of forces and measured points as records that JSON can hold, for an animation."""

from __future__ import annotations

from dataclasses import fields
from functools import partial

import numpy as np

from flexband.mechanics.kernels.forms import Vector
from flexband.mechanics.loads.load import in_time
from flexband.mechanics.loads.loads import Force
from flexband.mechanics.model.mechanism import Mechanism
from flexband.mechanics.sensors.motion import Acceleration, Position, SensorModel, Velocity
from flexband.report.page.arrays import JsonRecord, pack
from flexband.report.shapes.joints import force_point
from flexband.report.shapes.scene import body_of
from flexband.report.shapes.shapes import LocalFrame, Shape, Stroke
from flexband.report.shapes.sketch import Sketch
from flexband.report.shapes.tracks import Tracks


def record_shapes(sketch: Sketch) -> JsonRecord:
    """Return `shapes` in the order in which they are drawn, and `vertices` of all, packed.

    A shape has a `kind`, attributes that are not the default ones, and `strokes`, whose vertices
    are `count` from the `first` on; NaN lifts the pen.
    """
    vertices: list[np.ndarray] = [np.zeros((0, 4))]

    def strokes(*shape_strokes: Stroke) -> list[JsonRecord]:
        records = []
        for stroke in shape_strokes:
            frames = [_frame(frame) for frame in stroke.frames]
            first = sum(map(len, vertices))
            count = len(stroke.vertices)
            records.append({"frames": frames, "first": first, "count": count})
            vertices.append(stroke.vertices.astype(np.float32))
        return records

    lines = [line for line in sketch.lines if not line.start_only]
    shapes: list[JsonRecord] = [
        {"kind": kind, **_changed_attributes(shape), "strokes": strokes(*shape.strokes)}
        for kind, group in (("line", lines), ("mark", sketch.marks))
        for shape in group
    ]
    shapes += [{"kind": "field", "layer": 8.0, "vector": f.vector} for f in sketch.fields]
    shapes += [
        {"kind": "name", "layer": 10.0, "text": name.text, "color": name.color,
         "italic": name.italic, "strokes": strokes(name.stroke)}
        for name in sketch.names if name.stroke is not None
    ]  # fmt: skip
    shapes.sort(key=lambda record: record["layer"])
    return {"shapes": shapes, "vertices": pack(np.concatenate(vertices))}


def _changed_attributes(shape: Shape) -> JsonRecord:
    """Return attributes with other values than their defaults, and those that marks need."""
    always = ("layer", "width", "marker", "size")
    return {
        f.name: value
        for f in fields(shape)
        if f.name != "strokes" and ((value := vars(shape)[f.name]) != f.default or f.name in always)
    }


def _frame(frame: LocalFrame) -> JsonRecord:
    """Return a frame without what is not used."""
    values = {k: v for k, v in vars(frame).items() if v is not None and v is not False}
    if "turn" in values or "ends" in values or frame.fixed == (1.0, 0.0):
        del values["fixed"]
    return values


def force_arrows(mechanism: Mechanism, tracks: Tracks) -> list[JsonRecord]:
    """Return the arrows of reactions and of applied forces, with the numbers of their tracks."""
    arrows = []
    for name, joint in mechanism.joints.items():
        force = tracks.reaction(name)
        if force is not None and joint.points:
            at = force_point(joint, tracks, name)
            arrows.append({"kind": "reaction", "name": name, "at": at, "force": force})
    for name, load in mechanism.loads.items():
        if isinstance(load, Force):
            at = tracks.point(load.point)
            force = tracks.force(partial(_applied_force, load=load), ("load", name))
            arrows.append({"kind": "force", "name": name, "at": at, "force": force})
    return arrows


def _applied_force(model: SensorModel, load: Force) -> Vector:
    x = in_time("x", load.x)
    y = in_time("y", load.y)
    return model.frame(load.point).direction(x, y) if load.following else (x, y)


def traces_of(mechanism: Mechanism, tracks: Tracks) -> list[JsonRecord]:
    """Return the measured points whose paths tell something, unlike that of an Angle."""
    return [
        {"name": name, "at": tracks.point(sensor.point)}
        for name, sensor in mechanism.sensors.items()
        if isinstance(sensor, Position | Velocity | Acceleration) and body_of(sensor.point)
    ]
