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

from flexband.errors import InputError, finite, numbers
from flexband.mechanics.bodies import Point
from flexband.mechanics.forms import Form, Frame, TimeFunction, Vector, dot, scale, subtract

PointName = str | Point
Resolve = Callable[[PointName], Frame]
"""Finds the frame of a point."""


class Joint(Protocol):
    """What assembly asks of a joint."""

    def constraints(self, frame: Resolve) -> list[Form]:
        """Return the rows of Φ."""
        ...

    def conditions(self, frame: Resolve) -> list[Form]:
        """Return what must stay positive: where Φ = 0 has two branches, on which one to be."""
        ...

    def force(self, frame: Resolve, multipliers: Sequence[Form]) -> Vector:
        """Return the force [N] that the joint exerts on its first body, −Φ_qᵀλ at the point."""
        ...


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
        if np.linalg.norm(numbers("Prismatic axis", self.axis, 2)) == 0:
            raise InputError(f"Prismatic axis must have a length; got {self.axis}")
        finite("Prismatic angle [rad]", self.angle)

    def _normal(self, line: Frame) -> Vector:
        x, y = np.asarray(self.axis, dtype=float) / np.linalg.norm(self.axis)
        return line.direction(-y, x)

    def constraints(self, frame: Resolve) -> list[Form]:
        """Return n · (r_first − r_second) and the sine of the angle between the bodies."""
        slider, line = frame(self.first), frame(self.second)
        off_line = dot(self._normal(line), subtract(slider.position, line.position))
        turned = line.direction(-np.sin(self.angle), np.cos(self.angle))
        return [off_line, dot(slider.x, turned)]

    def conditions(self, frame: Resolve) -> list[Form]:
        """Return the cosine of the angle between the bodies."""
        line = frame(self.second)
        return [dot(frame(self.first).x, line.direction(np.cos(self.angle), np.sin(self.angle)))]

    def force(self, frame: Resolve, multipliers: Sequence[Form]) -> Vector:
        """Return −λ n; the second multiplier is a moment."""
        return scale(-multipliers[0], self._normal(frame(self.second)))


@dataclass(frozen=True)
class PrescribedRotation:
    """A drive: the body of `first` is at the given angle to the X axis.

    Parameters
    ----------
    first : a point of the driven body; its x axis there is turned.
    angle : function of the time [s] that returns radians, a number or an array of shape (n,).
        The body's own `angle` at the start has to be within 90° of it.
    """

    first: PointName
    angle: TimeFunction

    def __post_init__(self) -> None:
        if not callable(self.angle):
            raise InputError(
                f"PrescribedRotation angle must be a function of time; got {self.angle!r}"
            )

    def constraints(self, frame: Resolve) -> list[Form]:
        """Return the sine of the angle from the prescribed direction to the body's x axis."""
        x = frame(self.first).x
        return [x[1] * Form.function(self._cosine) - x[0] * Form.function(self._sine)]

    def _cosine(self, time: float) -> np.ndarray:
        return np.cos(self.angle(time))

    def _sine(self, time: float) -> np.ndarray:
        return np.sin(self.angle(time))

    def conditions(self, frame: Resolve) -> list[Form]:
        """Return the cosine of the angle from the prescribed direction to the body's x axis."""
        x = frame(self.first).x
        return [x[0] * Form.function(self._cosine) + x[1] * Form.function(self._sine)]

    def force(self, frame: Resolve, multipliers: Sequence[Form]) -> Vector:
        """Refuse: a drive exerts a moment only.

        Raises
        ------
        InputError
            Always.
        """
        raise InputError("a PrescribedRotation exerts a moment and no force")
