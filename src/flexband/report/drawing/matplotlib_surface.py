"""Axes of Matplotlib as a surface for shapes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextPath

from flexband.report.drawing.surface import COLORS, Lettering
from flexband.report.shapes.shapes import Line, Mark


@dataclass(frozen=True)
class MatplotlibSurface:
    """Axes to draw on, a `Surface`. The gid of an artist is its part."""

    axes: Axes

    def line(self, points: np.ndarray, style: Line) -> None:
        self.axes.plot(*points.T, color=COLORS[style.color], linewidth=style.width,
                       linestyle=_dashes(style), zorder=style.layer,
                       gid=style.part or None)  # fmt: skip

    def area(self, points: np.ndarray, style: Line) -> None:
        self.axes.fill(*points.T, facecolor=COLORS[style.fill], edgecolor=COLORS[style.color],
                       linewidth=style.width, linestyle=_dashes(style), alpha=style.alpha,
                       joinstyle="round", capstyle="round", snap=False, zorder=style.layer,
                       gid=style.part or None)  # fmt: skip

    def marks(self, points: np.ndarray, mark: Mark) -> None:
        """Draw a marker at each point [m], all as one artist."""
        marker = {"disc": "o", "square": "s", "diamond": "D", "f": "$f$"}[mark.marker]
        self.axes.plot(*points.T, linestyle="none", marker=marker, markersize=mark.size,
                       color=COLORS[mark.color], markerfacecolor=COLORS[mark.fill],
                       markeredgewidth=mark.width, zorder=mark.layer,
                       gid=mark.part or None)  # fmt: skip

    def text(self, place: np.ndarray, text: str, lettering: Lettering) -> None:
        color = None if lettering.color == "ink" else COLORS[lettering.color]
        style = "italic" if lettering.italic else "normal"
        white = {"facecolor": "white", "linewidth": 0.0, "pad": 1.0} if lettering.backed else None
        self.axes.text(place[0], place[1], text, fontsize=lettering.size, ha="center", va="center",
                       color=color, style=style, zorder=lettering.layer, bbox=white,
                       rotation=lettering.angle, rotation_mode="anchor")  # fmt: skip

    def note(self, text: str) -> None:
        size = Lettering().size
        self.axes.text(0.01, 0.01, text, transform=self.axes.transAxes, fontsize=size)

    def extent(self, text: str, lettering: Lettering) -> np.ndarray:
        size = lettering.size
        box = TextPath((0, 0), text, size=size, prop=FontProperties()).get_extents()
        return np.array([box.width, size])


def _dashes(style: Line) -> str | tuple[int, list[float]]:
    """Return the dashes of a line as Matplotlib takes them, in parts of its width."""
    return (0, [length / style.width for length in style.dash]) if style.dash else "-"
