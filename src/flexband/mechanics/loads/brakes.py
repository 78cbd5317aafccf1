"""Brakes and clutches: friction between bodies that something presses together."""

from __future__ import annotations

from collections.abc import Sequence

from numpy.typing import ArrayLike

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_non_negative, check_numbers, check_positive
from flexband.errors import InputError
from flexband.mechanics.contact.friction import (
    Coulomb,
    Friction,
    FrictionEntry,
    Travel,
    as_coulomb,
    check_law_output,
)
from flexband.mechanics.joints.joint import PointName
from flexband.mechanics.kernels.forms import Form, Vector
from flexband.mechanics.kernels.relation_forms import turn
from flexband.mechanics.loads.load import Entries, InTime, LoadModel, PairLoad, in_time


@frozen()
class Brake(PairLoad):
    """A brake: friction against the rotation of one body against another, or the ground.

    The moment is r µ F while it slides. What sticks is held where it is, without any drift.

    Parameters
    ----------
    first, second : points of the bodies.
    friction : `Coulomb` or µ.
    radius : r at which friction acts [m], times the number of pairs of faces.
    force : F that presses the faces together [N]: 0 or more, a function of the time [s], the name
        of a spring whose tension it is, or the names of a load and of one of its states, see
        `ForceLaw`. Of what changes the magnitude counts.

    Raises
    ------
    InputError
        If a number is out of its range.

    Examples
    --------
    >>> wheel = fb.Mechanism(
    ...     bodies={"wheel": fb.RigidBody(mass=1.0, inertia=0.02, rate=10.0)},
    ...     joints={"axle": fb.Revolute("wheel", (0.0, 0.0))},
    ...     loads={"brake": fb.contact.Brake(
    ...         "wheel", (0.0, 0.0), friction=0.4, radius=0.1, force=5.0)},
    ...     sensors={"turn": fb.Angle("wheel")},
    ... )
    >>> float(fb.simulate(wheel, duration=2.0, step=0.1)[0, -1].round(2))  # [rad], J ω²/(2 r µ F)
    5.0
    """

    first: PointName
    second: PointName
    friction: Friction
    radius: ArrayLike
    force: InTime | str | tuple[str, str]

    def __post_init__(self) -> None:
        as_coulomb(f"{type(self).__name__} friction", self.friction)
        check_positive(f"{type(self).__name__} radius [m]", self.radius)
        if isinstance(self.force, tuple):
            check_law_output(f"{type(self).__name__} force", self.force, "state")
        elif not callable(self.force) and not isinstance(self.force, str):
            check_non_negative(f"{type(self).__name__} force [N]", self.force)

    def enters(self, model: LoadModel) -> Entries:

        def pressure(forces: Sequence[Form]) -> list[Vector]:
            match self.force:
                case str(spring):
                    pressing, _ = model.spring(spring, torsion=False)
                case (str(load), str(state)):
                    pressing = model.law_state(load, state)
                case force:
                    pressing = in_time("Brake force [N]", force)
            return [(pressing, Form({}))]

        turn = turning_of(model, self.first, self.second)
        entry = FrictionEntry(turn, self.friction, pressure, lever=self.radius, angular=True)
        return Entries(frictions=[entry])


@frozen()
class Clutch(Brake):
    """A friction clutch between two shafts: a `Brake` whose bodies both turn."""


@frozen()
class OneWayClutch(PairLoad):
    """A freewheel: the first body turns against the second one in one sense only.

    Backwards it locks at once, by a plastic impact if it is turning back at the start.

    Parameters
    ----------
    first, second : points of the bodies, or of the ground.
    sense : 1 if the angle of the first body less that of the second may increase, −1 if it may
        decrease.

    Raises
    ------
    InputError
        If the sense is neither 1 nor −1.

    Examples
    --------
    >>> shaft = fb.Mechanism(
    ...     bodies={"shaft": fb.RigidBody(mass=1.0, inertia=0.5)},
    ...     joints={"axle": fb.Revolute("shaft", (0.0, 0.0))},
    ...     loads={
    ...         "freewheel": fb.contact.OneWayClutch("shaft", (0.0, 0.0)),
    ...         "torque": fb.Moment("shaft", lambda t: 1.0 - t),
    ...     },
    ...     sensors={"turn": fb.Angle("shaft")},
    ... )
    >>> fb.simulate(shaft, duration=4.0, step=1.0).values[0].round(4)  # [rad], t² − t³/3 up to 2 s
    array([0.    , 0.6667, 1.3333, 1.3333, 1.3333])
    """

    first: PointName
    second: PointName
    sense: int = 1

    def __post_init__(self) -> None:
        if check_numbers("OneWayClutch sense", self.sense) not in (1, -1):
            raise InputError(f"OneWayClutch sense must be 1 or -1; got {self.sense!r}")

    def enters(self, model: LoadModel) -> Entries:
        pressure, law = [(Form.constant(1.0), Form({}))], Coulomb(kinetic=0.0)
        turn = Travel(turning_of(model, self.first, self.second).travel * float(self.sense))
        entry = FrictionEntry(turn, law, lambda forces: pressure, angular=True, one_way=True)
        return Entries(frictions=[entry])


def turning_of(model: LoadModel, first: PointName, second: PointName) -> Travel:
    """Return the angle of the first body less that of the second one."""
    return Travel(turn(model.frame(first), model.frame(second)))
