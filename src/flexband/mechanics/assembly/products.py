"""Rows of forms as one table of products c f(t) z_i z_j."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from flexband.mechanics.assembly.parts import Slot
from flexband.mechanics.assembly.stacking import indices
from flexband.mechanics.assembly.structure import Products, Terms
from flexband.mechanics.forms import Form, TimeFunction


class FormTable:
    """The terms of some forms, products first and angles last.

    Parameters
    ----------
    rows : the forms.
    numbers : number of each function of time, 0 of None.
    first_row : row of the first form.
    first_angle : row of z from which on variables are angles.
    """

    def __init__(
        self,
        rows: Sequence[Form],
        numbers: dict[TimeFunction | None, int],
        first_row: int = 0,
        first_angle: int = 0,
    ):
        flat = [
            ((first_row + k, i, j, numbers[f]), c)
            for k, row in enumerate(rows)
            for (i, j, f), c in row.terms.items()
        ]
        flat.sort(key=lambda term: (term[0][1] == 0, term[0][2] >= first_angle))
        self.places = [place for place, _ in flat]
        self.coefficients = [c for _, c in flat]
        self.first_angle = first_angle

    def products(self) -> Products:
        """Return row, i, j and function of each."""
        return Products(*self._columns())

    def couples(self) -> Iterator[tuple[int, int]]:
        """Return the non-zeros that the terms of constraints need."""
        for k, i, j, _ in self.places:
            yield from ((k, i), (k, j), (i, j))

    def terms(self, slot: Slot) -> Terms:
        """Return the terms of constraints."""
        return Terms(
            *self._columns(),
            slot=indices(slot(*couple) for couple in self.couples()).reshape(-1, 3),
            products=sum(i > 0 for _, i, _, _ in self.places),
            polynomials=sum(j < self.first_angle for _, _, j, _ in self.places),
        )

    def _columns(self) -> list[np.ndarray]:
        return [indices(place[k] for place in self.places) for k in range(4)]


def functions_of(rows: Sequence[Form], others: Sequence[TimeFunction | None]) -> list[TimeFunction]:
    """Return the functions of time in use, each once."""
    in_rows = [f for row in rows for _, _, f in row.terms]
    return list(dict.fromkeys(f for f in [*in_rows, *others] if f is not None))


def asked_for(row: int, forms: Sequence[Form]) -> int:
    """Return a row of z where a form depends on it, else 0."""
    return row if any(row in key[:2] for form in forms for key in form.terms) else 0
