"""Joints: rows of at most quadratic constraints Φ(q, t) = 0, Eq. (26)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial, reduce
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.arguments import frozen
from flexband.basics.checks import (
    check_angle,
    check_finite,
    check_flag,
    check_non_negative,
    check_positive,
)
from flexband.errors import InputError
from flexband.mechanics.contact.contact_law import PairContact, check_law, pair_contact
from flexband.mechanics.contact.friction import Friction, FrictionEntry, as_coulomb, friction_entry
from flexband.mechanics.contact.geometry.circle_on_line import (
    gap_above_line,
    line_parameters,
    travel_on_line,
)
from flexband.mechanics.contact.geometry.circles import gap_in_circle, travel_on_circle
from flexband.mechanics.contact.geometry.geometry import Travel
from flexband.mechanics.contact.normal_laws import NormalLaw
from flexband.mechanics.joints.joint import (
    Couple,
    Held,
    HoldingJoint,
    Offset,
    PairJoint,
    PointName,
    Resolve,
    check_axis,
    checked_offset,
    couple,
    held_place,
    held_turn,
    straight,
)
from flexband.mechanics.kernels.forms import (
    Composed,
    Form,
    Frame,
    TimeFunction,
    Vector,
    add,
    cross,
    dot,
    rotate,
    scale,
    section_normal,
    subtract,
)
from flexband.mechanics.kernels.relation_forms import across, alignment, along, meet, parallel, turn


class AlignedJoint(PairJoint):
    """A joint whose bodies keep the angle between their sections."""

    angle: ArrayLike

    @property
    def _turn(self) -> np.ndarray:
        """The angle that they keep [rad]."""
        return np.asarray(self.angle, dtype=float)

    def _misalignment(self, frame: Resolve) -> tuple[Form, Form]:
        """Return the sine and the cosine of the angle between the sections, less the given one."""
        return alignment(frame(self.first), frame(self.second), *_unit(self._turn))

    def conditions(self, frame: Resolve) -> list[Form]:
        """Return the cosine of the angle between the sections."""
        return [self._misalignment(frame)[1]]


class LineJoint(PairJoint):
    """A joint whose first point stays on a straight line through the second one."""

    axis: tuple[float, float]
    friction: Friction | None

    def _across(self, frame: Resolve, *offsets: ArrayLike) -> list[Held]:
        """Return n · (r_first − r_second) less an offset [m], for each n across the line."""
        line = straight(type(self).__name__, frame(self.second))
        separation = subtract(frame(self.first).position, line.position)
        return [
            Held(dot(normal, separation) - np.asarray(offset, dtype=float), normal)
            for normal, offset in zip(across(line, self.axis), offsets, strict=True)
        ]

    def _travel(self, frame: Resolve) -> Travel:
        x, y = self.axis
        return Travel(travel_on_line(frame(self.first), frame(self.second), (-y, x)).travel)

    def force(self, frame: Resolve, multipliers: Sequence[Form]) -> Vector:
        """Return −λ n, and −λ along the line of friction, whose multiplier is the last one."""
        normals = across(frame(self.second), self.axis)
        pairs = zip(multipliers, normals, strict=False)
        force = reduce(add, (scale(-multiplier, normal) for multiplier, normal in pairs))
        if self.friction is None:
            return force
        return add(force, scale(-multipliers[-1], along(frame(self.second), self.axis)))


@frozen()
class Revolute(PairJoint):
    """A pin: the two points coincide or, with clearance, the pin moves in its hole.

    Parameters
    ----------
    first, second : the points, with clearance the centres of the pin and of the hole.
    clearance : radius of the hole less that of the pin [m], or None if there is none.
    law : the normal law of the contact of pin and hole, see `contact`.
    radius : of the pin [m]: without friction it matters for drawings alone.
    friction : `contact.Coulomb` or µ, or None for none. Without clearance, the moment of friction
        is r R sin(arctan µ) with the radius r and the resultant R of the reaction.
    offset : from the first point to the pin, in the axes of the first body [m]: a pair of numbers,
        such as the value of a `Play`.

    Raises
    ------
    InputError
        If the clearance or the radius is not positive, there is one of clearance and law only,
        friction without a radius, or an offset that is no pair, or beside a clearance.
    """

    first: PointName
    second: PointName
    clearance: ArrayLike | None = None
    law: NormalLaw | None = None
    radius: ArrayLike = 0.0
    friction: Friction | None = None
    offset: Offset = (0.0, 0.0)

    def __post_init__(self) -> None:
        _check_clearance("Revolute", self.clearance, self.law)
        _check_offset("Revolute", self.offset, self.clearance)
        check_non_negative("Revolute radius [m]", self.radius)
        if self.friction is not None:
            as_coulomb("Revolute friction", self.friction)
            check_positive("Revolute radius [m], with friction,", self.radius)

    def contacts(self, frame: Resolve) -> list[PairContact]:
        if self.clearance is None or self.law is None:
            return []
        points = map(frame, self.points)
        radius = np.asarray(self.radius, dtype=float)
        friction = friction_entry(self.friction, partial(travel_on_circle, *points, -radius))
        return [
            pair_contact(gap_in_circle, self.law, self.clearance, self.radius, friction=friction)
        ]

    def frictions(self, frame: Resolve) -> list[FrictionEntry]:
        if self.friction is None or self.clearance is not None:
            return []
        return [
            FrictionEntry(
                Travel(turn(frame(self.first), frame(self.second))),
                self.friction,
                lambda multipliers: [(multipliers[0], multipliers[1])],
                lever=self.radius,
                factor=lambda mu: np.sin(np.arctan(mu)),
                angular=True,
            )
        ]

    def constraints(self, frame: Resolve) -> list[Form]:
        """Return r_first − r_second, nothing with clearance."""
        if self.clearance is not None:
            return []
        first = frame(self.first)
        second = frame(self.second)
        return meet(self._pin(frame), second) + parallel(first, second)

    def _pin(self, frame: Resolve) -> Frame:
        return frame(self.first).translate(*checked_offset("Revolute offset [m]", self.offset))

    def held(self, frame: Resolve) -> list[Held]:
        return held_place(self._pin(frame), frame(self.second))

    def force(self, frame: Resolve, multipliers: Sequence[Form]) -> Vector:
        return _meeting_force(frame(self.first), multipliers)

    def moment(self, multipliers: Sequence[Form]) -> Form | None:
        """Return −λ of the friction."""
        return None if self.friction is None else -multipliers[2]


def _check_clearance(name: str, clearance: ArrayLike | None, law: NormalLaw | None) -> None:
    """Raise `InputError` if a clearance is not positive, or only one of both is given."""
    if (clearance is None) != (law is None):
        argument = "clearance" if law is None else "law"
        raise InputError(
            f"{name} needs both of clearance and law, or none of them; got {argument} alone"
        )
    if clearance is not None:
        check_positive(f"{name} clearance [m]", clearance)
        check_law(f"{name} law", law)


def _check_offset(name: str, offset: Offset, clearance: ArrayLike | None) -> None:
    """Raise `InputError` if an offset is no pair, or beside a clearance, which leaves it free."""
    numbers = checked_offset(f"{name} offset", offset)
    if clearance is not None and any(np.any(number != 0) for number in numbers):
        raise InputError(f"{name} needs one of clearance and offset; got both")


def _meeting_force(first: Frame, multipliers: Sequence[Form]) -> Vector:
    """Return −λ of the rows of `meet`."""
    return tuple(-multiplier for multiplier in multipliers[: len(first.position)])


def _unit(angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.cos(angle), np.sin(angle)


@frozen()
class Weld(AlignedJoint):
    """A clamp: the points coincide, and the sections there keep the angle between them.

    Parameters
    ----------
    first, second : the points.
    angle : from the normal of the second section (the x axis of a rigid body) to the normal of the
        first one [rad].
    axis : whether the axes of the two bodies keep their angle as well, and not only the sections.
        This is the built-in end of the literature on these elements: it forbids shear there, which
        matters on coarse meshes only. At least one of the points must belong to a beam.

    Raises
    ------
    InputError
        If the angle is not finite.
    """

    first: PointName
    second: PointName
    angle: ArrayLike = 0.0
    axis: bool = False

    def __post_init__(self) -> None:
        check_angle("Weld angle", self.angle)
        check_flag("Weld axis", self.axis)

    def constraints(self, frame: Resolve) -> list[Form]:
        """Return r_first − r_second and the sines of the angles of sections and axes."""
        first = frame(self.first)
        second = frame(self.second)
        rows = [*meet(first, second), *parallel(first, second), self._misalignment(frame)[0]]
        return [*rows, cross(rotate(second.x, self.angle), first.x)] if self.axis else rows

    def held(self, frame: Resolve) -> list[Held]:
        """Return the place and the angle between the sections; `axis` is of no effect."""
        first = frame(self.first)
        second = frame(self.second)
        return [*held_place(first, second), held_turn(first, second, self._turn)]

    def force(self, frame: Resolve, multipliers: Sequence[Form]) -> Vector:
        return _meeting_force(frame(self.first), multipliers)

    def moments(self, frame: Resolve, multipliers: Sequence[Form]) -> list[Couple]:
        """Return the moments of the angle between the sections, and of that between the axes."""
        first = frame(self.first)
        second = frame(self.second)
        normals = (section_normal(end) for end in (first, second))
        couples = [couple(multipliers[2], *zip((first, second), normals, strict=True))]
        if self.axis:
            couples.append(couple(multipliers[3], (first, first.x), (second, second.x)))
        return couples


@frozen()
class Prismatic(LineJoint, AlignedJoint):
    """A slide: the first point stays on a line, and its body does not rotate against the other.

    Parameters
    ----------
    first : the point that slides.
    second : a point of the line, on a rigid body or the ground.
    axis : direction of the line in the axes of the second body; any length but zero.
    angle : from the axes of the second body to those of the first [rad].
    clearance : on each side of a slider between two walls [m], or None if there is none. The
        corners of the slider then meet the walls, and it may rotate until they do.
    length, height : of the slider [m] along the line and across it, its middle being the first
        point. With clearance or friction the length must be given.
    law : the normal law of the contacts, see `contact`.
    friction : `contact.Coulomb` or µ, or None for none. Without clearance the normal forces are
        |N/2 ± M/ℓ| at the ends of the slider, with the force N across the line, the moment M and
        the length ℓ.
    offset : of the slider to the left of the axis [m], and the angle that it turns further [rad]: a
        pair of numbers, such as the value of a `GuidePlay`.

    Raises
    ------
    InputError
        If the axis has no length, a number is out of its range, there are not both of clearance and
        law, or no length where it is needed, the offset is no pair or beside a clearance and, when
        the mechanism is made, if the line or a slider with friction is on a flexible member.
    """

    first: PointName
    second: PointName
    axis: tuple[float, float] = (1.0, 0.0)
    angle: ArrayLike = 0.0
    clearance: ArrayLike | None = None
    length: ArrayLike | None = None
    height: ArrayLike = 0.0
    law: NormalLaw | None = None
    friction: Friction | None = None
    offset: Offset = (0.0, 0.0)

    def __post_init__(self) -> None:
        check_axis("Prismatic axis", self.axis)
        _check_offset("Prismatic", self.offset, self.clearance)
        check_angle("Prismatic angle", self.angle)
        _check_clearance("Prismatic", self.clearance, self.law)
        check_non_negative("Prismatic height [m]", self.height)
        if self.length is not None:
            check_positive("Prismatic length [m]", self.length)
        if self.friction is not None:
            as_coulomb("Prismatic friction", self.friction)
        if self.friction is not None and self.length is None:
            raise InputError("Prismatic with friction needs the length of the slider; got none")
        if self.friction is None and (self.length is None) != (self.clearance is None):
            raise InputError("Prismatic needs both of clearance and length, or none of them")

    def contacts(self, frame: Resolve) -> list[PairContact]:
        """Return those of the corners, two with each wall."""
        if self.clearance is None or self.law is None or self.length is None:
            return []
        straight("Prismatic", frame(self.second))
        half = 0.5 * np.asarray(self.length)
        side = 0.5 * np.asarray(self.height)
        x, y = self.axis
        turn = math.atan2(y, x) - np.asarray(self.angle)
        along = _unit(turn)
        across = _unit(turn + math.pi / 2)
        contacts = []
        # Each corner touches the wall on its side.
        for end, wall in product((-1.0, 1.0), repeat=2):
            normal = wall * y, -wall * x
            centre_x, centre_y = (
                end * half * a + wall * side * b for a, b in zip(along, across, strict=True)
            )
            height = -(side + np.asarray(self.clearance))
            numbers = line_parameters(normal, centre=(centre_x, centre_y), height=height)
            corner = frame(self.first).translate(centre_x, centre_y)
            lever = subtract(corner.position, frame(self.first).position)
            travel = partial(
                travel_on_line, corner, frame(self.second), normal, lever=lever, height=height
            )
            friction = friction_entry(self.friction, travel)
            contacts.append(pair_contact(gap_above_line, self.law, *numbers, friction=friction))
        return contacts

    def frictions(self, frame: Resolve) -> list[FrictionEntry]:
        if self.friction is None or self.clearance is not None or self.length is None:
            return []
        if not frame(self.first).rigid:
            raise InputError("Prismatic with friction must guide a rigid body")
        inverse = 1.0 / np.asarray(self.length, dtype=float)

        def ends(multipliers: Sequence[Form]) -> list[Vector]:
            half = multipliers[0] * 0.5
            couple = multipliers[1] * inverse
            return [(half + couple, Form({})), (half - couple, Form({}))]

        return [FrictionEntry(self._travel(frame), self.friction, ends, normals=2)]

    def conditions(self, frame: Resolve) -> list[Form]:
        """Return the cosine of the angle between the sections, nothing with clearance."""
        return super().conditions(frame) if self.clearance is None else []

    def constraints(self, frame: Resolve) -> list[Form]:
        """Return the row across the line and the sine of the angle, nothing with clearance."""
        if self.clearance is not None:
            return []
        first = frame(self.first)
        second = frame(self.second)
        rows = [row.travel for row in self._across(frame, self.offset[0])]
        return [*rows, *parallel(first, second, self.axis), self._misalignment(frame)[0]]

    def held(self, frame: Resolve) -> list[Held]:
        angle_row = held_turn(frame(self.first), frame(self.second), self._turn)
        return [*self._across(frame, self.offset[0]), angle_row]

    @property
    def _turn(self) -> np.ndarray:
        return np.asarray(self.angle) + np.asarray(self.offset[1])

    def force(self, frame: Resolve, multipliers: Sequence[Form]) -> Vector:
        """Return −λ n and friction along the line, or the sum of the forces of the contacts."""
        if self.clearance is not None:
            return -multipliers[0], -multipliers[1]
        return super().force(frame, multipliers)

    def moments(self, frame: Resolve, multipliers: Sequence[Form]) -> list[Couple]:
        """Return −λ of the angle, times the length of the slider's normal."""
        if self.clearance is not None:
            return [(-multipliers[2], [])]
        slider = frame(self.first)
        return [couple(multipliers[1], (slider, section_normal(slider)))]


@frozen()
class Slot(LineJoint, HoldingJoint):
    """A pin in a straight slot: the first point stays on a line, its body may rotate.

    Parameters
    ----------
    first : the pin.
    second : a point of the slot's line, on a rigid body or the ground.
    axis : direction of the line in the axes of the second body; any length but zero.
    friction : `contact.Coulomb` or µ against the reaction, or None for none.
    offset : of the pin to the left of the axis [m]: one number, since the body may rotate. An
        ``Interval(-c, c)`` is the play of the pin.

    Raises
    ------
    InputError
        If the axis has no length, friction is negative, the offset is not finite and, when the
        mechanism is made, if the line is on a flexible member.
    """

    first: PointName
    second: PointName
    axis: tuple[float, float] = (1.0, 0.0)
    friction: Friction | None = None
    offset: ArrayLike = 0.0

    def __post_init__(self) -> None:
        check_axis("Slot axis", self.axis)
        check_finite("Slot offset [m]", self.offset)
        if self.friction is not None:
            as_coulomb("Slot friction", self.friction)

    def frictions(self, frame: Resolve) -> list[FrictionEntry]:
        if self.friction is None:
            return []
        along = self._travel(frame)
        return [FrictionEntry(along, self.friction, lambda m: [(m[0], Form({}))])]

    def held(self, frame: Resolve) -> list[Held]:
        return self._across(frame, self.offset)


@frozen()
class Distance(PairJoint, HoldingJoint):
    """A rigid rod without mass between two points, or a cylinder whose stroke is prescribed.

    Parameters
    ----------
    first, second : the points.
    length : of the rod, or of the cylinder as a function of the time [s]; in m.

    Raises
    ------
    InputError
        If the length is not positive, for a cylinder at any time.
    """

    first: PointName
    second: PointName
    length: ArrayLike | TimeFunction

    def __post_init__(self) -> None:
        if not callable(self.length):
            check_positive("Distance length [m]", self.length)

    def _length(self, outer: Callable[[np.ndarray], np.ndarray]) -> Form:
        """Return a function of the length."""
        if callable(self.length):
            return Form.function(Composed(outer, self.length, "Distance length [m]"))
        return Form.constant(outer(np.asarray(self.length, dtype=float)))

    def rods(self, frame: Resolve) -> list[Vector]:
        """Return d = r_first − r_second."""
        return [subtract(frame(self.first).position, frame(self.second).position)]

    def held(self, frame: Resolve) -> list[Held]:
        """Return (d · d − ℓ²)/2ℓ with d = r_first − r_second; λ is then the force in the rod."""
        (separation,) = self.rods(frame)
        length = self._length(np.asarray)
        inverse = self._length(_inverse)
        return [
            Held((dot(separation, separation) * inverse - length) * 0.5, scale(inverse, separation))
        ]


def _inverse(length: np.ndarray) -> np.ndarray:
    """Return 1/ℓ; raise `InputError` if ℓ is not positive."""
    return 1.0 / check_positive("Distance length [m]", length, rank=None)
