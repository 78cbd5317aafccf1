"""Rows of the state with the gaps of force laws, and with the margins of friction behind them."""

from __future__ import annotations

from typing import NamedTuple

from flexband.mechanics.kernels.lanes import compiled
from flexband.mechanics.kernels.state import GAP_ROWS


class GapRows(NamedTuple):
    """The number of gaps, and the first row of each of their `GAP_ROWS`."""

    count: int
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
    n, first = (state.extreme - state.gap) // GAP_ROWS, state.gap
    return GapRows(
        n, first, first + n, first + 2 * n, first + 3 * n, first + 4 * n, first + 5 * n,
        first + 6 * n,
    )  # fmt: skip
