"""How bounds over the interval variables are searched: the numbers of the scan and the descents."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple


class BoundSearchOptions(NamedTuple):
    """The numbers of the search for bounds of μ + c σ; compiled loops take them as constants.

    Attributes
    ----------
    series_at_once : series that are searched in one call of compiled code.
    lanes : series that are served side by side.
    many_scan_points, max_scan_points : points from which on a grid becomes coarser, and most points
        of a grid.
    scattered_points, neighbours : points of a scan in more variables than a grid can have, and how
        many of them count as next to a point.
    max_starts : points of the scan to descend from.
    patience, patience_if_alone : the search ends when so many descents have reached the lowest
        minimum; the second number counts if this is the only one that is known.
    same_place : distance in η below which two minima count as one.
    resolved_dimension : up to so many variables, a grid resolves all waves, and only the lowest
        minimum is left along single variables.
    max_grid_dimension : in more variables, descents begin along single variables, since the scan is
        far from minima.
    max_start_height : higher points of a grid that resolves all waves, in parts of the range of its
        values, are no starts.
    max_drop : a minimum next to a point of such a grid may be lower than it by this part of how
        much all its neighbours together are higher. For a parabola it is 1/8 at most.
    max_turns : steps of both kinds from one start.
    flat : variation of a constant, as a part of its value, that is due to rounding.
    max_sweeps : visits of each variable in one descent along single variables.
    min_gain : a variable moves if that gains at least this fraction of the sum of all coefficients.
    max_newton_steps : of all lanes together.
    min_active_part : Newton's steps end when fewer than one in so many lanes is under way.
    min_relative_gain : Newton's descent ends when a step is expected to gain less than this
        fraction of the value.
    """

    series_at_once: int = 512
    lanes: int = 32
    many_scan_points: int = 200
    max_scan_points: int = 1400
    scattered_points: int = 1024
    neighbours: int = 12
    max_starts: int = 64
    patience: int = 12
    patience_if_alone: int = 8
    same_place: float = 1e-4
    resolved_dimension: int = 3
    max_grid_dimension: int = 5
    max_start_height: float = 0.5
    max_drop: float = 0.5
    max_turns: int = 40
    flat: float = 1e-13
    max_sweeps: int = 30
    min_gain: float = 1e-13
    max_newton_steps: int = 8
    min_active_part: int = 4
    min_relative_gain: float = 1e-13


class NextStep(IntEnum):
    """What a series waits for: a START, a descent along LINES, by NEWTON's method, or NOTHING."""

    START = 0
    LINES = 1
    NEWTON = 2
    NOTHING = 3


OPTIONS = BoundSearchOptions()
"""Numba takes the fields of a global tuple as constants."""
