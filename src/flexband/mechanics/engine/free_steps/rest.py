"""What counts as rest where surfaces slide, on lanes."""

from __future__ import annotations

from typing import NamedTuple

from flexband.mechanics.kernels.lanes import compiled, load, splat


class StickOptions(NamedTuple):
    """How sticking and sliding are told from each other."""

    speed: float = 1e-3
    """Sliding speed that counts as rest, in tolerances of a step per step of the output."""
    force: float = 1e-9
    """Force by which µs N must be exceeded, relative to N."""
    weakest: float = 1e-16
    """Part of a force that counts as held at least, where that is lost in rounding."""
    still: float = 1e-6
    """Rate of what sticks, relative to the largest q̈, that is due to rounding."""
    changes: int = 4
    """The most changes of modes at an event for each friction."""


STICK = StickOptions()


@compiled
def length_unit(structure, values, k):
    """Return the size of the mechanism, or 1 if the travel of friction k is an angle."""
    unit = splat(1.0)
    if not structure.friction.angular[k]:
        unit = 1.0 / load(values.inverse_scale, 1)
    return unit


@compiled
def rest_speed(structure, values, limits, step, k):
    """Return the sliding speed of friction k that counts as rest; `step` is that of the output."""
    return STICK.speed * limits.tolerance * length_unit(structure, values, k) / step
