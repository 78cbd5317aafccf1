"""The interface of loads: the points that a load names, and what it enters in the equations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple, Protocol, runtime_checkable

from numpy.typing import ArrayLike

from flexband.errors import InputError, check_finite
from flexband.mechanics.bodies.centre_line import CentreLine
from flexband.mechanics.bodies.properties import Property
from flexband.mechanics.contact.friction import FrictionEntry
from flexband.mechanics.joints.joint import PointName
from flexband.mechanics.kernels.forms import Form, Frame, GeneralizedForce, TimeFunction, Vector
from flexband.mechanics.kernels.laws.forces import GAP
from flexband.mechanics.loads.characteristic import Characteristic
from flexband.mechanics.loads.law_shape import Law, LawShape

InTime = ArrayLike | TimeFunction
"""A number, an array of shape (n,), or a function of the time [s] that returns one of these."""


class LoadModel(Protocol):
    """The methods of `Mechanism` that loads use; they are documented there."""

    def frame(self, point: PointName) -> Frame: ...
    def line_load(self, body: str, x: Property, y: Property) -> GeneralizedForce: ...
    def law_state(self, load: str, name: str) -> Form: ...
    def spring(self, name: str, *, torsion: bool) -> tuple[Form, Form]: ...
    def member(self, name: str) -> tuple[CentreLine, int]: ...
    def weight(self, x: ArrayLike, y: ArrayLike) -> GeneralizedForce: ...


class SpringEntry(NamedTuple):
    """A spring, damper and actuator along an elongation s, see `kernels.springs`.

    Attributes
    ----------
    vectors : of a translational spring one vector, whose length is s [m]; of a torsion spring two
        directions, the angle of the first less that of the second being s [rad].
    stiffness, cubic, damping : k, k₃ and d.
    rest : s₀, or None if the spring is relaxed at the start.
    pull : f(t), an additional tension: one term c f(t), or none.
    table : g(x, ṡ), by which f(t) is multiplied, or None.
    """

    vectors: Sequence[Vector]
    stiffness: ArrayLike
    rest: ArrayLike | None
    cubic: ArrayLike
    damping: ArrayLike
    pull: Form
    table: Characteristic | None = None

    @property
    def torsion(self) -> bool:
        """Whether it is a torsion spring."""
        return len(self.vectors) > 1


class LawEntry(NamedTuple):
    """A force law, see `kernels.laws.forces`.

    Attributes
    ----------
    points : the frames that the law reads and acts on.
    law : the user's function, see `compiled_laws`.
    parameters : numbers, arrays of shape (n,), or functions of the time [s].
    states : its first-order states at the start by name, or "steady" where their rates vanish.
    lines : that it reads and acts on: two numbers of points, and 0 for the line between them or 1
        for the place of the first one in the axes of the second one's body.
    events : the names of its gaps, whose zeros are events.
    gap_kind : what these are of, see `kernels.laws.forces`. Gaps of contacts have forces.
    closed_at_start : whether contacts may be closed at the start.
    """

    points: Sequence[Frame]
    law: Law
    parameters: Sequence[InTime]
    states: Mapping[str, ArrayLike] = MappingProxyType({})
    lines: Sequence[tuple[int, int, int]] = ()
    events: Sequence[str] = ()
    gap_kind: int = GAP.event
    closed_at_start: bool = False

    @property
    def shape(self) -> LawShape:
        """The sizes of what the law takes."""
        sizes = len(self.points), len(self.parameters), len(self.states), len(self.events)
        return LawShape(*sizes, tuple(self.lines), contact=self.gap_kind != GAP.event)


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
    """A force that turns with a body.

    Attributes
    ----------
    position : where it acts.
    direction : a vector that is linear in the coordinates, of any length.
    along, across : components [N] along this vector, and along this vector turned by 90°.
    """

    position: Vector
    direction: Vector
    along: Form
    across: Form


@dataclass(frozen=True)
class Entries:
    """What a load enters in the equations of motion.

    Attributes
    ----------
    forces : generalized forces that are forms of the state.
    potential : the potential energy [J] that `forces` derive from, zero if they derive from none.
    springs, laws, frictions : entries of the engine's springs, force laws and friction.
    strains : free strains of members.
    moments, following : moments and following forces at points of flexible members.
    """

    forces: GeneralizedForce = field(default_factory=dict)
    potential: Form = field(default_factory=lambda: Form({}))
    springs: Sequence[SpringEntry] = ()
    laws: Sequence[LawEntry] = ()
    frictions: Sequence[FrictionEntry] = ()
    strains: Sequence[FreeStrainEntry] = ()
    moments: Sequence[MomentEntry] = ()
    following: Sequence[FollowingEntry] = ()


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


def in_time(name: str, value: InTime) -> Form:
    """Return a form; raise `InputError` for a value that is neither finite nor a function."""
    if isinstance(value, type):
        raise InputError(f"{name} must be finite numbers or a function of time; got {value!r}")
    return Form.function(value) if callable(value) else Form.constant(check_finite(name, value))
