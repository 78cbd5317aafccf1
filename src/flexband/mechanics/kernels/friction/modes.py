"""Modes of friction, on lanes: the sign of the sliding speed, or one of these."""

from __future__ import annotations

from typing import NamedTuple

from flexband.mechanics.kernels.lanes import compiled, less, load, splat


class Modes(NamedTuple):
    """Modes of friction that are not the sign of a sliding speed."""

    inactive: float = 0.0
    sticks: float = 2.0


MODE = Modes()


@compiled
def sticks(state, z, k):
    """Return the mask of the lanes in which friction k sticks."""
    return less(splat(0.5 * (1.0 + MODE.sticks)), load(z, state.sliding + k))
