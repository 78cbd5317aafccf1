"""The springs of a mechanism as arrays."""

from __future__ import annotations

from collections.abc import Sequence

from flexband.mechanics.assembly.stacking import indices, stack
from flexband.mechanics.assembly.structure import Springs, SpringValues
from flexband.mechanics.assembly.tables import Couples, Places, pairs_of
from flexband.mechanics.kernels.springs import RELAXED
from flexband.mechanics.loads.load import SpringEntry


class SpringTable:
    """The springs.

    Parameters
    ----------
    springs : the entries, translational springs first.
    numbers : of the vectors of each spring.
    groups : the rows of z that each vector depends on.
    """

    def __init__(
        self,
        springs: Sequence[SpringEntry],
        numbers: Sequence[Sequence[int]],
        groups: Sequence[Sequence[int]],
    ):
        self.springs, self.numbers = springs, numbers
        self.groups = [[i for a in vectors for i in groups[a]] for vectors in numbers]
        self.pulls, self.functions = [], []
        for spring in springs:
            (((_, _, f), c),) = spring.pull.terms.items() or [((0, 0, None), 0.0)]
            self.pulls.append(c)
            self.functions.append(f)

    def couples(self) -> Couples:
        return pairs_of(self.groups)

    def structure(self, places: Places) -> Springs:
        return Springs(
            translational=sum(not spring.torsion for spring in self.springs),
            f=indices(places.functions[f] for f in self.functions),
            vector=indices(a for vectors in self.numbers for a in vectors),
            slot=places.square(self.groups),
        )

    def values(self) -> SpringValues:
        return SpringValues(
            stiffness=stack([s.stiffness for s in self.springs]),
            rest=stack([RELAXED if s.rest is None else s.rest for s in self.springs]),
            cubic=stack([s.cubic for s in self.springs]),
            damping=stack([s.damping for s in self.springs]),
            pull=stack(self.pulls),
        )
