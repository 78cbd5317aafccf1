"""Vectors that are linear in the coordinates, and the angles of some of them, as arrays."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from flexband.mechanics.assembly.stacking import indices, stack, starts
from flexband.mechanics.assembly.structure import Vectors, VectorValues
from flexband.mechanics.assembly.tables import Couples, Places, pairs_of
from flexband.mechanics.kernels.forms import Vector


def linear(vector: Vector) -> dict[int, list[ArrayLike]]:
    """Return row of z -> the coefficients in X and Y of a linear vector."""
    entries: dict[int, list[ArrayLike]] = {}
    for axis, form in enumerate(vector):
        for (_, j, _), c in form.terms.items():
            entries.setdefault(j, [0.0, 0.0])[axis] = c
    return dict(sorted(entries.items()))


class VectorTable:
    """The vectors, those with angles or lengths first.

    Parameters
    ----------
    vectors : linear in the coordinates.
    angles : number of angles and lengths.
    multipliers : row of z of the multiplier, for each angle or length of a constraint; these come
        first.
    lengths : for each of these, whether it is a length.
    direction : number of the first vector along which a following force acts.
    turning : number of the first vector that turns with a body or a rod.
    """

    functions = ()

    def __init__(
        self,
        vectors: Sequence[Vector],
        angles: int,
        multipliers: Sequence[int],
        lengths: Sequence[bool],
        direction: int,
        turning: int,
    ):
        self.vectors = [linear(vector) for vector in vectors]
        self.groups = [list(entries) for entries in self.vectors]
        self.turned, self.multipliers = self.groups[:angles], multipliers
        self.lengths, self.direction, self.turning = lengths, direction, turning

    def couples(self) -> Couples:
        yield from pairs_of(self.turned)
        for k, group in zip(self.multipliers, self.turned, strict=False):
            yield from ((k, i) for i in group)

    def structure(self, places: Places) -> Vectors:
        groups = self.turned[: len(self.multipliers)]
        multiplier_slot = np.full((len(groups), max(map(len, groups), default=0)), places.nowhere)
        for row, k, group in zip(multiplier_slot, self.multipliers, groups, strict=True):
            row[: len(group)] = [places.slot(k, i) for i in group]
        return Vectors(
            start=starts(self.groups),
            coordinate=indices(i for group in self.groups for i in group),
            length=np.array(
                [*self.lengths, *[False] * (len(self.turned) - len(groups))], dtype=bool
            ),
            direction=self.direction,
            turning=self.turning,
            slot=places.square(self.turned),
            multiplier_slot=multiplier_slot,
        )

    def values(self) -> VectorValues:
        return VectorValues(
            *(
                stack([c[axis] for vector in self.vectors for c in vector.values()])
                for axis in range(2)
            )
        )
