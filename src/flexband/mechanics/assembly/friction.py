"""The table of what sticks or slides."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexband.mechanics.assembly.entry_tables import Couples, Places, ProductTable, TermTable
from flexband.mechanics.assembly.stacking import indices, stack
from flexband.mechanics.assembly.structure import Friction, FrictionValues
from flexband.mechanics.assembly.vectors import VectorTables
from flexband.mechanics.contact.friction import FrictionEntry
from flexband.mechanics.kernels.forms import TimeFunction
from flexband.mechanics.model.model import Model


class FrictionTable:
    """What sticks or slides."""

    def __init__(self, model: Model, vectors: VectorTables):
        state = model.state
        self.frictions = [friction for _, friction in model.frictions]
        self.groups = vectors.vectors.groups
        self.actions = vectors.actions
        self.contact_forces = model.rubbed_rows
        self.gaps = model.rubbed_gaps
        self.earlier = _earlier_in_line(self.frictions, model.guess)
        travels = model.travel_forms
        self.terms = TermTable(travels, state.friction, state.angle, set())
        components = [form for group in model.normal_forces for v in group for form in v]
        self.normals = ProductTable(components, state.gap - len(components))
        self.normal_forces = model.normal_forces
        self.orbits = []  # of each, its term and its friction
        for k, (friction, travel) in enumerate(zip(self.frictions, travels, strict=True)):
            last = len(friction.sliding.orbit.polar) if friction.sliding.orbit else 0
            variables = sorted(j for _, j, _ in travel.terms if j >= state.angle)
            for j in variables[len(variables) - last :]:
                (term,) = (t for t, p in enumerate(self.terms.terms) if p.j == j)
                self.orbits.append((term, k))

    @property
    def functions(self) -> list[TimeFunction | None]:
        return [*self.terms.functions, *self.normals.functions]

    def couples(self) -> Couples:
        return self.terms.couples()

    def structure(self, places: Places) -> Friction:
        state = places.state
        slots = {}
        for term in self.terms.terms:
            rows: Sequence[int] = (term.i, term.j)
            if term.j >= state.angle:
                rows = self.groups[term.j - state.angle]
            slots |= {places.slot(term.row, i): term.row - state.friction for i in rows if i > 0}
        slots.pop(places.nowhere, None)
        multipliers = range(state.friction, state.angle)
        rubbed = list(self.contact_forces)
        keys = [[key for v in group for f in v for key in f.terms] for group in self.normal_forces]
        later = {k: n for n, k in self.earlier.items()}
        reacts = [
            any(state.sliding <= j < state.gap for key in group for j in key[:2]) for group in keys
        ]
        return Friction(
            terms=self.terms.structure(places),
            slot=indices(slots),
            of_slot=indices(slots.values()),
            diagonal=indices(places.slot(k, k) for k in multipliers),
            angular=indices(friction.angular for friction in self.frictions),
            one_way=indices(friction.one_way for friction in self.frictions),
            switched=indices(friction.active is not None for friction in self.frictions),
            follows=any(reacts),
            reacts=indices(reacts),
            normals=self.normals.structure(places),
            of_components=indices(k for k, group in enumerate(self.normal_forces) for _ in group),
            orbit_term=indices(term for term, _ in self.orbits),
            of_orbit=indices(k for _, k in self.orbits),
            is_orbit=indices(term in dict(self.orbits) for term in range(len(self.terms.terms))),
            circular=indices(friction.sliding.orbit is not None for friction in self.frictions),
            centres=indices(self.actions + 3 * rubbed.index(k) + 2 for _, k in self.orbits),
            rubbed=indices(rubbed),
            contact_force=indices(self.contact_forces.values()),
            gap=indices(self.gaps.get(k, -1) for k in range(len(self.frictions))),
            earlier=indices(self.earlier.get(k, -1) for k in range(len(self.frictions))),
            later=indices(later.get(k, -1) for k in range(len(self.frictions))),
            action=self.actions,
        )

    def values(self) -> FrictionValues:
        numbers = [friction.numbers for friction in self.frictions]
        names = ("static", "kinetic", "rise", "viscous", "inverse_square")
        coefficients = self.terms.terms
        return FrictionValues(
            terms=self.terms.values(),
            orbits=stack([coefficients[term].c for term, _ in self.orbits]),
            normals=self.normals.values(),
            **{name: stack([row[n] for row in numbers]) for n, name in enumerate(names)},
            radius=stack([f.sliding.action.radius for f in self.frictions if f.sliding.action]),
        )


def _earlier_in_line(
    frictions: Sequence[FrictionEntry], guess: Sequence[np.ndarray]
) -> dict[int, int]:
    """Return the last friction before another that slides along the same line with its body."""
    lines = {k: f.sliding.line for k, f in enumerate(frictions) if f.sliding.line}
    earlier = {}
    for k, line in lines.items():
        same = [n for n, other in lines.items() if n < k and line.is_that_of(other, guess)]
        if same:
            earlier[k] = same[-1]
    return earlier
