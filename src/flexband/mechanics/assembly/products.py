"""Rows of forms as products c f(t) z_i z_j: constraints, forces and sensors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from flexband.mechanics.assembly.stacking import indices, stack
from flexband.mechanics.assembly.structure import ConstraintProducts, Products
from flexband.mechanics.assembly.tables import Couples, Places
from flexband.mechanics.kernels.forms import Form, TimeFunction


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


class TermTable(_FormTable):
    """The products of constraints: those of two variables first, then with functions, angles last.

    Parameters
    ----------
    rows : the forms, whose multipliers are in the rows of z from `first_multiplier` on.
    first_angle : the row of z from which on variables are angles.
    turning : the coordinates that these angles depend on.
    """

    def __init__(
        self, rows: Sequence[Form], first_multiplier: int, first_angle: int, turning: set[int]
    ):
        super().__init__(rows, first_multiplier)
        self.terms.sort(key=lambda t: (t.i == 0, t.j >= first_angle, _is_steady(t, first_angle)))
        self.first_angle, self.turning = first_angle, turning

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
