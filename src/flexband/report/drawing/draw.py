"""Draw a mechanism at its assembled start on axes of Matplotlib."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextPath

from flexband.basics.checks import check_flag, check_instance
from flexband.mechanics.model.mechanism import Mechanism
from flexband.report.drawing.canvas import COLORS, Lettering
from flexband.report.drawing.sheet import (
    AFTER,
    BEFORE,
    POINTS_PER_INCH,
    Drawing,
    Sheet,
    sheet_for,
)
from flexband.report.shapes.shapes import Line, Mark


def draw(
    mechanism: Mechanism,
    *,
    sample: int = 0,
    dimensions: bool = True,
    names: bool = True,
    axes: Axes | None = None,
) -> Figure:
    """Draw a mechanism at its start, with its joints assembled.

    If they cannot be assembled, the bodies are drawn as they are given, and a warning says why.

    Rigid bodies are links or plates through their named points, with the centre of mass marked; a
    body with a single point is a dashed circle of its radius of gyration. Beams have their true
    height. Arrows show the directions of forces and drives at the start, not their sizes. A part of
    unknown type is a diamond at its first point.

    Parameters
    ----------
    sample : number of the sample to draw if parameters are arrays.
    dimensions : whether to write the lengths of bodies and rods.
    names : whether to write the names of bodies, joints and loads.
    axes : axes to draw on; by default those of a new figure of at most 8 by 6 inches.

    Returns
    -------
    The figure. The gid of an artist is its part: "body 'crank'", "joint 'A'", "load 'gravity'".

    Raises
    ------
    InputError
        If the mechanism does not have this sample, or if parameters have different numbers of
        samples.
    """
    check_flag("dimensions", dimensions)
    check_flag("names", names)
    if axes is not None:
        check_instance("axes", axes, Axes, "axes of matplotlib")
    drawing = Drawing.at_start(mechanism, sample)
    sheet, drawn = _layout(drawing.extremes, axes)
    drawn.update_datalim(sheet.box)  # keeps space for the names
    drawing.draw_on(MatplotlibSurface(drawn), sheet, names=names, dimensions=dimensions)
    drawn.margins(0.0)
    drawn.autoscale_view()
    drawn.set_aspect("equal", adjustable="datalim")
    return drawn.figure.figure


def _layout(extremes: np.ndarray, axes: Axes | None) -> tuple[Sheet, Axes]:
    """Return a sheet, and axes for it; without axes, those of a new figure of its size."""
    new = axes is None
    axes = labelled_axes(Figure() if axes is None else axes)
    figure = axes.figure.figure
    if not new:
        figure.draw_without_rendering()  # computes the layout
        size = np.array(axes.get_window_extent().size) / figure.dpi
        return sheet_for(extremes, size * POINTS_PER_INCH), axes
    sheet = sheet_for(extremes)
    width, height = total = BEFORE + sheet.space + AFTER
    figure.set_size_inches(width / POINTS_PER_INCH, height / POINTS_PER_INCH)
    axes.set_position((*(BEFORE / total), *(sheet.space / total)))
    return sheet, axes


def labelled_axes(place: Figure | Axes) -> Axes:
    """Return axes, those of a new figure if one is given, with the look of a drawing."""
    axes = place.add_subplot() if isinstance(place, Figure) else place
    axes.set(xlabel="X [m]", ylabel="Y [m]")
    axes.spines[:].set_color(COLORS["muted"])
    axes.tick_params(color=COLORS["muted"], labelsize=8)
    return axes


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
        return np.array([_text_width(text, lettering.size), lettering.size])


@lru_cache(maxsize=1024)
def _text_width(text: str, size: float) -> float:
    """Return the width of a text [pt]."""
    return TextPath((0, 0), text, size=size, prop=FontProperties()).get_extents().width


def _dashes(style: Line) -> str | tuple[int, list[float]]:
    """Return the dashes of a line as Matplotlib takes them, relative to its width."""
    return (0, [length / style.width for length in style.dash]) if style.dash else "-"
