"""Loads: springs and gravity."""

from __future__ import annotations

from dataclasses import dataclass

from numpy.typing import ArrayLike

from flexband.errors import finite, non_negative
from flexband.mechanics.forms import Vector, subtract
from flexband.mechanics.joints import PointName, Resolve


@dataclass(frozen=True)
class Spring:
    """A translational spring between two points, with force k (ℓ − ℓ₀) along their line.

    Parameters
    ----------
    first, second : the points it joins.
    stiffness : k [N/m].
    rest_length : ℓ₀ [m], or None for a spring that is relaxed at the start, once the mechanism
        is assembled.

    Raises
    ------
    InputError
        Where the stiffness or the rest length is negative or not finite.
    """

    first: PointName
    second: PointName
    stiffness: ArrayLike
    rest_length: ArrayLike | None = None

    def __post_init__(self) -> None:
        non_negative("Spring stiffness [N/m]", self.stiffness)
        if self.rest_length is not None:
            non_negative("Spring rest_length [m]", self.rest_length)

    def separation(self, frame: Resolve) -> Vector:
        """Return r_first − r_second, whose length is ℓ."""
        return subtract(frame(self.first).position, frame(self.second).position)


@dataclass(frozen=True)
class Gravity:
    """A uniform field of acceleration (X, Y) [m/s²] on every body."""

    x: ArrayLike = 0.0
    y: ArrayLike = -9.81

    def __post_init__(self) -> None:
        finite("Gravity x [m/s²]", self.x)
        finite("Gravity y [m/s²]", self.y)


Load = Spring | Gravity
