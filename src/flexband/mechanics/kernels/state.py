"""The state z of a mechanism: which of its rows holds what.

    z = [1, q, λ, θ | 0, v | 0, a | U | M | T | s | e | F | y | f | g | x]

z₀ = 1 makes constants and linear terms products of two rows, as quadratic terms are. q are the
coordinates, λ the Lagrange multipliers, those of friction last, and θ the angles and lengths of
vectors, which follow from q; v and a are the velocities and accelerations of q. U is the elastic
energy, M what acts on each angle or length, T the tension of each spring and s its elongation: the
length of a translational spring, the angle of a torsion spring. e are the unit vectors along which
following forces act, and F the forces and moments of force laws, which are set where a sensor reads
them. y are the first-order states of force laws and what integrates them, see
`kernels.laws.states`. f is what friction depends on, see `kernels.friction`. g are the gaps of
force laws whose zeros are events, and the margins of friction, with their rates, modes and more,
see `kernels.laws.gap_rows`. x are extremes and integrals over the steps of a
run, see `kernels.extremes`.
Everything that reads the state (forms, sensors, kernels) finds its rows here.
"""

from __future__ import annotations

from itertools import accumulate
from typing import NamedTuple

GAP_ROWS = 7
"""Rows of a gap, see `kernels.laws.gap_rows`."""

FRICTION_ROWS = 8
"""Rows of a friction, see `kernels.friction.StickSlipRows`. Those of all frictions are followed by
those of joints, see `kernels.friction.ReactionRows`, and by components of normal forces."""


class State(NamedTuple):
    """The number of coordinates, and the row of z where each part starts.

    Coordinate q_i is in row i = 1 … `coordinates`, its rate in row `velocity` + i, its second rate
    in row `acceleration` + i.
    """

    coordinates: int
    multiplier: int
    friction: int  # first multiplier of friction
    angle: int
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
    def of(
        coordinates: int,
        multipliers: int,
        frictions: int,
        angles: int,
        springs: int,
        directions: int,
        points: int,
        law_states: int,
        components: int,
        gaps: int,
    ) -> State:
        """Return the rows of a mechanism with so many coordinates, multipliers, … .

        `points` is the number of points of force laws, `law_states` and `gaps` those of
        their states and gaps, and `components` that of components of the normal forces of friction.
        """
        each = 1 + coordinates  # rows of 1 and q, of 0 and v, and of 0 and a
        parts = (each, multipliers, frictions, angles, each, each, 1, angles, springs, springs)
        parts = (*parts, 2 * directions, 3 * points, 4 * law_states, 3 * (law_states > 0))
        carried = 3 * multipliers + 1 if frictions else 0
        parts = (*parts, FRICTION_ROWS * frictions + carried + components)
        parts = (*parts, GAP_ROWS * (gaps + frictions), 0)
        return State(coordinates, *accumulate(parts))

    def with_extremes(self, count: int) -> State:
        """Return the rows with those of so many extremes and integrals."""
        return self._replace(rows=self.extreme + 2 * count)
