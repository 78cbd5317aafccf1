"""What an adaptive method knows after some batches of runs: models, and how far they are off.

Every run belongs to a term, so the runs of the first n terms make an expansion of their own. Those
of the batches before tell how the bands have changed.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexband.uncertainty.decomposition import Stage, decompose
from flexband.uncertainty.expansion import HybridExpansion, term_values
from flexband.uncertainty.expected_error import (
    CAUTION,
    DOUBT,
    apart,
    at_all_times,
    chosen_carriers,
    rms,
    running,
    stacked,
    steady_miss,
    thinned,
)
from flexband.uncertainty.index_sets import TermSizes
from flexband.uncertainty.nested import interval_sequence, random_sequence
from flexband.uncertainty.phase_expansion import Layout, PhaseExpansion
from flexband.uncertainty.polynomials import chebyshev_values, hermite_norms, hermite_values
from flexband.uncertainty.surrogate import Group, extremes_of

HIGHEST_INTERVAL, HIGHEST_RANDOM = 20, 8
"""Orders; runs of random variables stay within 4.2 standard deviations."""

SAFETY = 1.5
"""Factor of the estimate, so that over the cases of `benchmarks/accuracy.py` true errors are as
often larger as smaller."""

LEAST_SURPRISE = 0.003
"""Terms that turn out smaller than expected lower what is expected of others to this at most."""

RESOLUTION = 5e-5
"""Of an output's size: with carriers an expected error is never below, for the split of runs is not
better than that."""

WITHIN = 3.0
"""ξ² up to which a run counts in full; further out by the root of the density."""

OTHER = 0.5
"""Part of the mean's error that is expected in the error bar too, and the other way round."""

NEGLIGIBLE = 1e-10
"""An output below this part of the largest one is round-off."""


@dataclass(frozen=True)
class Design:
    """Terms and their runs, each at a point of nested sequences.

    Attributes
    ----------
    index : orders of the terms in each variable, η first, shape (terms, variables).
    interval_dimension : m.
    """

    index: np.ndarray
    interval_dimension: int

    @property
    def points(self) -> tuple[np.ndarray, np.ndarray]:
        """ξ and η of the runs, shapes (terms, n) and (terms, m)."""
        m = self.interval_dimension
        eta = interval_sequence(HIGHEST_INTERVAL + 1)[self.index[:, :m]]
        return random_sequence(HIGHEST_RANDOM + 1)[self.index[:, m:]], eta

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
        values += [hermite_values(k, x) for k, x in zip(orders[len(values) :], xi.T, strict=True)]
        return term_values(values, self.index)

    @property
    def norms(self) -> np.ndarray:
        """√E[Ψ²] of the terms, shape (terms,)."""
        norms = hermite_norms(HIGHEST_RANDOM)[self.index[:, self.interval_dimension :]]
        return np.sqrt(norms.prod(axis=1))


class NestedModel:
    """The models after every batch, on the newest decomposition.

    Parameters
    ----------
    F : all runs, shape (terms, outputs, times), at steps of dt.
    batches : how many terms there were after the last three batches or fewer, this one included.
    phase_resolved : whether carriers are looked for.
    """

    def __init__(
        self, F: np.ndarray, dt: float, design: Design, batches: Sequence[int], phase_resolved: bool
    ):
        self.F, self.design, self.batches = F, design, batches
        self.matrix = design.matrix
        self.stages = decompose(F, dt) if phase_resolved else [Stage([], F)]
        self.size = rms(F) + 1e-300
        errors, self.misses = [], []
        for stage in self.stages:
            found = [
                self._predicted(stage, *pair)
                for pair in itertools.pairwise(batches)
                if pair[0] > design.index.shape[1] or pair == tuple(batches[-2:])
            ]
            errors.append(found[-1][0])
            self.misses.append(np.max([miss for _, miss in found], axis=0))
        self.carriers = chosen_carriers(errors)
        self.frequencies = [c.frequency for c in self.stages[-1].carriers]
        self.thin, self.period = thinned(self.frequencies, dt, F.shape[-1])

    def _terms(self, stage: Stage, count: int) -> tuple[Layout, np.ndarray]:
        """Return the coefficients of the first terms, shape (count, series), and their layout."""
        layout = Layout.of(stage)
        values = layout.pack(stage.runs(slice(count)))
        return layout, np.linalg.solve(self.matrix[:count, :count], values)

    def _expansion(self, stage: Stage, count: int) -> PhaseExpansion:
        """Return the expansion with the first terms."""
        layout, terms = self._terms(stage, count)
        index, m = self.design.index[:count], self.design.interval_dimension
        return PhaseExpansion(HybridExpansion.of_terms(index, terms, m), layout, ())

    def _predicted(self, stage: Stage, before: int, now: int) -> tuple[np.ndarray, np.ndarray]:
        """Return how far the runs of a batch are from what was known before.

        The relative error of each output, shape (outputs,), and `steady_miss`.
        """
        model, unseen = self._expansion(stage, before), stage.runs(slice(before, now))
        xi, eta = (v[before:now] for v in self.design.points)
        far = np.sum(np.maximum(xi**2 - WITHIN, 0.0), axis=1)
        weight = np.exp(-far / 4)[:, None, None]
        error = rms(weight * (model.evaluate(xi, eta) - unseen.signal)) / self.size
        return error, steady_miss(model, unseen, xi, eta, weight)

    def groups(self, terms: int) -> list[Group]:
        """Return the model with the first terms, by the number of carriers."""
        found = []
        for k in np.unique(self.carriers):
            which = np.flatnonzero(self.carriers == k)
            found.append(Group(which, self._expansion(self.stages[k], terms).of(which)))
        return found

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
            layout, terms = self._terms(self.stages[k], len(self.F))
            base, carriers = layout.unpack(np.abs(terms) * self.design.norms[:, None])
            scale = self.size[which][:, None]
            parts = [base[:, which] / scale]
            for phase, re, im in carriers:
                envelope = np.hypot(re, im)[:, which] / scale
                parts += [envelope, phase * envelope[0]]
            for part, own in zip(parts, found, strict=False):
                own[which] = np.sqrt(np.mean(part**2, axis=-1)).T
        return found

    def next_terms(self, count: int) -> np.ndarray:
        """Return the next terms, shape (count, variables) or fewer."""
        known = TermSizes(self.design.index, self._rows(len(self.F)))
        return known.next_terms(count, self.design.highest)

    def _rows(self, count: int) -> np.ndarray:
        """Return the sizes of the first terms, shape (parts × outputs, count)."""
        return self.sizes[:, :, :count].reshape(-1, count)

    @cached_property
    def _bands(self) -> list[np.ndarray]:
        """Bounds at thinned times after each of the batches, (sigmas, 2, outputs, times)."""
        return [stacked(extremes_of(self.groups(count), self.thin)) for count in self.batches]

    @cached_property
    def expected_error(self) -> np.ndarray:
        """The errors expected of interval mean and error bar, shape (2, outputs, times).

        The change of the bands by a batch, times what further terms are expected to add over what
        those of the batch have added. Before a batch of expected terms has been run, not less than
        the change itself.
        """
        change = apart(self._bands[-1], self._bands[-2])
        change = change + OTHER * change[::-1]
        added = np.maximum(self._added, self._relative(change).max(axis=0))
        factor = (self._ahead / np.maximum(added, 1e-300))[:, None]
        error = change * (SAFETY * factor if self.tested else np.maximum(factor, 1.0))
        missed = np.minimum(self._missed, self.size[:, None])
        least = RESOLUTION * self.size * (self.carriers > 0)
        doubt = np.where(self.trusted[:, None], least[:, None], CAUTION * missed)
        error = np.maximum(at_all_times(error, self.thin, self.F.shape[-1]), doubt)
        return running(error, max(self.period, self.thin.step))

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

    @property
    def _missed(self) -> np.ndarray:
        """How far base and envelopes missed the last runs, shape (outputs, times)."""
        return np.stack([self.misses[k][o] for o, k in enumerate(self.carriers)])

    @property
    def trusted(self) -> np.ndarray:
        """Whether each output's base and envelopes were foreseen at all, shape (outputs,).

        Outputs that are round-off are not looked at.
        """
        missed = np.sqrt(np.mean(self._missed**2, axis=1))
        return (missed < DOUBT * self.size) | (self.size < NEGLIGIBLE * self.size.max())

    def _relative(self, error: np.ndarray) -> np.ndarray:
        """Return errors in parts of the error bar's mean width, shape (2, outputs).

        A band that is narrower than round-off counts as that wide.
        """
        width = (self._bands[-1][2, 1] - self._bands[-1][1, 0]).mean(axis=-1)
        least = NEGLIGIBLE * np.maximum(self.size, NEGLIGIBLE * self.size.max())
        counts = self.size > NEGLIGIBLE * self.size.max()
        return error.mean(axis=-1) * counts / np.maximum(width, np.maximum(least, 1e-300))

    @property
    def relative_error(self) -> float:
        """The largest error expected, in parts of the error bar's mean width."""
        return float(self._relative(self.expected_error).max())
