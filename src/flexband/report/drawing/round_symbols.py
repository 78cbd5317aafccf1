"""Symbols of round parts: gears, racks, springs and dampers about a pin, and of force laws.

Places are in metres, sizes of symbols in points.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from flexband.report.drawing.canvas import PALE, PEN_UP, Canvas

Array = np.ndarray
TOOTH, PITCH = 4.0, 5.0
"""Length and distance [pt] of the strokes that stand for teeth."""


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
