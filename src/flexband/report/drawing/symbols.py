"""Symbols of mechanisms as in textbooks. Places are in metres, sizes of symbols in points."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.path import Path

from flexband.report.drawing.canvas import DARK, GREY, PALE, PEN_UP, Canvas

Array = np.ndarray
LINK_WIDTH = 8.0
RAIL_DISTANCE = 7.0
"""Distance [pt] of rails from the line of their guide."""
TOOTH, PITCH = 4.0, 5.0
"""Length and distance [pt] of the strokes that stand for teeth."""
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


def circle(centre: Array, radius: float, count: int = 180) -> Array:
    """Return points on a circle; the first point is repeated at the end."""
    turn = np.linspace(0.0, 2.0 * np.pi, count + 1)
    return centre + radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)


def gears(canvas: Canvas, circles: list[tuple[Array, float]], gid: str) -> None:
    """Draw pitch circles [m] with teeth, which point outward on a ring, radius < 0."""
    pieces = []
    for centre, radius in circles:
        if radius > 0:
            canvas.area(circle(centre, radius), facecolor=PALE, alpha=0.5, linewidth=0.0,
                        zorder=1.2)  # fmt: skip
        count = max(int(2 * np.pi * abs(radius) / (PITCH * canvas.unit)), 8)
        ends = [circle(centre, abs(r), count) for r in (radius, radius - TOOTH * canvas.unit)]
        teeth = np.stack([*ends, np.full_like(ends[0], np.nan)], axis=1)
        pieces += [circle(centre, abs(radius)), [PEN_UP], teeth.reshape(-1, 2)]
    canvas.line(np.concatenate(pieces), linewidth=0.9, zorder=2.6, gid=gid)


def rack(canvas: Canvas, pinion: tuple[Array, float], start: Array, end: Array, gid: str) -> None:
    """Draw the pitch circle of a pinion and a rack [m] with teeth on the far side."""
    (centre, radius), along = pinion, end - start
    gears(canvas, [(centre, abs(radius))], f"pinion of {gid}")
    length = np.hypot(*along) / canvas.unit
    pieces = [(0.0, 0.0), (length, 0.0)]
    for x in np.arange(PITCH / 2, length, PITCH):
        pieces += [PEN_UP, (x, 0.0), (x, -np.sign(radius) * TOOTH)]
    canvas.line(canvas.local(start, along, pieces), linewidth=0.9, zorder=2.6, gid=gid)


def torsion(canvas: Canvas, place: Array, *, elastic: bool, damped: bool, gid: str) -> None:
    """Draw a spiral about a pin, a dashpot bent around it, or both."""
    shapes = []
    if elastic:
        share = np.linspace(0.0, 1.0, 120)
        turn, radius = np.pi * (0.5 + 4.5 * share), 4.0 + 10.0 * share
        shapes += [*zip(radius * np.cos(turn), radius * np.sin(turn), strict=True), PEN_UP]
    if damped:
        around = 20.0 if elastic else 15.0
        flat = [(-22, 0), (-2, 0), (-2, 3), (-2, -3), PEN_UP, (-9, 4), (8, 4), (8, -4), (-9, -4),
                PEN_UP, (8, 0), (22, 0)]  # fmt: skip
        for (x0, y0), (x1, y1) in pairwise(flat):
            x, y = np.linspace(x0, x1, 9), np.linspace(y0, y1, 9)
            turn = np.pi / 4 + x / around
            shapes += zip((around + y) * np.cos(turn), (around + y) * np.sin(turn), strict=True)
    canvas.line(canvas.local(place, (1.0, 0.0), shapes), zorder=6.0, gid=gid)


def law(canvas: Canvas, places: list[Array], gid: str, color: str) -> Array:
    """Draw an f in a circle, between two places or beside the first; return its place [m]."""
    spots = [canvas.local(places[0], way, [(18.0, 0.0)])[0] for way in circle(np.zeros(2), 1.0, 8)]
    if len(places) > 1 and np.hypot(*(places[1] - places[0])) > 30.0 * canvas.unit:
        spots = [(places[0] + places[1]) / 2]
    spot = min(spots, key=lambda spot: canvas.covered(spot, 8.0))
    for place in places:
        canvas.line([place, spot], color=color, linewidth=0.8, linestyle="--", zorder=2.5)
    canvas.mark(spot, "o", 12.0, color=color, zorder=8.0, gid=gid)
    canvas.mark(spot, "$f$", 7.0, color=color, markerfacecolor=color, markeredgewidth=0.3,
                zorder=8.1)  # fmt: skip
    return spot


def unknown(canvas: Canvas, places: list[Array], gid: str, color: str = DARK) -> None:
    """Draw a diamond at the first place, if there is one, and dashed lines to the others."""
    for place in places[:1]:
        canvas.mark(place, "D", 8.0, color=color, zorder=8.0, gid=gid)
    for place in places[1:]:
        canvas.line([places[0], place], color=color, linewidth=0.8, linestyle="--", zorder=2.5)
