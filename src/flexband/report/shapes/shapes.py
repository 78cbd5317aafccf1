"""Plain geometric shapes in frames of a mechanism: what a drawing and a moving picture show.

A vertex is four numbers in a frame: x and y that scale with the mechanism, in metres or in parts
of a distance, and x and y in points (1/72 inch), since symbols of watches and cranes are equally
large. Frames name positions and directions by their numbers in `tracks.Tracks`, so that the same
shapes can be placed at any instant.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

PEN_UP = (np.nan, np.nan)
"""Interrupts a stroke."""


@dataclass(frozen=True)
class LocalFrame:
    """Where vertices are counted from, and the direction of their x."""

    origin: int  # number of a position
    turn: int | None = None  # number of the direction of x, if it is a recorded one
    ends: tuple[int, int] | None = None  # numbers of two positions, if x points from one to another
    fixed: tuple[float, float] = (1.0, 0.0)  # the direction of x otherwise, in global axes
    shares: bool = False  # whether what scales is relative to the distance of the ends, not metres

    def axis(self, position: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """Return a vector along x; its length is that of `ends`, if there are any."""
        if self.turn is not None:
            return direction[self.turn]
        if self.ends is not None:
            return position[self.ends[1]] - position[self.ends[0]]
        return np.broadcast_to(np.reshape(self.fixed, (2,) + (1,) * (position.ndim - 2)),
                               position.shape[1:])  # fmt: skip


@dataclass(frozen=True)
class Stroke:
    """Vertices, shape (vertices, 4), in one frame, or each in a frame of its own."""

    frames: Sequence[LocalFrame]
    vertices: np.ndarray

    def places(self, position: np.ndarray, direction: np.ndarray, unit: float = 0.0) -> np.ndarray:
        """Return vertices [m], (vertices, 2, ...), from tracks (tracks, 2, ...), `unit` m/pt."""
        x, y, right, up = self.vertices.T.reshape((4, -1, *np.ones(position.ndim - 1, dtype=int)))
        vector = np.stack([frame.axis(position, direction) for frame in self.frames])
        length = np.sqrt((vector**2).sum(axis=1, keepdims=True))
        along = vector / np.where(length > 0, length, 1.0)
        shares = np.reshape([f.shares for f in self.frames], (-1, *np.ones(position.ndim - 1, int)))
        size = np.where(shares, length, 1.0)
        normal = np.stack([-along[:, 1], along[:, 0]], axis=1)
        origin = position[[frame.origin for frame in self.frames]]
        return origin + (size * x + unit * right) * along + (size * y + unit * up) * normal


def at(*numbers: int) -> Stroke:
    """Return a stroke through positions."""
    return Stroke([LocalFrame(number) for number in numbers], np.zeros((len(numbers), 4)))


def in_points(frame: LocalFrame, shape: ArrayLike) -> Stroke:
    """Return a stroke from coordinates in points, shape (vertices, 2)."""
    points = np.asarray(shape, dtype=float)
    return Stroke([frame], np.hstack([np.zeros_like(points), points]))


@dataclass(frozen=True, kw_only=True)
class Shape:
    """What has an edge and an area."""

    part: str = ""  # what it stands for, such as "body 'crank'"
    layer: float = 4.0  # shapes of a higher layer cover those of a lower one
    color: str = "ink"  # name of the colour of the edge
    fill: str = ""  # name of the colour of the area, if it has one
    width: float = 1.0  # of the edge [pt]
    alpha: float = 1.0  # opacity of the area
    spacing: float = 0.0  # it is not drawn if its places are less apart [pt], on average


@dataclass(frozen=True, kw_only=True)
class Line(Shape):
    """Lines along strokes; an area if it is `closed`, an arrow if it has a `head`."""

    strokes: Sequence[Stroke] = ()  # what it consists of
    closed: bool = False
    dash: Sequence[float] = ()  # lengths [pt] of dashes and gaps
    head: float = 0.0  # length [pt] of the head at its end
    start_only: bool = False  # whether it is true at the start alone, and not drawn in motion


@dataclass(frozen=True, kw_only=True)
class Mark(Shape):
    """A "disc", a "square", a "diamond" or the letter "f" of a size [pt] at each vertex."""

    strokes: Sequence[Stroke]
    marker: str = "disc"
    size: float = 7.0
    width: float = 1.2


class Name(NamedTuple):
    """A name near the middle of a stroke, or at it if it is `inside`; without one, a note."""

    text: str
    stroke: Stroke | None
    color: str = "ink"
    italic: bool = False
    inside: bool = False


class Length(NamedTuple):
    """A length [m] to be written along a stroke, at least `beside` metres away from it."""

    stroke: Stroke
    length: float
    beside: float = 0.0


class FieldArrow(NamedTuple):
    """An arrow along a vector in global axes, wherever there is space."""

    name: str
    part: str
    vector: tuple[float, float]
