"""How bounds over the interval variables are searched: the numbers of the scan and the descents."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple


class BoundSearchOptions(NamedTuple):
    """The numbers of the search for bounds of μ + c σ; compiled loops take them as constants."""

    series_at_once: int = 512
    """Series that are searched in one call of compiled code."""
    lanes: int = 32
    """Series that are served side by side."""
    many_scan_points: int = 200
    """Points from which on a grid becomes coarser."""
    max_scan_points: int = 1400
    """Most points of a grid."""
    scattered_points: int = 1024
    """Points of a scan in more variables than a grid can have."""
    neighbours: int = 12
    """How many of these count as next to a point."""
    max_starts: int = 64
    """Points of the scan to descend from."""
    patience: int = 12
    """The search ends when so many descents have reached the lowest minimum."""
    patience_if_alone: int = 8
    """The same, if this is the only minimum that is known."""
    same_place: float = 1e-4
    """Distance in η below which two minima count as one."""
    resolved_dimension: int = 3
    """Up to so many variables, a grid resolves all waves, and only the lowest minimum is left along
    single variables."""
    max_grid_dimension: int = 5
    """In more variables, descents begin along single variables, since the scan is far from
    minima."""
    max_start_height: float = 0.5
    """Higher points of a grid that resolves all waves, relative to the range of its values, are no
    starts."""
    max_drop: float = 0.5
    """A minimum next to a point of such a grid may be lower than it by this part of how much all
    its neighbours together are higher. For a parabola it is 1/8 at most."""
    max_turns: int = 40
    """Steps of both kinds from one start."""
    flat: float = 1e-13
    """Variation of a constant, as a part of its value, that is due to rounding."""
    max_sweeps: int = 30
    """Visits of each variable in one descent along single variables."""
    min_gain: float = 1e-13
    """A variable moves if that gains at least this fraction of the sum of all coefficients."""
    max_newton_steps: int = 8
    """Of all lanes together."""
    min_active_part: int = 4
    """Newton's steps end when fewer than one in so many lanes is under way."""
    min_relative_gain: float = 1e-13
    """Newton's descent ends when a step is expected to gain less than this fraction of the
    value."""


class NextStep(IntEnum):
    """What a series waits for: a START, a descent along LINES, by NEWTON's method, or NOTHING."""

    START = 0
    LINES = 1
    NEWTON = 2
    NOTHING = 3


OPTIONS = BoundSearchOptions()
"""Numba takes the fields of a global tuple as constants."""
