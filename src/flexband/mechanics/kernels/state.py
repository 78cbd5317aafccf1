"""The state z of a mechanism: which of its rows holds what.

    z = [1, q, λ, θ | 0, v | 0, a | U | M | T | s | e | F | y | f | g | x]

z₀ = 1 makes constants and linear terms products of two rows, as quadratic terms are. q are the
coordinates, λ the Lagrange multipliers, those of friction last, and θ the angles and lengths of
vectors, which follow from q, those that sensors alone read last; v and a are the velocities and
accelerations of q. U is the elastic energy, M what acts on each angle or length, T the tension of
each spring and s its elongation: the length of a translational spring, the angle of a torsion
spring. e are the unit vectors along which following forces act, and F the forces and moments of
force laws, which are set where a sensor reads them. y are the first-order states of force laws and
what integrates them, see `kernels.laws.states`. f is what friction depends on, see
`kernels.friction.rows`. g are the gaps of force laws whose zeros are events, and the margins of
friction, with their rates, modes and more, see `GapRows`. x are extremes and integrals over the
steps of a run, see `kernels.extremes`.
Everything that reads the state (forms, sensors, kernels) finds its rows here.
"""

from __future__ import annotations

from itertools import accumulate
from typing import NamedTuple

from flexband.mechanics.kernels.lanes import compiled

GAP_ROWS = 7
"""Rows of a gap, see `GapRows`."""

STATE_ROWS = 5
"""Rows of a first-order state of a law, see `kernels.laws.states`."""

FRICTION_ROWS = 8
"""Rows of a friction, see `StickSlipRows`. Those of all frictions are followed by
those of joints, see `ReactionRows`, and by components of normal forces."""


class State(NamedTuple):
    """The number of coordinates, and the row of z where each part starts.

    Coordinate q_i is in row i = 1 … `coordinates`, its rate in row `velocity` + i, its second rate
    in row `acceleration` + i.
    """

    coordinates: int
    multiplier: int
    friction: int  # first multiplier of friction
    angle: int
    sensor_angle: int  # first angle that sensors alone read
    velocity: int
    acceleration: int
    energy: int
    moment: int
    tension: int
    elongation: int
    direction: int
    law: int
    law_state: int
    rule: int
    sliding: int
    gap: int
    extreme: int
    rows: int

    @staticmethod
    def from_counts(
        *,
        coordinates: int,
        multipliers: int,
        frictions: int,
        angles: int,
        sensor_angles: int,
        springs: int,
        directions: int,
        poses: int,
        law_states: int,
        components: int,
        gaps: int,
    ) -> State:
        """Return the rows of a mechanism with so many coordinates, multipliers, … .

        `directions` and `poses` are the numbers of components of following forces and of what force
        laws do on points, `law_states` and `gaps` those of their states and gaps, and `components`
        that of components of the normal forces of friction.
        """
        q_rows = 1 + coordinates  # rows of 1 and q, of 0 and v, and of 0 and a
        parts = (q_rows, multipliers, frictions, angles, sensor_angles, q_rows, q_rows, 1, angles)
        parts = (*parts, springs, springs, directions, poses)
        parts = (*parts, STATE_ROWS * law_states, 3 * (law_states > 0))
        carried = 3 * multipliers + 1 if frictions else 0
        parts = (*parts, FRICTION_ROWS * frictions + carried + components)
        parts = (*parts, GAP_ROWS * (gaps + frictions), 0)
        return State(coordinates, *accumulate(parts))

    def with_extremes(self, count: int) -> State:
        """Return the rows with those of so many extremes and integrals."""
        return self._replace(rows=self.extreme + 2 * count)


class StickSlipRows(NamedTuple):
    """The number of frictions, and the first row of each of their `FRICTION_ROWS`."""

    frictions: int
    mode: int
    anchor: int
    speed: int
    normal: int
    distance: int  # |d| of circles; of a joint that switches, the energy that it has taken
    turn: int  # φ₀ of circles; in an impact, the sliding speed before it
    change: int  # last change of its impulse in the search for an impact
    work: int  # of its impulses so far on the mechanism [J]


@compiled
def friction_rows(state):
    """Return the `StickSlipRows`."""
    n = state.angle - state.friction
    first = state.sliding
    return StickSlipRows(
        n, first, first + n, first + 2 * n, first + 3 * n, first + 4 * n, first + 5 * n,
        first + 6 * n, first + 7 * n,
    )  # fmt: skip


class ReactionRows(NamedTuple):
    """The number of multipliers of joints, and the first row of what friction has of each."""

    number: int
    reaction: int  # that friction follows, or an impulse
    largest: int  # of all reactions so far, one row
    change: int  # last one of a reaction
    work: int  # of the impulses of a joint so far on the mechanism [J]


@compiled
def reaction_rows(state):
    """Return the `ReactionRows`."""
    n = state.friction - state.multiplier
    first = state.sliding + FRICTION_ROWS * (state.angle - state.friction)
    return ReactionRows(n, first, first + n, first + n + 1, first + 2 * n + 1)


class GapRows(NamedTuple):
    """The number of gaps, and the first row of each of their `GAP_ROWS`."""

    number: int
    value: int  # g
    rate: int  # ġ
    mode: int  # its sign is that of g, held in a step; its size is |ġ| at the last event
    force: int  # of a contact along its gap
    loss: int  # power that it takes from the motion for ever [W]
    mass: int  # effective one of a contact [kg], [kg m²]; negative where an impact is over
    depth: int  # of a closed contact: the largest so far, or that of its impact [m], [rad]


@compiled
def rows_of_gaps(state):
    """Return the `GapRows`."""
    n = (state.extreme - state.gap) // GAP_ROWS
    first = state.gap
    return GapRows(
        n, first, first + n, first + 2 * n, first + 3 * n, first + 4 * n, first + 5 * n,
        first + 6 * n,
    )  # fmt: skip
