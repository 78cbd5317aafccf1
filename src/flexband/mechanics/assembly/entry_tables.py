"""Tables: all entries of one kind in the equations of motion, as arrays.

A table says which functions of time and which non-zeros of the matrix its entries need. It then
gives their indices, which all samples share, and their numbers.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import Any, NamedTuple, Protocol

import numpy as np

from flexband.mechanics.assembly.stacking import indices, stack
from flexband.mechanics.assembly.structure import ConstraintProducts, Mass, Products, WatchedForms
from flexband.mechanics.bodies.body import MassEntries
from flexband.mechanics.kernels.forms import Form, TimeFunction
from flexband.mechanics.kernels.state import State

Couples = Iterator[tuple[int, int]]
"""Pairs (i, j) of rows of z."""


@dataclass(frozen=True)
class Places:
    """Where the numbers of a mechanism are."""

    state: State  # the rows of z
    functions: dict[TimeFunction | None, int]  # the number of each function of time, 0 for None
    slots: dict[tuple[int, int], int]  # (i, j), i ≤ j -> row of the matrix
    nowhere: int  # the row of the matrix that all other pairs share

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
        self.mass = mass
        self.regular_mass = regular_mass

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


class Product(NamedTuple):
    """A product c f(t) z_i z_j of a row."""

    row: int
    i: int
    j: int
    f: TimeFunction | None
    c: np.ndarray


class _FormTable:
    """The products of some forms, numbered from `first_row` on."""

    def __init__(self, rows: Sequence[Form], first_row: int = 0):
        self.terms = [
            Product(first_row + k, *key, c)
            for k, form in enumerate(rows)
            for key, c in form.terms.items()
        ]

    @property
    def functions(self) -> list[TimeFunction | None]:
        return [term.f for term in self.terms]

    def columns(self, places: Places) -> list[np.ndarray]:
        """Return row, i, j and number of the function of each product."""
        numbers = [indices(term[k] for term in self.terms) for k in range(3)]
        return [*numbers, indices(places.functions[term.f] for term in self.terms)]

    def values(self) -> np.ndarray:
        return stack([term.c for term in self.terms])


class ProductTable(_FormTable):
    """The products of forces or sensors."""

    def couples(self) -> Couples:
        return iter(())

    def structure(self, places: Places) -> Products:
        return Products(*self.columns(places))


class ExtremeTable(ProductTable):
    """The products of forms whose extremes and integrals are wanted, of these kinds."""

    def __init__(self, rows: Sequence[Form], kinds: Sequence[int]):
        super().__init__(rows)
        self.kinds = kinds

    def structure(self, places: Places) -> Any:
        return WatchedForms(*self.columns(places), kind=indices(self.kinds))


class TermTable(_FormTable):
    """Products of constraints: of two variables, with functions, angles (from `first_angle` on)."""

    def __init__(
        self, rows: Sequence[Form], first_multiplier: int, first_angle: int, turning: set[int]
    ):
        super().__init__(rows, first_multiplier)
        self.terms.sort(key=lambda t: (t.i == 0, t.j >= first_angle, _is_steady(t, first_angle)))
        self.first_angle = first_angle
        self.turning = turning

    def couples(self) -> Couples:
        for k, i, j, *_ in self.terms:
            yield from ((k, i), (k, j), (i, j))

    def structure(self, places: Places) -> ConstraintProducts:
        polynomials = sum(term.j < self.first_angle for term in self.terms)
        return ConstraintProducts(
            *self.columns(places),
            slot=indices(places.slot(*couple) for couple in self.couples()).reshape(-1, 3),
            products=sum(term.i > 0 for term in self.terms),
            steady=polynomials - sum(_is_steady(term, self.first_angle) for term in self.terms),
            polynomials=polynomials,
            curved=indices(sorted(self.turning | {n for t in self.terms if t.i for n in t[1:3]})),
        )


def _is_steady(term: Product, first_angle: int) -> bool:
    """Return whether a term is c z_j, without an angle or a function of time."""
    return term.i == 0 and term.j < first_angle and term.f is None
