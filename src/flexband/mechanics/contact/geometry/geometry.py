"""The geometry of a contact: gap, normal and material points, and how surfaces slide."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexband.errors import InputError
from flexband.mechanics.kernels.forms import (
    Form,
    Frame,
    Vector,
    constant_vector,
    cross,
    dot,
    subtract,
)

NO_LEVER = constant_vector((0.0, 0.0))


class Action(NamedTuple):
    """Where friction acts on the two bodies of a contact."""

    along: Vector  # direction, of any length, in which it acts on the second body where λ > 0
    first: Vector  # from the first point to where it acts, or to the centre of the first circle
    second: Vector  # the same from the second point
    radius: ArrayLike  # from this centre to where it acts: θ₁ enters s with it


class ContactLine(NamedTuple):
    """A straight line of the second body of a contact, beside which a point of the first slides."""

    first: Frame
    second: Frame
    normal: Vector  # a unit vector away from the second body
    height: ArrayLike  # of the line above the second point [m]

    def is_that_of(self, other: ContactLine, z: Sequence[ArrayLike]) -> bool:
        """Return whether a rigid body slides along both where all is in the state z."""
        if not (self.first.is_on_body_of(other.first) and self.second.is_on_body_of(other.second)):
            return False
        turn, distance = (
            np.asarray(form.at(z))
            for form in (
                cross(self.normal, other.normal),
                dot(self.normal, subtract(self.second.position, other.second.position)),
            )
        )
        same_side = dot(self.normal, other.normal).at(z) > 0.0
        height = np.asarray(self.height)
        others = np.asarray(other.height)
        rounding = 1e-12 * (np.abs(height) + np.abs(others) + np.abs(distance))
        off = np.abs(distance + height - others)
        return bool(np.all(same_side & (np.abs(turn) < 1e-12) & (off <= rounding)))


class Travel(NamedTuple):
    """How two surfaces slide: along s, whose rate is the sliding speed."""

    travel: Form  # s, of the coordinates and of angles
    action: Action | None = None  # of a contact
    orbit: Form | None = None  # φ, whose product with the length of ``action.second`` is added to s
    line: ContactLine | None = None  # along which a contact slides


class Geometry(ABC):
    """How two bodies meet, each at one of its points.

    A new geometry is a subclass with `kernel` and `parameters`.
    """

    kernel: ClassVar[Callable[..., tuple]]
    """A function, compiled by `kernels.lanes.compiled`, of the positions x of both points, each
    (X, Y, θ), and of the parameters, all of them lanes. It returns (gap, n_X, n_Y, X₁, Y₁, X₂, Y₂):
    the gap [m], the unit normal along which the contact pushes the first body, and the material
    points of both bodies that meet."""

    second_must_be_rigid: ClassVar[bool] = True
    """Whether the second point must be of a rigid body or the ground.

    What extends along a body, such as a line, does not bend with a flexible one. What lies around
    the point, such as a circle, may be on any body.
    """

    def travel(self, first: Frame, second: Frame) -> Travel:
        """Return how the surfaces slide, which friction needs.

        Raises
        ------
        InputError
            If friction is not possible.
        """
        raise InputError(f"{type(self).__name__} has no `travel`, so there cannot be friction")

    @property
    @abstractmethod
    def parameters(self) -> Sequence[ArrayLike]:
        """The parameters of `kernel`, numbers or arrays of shape (n,)."""
