"""The shapes of a mechanism as they are collected, part by part."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexband.mechanics.joints.joint import PairJoint, PointName
from flexband.mechanics.kernels.relation_forms import along
from flexband.mechanics.loads.load import PairLoad
from flexband.report.shapes.scene import Scene
from flexband.report.shapes.shapes import (
    PEN_UP,
    FieldArrow,
    Length,
    Line,
    LocalFrame,
    Mark,
    Name,
    Stroke,
    at,
    in_points,
)
from flexband.report.shapes.tracks import Tracks


class Outline(NamedTuple):
    """What is drawn of a body in other samples: a line through positions."""

    points: Sequence[int]  # numbers of positions
    closed: bool = False  # whether the line returns to the first
    radius: float = 0.0  # of a circle about the first [m], or zero


@dataclass(frozen=True)
class Sketch:
    """Shapes of a mechanism, and the tracks that place them."""

    scene: Scene  # the mechanism at its start
    tracks: Tracks  # positions and directions that the shapes name by numbers
    unit: float  # metres per point, by which the numbers of teeth and coils are chosen
    # joint -> lowest and highest place [m] of a slider along its guide during the motion; by
    # default that at the start
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    gaps: int = 24  # least number of gaps between the points that a beam's axis is drawn through
    # the shapes
    lines: list[Line] = field(default_factory=list)
    marks: list[Mark] = field(default_factory=list)
    names: list[Name] = field(default_factory=list)
    lengths: list[Length] = field(default_factory=list)
    fields: list[FieldArrow] = field(default_factory=list)
    outlines: list[Outline] = field(default_factory=list)  # of bodies in other samples
    # joint -> numbers of the positions of a slider and of its guide, and of its direction
    guides: dict[str, tuple[int, int, int]] = field(default_factory=dict)

    def line(self, *strokes: Stroke, **style: Any) -> None:
        """Add lines."""
        self.lines.append(Line(strokes=strokes, **style))

    def mark(self, stroke: Stroke, **style: Any) -> None:
        """Add a mark at each vertex."""
        self.marks.append(Mark(strokes=[stroke], **style))

    def name(self, text: str, stroke: Stroke | None, **style: Any) -> None:
        """Add a name near the middle of a stroke."""
        self.names.append(Name(text, stroke, **style))

    def points(self, points: Sequence[PointName]) -> list[int]:
        """Return the numbers of the positions of points."""
        return [self.tracks.point(point) for point in points]

    def travel(
        self, name: str, part: PairJoint | PairLoad, axis: tuple[float, float]
    ) -> tuple[float, float]:
        """Return the extreme places [m] of a part's first point on an axis of the second."""
        first, second = part.points
        direction = self.scene.start.vector(along(self.scene.mechanism.model.frame(second), axis))
        place = float((self.scene.at(first) - self.scene.at(second)) @ direction)
        return self.ranges.get(name, (place, place))

    def freest(self, places: Sequence[Stroke]) -> Stroke:
        """Return the one of several places that is the farthest from the mechanism's points."""
        start_tracks = self.tracks.at_start(self.scene.start)

        def distance(place: Stroke) -> float:
            (middle,) = place.places(*start_tracks, self.unit)
            return float(np.linalg.norm(start_tracks[0] - middle, axis=1).mean())

        return max(places, key=distance)

    def unknown(self, points: Sequence[PointName], part: str, color: str = "ink") -> None:
        """Add a diamond at the first point, if there is one, and dashed lines to the others."""
        numbers = self.points(points)
        if numbers:
            self.mark(at(numbers[0]), marker="diamond", size=8.0, color=color, fill="paper",
                      layer=8.0, part=part)  # fmt: skip
        for other in numbers[1:]:
            self.line(at(numbers[0], other), color=color, width=0.8, dash=(4, 3), layer=2.5)

    def hatch(
        self, frame: LocalFrame, first: ArrayLike, last: ArrayLike, tick: tuple[float, float]
    ) -> None:
        """Add the surface of the ground between two vertices, and strokes [pt] from it."""
        first = np.asarray(first, dtype=float)
        last = np.asarray(last, dtype=float)
        length = np.linalg.norm((last - first)[:2] / self.unit + (last - first)[2:])
        shares = np.linspace(3.0 / length, 1.0, int((length - 3.0) // 4.0) + 1)[:, None]
        surface = first + shares * (last - first)
        feet = surface + np.array([0.0, 0.0, *tick])
        ticks = np.stack([np.full_like(feet, np.nan), surface, feet], axis=1).reshape(-1, 4)
        self.line(Stroke([frame], np.vstack([first, last, ticks])), layer=2.0, width=0.9)

    def pedestal(self, place: int, up: tuple[float, float]) -> None:
        """Add a bearing that stands on the ground."""
        frame = LocalFrame(place, fixed=up)
        self.line(in_points(frame, [(0, 0), (-13, -7), (-13, 7)]), closed=True, fill="paper",
                  layer=2.1)  # fmt: skip
        self.hatch(frame, (0, 0, -13, -12), (0, 0, -13, 12), (-4, -4))

    def wall(self, frame: LocalFrame, half: float = 12.0, extent: float = 0.0) -> None:
        """Add a wall across x, which reaches `half` points and `extent` metres to each side."""
        self.hatch(frame, (0, -extent, 0, -half), (0, extent, 0, half), (-4, -4))

    def add_turn_arrow(
        self, frame: LocalFrame, start: float, sweep: float, radius: float, color: str, part: str
    ) -> Stroke:
        """Add an arrow from angle `start` by `sweep` [rad], radius in points; return its middle."""
        angles = start + sweep * np.linspace(0.0, 1.0, 40)
        points = arc(angles, radius)
        self.lines.append(arrow([in_points(frame, points)], color=color, part=part))
        return in_points(frame, points[20:21])

    def gear_circle(self, frame: LocalFrame, radius: float) -> Stroke:
        """Return a pitch circle with teeth, which point outward on a ring, radius < 0."""
        rim = circle(abs(radius), 180)
        count = max(int(2 * np.pi * abs(radius) / (TOOTH_SPACING * self.unit)), 8)
        feet = circle(1.0, count)[:-1]
        roots = np.hstack([abs(radius) * feet, np.zeros_like(feet)])
        tips = roots - np.hstack([np.zeros_like(feet), np.sign(radius) * TOOTH * feet])
        teeth = np.stack([np.full_like(roots, np.nan), roots, tips], axis=1).reshape(-1, 4)
        return Stroke([frame], np.vstack([np.hstack([rim, np.zeros_like(rim)]), teeth]))


AXIS = {"color": "muted", "width": 0.7, "dash": (9, 3, 2, 3), "layer": 1.0}
"""The line of a guide."""

TOOTH = 4.0
TOOTH_SPACING = 5.0
"""Length and distance [pt] of the strokes that stand for teeth."""


def arrow(strokes: Sequence[Stroke], **style: Any) -> Line:
    """Return an arrow along a stroke."""
    return replace(Line(width=1.6, layer=8.0, head=8.0), strokes=strokes, **style)


def arc(angles: np.ndarray, radius: ArrayLike = 1.0) -> np.ndarray:
    """Return points at angles [rad], each at its radius or all at one, (points, 2)."""
    return np.reshape(radius, (-1, 1)) * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def circle(radius: float, count: int) -> np.ndarray:
    """Return points on a circle; the first point is repeated at the end."""
    return arc(np.linspace(0.0, 2.0 * np.pi, count + 1), radius)


def in_metres(frame: LocalFrame, shape: ArrayLike) -> Stroke:
    """Return a stroke from coordinates in metres, shape (vertices, 2)."""
    metres = np.asarray(shape, dtype=float)
    return Stroke([frame], np.hstack([metres, np.zeros_like(metres)]))


def spring(
    frame: LocalFrame, length: float, *, elastic: bool, damped: bool
) -> tuple[Stroke, float]:
    """Return a zigzag, a dashpot, both or an actuator, and how far [pt] it is to the left.

    The frame is from end to end, relative to the distance, at the start `length` [pt].
    """
    actuator = [(-12, 0), (-12, 5), (12, 5), (12, -5), (-12, -5), (-12, 0), PEN_UP, (12, 0)]
    piston = [(-2, 0), (-2, 4), (-2, -4)]
    cylinder = [(-10, 6), (8, 6), (8, -6), (-10, -6)]
    dashpot = [*piston, PEN_UP, *cylinder, PEN_UP, (8, 0)]
    half = min(0.33, 45.0 / length) if length > 0 else 0.33
    parts: list[list[tuple[float, float, float, float]]] = []
    if elastic:
        teeth = 2 * max(round(half * length / 4.5), 2)
        x = np.linspace(0.5 - 0.8 * half, 0.5 + 0.8 * half, teeth + 1)
        x = [x[0], *((x[1:] + x[:-1]) / 2), x[-1]]
        y = [0.0, *np.resize([5.0, -5.0], teeth), 0.0]
        parts.append([(a, 0.0, 0.0, b) for a, b in zip(x, y, strict=True)])
    if damped or not elastic:
        parts.append([(0.5, 0.0, *point) for point in (dashpot if damped else actuator)])
    lift = 9.0 * (len(parts) - 1)
    first = (0.5 - half, 0.0, 0.0)
    last = (0.5 + half, 0.0, 0.0)
    vertices = [(0.0, 0.0, 0.0, 0.0), (*first, 0.0)]
    for part, shift in zip(parts, (lift, -lift), strict=False):
        part_vertices = [(a, b, x, y + shift) for a, b, x, y in part]
        vertices += [(np.nan,) * 4, (*first, 0.0), (*first, shift), *part_vertices, (*last, shift),
                     (*last, 0.0)]  # fmt: skip
    vertices += [(np.nan,) * 4, (*last, 0.0), (1.0, 0.0, 0.0, 0.0)]
    return Stroke([frame], np.array(vertices)), lift


def torsion(frame: LocalFrame, *, elastic: bool, damped: bool) -> Stroke:
    """Return a spiral about a pin, a dashpot bent around it, or both."""
    shape = [np.zeros((0, 2))]
    if elastic:
        share = np.linspace(0.0, 1.0, 120)
        shape += [arc(np.pi * (0.5 + 4.5 * share), 4.0 + 10.0 * share), [PEN_UP]]
    if damped:
        around = 20.0 if elastic else 15.0
        flat = np.array([(-22, 0), (-2, 0), (-2, 3), (-2, -3), PEN_UP, (-9, 4), (8, 4), (8, -4),
                         (-9, -4), PEN_UP, (8, 0), (22, 0)])  # fmt: skip
        x, y = np.concatenate(np.linspace(flat[:-1], flat[1:], 9, axis=1)).T
        shape.append(arc(np.pi / 4 + x / around, around + y))
    return in_points(frame, np.concatenate(shape))
