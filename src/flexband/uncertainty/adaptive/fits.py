"""Expansions fitted to runs, and for each output the one that is best in runs it has not seen."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from flexband.uncertainty.adaptive.parts import Split
from flexband.uncertainty.adaptive.rare_values import rare_values
from flexband.uncertainty.expansions.expansion import Expansion
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.interpolation import Interpolation, in_place
from flexband.uncertainty.phases.decomposition import Stage
from flexband.uncertainty.phases.expansion import expansion_of
from flexband.uncertainty.phases.layout import PartColumns
from flexband.uncertainty.surrogates.diagnostics import at_all_times, rms

BATCH = 8
"""Runs are asked for in multiples of this: as many as the lanes of a SIMD register."""

GAIN = 0.8
"""A further carrier is used for an output where it brings the error below this part."""

MOST_TIMES = 128
"""Times at which growth at rare values is seen."""

AT_ONCE = 64
"""Rare values at which an expansion is evaluated at once."""

MARGIN, GROWTH = 1.5, 2
"""There, an expansion may leave the range of the runs by this factor, times this power of how much
farther out it is than the runs."""


class Design(Protocol):
    """Where runs are, and how their parts are fitted."""

    @property
    def points(self) -> tuple[np.ndarray, np.ndarray]:
        """ξ and η, shapes (runs, n) and (runs, m)."""
        ...

    def __len__(self) -> int: ...

    def fit(self, stage: Stage) -> HybridExpansion | Interpolation:
        """Return the expansion of the parts of runs at these points."""
        ...


class GrowingDesign(Design, Protocol):
    """A design that may have further runs."""

    @property
    def few(self) -> int:
        """A number of first runs, few, from which small series are expanded."""
        ...

    def small(self, series: np.ndarray) -> HybridExpansion:
        """Return the expansion of small series in the first runs, shape (runs, series)."""
        ...

    def extended(self, count: int, split: Split) -> GrowingDesign:
        """Return the design with so many further runs, or fewer."""
        ...


class Fit(NamedTuple):
    """The expansion of the parts of some outputs, with some number of carriers.

    Attributes
    ----------
    outputs : their numbers, increasing.
    frequencies : of the carriers, in cycles per unit of time.
    """

    outputs: np.ndarray
    parts: HybridExpansion | Interpolation
    columns: PartColumns
    frequencies: list[float]

    @staticmethod
    def of(design: Design, stage: Stage) -> Fit:
        """Fit all outputs to the runs of a design, which are the first of the stage."""
        parts, columns = design.fit(stage.runs(slice(len(design)))), PartColumns.of_stage(stage)
        frequencies = [c.frequency for c in stage.carriers]
        return Fit(np.arange(columns.outputs), parts, columns, frequencies)

    def of_outputs(self, outputs: np.ndarray) -> Fit:
        """Return the fit of some of its outputs, by number."""
        which = self.columns.of_outputs(np.searchsorted(self.outputs, outputs))
        parts = self.parts.of_rows(self.columns.width, which, slice(None))
        columns = PartColumns.of(len(outputs), self.columns.carriers)
        return Fit(outputs, parts, columns, self.frequencies)

    @property
    def formed(self) -> HybridExpansion:
        """The parts, with all of their coefficients."""
        return self.parts.formed() if isinstance(self.parts, Interpolation) else self.parts

    def at(self, times: slice | np.ndarray) -> Fit:
        """Return the fit at some of the times."""
        rows = self.columns.width
        return self._replace(parts=self.parts.of_rows(rows, np.arange(rows), times))

    @property
    def expansion(self) -> Expansion:
        """The expansion of its outputs."""
        return expansion_of(self.outputs, self.formed, self.columns)

    def evaluate(self, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """Return its outputs at ξ and η, shape (points, outputs, times)."""
        return self.columns.join(self.parts.evaluate(xi, eta))

    def overshoot(self, runs: Runs, thin: slice) -> np.ndarray:
        """Return how far it leaves the range of all runs for random variables far from their mean.

        Moments of a polynomial depend on values there, and high orders may oscillate between the
        outermost runs. Root mean square over each ξ alone, and over those that are multiplied,
        shape (outputs, times).

        Parameters
        ----------
        runs, thin : all runs at some of the times, and which these are.
        """
        parts, own = self.at(thin).formed, runs.values[:, self.outputs]
        low, high = own.min(axis=0), own.max(axis=0)
        directions, distance, weight = rare_values(parts.random_index)
        square = np.zeros(low.shape)
        for k in range(0, len(weight), AT_ONCE):
            some = slice(k, k + AT_ONCE)
            along, z = directions[some], (distance[some, None] * directions[some]).T
            own = zip(parts.families, z, strict=True)
            xi = np.stack([family.of_normal(x) for family, x in own], axis=1)
            eta = np.resize(np.roll(runs.eta, -k, axis=0), (len(xi), runs.eta.shape[1]))
            reached = np.abs(runs.xi @ along.T).max(axis=0)
            farther = np.abs((xi * along).sum(axis=1)) / np.maximum(1.0, reached)
            allowed = MARGIN * np.maximum(1.0, farther) ** GROWTH
            off = self.columns.join(parts.evaluate(xi, eta))
            off = np.abs(off - (low + high) / 2) - allowed[:, None, None] * (high - low) / 2
            square += np.einsum("p,pot->ot", weight[some], np.maximum(off, 0.0) ** 2)
        return np.sqrt(square)


class Runs(NamedTuple):
    """Runs of a response.

    Attributes
    ----------
    xi, eta : shapes (runs, n) and (runs, m).
    values : shape (runs, outputs, times).
    """

    xi: np.ndarray
    eta: np.ndarray
    values: np.ndarray

    def at(self, times: slice) -> Runs:
        """Return the runs at some of the times."""
        return self._replace(values=self.values[..., times])

    def which(self, own: slice) -> Runs:
        """Return some of the runs, which are not copied."""
        return Runs(*(v[own] for v in self))

    @staticmethod
    def joined(*parts: Runs) -> Runs:
        """Return all runs of several parts."""
        return Runs(*map(np.concatenate, zip(*parts, strict=True)))


class Choice(NamedTuple):
    """The best fit of every output.

    Attributes
    ----------
    fits : each of the outputs for which it is the best.
    missed : what is missed of held-out runs, shape (runs, outputs, times).
    overshoot : of the fits, shape (outputs, times).
    """

    fits: list[Fit]
    missed: np.ndarray
    overshoot: np.ndarray

    @staticmethod
    def of(fits: Sequence[Fit], fitted: Runs, held: Runs) -> Choice:
        """Choose the fits that are best in held-out runs; every further carrier has to pay."""
        shape = held.values.shape
        thin = slice(None, None, -(-shape[-1] // MOST_TIMES))
        seen = Runs.joined(held.at(thin), fitted.at(thin))
        missed, overshoot = np.empty(shape), np.empty(shape[1:])
        least, best = np.full(shape[1], np.inf), np.zeros(shape[1], dtype=int)
        for k, fit in enumerate(fits):
            miss = fit.evaluate(held.xi, held.eta)
            for own, output in enumerate(fit.outputs):
                np.subtract(held.values[:, output], miss[:, own], out=miss[:, own])
            far = at_all_times(fit.overshoot(seen, thin), thin, shape[-1])
            error = np.hypot(rms(miss), rms(far[None])) / GAIN ** len(fit.frequencies)
            better = (error < least[fit.outputs]) | (k == 0)
            own = fit.outputs[better]
            least[own], best[own] = error[better], k
            for output, part in zip(own, np.flatnonzero(better), strict=True):
                missed[:, output] = miss[:, part]
            overshoot[own] = far[better]
        chosen = [fits[k].of_outputs(np.flatnonzero(best == k)) for k in np.unique(best)]
        return Choice(chosen, missed, overshoot)

    def expansions(self, times: slice | np.ndarray = slice(None)) -> list[Expansion]:
        """Return the expansions of all outputs at some of the times, one for each fit."""
        return [fit.at(times).expansion for fit in self.fits]

    def in_place_of_runs(self) -> list[Expansion]:
        """Return the expansions of all outputs; where it can be, they take the memory of the runs.

        Neither the runs nor the fits can be used afterwards.
        """
        linear = [fit for fit in self.fits if isinstance(fit.parts, Interpolation)]
        found = [fit.expansion for fit in self.fits if isinstance(fit.parts, HybridExpansion)]
        if linear:
            outputs = np.sort(np.concatenate([fit.outputs for fit in linear]))
            parts = [fit.parts for fit in linear if isinstance(fit.parts, Interpolation)]
            found.append(expansion_of(outputs, in_place(parts), linear[0].columns))
        return found

    @property
    def carriers(self) -> np.ndarray:
        """The number of carriers of each output, shape (outputs,)."""
        carriers = np.empty(self.missed.shape[1], dtype=int)
        for fit in self.fits:
            carriers[fit.outputs] = len(fit.frequencies)
        return carriers

    @property
    def frequencies(self) -> list[float]:
        """Those of the fit with the most carriers."""
        return max((fit.frequencies for fit in self.fits), key=len)

    @property
    def orders(self) -> np.ndarray:
        """The highest order in each variable, η first."""
        return np.max([fit.parts.orders for fit in self.fits], axis=0)
