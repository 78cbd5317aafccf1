"""Contacts as loads: of two bodies with given shapes, and stops along a line and of an angle."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from numpy.typing import ArrayLike

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_flag, check_instance
from flexband.basics.words import value_text
from flexband.errors import InputError
from flexband.mechanics.contact.contact_law import (
    PairContact,
    angle_contact,
    check_law,
    checked_limits,
    pair_contact,
)
from flexband.mechanics.contact.friction import Friction, as_coulomb, friction_entry
from flexband.mechanics.contact.geometry.circle_on_line import (
    gap_above_line,
    line_parameters,
    travel_on_line,
)
from flexband.mechanics.contact.geometry.geometry import Geometry
from flexband.mechanics.contact.normal_laws import NormalLaw
from flexband.mechanics.joints.joint import PointName, body_and_point, check_axis, straight
from flexband.mechanics.kernels.forms import Form, Frame, Vector
from flexband.mechanics.loads.load import Entries, LawEntry, LoadModel, PairLoad


def contact_entries(
    contacts: Sequence[PairContact], first: Frame, second: Frame, *, closed_at_start: bool
) -> Entries:
    """Return the entries of contacts between two points, with friction where they have it."""
    return Entries(
        frictions=[
            contact.friction._replace(normal=partial(_force_of, n))
            for n, contact in enumerate(contacts)
            if contact.friction
        ],
        laws=[
            LawEntry(
                (first, second), contact.law, contact.parameters, events=("gap",),
                gap_kind=contact.kind, closed_at_start=closed_at_start,
            )
            for contact in contacts
        ]
    )  # fmt: skip


def _force_of(number: int, forces: Sequence[Form]) -> list[Vector]:
    return [(forces[number], Form({}))]


class ContactLoad(PairLoad):
    """Contacts between two points of different bodies, one of which may be the ground."""

    law: NormalLaw
    closed_at_start: bool

    def __post_init__(self) -> None:
        name = type(self).__name__
        check_law(f"{name} law", self.law)
        check_flag(f"{name} closed_at_start", self.closed_at_start)
        (first, _), (second, _) = map(body_and_point, self.points)
        if first == second:
            owner = f"of body {first!r}" if first else "of the ground"
            raise InputError(
                f"{name} must be between two bodies, or a body and the ground; its points "
                f"{value_text(self.first)} and {value_text(self.second)} are both {owner}"
            )

    def contacts(self, first: Frame, second: Frame) -> list[PairContact]:
        """Return the contacts between two frames, each with a law of its own."""
        raise NotImplementedError

    def enters(self, model: LoadModel) -> Entries:
        first = model.frame(self.first)
        second = model.frame(self.second)
        contacts = self.contacts(first, second)
        return contact_entries(contacts, first, second, closed_at_start=self.closed_at_start)


@frozen()
class Contact(ContactLoad):
    """A contact of two bodies.

    In a mechanism with contacts every sample chooses its steps, see `GeneralizedAlpha`, and steps
    end where contacts close and open.

    Parameters
    ----------
    first, second : the points where `geometry` has the shapes of both bodies.
    geometry : `CircleOnLine`, `CircleOnCircle` or `CircleInCircle`.
    law : the normal law.
    friction : of the surfaces, `Coulomb` or µ, or None for none. It acts on both bodies at one
        point, that of the first one.
    closed_at_start : whether the contact may be closed at the start. Otherwise a simulation of
        bodies that overlap there is refused. It is then at rest, a spring with little damping,
        unless its speed at the start, δ̇₀, presses it in deeper.

    Raises
    ------
    InputError
        If both points are of one body, the geometry or the law is of another type, the second point
        is of a flexible member and the geometry needs a rigid body there, or friction is asked for
        on a line with ends.
    """

    first: PointName
    second: PointName
    geometry: Geometry
    law: NormalLaw
    closed_at_start: bool = False
    friction: Friction | None = None

    def __post_init__(self) -> None:
        ContactLoad.__post_init__(self)
        check_instance(
            "Contact geometry", self.geometry, Geometry, "a geometry, such as CircleOnLine"
        )
        if self.friction is not None:
            as_coulomb("Contact friction", self.friction)

    def contacts(self, first: Frame, second: Frame) -> list[PairContact]:
        if self.geometry.second_must_be_rigid:
            straight(f"Contact of a {type(self.geometry).__name__}", second)
        friction = friction_entry(self.friction, partial(self.geometry.travel, first, second))
        kernel = type(self.geometry).kernel
        parameters = self.geometry.parameters
        return [pair_contact(kernel, self.law, *parameters, friction=friction)]


@frozen()
class Stop(ContactLoad):
    """Stops that keep a travel between limits: the place of one point along a line of another.

    Parameters
    ----------
    first : the point whose travel is limited.
    second : the origin of the line, on a rigid body or the ground.
    law : the normal law, stiffness in N/mⁿ.
    lower, upper : limits of the travel [m], one of which may be None.
    axis : direction of the line in the axes of the second body; any length but zero.
    closed_at_start, friction : as in `Contact`.

    Raises
    ------
    InputError
        If there is no limit, they do not increase, or the axis has no length.

    Examples
    --------
    >>> mass = fb.Mechanism(
    ...     bodies={"m": fb.PointMass(mass=1.0, position=(0.0, 0.0), velocity=(2.0, 0.0))},
    ...     joints={"guide": fb.Slot("m", (0.0, 0.0))},
    ...     loads={"stop": fb.contact.Stop(
    ...         "m", (0.0, 0.0), fb.contact.KeepsRestitution(stiffness=1e8, restitution=0.5),
    ...         upper=0.1)},
    ...     sensors={"v": fb.Velocity("m")},
    ... )
    >>> motion = fb.simulate(mass, duration=0.1, step=0.01)
    >>> float(motion.sel(output="v_X").values[-1].round(3))
    -1.0
    """

    first: PointName
    second: PointName
    law: NormalLaw
    lower: ArrayLike | None = None
    upper: ArrayLike | None = None
    axis: tuple[float, float] = (1.0, 0.0)
    closed_at_start: bool = False
    friction: Friction | None = None

    def __post_init__(self) -> None:
        ContactLoad.__post_init__(self)
        check_axis("Stop axis", self.axis)
        checked_limits("Stop", self.lower, self.upper)
        if self.friction is not None:
            as_coulomb("Stop friction", self.friction)

    def contacts(self, first: Frame, second: Frame) -> list[PairContact]:
        straight("Stop", second)
        x, y = self.axis
        along = partial(travel_on_line, first, second, self.axis)
        return [
            pair_contact(
                gap_above_line,
                self.law,
                *line_parameters((-sign * x, -sign * y), height=-limit),
                friction=friction_entry(self.friction, partial(along, height=sign * limit)),
            )
            for sign, limit in checked_limits("Stop", self.lower, self.upper)
        ]


@frozen()
class AngularStop(ContactLoad):
    """Stops that keep the angle of one body against another between limits.

    Angles are counted from those that bodies are given, turns included: a body at −170° is below a
    lower limit of 150°, and one at 190° is above it.

    Parameters
    ----------
    first, second : points of both bodies, or of the ground.
    law : the normal law: its force is a moment, its stiffness is in N m/radⁿ.
    lower, upper : limits of the angle of the first less that of the second [rad], one of which may
        be None.
    closed_at_start : as in `Contact`.

    Raises
    ------
    InputError
        If there is no limit, or they do not increase.
    """

    first: PointName
    second: PointName
    law: NormalLaw
    lower: ArrayLike | None = None
    upper: ArrayLike | None = None
    closed_at_start: bool = False

    def __post_init__(self) -> None:
        ContactLoad.__post_init__(self)
        checked_limits("AngularStop", self.lower, self.upper)

    def contacts(self, first: Frame, second: Frame) -> list[PairContact]:
        limits = checked_limits("AngularStop", self.lower, self.upper)
        return [angle_contact(self.law, sign, limit) for sign, limit in limits]
