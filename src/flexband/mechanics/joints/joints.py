"""Joints: rows of at most quadratic constraints Φ(q, t) = 0, Eq. (26).

A point is written "body.point" ("body" alone is its "center"), or as its coordinates (X, Y) [m]
where it belongs to the ground.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from flexband.errors import InputError, finite, numbers, positive
from flexband.mechanics.bodies.body import Point
from flexband.mechanics.forms import (
    Form,
    Frame,
    Vector,
    cross,
    dot,
    scale,
    subtract,
    turned,
)

PointName = str | Point
Resolve = Callable[[PointName], Frame]
"""Finds the frame of a point."""


class Joint(Protocol):
    """What assembly asks of a joint; `first` is on the body that forces are told for."""

    first: PointName

    def constraints(self, frame: Resolve) -> list[Form]:
        """Return the rows of Φ."""
        ...

    def conditions(self, frame: Resolve) -> list[Form]:
        """Return what must stay positive: where Φ = 0 has two branches, on which one to be."""
        ...

    def force(self, frame: Resolve, multipliers: Sequence[Form]) -> Vector | None:
        """Return the force [N] on the first body at its point, −Φ_qᵀλ; None where there is none."""
        ...

    def moment(self, multipliers: Sequence[Form]) -> Form | None:
        """Return the moment [N m] on the first body, −Φ_θᵀλ; None where there is none."""
        ...


def along(line: Frame, axis: tuple[float, float]) -> Vector:
    """Return the unit vector of this direction in the axes of a frame."""
    x, y = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    return line.direction(x, y)


def _normal(axis: tuple[float, float]) -> tuple[float, float]:
    return -axis[1], axis[0]


def check_axis(name: str, axis: tuple[float, float]) -> None:
    """Raise `InputError` where an axis has no length."""
    if np.linalg.norm(numbers(name, axis, 2)) == 0:
        raise InputError(f"{name} must have a length; got {axis}")


@dataclass(frozen=True)
class Revolute:
    """A pin: the two points coincide."""

    first: PointName
    second: PointName

    def constraints(self, frame: Resolve) -> list[Form]:
        """Return r_first − r_second."""
        return list(subtract(frame(self.first).position, frame(self.second).position))

    def conditions(self, frame: Resolve) -> list[Form]:
        """Return none."""
        return []

    def force(self, frame: Resolve, multipliers: Sequence[Form]) -> Vector:
        """Return −λ."""
        return -multipliers[0], -multipliers[1]

    def moment(self, multipliers: Sequence[Form]) -> None:
        """Return none."""


@dataclass(frozen=True)
class Weld:
    """A clamp: the points coincide and the sections there keep their angle.

    Parameters
    ----------
    first, second : the points.
    angle : from the second section's normal (the body's x axis, where it is rigid) to the first
        one's [rad].
    axis : whether the axes of the two keep their angle as well, and not only the sections: the
        built-in end of the literature on these elements. It forbids shear there, which matters on
        coarse meshes only. At least one of the points has to be a beam's.

    Raises
    ------
    InputError
        Where the angle is not finite.
    """

    first: PointName
    second: PointName
    angle: ArrayLike = 0.0
    axis: bool = False

    def __post_init__(self) -> None:
        finite("Weld angle [rad]", self.angle)

    def _normals(self, frame: Resolve) -> tuple[Vector, Vector]:
        return turned(frame(self.second).normal, self.angle), frame(self.first).normal

    def constraints(self, frame: Resolve) -> list[Form]:
        """Return r_first − r_second and the sine of the angle between sections, and of that between
        axes.
        """  # noqa: D205
        first, second = frame(self.first), frame(self.second)
        rows = [*subtract(first.position, second.position), cross(*self._normals(frame))]
        return [*rows, cross(turned(second.x, self.angle), first.x)] if self.axis else rows

    def conditions(self, frame: Resolve) -> list[Form]:
        """Return the cosine of the angle that is left."""
        return [dot(*self._normals(frame))]

    def force(self, frame: Resolve, multipliers: Sequence[Form]) -> Vector:
        """Return −λ of the positions."""
        return -multipliers[0], -multipliers[1]

    def moment(self, multipliers: Sequence[Form]) -> Form:
        """Return −λ of the angle."""
        return -multipliers[2]


@dataclass(frozen=True)
class Prismatic:
    """A slide: the first point stays on a line, and its body does not turn against the other.

    Parameters
    ----------
    first : the point that slides.
    second : a point of the line.
    axis : direction of the line in the axes of the second point's body; need not have length 1.
    angle : from the axes of the second body to those of the first [rad].

    Raises
    ------
    InputError
        Where the axis has no length or a number is not finite.
    """

    first: PointName
    second: PointName
    axis: tuple[float, float] = (1.0, 0.0)
    angle: ArrayLike = 0.0

    def __post_init__(self) -> None:
        check_axis("Prismatic axis", self.axis)
        finite("Prismatic angle [rad]", self.angle)

    def _normals(self, frame: Resolve) -> tuple[Vector, Vector]:
        return turned(frame(self.second).normal, self.angle), frame(self.first).normal

    def constraints(self, frame: Resolve) -> list[Form]:
        """Return n · (r_first − r_second) and the sine of the angle between the bodies."""
        slider, line = frame(self.first), frame(self.second)
        apart = subtract(slider.position, line.position)
        return [dot(along(line, _normal(self.axis)), apart), cross(*self._normals(frame))]

    def conditions(self, frame: Resolve) -> list[Form]:
        """Return the cosine of the angle between the bodies."""
        return [dot(*self._normals(frame))]

    def force(self, frame: Resolve, multipliers: Sequence[Form]) -> Vector:
        """Return −λ n."""
        return scale(-multipliers[0], along(frame(self.second), _normal(self.axis)))

    def moment(self, multipliers: Sequence[Form]) -> Form:
        """Return −λ of the angle."""
        return -multipliers[1]


@dataclass(frozen=True)
class Slot:
    """A pin in a straight slot: the first point stays on a line, its body may turn.

    Parameters
    ----------
    first : the pin.
    second : a point of the slot's line.
    axis : direction of the line in the axes of the second point's body; need not have length 1.

    Raises
    ------
    InputError
        Where the axis has no length.
    """

    first: PointName
    second: PointName
    axis: tuple[float, float] = (1.0, 0.0)

    def __post_init__(self) -> None:
        check_axis("Slot axis", self.axis)

    def constraints(self, frame: Resolve) -> list[Form]:
        """Return n · (r_first − r_second)."""
        pin, line = frame(self.first), frame(self.second)
        return [dot(along(line, _normal(self.axis)), subtract(pin.position, line.position))]

    def conditions(self, frame: Resolve) -> list[Form]:
        """Return none."""
        return []

    def force(self, frame: Resolve, multipliers: Sequence[Form]) -> Vector:
        """Return −λ n."""
        return scale(-multipliers[0], along(frame(self.second), _normal(self.axis)))

    def moment(self, multipliers: Sequence[Form]) -> None:
        """Return none."""


@dataclass(frozen=True)
class Distance:
    """A rigid rod without mass between two points.

    Parameters
    ----------
    first, second : the points.
    length : of the rod [m].

    Raises
    ------
    InputError
        Where the length is not positive.
    """

    first: PointName
    second: PointName
    length: ArrayLike

    def __post_init__(self) -> None:
        positive("Distance length [m]", self.length)

    def constraints(self, frame: Resolve) -> list[Form]:
        """Return (d · d − ℓ²)/2ℓ with d = r_first − r_second: the multiplier is the rod's force."""
        apart = subtract(frame(self.first).position, frame(self.second).position)
        length = np.asarray(self.length, dtype=float)
        return [dot(apart, apart) * (0.5 / length) - Form.constant(0.5 * length)]

    def conditions(self, frame: Resolve) -> list[Form]:
        """Return none."""
        return []

    def force(self, frame: Resolve, multipliers: Sequence[Form]) -> Vector:
        """Return −λ d/ℓ."""
        apart = subtract(frame(self.first).position, frame(self.second).position)
        return scale(-multipliers[0] * (1 / np.asarray(self.length, dtype=float)), apart)

    def moment(self, multipliers: Sequence[Form]) -> None:
        """Return none."""
