"""Joints that give: springs along what a joint holds, in place of its multipliers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_instance, check_non_negative, check_positive
from flexband.basics.words import with_article
from flexband.errors import InputError
from flexband.mechanics.joints.joint import (
    Compliance,
    Held,
    Joint,
    ModifiedJoint,
    Resolve,
)
from flexband.mechanics.kernels.forms import Form, Vector

Stiffness = ArrayLike | tuple[ArrayLike, ArrayLike]
"""One number for all directions, an array of shape (n,), or a pair for two directions."""


@frozen()
class Compliant(ModifiedJoint):
    """A joint that gives: springs and dampers along what it holds.

    A rigid joint is the limit of a large stiffness. Where several rigid joints hold the same
    motion, their reactions are not unique; those of compliant ones are.

    Parameters
    ----------
    joint : any joint or drive without clearance, friction, losses or play. A `Gear` or `Rack` is
        relaxed at the start, all others where their points meet.
    stiffness : of the places that the joint holds [N/m]: one number, or a pair for the two
        directions of a `Revolute` or a `Weld`, the axes of the second body.
    tilt_stiffness : of the angle that it holds [N m/rad].
    damping : retardation time τ [s] of all its springs, whose dampers are τ times their stiffness.

    Raises
    ------
    InputError
        If a stiffness is not positive, or the damping is negative; when the mechanism is made, if
        the joint is rough, switched, or has clearance or play, if a stiffness is missing or of
        nothing that the joint holds, or if a drive has damping, or is a cylinder.

    Examples
    --------
    >>> rotor = fb.Mechanism(
    ...     bodies={"rotor": fb.RigidBody.disc(radius=0.1, width=0.05, density=7800.0)},
    ...     joints={
    ...         "bearing": fb.Compliant(fb.Revolute("rotor", (0.0, 0.0)), stiffness=(2e6, 1e6)),
    ...     },
    ... )
    >>> fb.modes(rotor, 3)["frequency"].values.round(1)  # √(k/m)/2π [Hz], and the free turn
    array([ 0. , 45.5, 64.3])
    """

    joint: Joint
    stiffness: Stiffness | None = None
    tilt_stiffness: ArrayLike | None = None
    damping: ArrayLike = 0.0

    def __post_init__(self) -> None:
        check_instance("Compliant joint", self.joint, Joint, "a joint")
        for stiffness in self._by_direction(1):
            if stiffness is not None:
                check_positive("Compliant stiffness [N/m]", stiffness)
        if self.tilt_stiffness is not None:
            check_positive("Compliant tilt_stiffness [N m/rad]", self.tilt_stiffness)
        check_non_negative("Compliant damping [s]", self.damping)

    def held(self, frame: Resolve) -> list[Held]:
        joint = self.joint
        kind = with_article(type(self.joint).__name__)
        if np.any(np.asarray(vars(joint).get("offset", 0.0), dtype=float)):
            raise InputError(f"{kind} with an offset, or with play, cannot be Compliant")
        rows = self.rows_of_joint(frame)
        if not rows:
            raise InputError(
                f"{kind} cannot be Compliant if it has clearance, friction or losses, switches, "
                "gives already, or does not say what it holds (`held`)"
            )
        return rows

    def constraints(self, frame: Resolve) -> list[Form]:
        """Return none: springs hold the points."""
        return []

    def rods(self, frame: Resolve) -> list[Vector]:
        return self.joint.rods(frame)

    def compliances(self, frame: Resolve) -> list[Compliance]:
        """Return a spring along each travel that the joint holds."""
        rows = self.held(frame)
        kind = with_article(type(self.joint).__name__)
        places = sum(not row.angular for row in rows)
        tilts = len(rows) - places
        for name, count, stiffness in (
            ("stiffness", places, self.stiffness),
            ("tilt_stiffness", tilts, self.tilt_stiffness),
        ):
            if (stiffness is None) == (count > 0):
                what = "needs a" if count else "holds nothing with a"
                raise InputError(f"{kind} that is Compliant {what} {name}; got {stiffness}")
        along = self._by_direction(places)
        if places and len(along) != places:
            raise InputError(
                f"{kind} that is Compliant needs a stiffness for each of its directions, which "
                f"are {places}; got {len(along)}"
            )
        along = iter(along)
        return [
            self._spring(row, self.tilt_stiffness if row.angular else next(along)) for row in rows
        ]

    def _by_direction(self, directions: int) -> Sequence[ArrayLike | None]:
        """Return the stiffness along each direction."""
        if isinstance(self.stiffness, tuple | list):
            return [*self.stiffness]
        return [self.stiffness] * directions

    def _spring(self, row: Held, stiffness: ArrayLike | None) -> Compliance:
        k = np.asarray(stiffness, dtype=float)
        damping = np.asarray(self.damping, dtype=float)
        if any(polar.f is not None or polar.length for polar in row.travel.polar):
            raise InputError("a drive along a flexible member's section cannot be Compliant")
        in_time = [key for key in row.travel.terms if key[2] is not None]
        if any((i, j) != (0, 0) for i, j, _ in in_time):
            raise InputError("a cylinder cannot be Compliant; a Spring whose pull is −k ℓ(t) gives")
        if in_time and np.any(damping):
            raise InputError(
                "a drive that is Compliant needs damping 0; a Spring or a TorsionSpring beside it "
                f"damps; got {self.damping}"
            )
        return Compliance(row.travel, k, damping * k, row.angular, self.joint.holds_start)
