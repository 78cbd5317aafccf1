"""Tables: all entries of one kind in the equations of motion, as arrays.

A table says which functions of time and which non-zeros of the matrix its entries need. It then
gives their indices, which all samples share, and their numbers.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import Any, Protocol

import numpy as np

from flexband.mechanics.assembly.stacking import indices, stack
from flexband.mechanics.assembly.structure import Mass
from flexband.mechanics.bodies.body import MassEntries
from flexband.mechanics.kernels.forms import TimeFunction
from flexband.mechanics.kernels.state import State

Couples = Iterator[tuple[int, int]]
"""Pairs (i, j) of rows of z."""


@dataclass(frozen=True)
class Places:
    """Where the numbers of a mechanism are.

    Attributes
    ----------
    state : the rows of z.
    functions : the number of each function of time, 0 for None.
    slots : (i, j), i ≤ j -> row of the matrix.
    nowhere : the row of the matrix that all other pairs share.
    """

    state: State
    functions: dict[TimeFunction | None, int]
    slots: dict[tuple[int, int], int]
    nowhere: int

    def slot(self, i: int, j: int) -> int:
        """Return the row of the matrix for (i, j)."""
        return self.slots.get((min(i, j), max(i, j)), self.nowhere)

    def square(self, groups: Sequence[Sequence[int]]) -> np.ndarray:
        """Return the rows of the pairs in each group, shape (groups, longest, longest)."""
        longest = max(map(len, groups), default=0)
        slots = np.full((len(groups), longest, longest), self.nowhere)
        for block, group in zip(slots, groups, strict=True):
            block[: len(group), : len(group)] = [[self.slot(i, j) for j in group] for i in group]
        return slots


class Table(Protocol):
    """All entries of one kind in the equations of a mechanism."""

    @property
    def functions(self) -> Sequence[TimeFunction | None]:
        """The functions of time that the entries use."""
        ...

    def couples(self) -> Couples:
        """Yield the non-zeros of the matrix that the entries need."""
        ...

    def structure(self, places: Places) -> Any:
        """Return the indices, as the field of `Structure` for this table."""
        ...

    def values(self) -> Any:
        """Return the numbers of all samples, as the field of `Values` for this table."""
        ...


def pairs_of(groups: Sequence[Sequence[int]]) -> Couples:
    """Yield the pairs of rows that share a group."""
    for group in groups:
        yield from combinations_with_replacement(group, 2)


class MassTable:
    """The entries of the mass matrix."""

    functions = ()

    def __init__(self, mass: MassEntries, regular_mass: MassEntries):
        self.mass, self.regular_mass = mass, regular_mass

    def couples(self) -> Couples:
        return iter(self.mass)

    def structure(self, places: Places) -> Mass:
        i, j = (indices(couple[axis] for couple in self.mass) for axis in range(2))
        slots = indices(places.slot(*couple) for couple in self.mass)
        replaced = (
            n
            for n, (couple, m) in enumerate(self.mass.items())
            if self.regular_mass[couple] is not m and np.any(self.regular_mass[couple] != m)
        )
        return Mass(i, j, slots, massless=indices(replaced))

    def values(self) -> np.ndarray:
        return stack(list(self.mass.values()))
