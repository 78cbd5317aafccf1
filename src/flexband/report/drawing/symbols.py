"""Symbols of mechanisms as in textbooks. Places are in metres, sizes of symbols in points."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.path import Path

from flexband.report.drawing.canvas import DARK, GREY, PALE, PEN_UP, Canvas

Array = np.ndarray
LINK_WIDTH = 8.0
RAIL_DISTANCE = 7.0
"""Distance [pt] of rails from the line of their guide."""
QUARTERS = Path.make_compound_path(Path.wedge(0, 90), Path.wedge(180, 270))
PIN = {"marker": "o", "size": 7.0, "zorder": 7.0}
WELD = {"marker": "s", "size": 6.0, "zorder": 7.0, "markerfacecolor": DARK}
ROD_END = {"marker": "o", "size": 5.0, "zorder": 7.0, "markerfacecolor": DARK}
AXIS = {"color": GREY, "linewidth": 0.7, "dashes": (9, 3, 2, 3), "zorder": 1.0}
"""Styles of markers, and of the line of a guide."""
DASHPOT = [(-2, 0), (-2, 4), (-2, -4), PEN_UP, (-10, 6), (8, 6), (8, -6), (-10, -6), PEN_UP, (8, 0)]
ACTUATOR = [(-12, 0), (-12, 5), (12, 5), (12, -5), (-12, -5), (-12, 0), PEN_UP, (12, 0)]


def link(canvas: Canvas, corners: Array, gid: str) -> None:
    """Draw a rigid body: a plate with rounded corners [m], or a bar between two corners."""
    for color, width, name in ((DARK, LINK_WIDTH, gid), (PALE, LINK_WIDTH - 2.0, None)):
        canvas.area(corners, facecolor=color, edgecolor=color, linewidth=width, capstyle="round",
                    zorder=3.0, gid=name)  # fmt: skip


def center_of_mass(canvas: Canvas, place: Array, gid: str) -> None:
    """Draw a circle with two black quarters."""
    canvas.mark(place, "o", 7.0, markeredgewidth=0.8, zorder=6.1, gid=gid)
    canvas.mark(place, QUARTERS, 7.0, markerfacecolor=DARK, markeredgewidth=0.0, zorder=6.2)


def hatch(canvas: Canvas, origin: Array, outward: Array, half: float, depth: float = 0.0) -> None:
    """Draw the surface of the ground, 2 `half` long, `depth` behind the origin."""
    pieces = [(-depth, -half), (-depth, half)]
    for y in np.arange(-half + 3.0, half + 0.1, 4.0):
        pieces += [PEN_UP, (-depth, y), (-depth - 4.0, y - 4.0)]
    canvas.line(canvas.local(origin, outward, pieces), zorder=2.0, linewidth=0.9)


def pedestal(canvas: Canvas, place: Array, up: Array) -> None:
    """Draw a bearing that stands on the ground."""
    canvas.area(canvas.local(place, up, [(0, 0), (-13.0, -7.0), (-13.0, 7.0)]), facecolor="white",
                linewidth=1.0, zorder=2.1)  # fmt: skip
    hatch(canvas, place, up, 12.0, 13.0)


def rails(
    canvas: Canvas, place: Array, axis: Array, *, ground: bool, block: bool, gid: str
) -> None:
    """Draw a guide along an axis, and a block or a pin in it."""
    half = 26.0
    for side in (-1, 1):
        if ground:
            normal = canvas.local((0, 0), axis, [(0, -side)])[0]
            hatch(canvas, place, normal, half, RAIL_DISTANCE)
        else:
            ends = [(-half, side * RAIL_DISTANCE), (half, side * RAIL_DISTANCE)]
            canvas.line(canvas.local(place, axis, ends), zorder=5.0)
    if block:
        corners = [(x, y * RAIL_DISTANCE) for x, y in ((-13, -1), (13, -1), (13, 1), (-13, 1))]
        canvas.area(canvas.local(place, axis, corners), facecolor=PALE, zorder=5.5, gid=gid)
    else:
        canvas.mark(place, gid=gid, **PIN)


def spring(
    canvas: Canvas, start: Array, end: Array, *, elastic: bool, damped: bool, gid: str
) -> Array:
    """Draw a zigzag, a dashpot, or both side by side; an actuator if it is neither.

    Returns the middle of the symbol drawn first [m].
    """
    along, middle = end - start, (start + end) / 2
    length = np.hypot(*along) / canvas.unit
    half = min(0.33 * length, 45.0)
    shapes = []
    if elastic:
        teeth = 2 * max(round(half / 4.5), 2)
        x = np.linspace(-0.8 * half, 0.8 * half, teeth + 1)
        x = np.array([x[0], *((x[1:] + x[:-1]) / 2), x[-1]])
        shapes.append([*zip(x, [0.0, *np.resize([5.0, -5.0], teeth), 0.0], strict=True)])
    if damped or not elastic:
        shapes.append(DASHPOT if damped else ACTUATOR)
    lift = 9.0 * (len(shapes) - 1)
    outline: list[Any] = [(-length / 2, 0.0), (-half, 0.0)]
    for shape, shift in zip(shapes, (lift, -lift), strict=False):
        shifted = [(x, y + shift) for x, y in ((-half, 0.0), *shape, (half, 0.0))]
        outline += [PEN_UP, (-half, 0.0), *shifted, (half, 0.0)]
    outline += [PEN_UP, (half, 0.0), (length / 2, 0.0)]
    if length > 0:
        canvas.line(canvas.local(middle, along, outline), zorder=6.0, gid=gid)
    for place in (start, end):
        canvas.mark(place, "o", 3.0, markerfacecolor=DARK, zorder=7.1)
    return canvas.local(middle, along, [(0.0, lift)])[0] if length > 0 else middle


def turning(
    canvas: Canvas, place: Array, start: float, sweep: float, radius: float, **style: Any
) -> Array:
    """Draw an arrow around a place, from angle `start` to `start + sweep` [rad]; return its middle.

    The middle is in metres.
    """
    angles = start + sweep * np.linspace(0.0, 1.0, 40)
    arc = place + canvas.unit * radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    canvas.arrow(arc, **style)
    return arc[20]


def unknown(canvas: Canvas, places: list[Array], gid: str, color: str = DARK) -> Array | None:
    """Draw a diamond at the first place and dashed lines to the others.

    Returns the first place [m], or None without places.
    """
    if not places:
        return None
    canvas.mark(places[0], "D", 8.0, color=color, zorder=8.0, gid=gid)
    for place in places[1:]:
        canvas.line([places[0], place], color=color, linewidth=0.8, linestyle="--", zorder=2.5)
    return places[0]
