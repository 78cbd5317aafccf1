"""The canvas that mechanisms are drawn on, whatever its surface is: Matplotlib or SVG.

Places are in metres, sizes of symbols in points (1/72 inch). The canvas records as ink where it is
covered, so that names can be written where there is little ink.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import product
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from flexband.report.shapes.shapes import FieldArrow, Line, Mark, Name, Shape, Stroke
from flexband.report.shapes.sketch import Sketch, arrow, circle

COLORS = {
    "": "none", "ink": "#262626", "paper": "#ffffff", "hole": "#ffffff", "pale": "#e6e6e6",
    "muted": "#999999", "flexible": "#1f78b4", "filled": "#c6dbef", "load": "#d95f02",
    "drive": "#1b7837", "length": "#666666", "realization": "#5b9bd0",
}  # fmt: skip
"""Colours by their names in shapes."""


class Lettering(NamedTuple):
    """How a text is written, centred at its place."""

    color: str = "ink"  # name of a colour
    italic: bool = False
    size: float = 9.0
    """Of the letters [pt]."""
    angle: float = 0.0
    """Of the line [degrees]."""
    backed: bool = False  # whether what is behind the text is hidden
    layer: float = 10.0


class Surface(Protocol):
    """Where shapes are drawn: places are in metres, sizes in points."""

    def line(self, points: np.ndarray, style: Line) -> None:
        """Draw a line through points; NaN interrupts the line."""

    def area(self, points: np.ndarray, style: Line) -> None:
        """Fill a polygon."""

    def marks(self, points: np.ndarray, mark: Mark) -> None:
        """Draw a marker at each point."""

    def text(self, place: np.ndarray, text: str, lettering: Lettering) -> None:
        """Write a text."""

    def note(self, text: str) -> None:
        """Write a text into the lower left corner."""

    def extent(self, text: str, lettering: Lettering) -> np.ndarray:
        """Return the width and the height of a text [pt]."""
        ...


class Label(NamedTuple):
    """A name to be written near a place [m], or at the place if `inside`."""

    place: np.ndarray
    text: str
    inside: bool
    lettering: Lettering = Lettering()


Dimension = tuple[np.ndarray, str, float]
"""The line [m] of a length, its text, and how far [m] it is at least written from the line."""


@dataclass
class Canvas:
    """A surface with a scale, and the ink on it."""

    surface: Surface  # to draw on
    box: np.ndarray  # two opposite corners of the drawing [m], shape (2, 2)
    unit: float  # metres per point
    # those that the shapes are placed by, shape (tracks, 2)
    position: np.ndarray
    direction: np.ndarray
    # whether these are written
    names: bool
    dimensions: bool
    ink: list[np.ndarray] = field(default_factory=list)  # points [m] that are covered
    keeps_ink: bool = True  # whether ink is recorded, which names without a place need
    # what is to be written
    labels: list[Label] = field(default_factory=list)
    measured: list[Dimension] = field(default_factory=list)
    is_crowded: bool = False  # whether no corner was empty for the arrow of a field
    notes: list[str] = field(default_factory=list)

    def places(self, stroke: Stroke) -> np.ndarray:
        """Return the vertices of a stroke [m], shape (vertices, 2)."""
        return stroke.places(self.position, self.direction, self.unit)

    def draw(self, sketch: Sketch) -> None:
        """Draw all shapes; names and lengths are written afterwards, by `words.write`."""
        for line in sketch.lines:
            self.draw_line(line)
        for mark in sketch.marks:
            self.draw_mark(mark)
        for name in sketch.names:
            self.draw_name(name)
        for field_arrow in sketch.fields:  # last, since these may be anywhere
            self.draw_field(field_arrow)
        if self.dimensions:
            self.measured += [
                (self.places(stroke), f"{length:.4g} m", beside)
                for stroke, length, beside in sketch.lengths
            ]

    def draw_line(self, line: Line) -> None:
        """Draw lines, an area, or an arrow."""
        strokes = [self.places(stroke) for stroke in line.strokes]
        if line.head:
            self.arrow(strokes[0], line)
        elif line.closed:
            self.area(strokes[0], line)
        elif self._is_apart(np.array([stroke.mean(axis=0) for stroke in strokes]), line):
            gaps = [part for stroke in strokes for part in (np.full((1, 2), np.nan), stroke)]
            self.line(np.concatenate(gaps[1:]), line)

    def line(self, points: np.ndarray, style: Line) -> None:
        """Draw a line through points [m]; NaN interrupts the line."""
        self.surface.line(points, style)
        self.add_ink(points)

    def area(self, points: np.ndarray, style: Line) -> None:
        """Fill a polygon [m]."""
        self.surface.area(points, style)
        self.add_ink(np.concatenate([points, points[:1]]), style.width)

    def arrow(self, points: np.ndarray, style: Line) -> None:
        """Draw an arrow along points [m]."""
        tip = points[-1]
        head = style.head
        shaft = points[np.hypot(*(points - tip).T) > 0.9 * head * self.unit]
        if not len(shaft):
            shaft = 2 * tip[None] - self.local(tip, tip - points[0], [[head, 0.0]])
        corners = [(0, 0), (-head, head / 3.2), (-head, -head / 3.2)]
        triangle = self.local(tip, tip - shaft[-1], corners)
        self.line(np.concatenate([shaft, triangle[1:].mean(axis=0)[None]]), style)
        self.area(triangle, replace(style, part="", fill=style.color, width=0.0))

    def local(self, origin: ArrayLike, direction: ArrayLike, shape: ArrayLike) -> np.ndarray:
        """Return points [m] from their coordinates [pt] along a direction and to its left."""
        x, y = np.asarray(direction, dtype=float) / np.hypot(*np.asarray(direction, dtype=float))
        return np.asarray(origin) + self.unit * np.asarray(shape, dtype=float) @ [[x, y], [-y, x]]

    def draw_mark(self, mark: Mark) -> None:
        places = self.places(mark.strokes[0])
        if not self._is_apart(places, mark):
            return
        self.surface.marks(places, mark)
        rim = circle(self.unit * mark.size / 2, 11)
        for place in places:
            self.add_ink(place + rim)

    def _is_apart(self, places: np.ndarray, shape: Shape) -> bool:
        """Return whether places [m] are far enough from each other to draw a shape at each."""
        distances = np.hypot(*np.diff(places, axis=0).T)
        min_distance = shape.spacing * self.unit * len(distances)
        return not shape.spacing or min_distance <= distances.sum()

    def draw_name(self, name: Name) -> None:
        """Add a name; without a place, a note."""
        if name.stroke is None:
            self.notes.append(name.text)
        elif self.names:
            place = self.places(name.stroke).mean(axis=0)
            lettering = Lettering(name.color, name.italic)
            self.labels.append(Label(place, name.text, name.inside, lettering))

    def draw_field(self, field: FieldArrow) -> None:
        """Draw an arrow in the emptiest corner, or a dot if its vector vanishes."""
        inset = 27.0 * self.unit
        half = 18.0
        (left, bottom), (right, top) = self.box[0] + inset, self.box[1] - inset
        corners = [np.array(corner) for corner in product((right, left), (top, bottom))]
        place = min(corners, key=lambda corner: self.ink_count(corner, 2 * half))
        self.is_crowded |= self.ink_count(place, 1.3 * half) > 0
        if np.any(field.vector):
            shaft = self.local(place, field.vector, [(-half, 0), (half, 0)])
            self.arrow(shaft, arrow((), color="load", part=field.part))
        else:
            dot = Mark(strokes=(), size=4.0, width=1.0, color="load", fill="load", part=field.part)
            self.surface.marks(place[None], dot)
        if self.names:
            self.labels.append(Label(place, field.name, False, Lettering("load")))

    def ink_count(self, place: np.ndarray, reach: float) -> int:
        """Count the points of ink within `reach` points of a place [m]."""
        return int(np.all(np.abs(self.all_ink() - place) < reach * self.unit, axis=1).sum())

    def all_ink(self) -> np.ndarray:
        """Return all points of ink [m], shape (points, 2)."""
        return np.concatenate([np.zeros((0, 2)), *self.ink])

    def add_ink(self, points: np.ndarray, width: float = 1.0) -> None:
        """Add a stroke through points [m] of a width [pt]; of a wide stroke, its edges."""
        if not self.keeps_ink:
            return
        shifts = width / 2 * self.unit * np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
        count = 4 if width > 2.0 else 1
        self.ink += [self.dense(points) + shift for shift in shifts[:count]]

    def dense(self, points: np.ndarray) -> np.ndarray:
        """Return points 2 pt apart along a line, without its gaps."""
        steps = np.hypot(*np.diff(points, axis=0).T) / self.unit / 2.0
        counts = np.maximum(np.nan_to_num(steps).astype(int), 1)
        pieces = zip(points, points[1:], counts, strict=False)
        parts = [np.linspace(a, b, n, endpoint=False) for a, b, n in pieces]
        dense = np.concatenate([*parts, points[-1:]])
        return dense[np.isfinite(dense).all(axis=1)]
