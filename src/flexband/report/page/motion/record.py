"""Shapes as records that JSON can hold, which motion_scene.js draws."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import MISSING, dataclass, field, fields
from typing import Any

import numpy as np

from flexband.report.page.arrays import packed
from flexband.report.shapes.shapes import (
    Alternatives,
    FieldArrow,
    Length,
    Line,
    LocalFrame,
    Mark,
    Name,
    Shape,
    Stroke,
)


def recorded(shapes: Iterable[Shape]) -> dict[str, Any]:
    """Return `shapes` in the order in which they are drawn, and the `vertices` of all, packed.

    A shape has a `kind`, "line", "mark", "name" or "field", the attributes that are not the default
    ones, and `strokes`, whose vertices are `count` from the `first` on; NaN lifts the pen.
    """
    recorder = Recorder()
    for shape in shapes:
        shape.draw(recorder)
    return {
        "shapes": sorted(recorder.records, key=lambda record: record["layer"]),
        "vertices": packed(np.concatenate([np.zeros((0, 4)), *recorder.vertices])),
    }


@dataclass
class Recorder:
    """A surface that makes records of shapes."""

    records: list[dict[str, Any]] = field(default_factory=list)
    vertices: list[np.ndarray] = field(default_factory=list)

    def draw_line(self, line: Line) -> None:
        if not line.start_only:
            strokes = [self._stroke(stroke) for stroke in line.strokes]
            self.records.append({"kind": "line", **_changed(line), "strokes": strokes})

    def draw_mark(self, mark: Mark) -> None:
        record = {"kind": "mark", "marker": mark.marker, "size": mark.size, **_changed(mark)}
        self.records.append(record | {"strokes": [self._stroke(mark.stroke)]})

    def draw_name(self, name: Name) -> None:
        if name.stroke is not None:
            record = {"kind": "name", "layer": 10.0, "text": name.text, "color": name.color}
            record |= {"italic": name.italic, "strokes": [self._stroke(name.stroke)]}
            self.records.append(record)

    def draw_field(self, field: FieldArrow) -> None:
        self.records.append({"kind": "field", "layer": 8.0, "vector": field.vector})

    def draw_length(self, length: Length) -> None:
        pass

    def draw_alternatives(self, alternatives: Alternatives) -> None:
        for shape in alternatives.options[0][1]:
            shape.draw(self)

    def _stroke(self, stroke: Stroke) -> dict[str, Any]:
        first = sum(map(len, self.vertices))
        self.vertices.append(stroke.vertices.astype(np.float32))
        frames = [_frame(frame) for frame in stroke.frames]
        return {"frames": frames, "first": first, "count": len(stroke.vertices)}


def _changed(shape: Line | Mark) -> dict[str, Any]:
    """Return the attributes with other values than their defaults, and the layer."""
    plain = [f for f in fields(shape) if f.default is not MISSING]
    values = {f.name: getattr(shape, f.name) for f in plain}
    changed = {f.name: values[f.name] for f in plain if values[f.name] != f.default}
    return {**changed, "layer": shape.layer, "width": shape.width}


def _frame(frame: LocalFrame) -> dict[str, Any]:
    """Return a frame without what is not used."""
    values = {k: v for k, v in vars(frame).items() if v is not None and v is not False}
    if "turn" in values or "ends" in values or frame.fixed == (1.0, 0.0):
        del values["fixed"]
    return values
