"""Shapes as records that JSON can hold, which motion_scene.js draws."""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from flexband.report.page.arrays import JsonRecord, packed
from flexband.report.shapes.shapes import LocalFrame, Shape, Stroke
from flexband.report.shapes.sketch import Sketch


def recorded(sketch: Sketch) -> JsonRecord:
    """Return `shapes` in the order in which they are drawn, and the `vertices` of all, packed.

    A shape has a `kind`, "line", "mark", "name" or "field", the attributes that are not the default
    ones, and `strokes`, whose vertices are `count` from the `first` on; NaN lifts the pen.
    """
    vertices: list[np.ndarray] = [np.zeros((0, 4))]

    def strokes(*given: Stroke) -> list[JsonRecord]:
        records = []
        for stroke in given:
            frames = [_frame(frame) for frame in stroke.frames]
            first, count = sum(map(len, vertices)), len(stroke.vertices)
            records.append({"frames": frames, "first": first, "count": count})
            vertices.append(stroke.vertices.astype(np.float32))
        return records

    lines = [line for line in sketch.lines if not line.start_only]
    shapes: list[JsonRecord] = [
        {"kind": kind, **_changed(shape), "strokes": strokes(*shape.strokes)}
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
    return {"shapes": shapes, "vertices": packed(np.concatenate(vertices))}


def _changed(shape: Shape) -> JsonRecord:
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
