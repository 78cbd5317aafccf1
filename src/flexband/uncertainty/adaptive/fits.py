"""Expansions fitted to runs, and for each output the one that is best in runs it has not seen."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from flexband.uncertainty.adaptive.parts import Split
from flexband.uncertainty.expansions.expansion import Expansion
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.phases.decomposition import Stage
from flexband.uncertainty.phases.expansion import expansion_of
from flexband.uncertainty.phases.layout import PartColumns
from flexband.uncertainty.surrogates.diagnostics import at_all_times, rms

BATCH = 8
"""Runs are asked for in multiples of this: as many as the lanes of a SIMD register."""

GAIN = 0.8
"""A further carrier is used for an output where it brings the error below this part."""

FAR = np.arange(3.0, 5.5, 0.5)
"""Values of |z| of the normal variables of which ξ are functions, where an expansion must not grow
beyond measure."""

SWEEPS = 3
"""Times that these values are visited, at different η."""

MOST_TIMES = 128
"""Times at which this is seen."""

MARGIN, GROWTH = 1.5, 2
"""There it may leave the range of the runs by this factor, times this power of how much farther
out it is than the runs."""


class Design(Protocol):
    """Where runs are, and how their parts are fitted."""

    @property
    def points(self) -> tuple[np.ndarray, np.ndarray]:
        """ξ and η, shapes (runs, n) and (runs, m)."""
        ...

    def __len__(self) -> int: ...

    def fit(self, stage: Stage) -> HybridExpansion:
        """Return the expansion of the parts of runs at these points."""
        ...

    @property
    def few(self) -> int:
        """A number of first runs, few, from which small series are expanded."""
        ...

    def small(self, series: np.ndarray) -> HybridExpansion:
        """Return the expansion of small series in the first runs, shape (runs, series)."""
        ...

    def extended(self, count: int, split: Split) -> Design:
        """Return the design with so many further runs, or fewer."""
        ...


class Fit(NamedTuple):
    """The expansion of the parts of a response with some number of carriers.

    Attributes
    ----------
    frequencies : of the carriers, in cycles per unit of time.
    """

    parts: HybridExpansion
    columns: PartColumns
    frequencies: list[float]

    @staticmethod
    def of(design: Design, stage: Stage) -> Fit:
        """Fit the runs of a design, which are the first of the stage."""
        parts = design.fit(stage.runs(slice(len(design))))
        return Fit(parts, PartColumns.of_stage(stage), [c.frequency for c in stage.carriers])

    def evaluate(self, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """Return the response at ξ and η, shape (points, outputs, times)."""
        return self.columns.join(self.parts.evaluate(xi, eta))

    def overshoot(self, runs: Runs, thin: slice) -> np.ndarray:
        """Return how far it leaves the range of all runs for random variables far from their mean.

        Moments of a polynomial depend on values there, and high orders may oscillate between the
        outermost runs. Root mean square over each ξ alone, shape (outputs, times).

        Parameters
        ----------
        runs, thin : the runs at some of the times, and which these are.
        """
        orders, all_rows = np.array(self.parts.random_orders, dtype=int), self.columns.width
        parts = self.parts.of_rows(all_rows, np.arange(all_rows), thin)
        low, high = runs.values.min(axis=0), runs.values.max(axis=0)
        x = np.tile(np.concatenate([-FAR, FAR]), SWEEPS)
        weight = np.exp(-x * x / 2) / np.sqrt(2 * np.pi) * np.diff(FAR)[0] / SWEEPS
        eta = np.resize(runs.eta, (len(x), runs.eta.shape[1]))
        square = np.zeros(low.shape)
        for v in np.flatnonzero(orders > 1):
            far = self.parts.families[v].of_normal(x)
            farther = np.abs(far) / max(1.0, np.abs(runs.xi[:, v]).max())
            allowed = MARGIN * np.maximum(1.0, farther) ** GROWTH
            xi = far[:, None] * (np.arange(len(orders)) == v)
            off = self.columns.join(parts.evaluate(xi, eta))
            off = np.abs(off - (low + high) / 2) - allowed[:, None, None] * (high - low) / 2
            square += np.einsum("p,pot->ot", weight, np.maximum(off, 0.0) ** 2)
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

    def __add__(self, other: Runs) -> Runs:  # pyright: ignore[reportIncompatibleMethodOverride]
        return Runs(*(np.concatenate(pair) for pair in zip(self, other, strict=True)))


class Choice(NamedTuple):
    """Fits, and the one that each output uses.

    Attributes
    ----------
    which : number of the fit of each output, shape (outputs,).
    missed : what is missed of held-out runs, shape (runs, outputs, times).
    overshoot : of the fits, shape (outputs, times).
    """

    fits: list[Fit]
    which: np.ndarray
    missed: np.ndarray
    overshoot: np.ndarray

    @staticmethod
    def of(fits: Sequence[Fit], fitted: Runs, held: Runs) -> Choice:
        """Choose the fits that are best in held-out runs; every further carrier has to pay."""
        missed = [held.values - fit.evaluate(held.xi, held.eta) for fit in fits]
        times = held.values.shape[-1]
        thin = slice(None, None, -(-times // MOST_TIMES))
        seen = held.at(thin) + fitted.at(thin)
        over = [at_all_times(fit.overshoot(seen, thin), thin, times) for fit in fits]
        errors = [
            np.hypot(rms(miss), rms(far[None])) / GAIN ** len(fit.frequencies)
            for fit, miss, far in zip(fits, missed, over, strict=True)
        ]
        best, outputs = np.argmin(errors, axis=0), np.arange(held.values.shape[1])
        used, which = np.unique(best, return_inverse=True)
        missed = np.moveaxis(np.stack(missed)[best, :, outputs], 0, 1)
        return Choice([fits[k] for k in used], which, missed, np.stack(over)[best, outputs])

    def expansions(self) -> list[Expansion]:
        """Return the expansions of all outputs, one for each fit."""
        return self.expansions_of(self.fits, self.which)

    @staticmethod
    def expansions_of(fits: Sequence[Fit], which: np.ndarray) -> list[Expansion]:
        """Return the expansions of all outputs by the number of the fit that each uses."""
        return [
            expansion_of(fit.parts, fit.columns).of(np.flatnonzero(which == k))
            for k, fit in enumerate(fits)
        ]

    @property
    def carriers(self) -> np.ndarray:
        """The number of carriers of each output, shape (outputs,)."""
        return np.array([len(fit.frequencies) for fit in self.fits])[self.which]

    @property
    def frequencies(self) -> list[float]:
        """Those of the fit with the most carriers."""
        return max((fit.frequencies for fit in self.fits), key=len)

    @property
    def orders(self) -> np.ndarray:
        """The highest order in each variable, η first."""
        return np.max([fit.parts.orders for fit in self.fits], axis=0)
