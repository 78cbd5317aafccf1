"""Rows w of constraints and of sliding speeds, w · v, as functions of complex coordinates.

Their derivative along the motion is the imaginary part of w(q + i ε v)/ε, exact to rounding; no
second derivatives are written down.
"""

from __future__ import annotations

import cmath
import math
from typing import NamedTuple

import numpy as np

from benchmarks.friction.draws import Link
from benchmarks.numerics.contact_draws import GROUND, Place, Touch


def point_at(q: np.ndarray, place: Place):
    """Return a point."""
    if place.body == GROUND:
        return place.x, place.y
    x, y, angle = q[3 * place.body : 3 * place.body + 3]
    c = cmath.cos(angle)
    s = cmath.sin(angle)
    return x + c * place.x - s * place.y, y + s * place.x + c * place.y


def rotated_axes(q: np.ndarray, body: int, axis: tuple[float, float]):
    """Return a direction that is given in the axes of a body, and the one to its left."""
    x, y = np.array(axis) / np.hypot(*axis)
    angle = 0.0 if body == GROUND else q[3 * body + 2]
    c = cmath.cos(angle)
    s = cmath.sin(angle)
    t = c * x - s * y, s * x + c * y
    return t, (-t[1], t[0])


def separation_row(q: np.ndarray, first: tuple, second: tuple, n: tuple) -> np.ndarray:
    """Return w of n · (v₁ − v₂) = w · v, for two points (body, (X, Y)) that bodies carry along."""
    row = np.zeros(len(q), dtype=complex)
    for (body, (x, y)), sign in ((first, 1.0), (second, -1.0)):
        if body != GROUND:
            k = 3 * body
            row[k : k + 2] += sign * n[0], sign * n[1]
            row[k + 2] += sign * (n[1] * (x - q[k]) - n[0] * (y - q[k + 1]))
    return row


def spin(q: np.ndarray, first: int, second: int, radius: float = 1.0) -> np.ndarray:
    """Return w of r (ω₁ − ω₂)."""
    row = np.zeros(len(q), dtype=complex)
    for body, sign in ((first, radius), (second, -radius)):
        if body != GROUND:
            row[3 * body + 2] += sign
    return row


def rows_of(q: np.ndarray, link: Link) -> list[np.ndarray]:
    """Return the rows of a joint."""
    i = link.first.body
    j = link.second.body
    p = point_at(q, link.first)
    t, n = rotated_axes(q, j, link.axis)
    if link.kind == "pin":
        r = point_at(q, link.second)
        return [separation_row(q, (i, p), (j, r), axis) for axis in ((1.0, 0.0), (0.0, 1.0))]
    if link.kind == "motor":
        return [spin(q, i, GROUND)]
    across = separation_row(q, (i, p), (j, p), t if link.kind == "travel" else n)
    return [across, spin(q, i, j)] if link.kind == "guide" else [across]


def sliding_row(q: np.ndarray, link: Link) -> np.ndarray:
    """Return w of the sliding speed of a joint."""
    i = link.first.body
    j = link.second.body
    if link.kind == "pin":
        return spin(q, i, j, link.length)
    p = point_at(q, link.first)
    return separation_row(q, (i, p), (j, p), rotated_axes(q, j, link.axis)[0])


def normal_force(link: Link, reactions: np.ndarray) -> tuple[float, np.ndarray]:
    """Return what the friction of a joint is proportional to, and its derivative by reactions."""
    if link.kind == "pin":
        value = float(np.hypot(*reactions))
        return value, reactions / max(value, 1e-300)
    if link.kind == "slot":
        return abs(float(reactions[0])), np.sign(reactions)
    value = 0.0
    gradient = np.zeros(2)
    for end in (0.5, -0.5):  # of the guide
        N = reactions[0] / 2 + end * 2 * reactions[1] / link.length
        value += abs(float(N))
        gradient += np.sign(N) * np.array([0.5, end * 2 / link.length])
    return value, gradient


class Meeting(NamedTuple):
    """A gap, and w of its rate and of the sliding speed."""

    gap: complex
    normal: np.ndarray
    sliding: np.ndarray


def meetings(q: np.ndarray, touch: Touch) -> list[Meeting]:
    """Return the gaps of a contact."""
    kind, a, b, numbers, _ = touch
    (cx, cy), other = point_at(q, a), point_at(q, b)
    x = cx - other[0]
    y = cy - other[1]
    of_walls = []  # gap, normal and radius
    if kind == "line":
        radius, angle = numbers
        n, _ = rotated_axes(q, b.body, (math.cos(angle), math.sin(angle)))
        of_walls = [(n[0] * x + n[1] * y - radius, n, radius)]
    elif kind == "stop":
        for side, height in ((1.0, numbers[0]), (-1.0, -numbers[1])):
            n, _ = rotated_axes(q, b.body, (side, 0.0))
            of_walls.append((n[0] * x + n[1] * y - height, n, 0.0))
    else:
        d = cmath.sqrt(x * x + y * y)
        radius = numbers[0]
        n = (-x / d, -y / d) if kind == "hole" else (x / d, y / d)
        gap = numbers[1] - radius - d if kind == "hole" else d - radius - numbers[1]
        of_walls = [(gap, n, radius)]
    of_touch = []
    for gap, n, radius in of_walls:
        p = cx - radius * n[0], cy - radius * n[1]
        r = p[0] - gap * n[0], p[1] - gap * n[1]
        normal = separation_row(q, (a.body, p), (b.body, r), n)
        # friction acts on both at the same point, without a couple by the depth
        sliding = separation_row(q, (a.body, p), (b.body, p), (-n[1], n[0]))
        of_touch.append(Meeting(gap, normal, sliding))
    return of_touch
