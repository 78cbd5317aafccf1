"""Springs, dampers and actuators between two points, along their distance or their angle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, cast

from numpy.typing import ArrayLike

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_angle, check_finite, check_non_negative
from flexband.errors import InputError
from flexband.mechanics.joints.joint import Compliance, PointName
from flexband.mechanics.kernels.forms import Form, angle, length, moves, section_normal, subtract
from flexband.mechanics.loads.characteristic import Characteristic
from flexband.mechanics.loads.load import Entries, InTime, LoadModel, PairLoad, SpringEntry, in_time

Drive = InTime | Characteristic
"""A force in time, or over elongation and speed."""


def spring_entries(compliances: Sequence[Compliance]) -> Entries:
    """Return the springs of a joint that gives, T = k (s − s(t)) + d ṡ."""
    springs = []
    for travel, stiffness, damping, angular, relaxed in compliances:
        terms = travel.terms.items()
        elongation = Form({key: c for key, c in terms if key[2] is None}, travel.polar)
        driven = Form({key: c for key, c in terms if key[2] is not None})
        rest = None if relaxed else 0.0
        numbers = (stiffness, rest, 0.0, damping, driven * stiffness)
        springs.append(SpringEntry(elongation, *numbers, angular=angular))
    return Entries(springs=springs)


class SpringLoad(PairLoad):
    """A spring, damper and actuator."""

    stiffness: ArrayLike
    cubic: ArrayLike
    damping: ArrayLike
    units: ClassVar[tuple[str, str, str]]  # of the three above

    def __post_init__(self) -> None:
        kind, (stiffness, cubic, damping) = type(self).__name__, self.units
        check_non_negative(f"{kind} stiffness [{stiffness}]", self.stiffness)
        check_finite(f"{kind} cubic [{cubic}]", self.cubic)
        check_non_negative(f"{kind} damping [{damping}]", self.damping)

    def _along(
        self, elongation: Form, rest: ArrayLike | None, drive: Drive, *, angular: bool = False
    ) -> Entries:
        pull, table = _pull_and_table("pull", drive)
        numbers = (self.stiffness, rest, self.cubic, self.damping, -pull if angular else pull)
        return Entries(springs=[SpringEntry(elongation, *numbers, table, angular)])


def _pull_and_table(name: str, drive: Drive) -> tuple[Form, Characteristic | None]:
    if isinstance(drive, Characteristic):
        return in_time(name, drive.factor), drive
    return in_time(name, cast(InTime, drive)), None


@frozen()
class Spring(SpringLoad):
    """A translational spring, damper and actuator between two points.

    It pulls with the force k (ℓ − ℓ₀) + k₃ (ℓ − ℓ₀)³ + d ℓ̇ + f(t) along its line.

    Parameters
    ----------
    first, second : the points that it joins.
    stiffness : k [N/m].
    rest_length : ℓ₀ [m], or None for a spring that is relaxed at the start, after assembly.
    cubic : k₃ [N/m³].
    damping : d [N s/m].
    pull : f [N], positive if it draws the points together; also a `Characteristic` over ℓ − ℓ₀ and
        its rate, a spring, damper or actuator from a table.

    Raises
    ------
    InputError
        If the stiffness, rest length or damping is negative, or a number is not finite.
    """

    first: PointName
    second: PointName
    stiffness: ArrayLike = 0.0
    rest_length: ArrayLike | None = None
    cubic: ArrayLike = 0.0
    damping: ArrayLike = 0.0
    pull: Drive = 0.0

    units = ("N/m", "N/m³", "N s/m")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.rest_length is not None:
            check_non_negative("Spring rest_length [m]", self.rest_length)
        _pull_and_table("Spring pull [N]", self.pull)

    def enters(self, model: LoadModel) -> Entries:
        separation = subtract(model.frame(self.first).position, model.frame(self.second).position)
        return self._along(length(separation), self.rest_length, self.pull)


@frozen()
class TorsionSpring(SpringLoad):
    """A spring, damper and actuator that turns two bodies, or a body and the ground.

    It exerts the moment −(k (φ − φ₀) + k₃ (φ − φ₀)³ + d φ̇) + T(t) on the first body and the
    opposite moment on the second, where φ is the angle of the first less that of the second, each
    counted from the `angle` that its body is given. On a
    beam it acts on the section.

    Parameters
    ----------
    first, second : points of the bodies; the second one is the ground if it is not given.
    stiffness : k [N m/rad].
    rest_angle : φ₀ [rad], or None for a spring that is relaxed at the start, after assembly.
    cubic : k₃ [N m/rad³].
    damping : d [N m s/rad]; alone it is the viscous friction of a pin.
    torque : T [N m], a motor between the two; also a `Characteristic` over φ − φ₀ and φ̇.

    Raises
    ------
    InputError
        If the stiffness or damping is negative, or a number is not finite.
    """

    first: PointName
    second: PointName = (0.0, 0.0)
    stiffness: ArrayLike = 0.0
    rest_angle: ArrayLike | None = None
    cubic: ArrayLike = 0.0
    damping: ArrayLike = 0.0
    torque: Drive = 0.0

    units = ("N m/rad", "N m/rad³", "N m s/rad")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.rest_angle is not None:
            check_angle("TorsionSpring rest_angle", self.rest_angle, turns=4.0)
        _pull_and_table("TorsionSpring torque [N m]", self.torque)

    @property
    def rest_turn(self) -> ArrayLike | None:
        return self.rest_angle

    def enters(self, model: LoadModel) -> Entries:
        first, second = (section_normal(model.frame(point)) for point in self.points)
        if not (moves(first) or moves(second)):
            raise InputError("a TorsionSpring must join a body that rotates")
        turn = angle(first) - angle(second)
        return self._along(turn, self.rest_angle, self.torque, angular=True)
