"""Force laws: compiled functions of time, positions, velocities and parameters.

The engine calls a law through its address, so it need not be compiled again for a new law.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_finite, check_function, check_instance, check_non_negative
from flexband.basics.words import value_text
from flexband.compilation.functions import Deferred
from flexband.errors import InputError
from flexband.mechanics.joints.joint import PointName
from flexband.mechanics.loads.law_shape import Law
from flexband.mechanics.loads.lines import check_lines
from flexband.mechanics.loads.load import Entries, InTime, LawEntry, LoadModel, PairLoad, in_time

compiled_laws = Deferred("flexband.mechanics.loads.compiled_laws")


@frozen()
class ForceLaw:
    """Forces and moments on points by a user's function.

    Parameters
    ----------
    points : where the forces act. Points of the ground are allowed, so that the law can read them.
    law : ``law(t, x, v, p, force)``, a Python function that Numba can compile, or a compiled one.
        It receives the time [s], the positions and velocities of the points as arrays of shape
        (points, 3) with rows (X, Y, θ), and the parameters, shape (parameters,). It fills `force`,
        zeros of shape (points, 3), with rows (F_X, F_Y, M). On a beam, θ and M belong to the
        section. It is compiled anew when its code, or a number that it reads from outside, is
        new. A sample in which it raises an error, or forces are not finite, fails.
    parameters : numbers, arrays of shape (n,), or functions of the time [s].
    states : first-order states of the law, such as a pressure or the integral of an error: name ->
        value at the start, a number or an array of shape (n,), or "steady" where the state starts
        with no rate. The law is then ``law(t, x, v, s, p, force, rate)``: it also receives the
        states, shape (states,), in this order, and fills their `rate` ds/dt. They may be stiff:
        their rule is L-stable and of second order (Jansen, Whiting and Hulbert 2000). The sensor
        `LawState` reads them.
    between : pairs of numbers of points, such as ``[(0, 1)]``. The law reads one more row of `x`
        and `v` for each: (ℓ, 0, φ), the distance of the two points and the angle of the first less
        that of the second, with turns counted. In `force` the row is (F, 0, M): F pushes the points
        apart, M turns the first body, and the second one the other way.
    within : more such pairs. The row of x is (x, y, φ), the place of the first point in the axes of
        the second body; forces and M along these act on the first body, and back on the second.
    events : names of gaps, functions of what the law reads whose zeros are events, such as the
        place of a switch. The law takes two arguments more, ``law(…, mode, gap)``, shape (events,).
        It fills `gap`, and takes its sign from `mode`, 1.0 or -1.0, which is held while a step is
        taken. Steps then end where a gap changes its sign, within a thousandth of a step, and every
        sample chooses its steps, see `GeneralizedAlpha`.

    Raises
    ------
    InputError
        If there is no point, a parameter is neither finite nor a function of time, a state at the
        start is neither finite nor "steady", a number in `between` or `within` is not of a point,
        or the law does not compile, returns a value or calls itself.
    """

    points: Sequence[PointName]
    law: Law
    parameters: Sequence[InTime] = ()
    states: Mapping[str, ArrayLike] = field(default_factory=dict)
    between: Sequence[tuple[int, int]] = ()
    events: Sequence[str] = ()
    within: Sequence[tuple[int, int]] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.points, list | tuple) or not self.points:
            raise InputError(
                f"ForceLaw points must be a list of points; got {value_text(self.points)}"
            )
        if not isinstance(self.parameters, list | tuple | np.ndarray) or not np.iterable(
            self.parameters
        ):
            text = value_text(self.parameters)
            raise InputError(f"ForceLaw parameters must be a list of numbers; got {text}")
        for k, value in enumerate(self.parameters):
            in_time(f"ForceLaw parameter {k}", value)
        check_function("ForceLaw law", self.law)
        _check_states(self.states)
        check_lines("between", self.between, len(self.points))
        check_lines("within", self.within, len(self.points))
        _check_events(self.events)
        compiled_laws.compiled_law(self.law, self._entry([None] * len(self.points)).shape)

    def enters(self, model: LoadModel) -> Entries:
        return Entries(laws=[self._entry([model.frame(point) for point in self.points])])

    def _entry(self, frames: Sequence[Any]) -> LawEntry:
        lines = [(i, j, kind) for kind in (0, 1) for i, j in (self.between, self.within)[kind]]
        return LawEntry(frames, self.law, self.parameters, self.states, lines, self.events)


def _check_states(states: Mapping[str, ArrayLike]) -> None:
    """Raise `InputError` if these are not names of states with values at the start."""
    check_instance(
        "ForceLaw states", states, Mapping, "a mapping from names to values at the start"
    )
    for name, value in states.items():
        if not isinstance(name, str) or not name:
            raise InputError(f"the name of a state must be non-empty text; got {value_text(name)}")
        if not isinstance(value, str) or value != "steady":
            check_finite(f"ForceLaw state {name!r}", value, 'finite numbers or "steady"')


def _check_events(events: Sequence[str]) -> None:
    """Raise `InputError` if these are not different names."""
    names = events if isinstance(events, list | tuple) else [None]
    if not all(isinstance(name, str) and name for name in names) or len({*names}) < len(names):
        raise InputError(
            f"ForceLaw events must be a list of different names; got {value_text(events)}"
        )


@frozen()
class ViscousFriction(PairLoad):
    """Friction in proportion to the relative velocity of two points, as in a guide.

    The force on the first is −d (ṙ_first − ṙ_second), on the second the opposite, with the damping
    d [N s/m]. The friction of a pin, which rotates, is a `TorsionSpring` with damping alone.

    Raises
    ------
    InputError
        If the damping is negative.
    """

    first: PointName
    second: PointName
    damping: ArrayLike

    def __post_init__(self) -> None:
        check_non_negative("ViscousFriction damping [N s/m]", self.damping)

    def enters(self, model: LoadModel) -> Entries:
        return ForceLaw(self.points, drag, (self.damping,)).enters(model)


def drag(t, x, v, p, force):
    """Fill in the forces of a `ViscousFriction`."""
    for axis in range(2):
        force[0, axis] = -p[0] * (v[0, axis] - v[1, axis])
        force[1, axis] = -force[0, axis]
