"""Paper to draw mechanisms on.

Places are in metres, sizes of symbols in points (1/72 inch), so that a watch and a crane are drawn
alike. What is drawn is remembered as ink, so that words can be put where there is least of it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

DARK, PALE, GREY = "0.15", "0.9", "0.6"
GRAIN = 2.0
"""Distance [pt] between points of ink."""


class Label(NamedTuple):
    """A name to be written near a place [m], or at it where `inside`."""

    place: np.ndarray
    text: str
    inside: bool
    style: dict[str, Any]


class Dimension(NamedTuple):
    """A line [m] whose length is to be written, at least `beside` metres away from it."""

    points: np.ndarray
    text: str
    beside: float


class Canvas:
    """Axes with a scale.

    Parameters
    ----------
    axes : to draw on.
    box : two opposite corners of what will be drawn [m], shape (2, 2).
    unit : metres a point.
    names, dimensions : whether to write these.
    """

    def __init__(self, axes: Axes, box: np.ndarray, unit: float, *, names: bool, dimensions: bool):
        self.axes, self.unit, self.box = axes, unit, box
        self.names, self.dimensions = names, dimensions
        self.ink: list[np.ndarray] = []
        self.labels: list[Label] = []
        self.measured: list[Dimension] = []
        self.notes: list[str] = []

    def local(self, origin: ArrayLike, direction: ArrayLike, shape: ArrayLike) -> np.ndarray:
        """Return points [m] given by their place [pt] along a direction from an origin, and left
        of it.
        """  # noqa: D205
        x, y = np.asarray(direction, dtype=float) / np.hypot(*np.asarray(direction, dtype=float))
        return np.asarray(origin) + self.unit * np.asarray(shape, dtype=float) @ [[x, y], [-y, x]]

    def line(self, points: ArrayLike, **style: Any) -> None:
        """Draw a line through points [m]; NaN lifts the pen."""
        points = np.asarray(points, dtype=float)
        self.axes.plot(*points.T, **{"color": DARK, "linewidth": 1.0} | style)
        self.remember(points)

    def area(self, points: ArrayLike, **style: Any) -> None:
        """Fill a polygon [m]."""
        points = np.asarray(points, dtype=float)
        self.axes.fill(
            *points.T, **{"edgecolor": DARK, "joinstyle": "round", "snap": False} | style
        )
        self.remember(np.concatenate([points, points[:1]]), style.get("linewidth", 1.0))

    def mark(self, place: np.ndarray, marker: Any, size: float, **style: Any) -> None:
        """Draw a marker, `size` points wide."""
        white = {"color": DARK, "markerfacecolor": "white", "markeredgewidth": 1.2}
        self.axes.plot(*place[:, None], marker=marker, markersize=size, **white | style)
        turn = np.linspace(0, 2 * np.pi, 12)
        self.remember(place + self.unit * size / 2 * np.stack([np.cos(turn), np.sin(turn)], 1))

    def arrow(self, points: ArrayLike, head: float = 8.0, **style: Any) -> None:
        """Draw an arrow along points [m]; the head is this long [pt], and the shaft ends in it."""
        points = np.asarray(points, dtype=float)
        tip = points[-1]
        behind = points[np.hypot(*(points - tip).T) > 0.9 * head * self.unit]
        if not len(behind):
            behind = 2 * tip[None] - self.local(tip, points[-1] - points[0], [[head, 0.0]])
        shape = self.local(
            tip, tip - behind[-1], [(0, 0), (-head, head / 3.2), (-head, -head / 3.2)]
        )
        self.line(np.concatenate([behind, shape[1:].mean(axis=0)[None]]), **style)
        style = {k: v for k, v in style.items() if k in ("color", "zorder")}
        self.area(shape, linewidth=0.0, **{"color": DARK} | style)

    # --- words, which `words.write` writes once all is drawn ----------------------------------

    def label(self, place: ArrayLike, text: str, *, inside: bool = False, **style: Any) -> None:
        """Have a name written near a place [m], or at it where `inside`."""
        if self.names:
            self.labels.append(Label(np.asarray(place, dtype=float), text, inside, style))

    def dimension(self, points: ArrayLike, text: str, *, beside: float = 0.0) -> None:
        """Have the length of a line [m] written, at least `beside` metres away from it."""
        if self.dimensions:
            self.measured.append(Dimension(np.asarray(points, dtype=float), text, beside))

    def note(self, text: str) -> None:
        """Have a part named that has no place in the drawing."""
        self.notes.append(text)

    # --- ink ----------------------------------------------------------------------------------

    def covered(self, place: np.ndarray, reach: float) -> int:
        """Return how much ink is within `reach` points of a place [m]."""
        return int(np.all(np.abs(self.all_ink() - place) < reach * self.unit, axis=1).sum())

    def all_ink(self) -> np.ndarray:
        """Return points of all that is drawn [m], shape (points, 2)."""
        return np.concatenate([np.zeros((0, 2)), *self.ink])

    def remember(self, points: np.ndarray, width: float = 1.0) -> None:
        """Add the edges of a stroke, this wide [pt], to the ink."""
        shifts = width / 2 * self.unit * np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
        self.ink += [self.dense(points) + shift for shift in shifts[: 4 if width > GRAIN else 1]]

    def dense(self, points: np.ndarray) -> np.ndarray:
        """Return points `GRAIN` apart along a line, without its gaps."""
        steps = np.hypot(*np.diff(points, axis=0).T) / self.unit / GRAIN
        parts = [
            np.linspace(a, b, max(int(n), 1), endpoint=False)
            for a, b, n in zip(points, points[1:], np.nan_to_num(steps), strict=False)
        ]
        dense = np.concatenate([*parts, points[-1:]])
        return dense[np.isfinite(dense).all(axis=1)]
