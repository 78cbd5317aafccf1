"""The angles of a mechanism as arrays."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexband.mechanics.assembly.stacking import indices, starts
from flexband.mechanics.assembly.structure import Angles, AngleValues
from flexband.mechanics.assembly.tables import Couples, Places, columns, linear, pairs_of
from flexband.mechanics.forms import Vector


class AngleTable:
    """The angles, those of the constraints first.

    Parameters
    ----------
    directions : the vectors whose angles they are.
    multipliers : row of z of the multiplier, for each angle of a constraint.
    """

    functions = ()

    def __init__(self, directions: Sequence[Vector], multipliers: Sequence[int]):
        self.vectors, self.multipliers = [linear(v) for v in directions], multipliers
        self.groups = [list(entries) for entries in self.vectors]

    def couples(self) -> Couples:
        yield from pairs_of(self.groups)
        for k, group in zip(self.multipliers, self.groups, strict=False):
            yield from ((k, i) for i in group)

    def structure(self, places: Places) -> Angles:
        own = self.groups[: len(self.multipliers)]
        multiplier_slot = np.full((len(own), max(map(len, own), default=0)), places.nowhere)
        for row, k, group in zip(multiplier_slot, self.multipliers, own, strict=True):
            row[: len(group)] = [places.slot(k, i) for i in group]
        return Angles(
            start=starts(self.groups),
            coordinate=indices(i for group in self.groups for i in group),
            slot=places.square(self.groups),
            multiplier_slot=multiplier_slot,
        )

    def values(self) -> AngleValues:
        return AngleValues(*columns(self.vectors))
