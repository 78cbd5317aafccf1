"""The interface of joints, and the points that they name.

A point is written "body.point" ("body" alone is its "center"), or as coordinates (X, Y) [m] if it
belongs to the ground.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from functools import reduce
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.checks import check_finite, check_numbers
from flexband.basics.words import value_text
from flexband.errors import InputError
from flexband.mechanics.bodies.body import Point
from flexband.mechanics.contact.contact_law import PairContact
from flexband.mechanics.contact.friction import FrictionEntry
from flexband.mechanics.kernels.forms import (
    Form,
    Frame,
    Vector,
    add,
    dot,
    scale,
    subtract,
)
from flexband.mechanics.kernels.relation_forms import turn

PointName = str | Point
"""A point of a body by name, or coordinates (X, Y) [m] of a point of the ground."""

Offset = Sequence[ArrayLike] | np.ndarray
"""A pair of numbers, or an array of shape (2, n)."""

Resolve = Callable[[PointName], Frame]
"""Returns the frame of a point."""

Couple = tuple[Form, Sequence[Vector]]
"""A moment [N m] is a form times the lengths of these vectors, which a form cannot express."""


def body_and_point(point: PointName) -> tuple[str, str]:
    """Return the names of a body and of its point; both are empty for a point of the ground."""
    if not isinstance(point, str):
        return "", ""
    body, _, name = point.partition(".")
    return body, name or "center"


class Held(NamedTuple):
    """What a joint holds: a travel s that keeps its value, with the multiplier λ."""

    travel: Form  # s [m] or [rad], 0 at the place that the joint states
    force: Vector | None = None  # −λ times it is the force on the first body at its point
    moment: ArrayLike | None = None  # −λ times it is the moment on the first body
    angular: bool = False  # whether s is an angle


class Compliance(NamedTuple):
    """A spring along a travel that a joint holds, in place of a multiplier."""

    travel: Form  # s [m] or [rad]; what it has of the time alone is subtracted from the place
    stiffness: ArrayLike  # [N/m] or [N m/rad]
    damping: ArrayLike  # [N s/m] or [N m s/rad]
    angular: bool
    relaxed: bool  # whether s counts from its value at the start


class Joint(ABC):
    """A constraint between points. The first point is on the body that reactions act on.

    A new kind of joint is a subclass with `constraints` and, so that sensors can report reactions,
    `force` or `moment`.
    """

    first: PointName

    holds_start: ClassVar[bool] = False
    """Whether the rows of Φ keep the values that they have in the guess, instead of 0."""

    @property
    def points(self) -> Sequence[PointName]:
        """The points that the joint names."""
        return [self.first]

    @abstractmethod
    def constraints(self, frame: Resolve) -> list[Form]:
        """Return the rows of Φ."""

    def held(self, frame: Resolve) -> list[Held]:
        """Return what the joint holds from any place on, as a `Switched` one; none if it cannot."""
        return []

    def conditions(self, frame: Resolve) -> list[Form]:
        """Return forms that must stay positive: they select a branch if Φ = 0 has two."""
        return []

    def contacts(self, frame: Resolve) -> list[PairContact]:
        """Return contacts between the two points that hold them in place of constraints."""
        return []

    def compliances(self, frame: Resolve) -> list[Compliance]:
        """Return springs that hold the two points in place of constraints."""
        return []

    def frictions(self, frame: Resolve) -> list[FrictionEntry]:
        """Return what slides, against forces that depend on the joint's multipliers."""
        return []

    def rods(self, frame: Resolve) -> list[Vector]:
        """Return vectors of constant length that turn with none of the bodies."""
        return []

    def at_rest(self) -> Joint:
        """Return the joint for statics and modes, another one if it switches."""
        return self

    def force(self, frame: Resolve, multipliers: Sequence[Form]) -> Vector | None:
        """Return the force [N] on the first body at its point, from −Φ_qᵀλ, or None."""
        return None

    def moment(self, multipliers: Sequence[Form]) -> Form | None:
        """Return the moment [N m] on the first body, from −Φ_qᵀλ, or None."""
        return None

    def moments(self, frame: Resolve, multipliers: Sequence[Form]) -> list[Couple]:
        """Return the terms of the moment [N m] on the first body; by default `moment` alone."""
        moment = self.moment(multipliers)
        return [] if moment is None else [(moment, [])]


def couple(multiplier: Form, *frames: tuple[Frame, Vector]) -> Couple:
    """Return the moment of a row d₁ × d₂ of Φ: −λ |d₁||d₂|, where rigid frames have |d| = 1."""
    return -multiplier, [direction for frame, direction in frames if not frame.rigid]


class PairJoint(Joint):
    """A joint between two points."""

    second: PointName

    @property
    def points(self) -> Sequence[PointName]:
        return [self.first, self.second]


class HoldingJoint(Joint):
    """A joint whose constraints, force and moment follow from what it holds."""

    @abstractmethod
    def held(self, frame: Resolve) -> list[Held]: ...

    def constraints(self, frame: Resolve) -> list[Form]:
        return [row.travel for row in self.held(frame)]

    def _pair_multipliers(
        self, frame: Resolve, multipliers: Sequence[Form]
    ) -> list[tuple[Held, Form]]:
        """Pair the rows with their multipliers, or with zeros if there are none."""
        rows = self.held(frame)
        return [*zip(rows, multipliers or [Form({})] * len(rows), strict=False)]

    def force(self, frame: Resolve, multipliers: Sequence[Form]) -> Vector | None:
        pairs = self._pair_multipliers(frame, multipliers)
        forces = [scale(-m, row.force) for row, m in pairs if row.force is not None]
        return reduce(add, forces) if forces else None

    def moments(self, frame: Resolve, multipliers: Sequence[Form]) -> list[Couple]:
        pairs = self._pair_multipliers(frame, multipliers)
        return [(-m * np.asarray(row.moment), []) for row, m in pairs if row.moment is not None]


class ModifiedJoint(HoldingJoint):
    """A joint that holds what another one does, in another way than by constraints."""

    joint: Joint

    @property
    def first(self) -> PointName:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.joint.first

    @property
    def points(self) -> Sequence[PointName]:
        return self.joint.points

    def rows_of_joint(self, frame: Resolve) -> list[Held]:
        """Return what the joint holds; none if it has contacts, friction, losses or springs."""
        joint = self.joint
        loose = joint.contacts(frame) or joint.frictions(frame) or joint.compliances(frame)
        return [] if loose else joint.held(frame)


def held_place(first: Frame, second: Frame) -> list[Held]:
    """Return what holds the first point at its place in the axes of the second body."""
    separation = subtract(first.position, second.position)
    axes = (second.direction(*axis) for axis in np.eye(len(separation)).tolist())
    return [Held(dot(axis, separation), axis) for axis in axes]


def held_turn(first: Frame, second: Frame, angle: Form | np.ndarray) -> Held:
    """Return what holds the angle between two sections at `angle` [rad]."""
    return Held(turn(first, second) - angle, moment=1.0, angular=True)


def straight(kind: str, line: Frame) -> Frame:
    """Return the frame of a straight line; raise `InputError` if it is on a flexible member."""
    if not line.rigid:
        raise InputError(
            f"the line of a {kind} does not bend, so its second point must be of a rigid body or "
            "the ground; on a flexible member it would follow the tangent at that point and not "
            "the bent member. For a guide at one section, weld a rigid body to the member there"
        )
    return line


def checked_offset(name: str, offset: Offset) -> tuple[np.ndarray, np.ndarray]:
    """Return both numbers of an offset; raise `InputError` if it is no pair of finite numbers."""
    try:
        first, second = offset
    except (TypeError, ValueError):
        raise InputError(f"{name} must be a pair of numbers; got {value_text(offset)}") from None
    return check_finite(name, first), check_finite(name, second)


def check_axis(name: str, axis: tuple[float, float]) -> None:
    """Raise `InputError` if an axis has no length."""
    if np.linalg.norm(check_numbers(name, axis, 2)) == 0:
        raise InputError(f"{name} must have a length; got {axis}")
