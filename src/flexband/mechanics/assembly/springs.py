"""The springs of a mechanism as arrays."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexband.mechanics.assembly.stacking import indices, stack, starts
from flexband.mechanics.assembly.structure import Springs, SpringValues
from flexband.mechanics.assembly.tables import Couples, Places, columns, linear, pairs_of
from flexband.mechanics.kernels.springs import RELAXED
from flexband.mechanics.loads.loads import SpringEntry


class SpringTable:
    """The springs.

    Parameters
    ----------
    springs : the entries, translational springs first.
    first_angle : number of the first angle of the torsion springs.
    """

    def __init__(self, springs: Sequence[SpringEntry], first_angle: int):
        self.springs, self.first_angle = springs, first_angle
        self.vectors = [linear(vector) for s in springs if not s.torsion for vector in s.vectors]
        self.directions = [vector for s in springs if s.torsion for vector in s.vectors]
        turned = [list(linear(vector)) for vector in self.directions]
        self.groups = [list(entries) for entries in self.vectors]
        self.torsion_groups = [a + b for a, b in zip(turned[::2], turned[1::2], strict=True)]
        pulls = [next(iter(s.pull.terms.items()), ((0, 0, None), 0.0)) for s in springs]
        self.pulls = [c for _, c in pulls]
        self.functions = [f for (_, _, f), _ in pulls]

    def couples(self) -> Couples:
        return pairs_of(self.groups + self.torsion_groups)

    def structure(self, places: Places) -> Springs:
        return Springs(
            f=indices(places.functions[f] for f in self.functions),
            start=starts(self.groups),
            coordinate=indices(i for group in self.groups for i in group),
            slot=places.square(self.groups),
            angle=self.first_angle + np.arange(len(self.directions)),
            torsion_slot=places.square(self.torsion_groups),
        )

    def values(self) -> SpringValues:
        x, y = columns(self.vectors)
        return SpringValues(
            x,
            y,
            stiffness=stack([s.stiffness for s in self.springs]),
            rest=stack([RELAXED if s.rest is None else s.rest for s in self.springs]),
            cubic=stack([s.cubic for s in self.springs]),
            damping=stack([s.damping for s in self.springs]),
            pull=stack(self.pulls),
        )
