"""Two circles, side by side or one in the other, with their centres at the points."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_non_negative, check_pair, check_positive
from flexband.errors import InputError
from flexband.mechanics.contact.geometry.geometry import NO_LEVER, Action, Geometry, Travel
from flexband.mechanics.kernels.forms import Frame, angle, section_normal, subtract
from flexband.mechanics.kernels.lanes import compiled, maximum, splat, sqrt


@compiled
def gap_between_circles(x, p):
    """Return what `Geometry.kernel` returns; the parameters are both radii."""
    dx = x[0][0] - x[1][0]
    dy = x[0][1] - x[1][1]
    distance = maximum(sqrt(dx * dx + dy * dy), splat(1e-300))
    nx = dx / distance
    ny = dy / distance
    px = x[0][0] - p[0] * nx
    py = x[0][1] - p[0] * ny
    qx = p[1] * nx
    qy = p[1] * ny
    return distance - p[0] - p[1], nx, ny, px, py, x[1][0] + qx, x[1][1] + qy


@compiled
def gap_in_circle(x, p):
    """Return what `Geometry.kernel` returns; the parameters are the clearance and the radius."""
    dx = x[0][0] - x[1][0]
    dy = x[0][1] - x[1][1]
    distance = maximum(sqrt(dx * dx + dy * dy), splat(1e-300))
    nx = -dx / distance
    ny = -dy / distance
    hole = p[0] + p[1]
    px = x[0][0] - p[1] * nx
    py = x[0][1] - p[1] * ny
    qx = hole * nx
    qy = hole * ny
    return p[0] - distance, nx, ny, px, py, x[1][0] - qx, x[1][1] - qy


@frozen(kw_only=True)
class CircleOnCircle(Geometry):
    """Circles of two bodies, each outside of the other.

    Parameters
    ----------
    radii : of the circles around the first and the second point [m]. One of them may be 0.

    Raises
    ------
    InputError
        If a radius is negative, or both are zero.
    """

    radii: tuple[ArrayLike, ArrayLike]
    kernel = gap_between_circles
    second_must_be_rigid = False

    def __post_init__(self) -> None:
        radii = check_radii("CircleOnCircle", self.radii, check_non_negative)
        if np.any(np.add(*radii) == 0):
            raise InputError(f"CircleOnCircle radii [m] must not both be 0; got {self.radii}")

    def travel(self, first: Frame, second: Frame) -> Travel:
        return travel_on_circle(first, second, np.asarray(self.radii[0], dtype=float))

    @property
    def parameters(self) -> Sequence[ArrayLike]:
        return self.radii


@frozen(kw_only=True)
class CircleInCircle(Geometry):
    """A circle of the first body in a circular hole of the second one, as a pin in its bearing.

    Parameters
    ----------
    radii : of the circle around the first point and of the hole around the second one [m].

    Raises
    ------
    InputError
        If a radius is not positive, or the hole is not larger than the circle.
    """

    radii: tuple[ArrayLike, ArrayLike]
    kernel = gap_in_circle
    second_must_be_rigid = False

    def __post_init__(self) -> None:
        circle, hole = check_radii("CircleInCircle", self.radii, check_positive)
        if np.any(hole <= circle):
            raise InputError(
                "CircleInCircle radii [m] must be those of a circle and of a larger hole; got "
                f"{self.radii}"
            )

    def travel(self, first: Frame, second: Frame) -> Travel:
        return travel_on_circle(first, second, -np.asarray(self.radii[0], dtype=float))

    @property
    def parameters(self) -> Sequence[ArrayLike]:
        circle = np.asarray(self.radii[0], float)
        hole = np.asarray(self.radii[1], float)
        return hole - circle, circle


def travel_on_circle(first: Frame, second: Frame, radius: np.ndarray) -> Travel:
    """Return |d| (φ − θ₂) − r (θ₁ − θ₂), with φ the angle of d = r₁ − r₂; r < 0 in a hole.

    It is the travel of the first circle where it meets the second body: its rate is
    |d| φ̇ − r θ̇₁ − (|d| − r) θ̇₂, the difference of the speeds of both bodies there.
    """
    centres = subtract(first.position, second.position)
    below = angle(section_normal(second))
    turn = (angle(section_normal(first)) - below) * -radius
    action = Action((-centres[1], centres[0]), NO_LEVER, centres, -radius)
    return Travel(turn, action, orbit=angle(centres) - below)


def check_radii(name: str, radii: object, check) -> tuple[np.ndarray, np.ndarray]:
    """Return two radii; raise `InputError` if they are not a pair, or not as `check` allows."""
    name = f"{name} radii [m]"
    first, second = (check(name, radius) for radius in check_pair(name, radii))
    return first, second
