"""The canvas that mechanisms are drawn on.

Places are in metres, sizes of symbols in points (1/72 inch), so that watches and cranes have
symbols of the same size. The canvas records as ink where it is covered, so that names can be
written where there is little ink.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

DARK, PALE, GREY = "0.15", "0.9", "0.6"
PEN_UP = (np.nan, np.nan)
INK_SPACING = 2.0
"""Distance [pt] between points of ink."""


class Label(NamedTuple):
    """A name to be written near a place [m], or at the place if `inside`."""

    place: np.ndarray
    text: str
    inside: bool
    style: dict[str, Any]


class Dimension(NamedTuple):
    """A length to be written along a line [m], at least `beside` metres away from the line."""

    points: np.ndarray
    text: str
    beside: float


class Canvas:
    """Axes with a scale, and the ink on them.

    Parameters
    ----------
    axes : axes to draw on.
    box : two opposite corners of the drawing [m], shape (2, 2).
    unit : metres per point.
    names, dimensions : whether these are written.
    """

    def __init__(self, axes: Axes, box: np.ndarray, unit: float, *, names: bool, dimensions: bool):
        self.axes, self.unit, self.box = axes, unit, box
        self.names, self.dimensions = names, dimensions
        self.ink: list[np.ndarray] = []
        self.labels: list[Label] = []
        self.measured: list[Dimension] = []
        self.notes: list[str] = []

    def local(self, origin: ArrayLike, direction: ArrayLike, shape: ArrayLike) -> np.ndarray:
        """Return points [m] from their coordinates [pt] along a direction and to its left."""
        x, y = np.asarray(direction, dtype=float) / np.hypot(*np.asarray(direction, dtype=float))
        return np.asarray(origin) + self.unit * np.asarray(shape, dtype=float) @ [[x, y], [-y, x]]

    def line(self, points: ArrayLike, **style: Any) -> None:
        """Draw a line through points [m]; NaN interrupts the line."""
        points = np.asarray(points, dtype=float)
        self.axes.plot(*points.T, **{"color": DARK, "linewidth": 1.0} | style)
        self.add_ink(points)

    def area(self, points: ArrayLike, **style: Any) -> None:
        """Fill a polygon [m]."""
        points = np.asarray(points, dtype=float)
        edge = {"edgecolor": DARK, "joinstyle": "round", "snap": False}
        self.axes.fill(*points.T, **edge | style)
        self.add_ink(np.concatenate([points, points[:1]]), style.get("linewidth", 1.0))

    def mark(self, place: np.ndarray, marker: Any, size: float, **style: Any) -> None:
        """Draw a marker of a size [pt]."""
        white = {"color": DARK, "markerfacecolor": "white", "markeredgewidth": 1.2}
        self.axes.plot(*place[:, None], marker=marker, markersize=size, **white | style)
        turn = np.linspace(0, 2 * np.pi, 12)
        self.add_ink(place + self.unit * size / 2 * np.stack([np.cos(turn), np.sin(turn)], 1))

    def arrow(self, points: ArrayLike, head: float = 8.0, **style: Any) -> None:
        """Draw an arrow along points [m] with a head of a length [pt]."""
        points = np.asarray(points, dtype=float)
        tip = points[-1]
        shaft = points[np.hypot(*(points - tip).T) > 0.9 * head * self.unit]
        if not len(shaft):
            shaft = 2 * tip[None] - self.local(tip, tip - points[0], [[head, 0.0]])
        corners = [(0, 0), (-head, head / 3.2), (-head, -head / 3.2)]
        triangle = self.local(tip, tip - shaft[-1], corners)
        self.line(np.concatenate([shaft, triangle[1:].mean(axis=0)[None]]), **style)
        style = {k: v for k, v in style.items() if k in ("color", "zorder")}
        self.area(triangle, linewidth=0.0, **{"color": DARK} | style)

    def label(
        self, place: np.ndarray | None, text: str, *, inside: bool = False, **style: Any
    ) -> None:
        """Add a name near a place [m], or at the place if `inside`; without a place, a note.

        Names, lengths and notes are written last, by `words.write`.
        """
        if place is None:
            self.notes.append(text)
        elif self.names:
            self.labels.append(Label(place, text, inside, style))

    def dimension(
        self, points: np.ndarray, length: float | np.floating, *, beside: float = 0.0
    ) -> None:
        """Add the length [m] of a line [m], written at least `beside` metres away from it."""
        if self.dimensions:
            self.measured.append(Dimension(points, f"{length:.4g} m", beside))

    def covered(self, place: np.ndarray, reach: float) -> int:
        """Return how many points of ink are within `reach` points of a place [m]."""
        return int(np.all(np.abs(self.all_ink() - place) < reach * self.unit, axis=1).sum())

    def all_ink(self) -> np.ndarray:
        """Return all points of ink [m], shape (points, 2)."""
        return np.concatenate([np.zeros((0, 2)), *self.ink])

    def add_ink(self, points: np.ndarray, width: float = 1.0) -> None:
        """Add a stroke through points [m] of a width [pt]; of a wide stroke, its edges."""
        shifts = width / 2 * self.unit * np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
        count = 4 if width > INK_SPACING else 1
        self.ink += [self.dense(points) + shift for shift in shifts[:count]]

    def dense(self, points: np.ndarray) -> np.ndarray:
        """Return points `INK_SPACING` apart along a line, without its gaps."""
        steps = np.hypot(*np.diff(points, axis=0).T) / self.unit / INK_SPACING
        counts = np.maximum(np.nan_to_num(steps).astype(int), 1)
        pieces = zip(points, points[1:], counts, strict=False)
        parts = [np.linspace(a, b, n, endpoint=False) for a, b, n in pieces]
        dense = np.concatenate([*parts, points[-1:]])
        return dense[np.isfinite(dense).all(axis=1)]
