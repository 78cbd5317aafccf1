"""A circle, or a point, above a straight line that belongs to the second body."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_finite, check_non_negative, check_numbers, check_pair
from flexband.errors import InputError
from flexband.mechanics.contact.geometry.geometry import (
    NO_LEVER,
    Action,
    ContactLine,
    Geometry,
    Travel,
)
from flexband.mechanics.kernels.forms import Frame, Vector, dot, subtract
from flexband.mechanics.kernels.lanes import (
    compiled,
    cosine,
    less,
    magnitude,
    sine,
    splat,
    sqrt,
    where,
)
from flexband.mechanics.kernels.relation_forms import turn

ENDLESS = 1e300
"""In place of the end of a line that has none."""


@compiled
def gap_above_line(x, p):
    """Return what `Geometry.kernel` returns.

    The parameters are the centre in the axes of the first body [m], the radius [m], then in the
    axes of the second body the angle of the normal [rad], the height of the line along it, and its
    two ends along the line, from the second point [m].
    """
    # The centre of the circle.
    c = cosine(x[0][2])
    s = sine(x[0][2])
    px = x[0][0] + c * p[0] - s * p[1]
    py = x[0][1] + s * p[0] + c * p[1]
    nx = cosine(x[1][2] + p[3])
    ny = sine(x[1][2] + p[3])
    # Its place across and along the line, and how far it is beyond an end.
    dx = px - x[1][0]
    dy = py - x[1][1]
    across = nx * dx + ny * dy - p[4]
    along = ny * dx - nx * dy
    past = along - where(less(along, p[5]), p[5], where(less(p[6], along), p[6], along))
    beyond = less(splat(0.0), magnitude(past))  # nearest to an end of the line
    distance = where(beyond, sqrt(across * across + past * past), across)
    # Beyond an end the normal leads to that end.
    ex = (across * nx + past * ny) / distance
    ey = (across * ny - past * nx) / distance
    nx = where(beyond, ex, nx)
    ny = where(beyond, ey, ny)
    qx = px - distance * nx
    qy = py - distance * ny
    return distance - p[2], nx, ny, px - p[2] * nx, py - p[2] * ny, qx, qy


@frozen(kw_only=True)
class CircleOnLine(Geometry):
    """A circle of the first body, or a point of it, above a straight line of the second one.

    The line bounds the second body, which is on its other side: the gap is negative there. Beyond
    the ends of a line a circle meets these ends, and a point meets nothing.

    Parameters
    ----------
    radius : of the circle around the first point [m]; 0 for a point.
    normal : away from the second body, in its axes, whose point is on the line; any length but 0.
    ends : of the line [m], from the second point along the normal turned by −90°, or None for an
        endless line.

    Raises
    ------
    InputError
        If the radius is negative, the normal has no length, or the ends do not increase.
    """

    radius: ArrayLike = 0.0
    normal: tuple[float, float] = (0.0, 1.0)
    ends: tuple[ArrayLike, ArrayLike] | None = None
    kernel = gap_above_line

    def __post_init__(self) -> None:
        check_non_negative("CircleOnLine radius [m]", self.radius)
        if not np.any(check_numbers("CircleOnLine normal", self.normal, 2)):
            raise InputError(f"CircleOnLine normal must have a length; got {self.normal}")
        if self.ends is not None:
            name = "CircleOnLine ends [m]"
            begin, end = (check_finite(name, end) for end in check_pair(name, self.ends))
            if np.any(begin >= end):
                raise InputError(f"CircleOnLine ends [m] must increase; got {self.ends}")

    def travel(self, first: Frame, second: Frame) -> Travel:
        """Return the travel along an endless line; `InputError` if it has ends."""
        if self.ends is not None:
            raise InputError(
                "CircleOnLine ends [m] must be None with friction, which acts along an endless "
                f"line only; got {self.ends}"
            )
        return travel_on_line(first, second, self.normal, self.radius)

    @property
    def parameters(self) -> Sequence[ArrayLike]:
        return line_parameters(self.normal, radius=self.radius, ends=self.ends)


def travel_on_line(
    first: Frame,
    second: Frame,
    normal: tuple[float, float],
    radius: ArrayLike = 0.0,
    lever: Vector = NO_LEVER,
    height: ArrayLike = 0.0,
) -> Travel:
    """Return t · (r₁ − r₂) + r (θ₁ − θ₂), t along the line; `lever` leads to `first`.

    The line is at a `height` above the second point, along its normal.
    """
    x, y = np.asarray(normal, dtype=float) / np.linalg.norm(normal)
    separation = subtract(first.position, second.position)
    line = second.direction(y, -x)
    radius = np.asarray(radius, dtype=float)
    travel = dot(line, separation)
    action = Action(line, lever, separation, radius)
    if np.any(radius):
        travel = travel + turn(first, second) * radius
    return Travel(travel, action, line=ContactLine(first, second, second.direction(x, y), height))


def line_parameters(
    normal: tuple[float, float],
    *,
    centre: tuple[ArrayLike, ArrayLike] = (0.0, 0.0),
    radius: ArrayLike = 0.0,
    height: ArrayLike = 0.0,
    ends: tuple[ArrayLike, ArrayLike] | None = None,
) -> Sequence[ArrayLike]:
    """Return the parameters of `gap_above_line`."""
    angle = math.atan2(normal[1], normal[0])
    return (*centre, radius, angle, height, *(ends or (-ENDLESS, ENDLESS)))
