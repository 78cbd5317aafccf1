"""Symbols of mechanisms as textbooks draw them, at places in metres; sizes are in points."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.path import Path

from flexband.report.drawing.canvas import DARK, GREY, PALE, Canvas

Array = np.ndarray
LINK = 8.0
"""Width of a rigid link."""
RAIL = 7.0
"""From the line of a guide to its rails."""
_QUARTERS = Path.make_compound_path(Path.wedge(0, 90), Path.wedge(180, 270))


def link(canvas: Canvas, corners: Array, gid: str) -> None:
    """Draw a rigid body: a plate with rounded corners [m], a bar where they are two."""
    for color, width, name in ((DARK, LINK, gid), (PALE, LINK - 2.0, None)):
        canvas.area(corners, facecolor=color, edgecolor=color, linewidth=width, capstyle="round",
                    zorder=3.0, gid=name)  # fmt: skip


def center_of_mass(canvas: Canvas, place: Array, gid: str) -> None:
    """Draw a circle with two of its quarters black."""
    canvas.mark(place, "o", 7.0, markeredgewidth=0.8, zorder=6.1, gid=gid)
    canvas.mark(place, _QUARTERS, 7.0, markerfacecolor=DARK, markeredgewidth=0.0, zorder=6.2)


def pin(canvas: Canvas, place: Array, gid: str) -> None:
    """Draw a pin."""
    canvas.mark(place, "o", 7.0, zorder=7.0, gid=gid)


def weld(canvas: Canvas, place: Array, gid: str) -> None:
    """Draw a weld."""
    canvas.mark(place, "s", 6.0, markerfacecolor=DARK, zorder=7.0, gid=gid)


def hatch(canvas: Canvas, origin: Array, outward: Array, half: float, at: float = 0.0) -> None:
    """Draw a surface of the ground across a direction, `half` long each way, `at` points behind
    the origin.
    """  # noqa: D205
    pieces = [(-at, -half), (-at, half)]
    for y in np.arange(-half + 3.0, half + 0.1, 4.0):
        pieces += [(np.nan, np.nan), (-at, y), (-at - 4.0, y - 4.0)]
    canvas.line(canvas.local(origin, outward, pieces), zorder=2.0, linewidth=0.9)


def pedestal(canvas: Canvas, place: Array, up: Array) -> None:
    """Draw a bearing that stands on the ground."""
    canvas.area(canvas.local(place, up, [(0, 0), (-13.0, -7.0), (-13.0, 7.0)]), facecolor="white",
                linewidth=1.0, zorder=2.1)  # fmt: skip
    hatch(canvas, place, up, 12.0, 13.0)


def rails(
    canvas: Canvas, place: Array, axis: Array, *, ground: bool, block: bool, gid: str
) -> None:
    """Draw a guide along an axis, and in it a block, or a pin."""
    half = 26.0
    for side in (-1, 1):
        if ground:
            normal = canvas.local((0, 0), axis, [(0, -side)])[0]
            hatch(canvas, place, normal, half, RAIL)
        else:
            ends = [(-half, side * RAIL), (half, side * RAIL)]
            canvas.line(canvas.local(place, axis, ends), zorder=5.0)
    if block:
        corners = [(-13, -RAIL), (13, -RAIL), (13, RAIL), (-13, RAIL)]
        canvas.area(canvas.local(place, axis, corners), facecolor=PALE, zorder=5.5, gid=gid)
    else:
        pin(canvas, place, gid)


def spring(
    canvas: Canvas, start: Array, end: Array, *, elastic: bool, damped: bool, gid: str
) -> Array:
    """Draw a zigzag, a dashpot, or both side by side; an actuator where it is neither.

    Returns the middle of what is drawn first [m].
    """
    along, middle = end - start, (start + end) / 2
    length = np.hypot(*along) / canvas.unit
    half = min(0.33 * length, 45.0)
    shapes = []
    if elastic:
        teeth = 2 * max(round(half / 4.5), 2)
        x = np.linspace(-0.8 * half, 0.8 * half, teeth + 1)
        y = np.array([0.0, *np.resize([5.0, -5.0], teeth), 0.0])
        x = np.array([x[0], *((x[1:] + x[:-1]) / 2), x[-1]])
        shapes.append([(-half, 0.0), *zip(x, y, strict=True), (half, 0.0)])
    if damped:
        shapes.append([(-half, 0), (-2, 0), (-2, 4), (-2, -4), (np.nan, np.nan), (-10, 6), (8, 6),
                       (8, -6), (-10, -6), (np.nan, np.nan), (8, 0), (half, 0)])  # fmt: skip
    if not shapes:
        shapes.append([(-half, 0), (-12, 0), (-12, 5), (12, 5), (12, -5), (-12, -5), (-12, 0),
                       (np.nan, np.nan), (12, 0), (half, 0)])  # fmt: skip
    lift = 9.0 * (len(shapes) - 1)
    outline: list[Any] = [(-length / 2, 0.0), (-half, 0.0)]
    for shape, shift in zip(shapes, (lift, -lift), strict=False):
        outline += [
            (np.nan, np.nan),
            (-half, 0.0),
            *((x, y + shift) for x, y in shape),
            (half, 0.0),
        ]
    outline += [(np.nan, np.nan), (half, 0.0), (length / 2, 0.0)]
    if length > 0:
        canvas.line(canvas.local(middle, along, outline), zorder=6.0, gid=gid)
    for place in (start, end):
        canvas.mark(place, "o", 3.0, markerfacecolor=DARK, zorder=7.1)
    return canvas.local(middle, along, [(0.0, lift)])[0] if length > 0 else middle


def turning(
    canvas: Canvas, place: Array, start: float, sweep: float, radius: float, **style: Any
) -> Array:
    """Draw an arrow around a place, from an angle on [rad]; return its middle [m]."""
    angles = start + sweep * np.linspace(0.0, 1.0, 40)
    arc = place + canvas.unit * radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    canvas.arrow(arc, **style)
    return arc[20]


def rod(canvas: Canvas, start: Array, end: Array, gid: str) -> None:
    """Draw a rod without mass."""
    canvas.line([start, end], linewidth=1.2, zorder=4.0, gid=gid)
    for place in (start, end):
        canvas.mark(place, "o", 5.0, markerfacecolor=DARK, zorder=7.0)


def axis_line(canvas: Canvas, start: Array, end: Array) -> None:
    """Draw the line of a guide."""
    canvas.line([start, end], color=GREY, linewidth=0.7, dashes=(9, 3, 2, 3), zorder=1.0)


def unknown(canvas: Canvas, places: list[Array], name: str, gid: str, color: str = DARK) -> None:
    """Draw a diamond, and dashed lines from it to the other places; a note where there is none."""
    if not places:
        canvas.note(name)
        return
    canvas.mark(places[0], "D", 8.0, color=color, zorder=8.0, gid=gid)
    for place in places[1:]:
        canvas.line([places[0], place], color=color, linewidth=0.8, linestyle="--", zorder=2.5)
    canvas.label(places[0], name, color=color)
