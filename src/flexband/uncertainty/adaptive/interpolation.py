"""The adaptive model of one run a term, and what further terms are expected to add.

Every run belongs to a term, so the runs of the first n terms make an expansion of their own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexband.uncertainty.adaptive.batches import BATCH, BatchModel
from flexband.uncertainty.expansions.families import Family, mean_squares
from flexband.uncertainty.expansions.hybrid import term_values
from flexband.uncertainty.expansions.index_sets import TermSizes, first_terms
from flexband.uncertainty.expansions.polynomials import chebyshev_values
from flexband.uncertainty.expansions.sequences import interval_sequence
from flexband.uncertainty.phases.decomposition import Stage
from flexband.uncertainty.phases.layout import PartColumns

HIGHEST_INTERVAL, HIGHEST_RANDOM = 20, 8
"""Orders; runs of random variables stay within 4.2 standard deviations."""

WITHIN = 3.0
"""ξ² up to which a run counts in full; further out by the root of the density."""

SAFETY = 1.5
"""Factor of the estimate, so that over the cases of `benchmarks/accuracy.py` true errors are as
often larger as smaller."""

LEAST_SURPRISE = 0.003
"""Terms that turn out smaller than expected lower what is expected of others to this at most."""


@dataclass(frozen=True)
class Design:
    """Terms and their runs, each at a point of nested sequences.

    Attributes
    ----------
    index : orders of the terms in each variable, η first, shape (terms, variables).
    families : the polynomials of each ξ.
    """

    index: np.ndarray
    families: Sequence[Family]

    @property
    def interval_dimension(self) -> int:
        """Number m of variables η."""
        return self.index.shape[1] - len(self.families)

    @property
    def points(self) -> tuple[np.ndarray, np.ndarray]:
        """ξ and η of the runs, shapes (terms, n) and (terms, m)."""
        m = self.interval_dimension
        eta = interval_sequence(HIGHEST_INTERVAL + 1)[self.index[:, :m]]
        random = zip(self.families, self.index[:, m:].T, strict=True)
        xi = [family.sequence(HIGHEST_RANDOM + 1)[k] for family, k in random]
        return np.reshape(xi, (-1, len(eta))).T.copy(), eta

    @property
    def highest(self) -> np.ndarray:
        """The highest order there may be in each variable."""
        m, d = self.interval_dimension, self.index.shape[1]
        return np.repeat([HIGHEST_INTERVAL, HIGHEST_RANDOM], [m, d - m])

    @property
    def matrix(self) -> np.ndarray:
        """The terms' values in the runs, shape (terms, terms)."""
        xi, eta = self.points
        orders = self.index.max(axis=0)
        values = [chebyshev_values(q, x) for q, x in zip(orders, eta.T, strict=False)]
        random = zip(self.families, orders[len(values) :], xi.T, strict=True)
        values += [family.values(k, x) for family, k, x in random]
        return term_values(values, self.index)

    @property
    def norms(self) -> np.ndarray:
        """√E[Ψ²] of the terms, shape (terms,)."""
        return np.sqrt(mean_squares(self.index[:, self.interval_dimension :], self.families))

    def __len__(self) -> int:
        return len(self.index)


class NestedModel(BatchModel):
    """The models after every batch of terms: sparse interpolation."""

    def __init__(
        self, F: np.ndarray, dt: float, design: Design, batches: Sequence[int], phase_resolved: bool
    ):
        self.design, self.matrix = design, design.matrix
        super().__init__(F, dt, design, batches, phase_resolved)

    @staticmethod
    def start(m: int, families: Sequence[Family], most: int) -> tuple[Design, list[int]]:
        """Return the first terms, as far as the budget reaches, and where their batches end."""
        n = len(families)
        wanted = BATCH * -(-(1 + m + 2 * n) // BATCH)
        index = first_terms(m, n, min(wanted, most))
        return Design(index, families), [1, 1 + m + n] + [len(index)] * (len(index) > 1 + m + n)

    @property
    def _pairs(self) -> list[tuple[int, int]]:
        """The last batch, and those before that have had runs in every variable."""
        pairs = super()._pairs
        return [p for p in pairs if p[0] > self.design.index.shape[1] or p == pairs[-1]]

    def _weight(self, xi: np.ndarray) -> np.ndarray:
        return np.exp(-np.sum(np.maximum(xi**2 - WITHIN, 0.0), axis=1) / 4)

    def _terms(self, stage: Stage, count: int) -> tuple[np.ndarray, np.ndarray]:
        values = PartColumns.of_stage(stage).pack(stage.runs(slice(count)))
        return self.design.index[:count], np.linalg.solve(self.matrix[:count, :count], values)

    @property
    def orders(self) -> np.ndarray:
        """The highest order in each variable, η first."""
        return self.design.index.max(axis=0)

    @cached_property
    def sizes(self) -> np.ndarray:
        """How much every term adds to each output, in parts of its size.

        Shape (parts, outputs, terms). Base, envelopes and phases are parts; a phase counts with the
        constant term of the envelope. Parts that an output does not have are zero.
        """
        most, outputs = int(self.carriers.max(initial=0)), len(self.size)
        found = np.zeros((1 + 2 * most, outputs, len(self.F)))
        for k in np.unique(self.carriers):
            which = np.flatnonzero(self.carriers == k)
            _, terms = self._terms(self.stages[k], len(self.F))
            layout = PartColumns.of_stage(self.stages[k])
            base, carriers = layout.unpack(np.abs(terms) * self.design.norms[:, None])
            scale = self.size[which][:, None]
            parts = [base[:, which] / scale]
            for phase, re, im in carriers:
                envelope = np.hypot(re, im)[:, which] / scale
                parts += [envelope, phase * envelope[0]]
            for part, own in zip(parts, found, strict=False):
                own[which] = np.sqrt(np.mean(part**2, axis=-1)).T
        return found

    def _rows(self, count: int) -> np.ndarray:
        """Return the sizes of the first terms, shape (parts × outputs, count)."""
        return self.sizes[:, :, :count].reshape(-1, count)

    def extended(self, count: int) -> Design:
        """Return the design with the next terms, so many or fewer."""
        known = TermSizes(self.design.index, self._rows(len(self.F)))
        more = known.next_terms(count, self.design.highest)
        index = np.concatenate([self.design.index, more])
        return Design(index, self.design.families)

    def _scaled(self, change: np.ndarray) -> np.ndarray:
        """Return the errors expected, of how the bands have changed, both (2, outputs, times).

        The change times what further terms are expected to add over what those of the batch have
        added. Before a batch of expected terms has been run, not less than the change itself.
        """
        added = np.maximum(self._added, self._relative(change).max(axis=0))
        factor = (self._ahead / np.maximum(added, 1e-300))[:, None]
        return change * (SAFETY * factor if self.tested else np.maximum(factor, 1.0))

    @property
    def _ahead(self) -> np.ndarray:
        """What as many further terms as in the last batch are expected to add, (outputs,).

        They are expected to surprise as those of the batch did.
        """
        before, now = self.batches[-2:]
        index, shape = self.design.index, (-1, len(self.size))
        foreseen = TermSizes(index[:before], self._rows(before)).total(index[before:now])
        known = TermSizes(index, self._rows(now))
        ahead = known.total(known.next_terms(now - before, self.design.highest + now))
        foreseen, ahead = (v.reshape(shape).sum(axis=0) for v in (foreseen, ahead))
        surprise = np.maximum(LEAST_SURPRISE, self._added / np.maximum(foreseen, 1e-300))
        return np.minimum(ahead * surprise, np.maximum(self._added, ahead))

    @property
    def _added(self) -> np.ndarray:
        """What the terms of the last batch have added, shape (outputs,)."""
        return self.sizes[:, :, self.batches[-2] : self.batches[-1]].sum(axis=(0, 2))

    @property
    def tested(self) -> bool:
        """Whether a batch of terms that were expected has been run."""
        return self.batches[0] > 1
