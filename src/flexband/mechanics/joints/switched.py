"""Joints that switch: a latch, a gripper, a release. They use the rows of friction."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_instance, check_option, check_positive
from flexband.basics.user_functions import evaluate_function
from flexband.errors import InputError
from flexband.mechanics.contact.friction import Activity, Coulomb, FrictionEntry, as_activity
from flexband.mechanics.contact.geometry.geometry import Travel
from flexband.mechanics.joints.joint import (
    Held,
    HoldingJoint,
    Joint,
    ModifiedJoint,
    Resolve,
)
from flexband.mechanics.joints.joints import Distance
from flexband.mechanics.kernels.forms import Form


@frozen()
class Switched(ModifiedJoint):
    """A joint that is active only part of the time.

    Becoming active is a plastic impact; `sensors.SwitchingLoss` is the energy that it takes. With
    such a joint every sample chooses its steps, see `GeneralizedAlpha`.

    Parameters
    ----------
    joint : any joint or drive without clearance, friction and losses. A `Gear` or `Rack` engages
        at any angle. A drive goes on from where the bodies are: its angle or travel counts from
        there.
    active : function of the time [s] that is more than 0.5 while the joint is active, such as
        ``lambda t: t > 0.2``; or the names of a `ForceLaw` and of one of its events: the joint is
        active while the gap of this event is negative.
    where : "present" to hold the bodies where they are when the joint becomes active, "given" to
        hold the place that the joint states. A cylinder, a `Distance` whose length is a function,
        needs "given"; a `Gear` or `Rack` states no place.
    tolerance : how far the bodies may then be from the given place, along each direction [m] and in
        angle [rad]; a sample that is farther fails. The distance is kept, not corrected.

    Raises
    ------
    InputError
        If an argument is not allowed and, when the mechanism is made, if the joint has clearance,
        friction or losses, or does not say what it would hold (`Joint.held`).

    Examples
    --------
    >>> wagons = fb.Mechanism(
    ...     bodies={
    ...         "a": fb.PointMass(mass=3.0, velocity=(2.0, 0.0)),
    ...         "b": fb.PointMass(mass=1.0, position=(1.0, 0.0)),
    ...     },
    ...     joints={
    ...         "rail a": fb.Slot("a", (0.0, 0.0)),
    ...         "rail b": fb.Slot("b", (0.0, 0.0)),
    ...         "hook": fb.contact.Switched(fb.Distance("a", "b", 1.0), lambda t: t > 0.2),
    ...     },
    ...     sensors={"v": fb.Velocity("b"), "lost": fb.sensors.SwitchingLoss("hook")},
    ... )
    >>> motion = fb.simulate(wagons, duration=0.3, step=0.1)
    >>> motion.sel(output=["v_X", "lost"]).values[:, -1].round(6)  # m/s, J
    array([1.5, 1.5])
    """

    joint: Joint
    active: Activity
    where: str = "present"
    tolerance: ArrayLike = 1e-3

    def __post_init__(self) -> None:
        kind = type(self.joint).__name__
        joint = self.joint
        check_instance("Switched joint", joint, Joint, "a joint")
        check_option("where", self.where, ["present", "given"])
        check_positive("Switched tolerance [m]", self.tolerance)
        if self.where == "given" and joint.holds_start:
            raise InputError(f'a {kind} states no place; a Switched one needs where="present"')
        if self.where == "present" and isinstance(joint, Distance) and callable(joint.length):
            raise InputError(
                'a Switched cylinder needs where="given", which states its length; a '
                "PrescribedTravel goes on from any place"
            )
        object.__setattr__(self, "active", as_activity("Switched active", self.active))

    def held(self, frame: Resolve) -> list[Held]:
        rows = self.rows_of_joint(frame)
        if not rows:
            raise InputError(
                f"a {type(self.joint).__name__} cannot switch if it has clearance, friction or "
                "losses, gives, or does not say what it holds (`held`). A contact.Brake beside it "
                "rubs"
            )
        return rows

    def constraints(self, frame: Resolve) -> list[Form]:
        """Return none: the rows are those of friction."""
        self.held(frame)
        return []

    def frictions(self, frame: Resolve) -> list[FrictionEntry]:
        """Return the rows, each as what sticks while the joint is active."""
        law = Coulomb(kinetic=0.0, static=self.tolerance if self.where == "given" else 1e30)
        return [
            FrictionEntry(Travel(s), law, lambda m: [], angular=angular, active=self.active)
            for s, _, _, angular in self.held(frame)
        ]

    def at_rest(self) -> Joint:
        return _AtRest(**vars(self))


class _AtRest(Switched):
    """A joint that stays as it is at the start."""

    holds_start = True

    def at_rest(self) -> Joint:
        return self

    def constraints(self, frame: Resolve) -> list[Form]:
        if isinstance(self.active, tuple):
            raise InputError("statics and modes need a Switched active that is a function of time")
        active = np.unique(np.asarray(evaluate_function(self.active, 0.0), dtype=float) > 0.5)
        if len(active) > 1:
            raise InputError("a Switched must be active at the start in all samples or in none")
        return HoldingJoint.constraints(self, frame) if active[0] else []

    def frictions(self, frame: Resolve) -> list[FrictionEntry]:
        return []
