"""The interface of loads: the points that a load names, and what it enters in the equations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple, Protocol, runtime_checkable

from numpy.typing import ArrayLike

from flexband.basics.checks import check_finite
from flexband.errors import InputError
from flexband.mechanics.bodies.centre_line import CentreLine
from flexband.mechanics.bodies.properties import Property
from flexband.mechanics.contact.friction import FrictionEntry
from flexband.mechanics.joints.joint import PointName
from flexband.mechanics.kernels.forms import (
    Form,
    Frame,
    GeneralizedForce,
    Polar,
    TimeFunction,
    Vector,
)
from flexband.mechanics.kernels.laws.forces import GAP
from flexband.mechanics.loads.characteristic import Characteristic
from flexband.mechanics.loads.law_shape import Law, LawShape

InTime = ArrayLike | TimeFunction
"""A number, an array of shape (n,), or a function of the time [s] that returns one of these."""


class LoadModel(Protocol):
    """The methods of a mechanism's `model` that loads use; they are documented there."""

    def frame(self, point: PointName) -> Frame: ...
    def line_load(self, body: str, x: Property, y: Property) -> GeneralizedForce: ...
    def law_state(self, load: str, name: str) -> Form: ...
    def spring(self, name: str, *, torsion: bool) -> tuple[Form, Form]: ...
    def member(self, name: str) -> tuple[CentreLine, int]: ...
    def weight(self, *components: ArrayLike) -> GeneralizedForce: ...


class SpringEntry(NamedTuple):
    """A spring, damper and actuator along an elongation s, see `kernels.springs`.

    s is the length of a linear vector, or at most quadratic in the coordinates with angles of
    vectors.
    """

    elongation: Form  # s [m] or [rad]
    stiffness: ArrayLike  # k
    rest: ArrayLike | None  # s₀, or None if the spring is relaxed at the start
    cubic: ArrayLike  # k₃
    damping: ArrayLike  # d
    pull: Form  # f(t), an additional tension: one term c f(t), or none
    table: Characteristic | None = None  # g(x, ṡ), by which f(t) is multiplied
    angular: bool = False  # whether s is an angle

    @property
    def line(self) -> Vector | None:
        """The vector of which s is the length, if it is one: of a translational spring."""
        (first, *others) = self.elongation.polar or (None,)
        alone = first is not None and first.length and not (others or self.elongation.terms)
        return first.vector if first is not None and alone else None

    @property
    def angles(self) -> Sequence[Polar]:
        """The angles in s."""
        return () if self.line is not None else self.elongation.polar

    @property
    def polynomial(self) -> Form:
        """The rest of s."""
        return Form(self.elongation.terms)


class LawEntry(NamedTuple):
    """A force law, see `kernels.laws.forces`.

    A line has two numbers of points, and 0 for the line between them or 1 for the place of the
    first one in the axes of the second one's body.
    """

    points: Sequence[Frame]  # that the law reads and acts on
    law: Law  # the user's function, see `compiled_laws`
    parameters: Sequence[InTime]
    states: Mapping[str, ArrayLike] = MappingProxyType({})  # at the start, or "steady"
    lines: Sequence[tuple[int, int, int]] = ()  # that it reads and acts on
    events: Sequence[str] = ()  # names of its gaps, whose zeros are events
    gap_kind: int = GAP.event  # of all its gaps, those of contacts have forces
    closed_at_start: bool = False  # whether contacts may be so

    @property
    def is_contact(self) -> bool:
        """Whether its gaps are those of contacts."""
        return self.gap_kind != GAP.event

    @property
    def is_angular(self) -> bool:
        """Whether its gaps are angles."""
        return self.gap_kind == GAP.angle

    @property
    def shape(self) -> LawShape:
        """The sizes of what the law takes."""
        sizes = len(self.points), len(self.parameters), len(self.states), len(self.events)
        return LawShape(*sizes, tuple(self.lines), contact=self.is_contact)


class FreeStrainEntry(NamedTuple):
    """Strains of a member without stress, Σ c f(t): of each element its first `element_strains`.

    They are axial strains at the places `AXIAL`, and then the two of bending, see
    `bodies.assumed_strains.bent`.
    """

    member: str
    strains: Sequence[Sequence[Form]]


class MomentEntry(NamedTuple):
    """A moment [N m] on the angle of a vector that is linear in the coordinates."""

    direction: Vector
    moment: Form


class FollowingEntry(NamedTuple):
    """A force that turns with a body."""

    position: Vector  # where it acts
    direction: Vector  # linear in the coordinates, of any length
    along: Form  # component along the direction [N]
    across: Form  # component along the direction turned by 90° [N]


@dataclass(frozen=True)
class Entries:
    """What a load enters in the equations of motion."""

    forces: GeneralizedForce = field(default_factory=dict)
    potential: Form = field(default_factory=lambda: Form({}))  # [J], that `forces` derive from
    springs: Sequence[SpringEntry] = ()
    laws: Sequence[LawEntry] = ()
    frictions: Sequence[FrictionEntry] = ()
    strains: Sequence[FreeStrainEntry] = ()
    moments: Sequence[MomentEntry] = ()  # at points of flexible members
    following: Sequence[FollowingEntry] = ()  # at points of flexible members


@runtime_checkable
class Load(Protocol):
    """A load on a mechanism: which points it names, and what it enters."""

    @property
    def points(self) -> Sequence[PointName]:
        """The points that the load names. A flexible member is divided where they are."""
        ...

    def enters(self, model: LoadModel) -> Entries:
        """Return what the load enters in the equations of motion."""
        ...


class PairLoad:
    """A load between two points."""

    first: PointName
    second: PointName

    @property
    def points(self) -> Sequence[PointName]:
        return [self.first, self.second]

    @property
    def rest_turn(self) -> ArrayLike | None:
        """The angle of the first body less that of the second at rest [rad], if it has one."""
        return None


def in_time(name: str, value: InTime) -> Form:
    """Return a form; raise `InputError` for a value that is neither finite nor a function."""
    if isinstance(value, type):
        raise InputError(f"{name} must be finite numbers or a function of time; got {value!r}")
    return Form.function(value) if callable(value) else Form.constant(check_finite(name, value))
