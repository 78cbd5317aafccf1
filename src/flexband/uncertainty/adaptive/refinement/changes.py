"""How the parts of runs differ between a discretization and finer ones.

The difference is small and almost linear in the inputs. With an error of order p it is the part
1 − 2⁻ᵖ of the error, which a third level tells.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from flexband.basics.rounding import ROUNDING
from flexband.uncertainty.adaptive.fits import PartsFit
from flexband.uncertainty.adaptive.refinement.refined_runs import RefinedRuns
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.phases.decomposition import Stage, follow
from flexband.uncertainty.phases.layout import PartColumns
from flexband.uncertainty.surrogates.diagnostics import rms

SECOND_ORDER = 4 / 3
"""The error of a method of order two, as a multiple of the difference from half the step."""

SmallExpansion = Callable[[np.ndarray], HybridExpansion]
"""The expansion of small series that are known in the runs of a design, shape (runs, series)."""

MAX_ORDER = 4
"""Of convergence: errors that fall faster are as good as gone on the finer discretization."""


class RunChanges(NamedTuple):
    """The parts of runs, and how they change on finer discretizations."""

    columns: PartColumns  # of the parts
    parts: np.ndarray  # of the coarse runs, (runs, series)
    change: np.ndarray  # from these to the fine ones, (runs, series)
    second_change: np.ndarray  # from the fine to the finest runs, (finest, series)
    fitted: int  # number of runs that are not held out, the first ones

    @staticmethod
    def of_values(fit: PartsFit, runs: RefinedRuns) -> RunChanges:
        """Return how the values of a fit's outputs change."""
        return RunChanges._of([Stage([], values) for values in runs.levels], fit, runs)

    @staticmethod
    def of_phases(fit: PartsFit, runs: RefinedRuns, dt: float) -> RunChanges | None:
        """Return how phases, envelopes and base of a fit's outputs change; None if one is lost.

        Each run is split with phases that start from those of the fit, so that its parts are those
        of the fit, but for what this misses.
        """
        parts = fit.parts.evaluate(runs.coarse.xi, runs.coarse.eta)
        phases = [phase[:, 0] for phase, _, _ in fit.columns.unpack(parts)[1]]
        stages = []
        for rows, values in zip((..., ..., runs.third_level), runs.levels, strict=True):
            if not len(values):
                stages.append(stages[0].part(slice(0)))
            elif stage := follow(values, dt, [phase[rows] for phase in phases], fit.frequencies):
                stages.append(stage)
            else:
                return None
        return RunChanges._of(stages, fit, runs)

    @staticmethod
    def _of(stages: list[Stage], fit: PartsFit, runs: RefinedRuns) -> RunChanges:
        """Return how a fit's outputs change, of all outputs on three levels."""
        of_fit = [stage.part(outputs=fit.outputs) for stage in stages]
        columns = PartColumns.of_stage(of_fit[0])
        coarse, fine, finest = map(columns.pack, of_fit)
        second_change = finest - fine[runs.third_level]
        return RunChanges(columns, coarse, fine - coarse, second_change, runs.fitted)

    def first(self, changes: Sequence[RunChanges]) -> np.ndarray:
        """Return the first check run with the sum of its changes, shape (outputs, times)."""
        total = sum(change.change[self.fitted] for change in changes)
        return self.columns.join((self.parts[self.fitted] + total)[None])[0]

    @property
    def holdout_rows(self) -> slice:
        """The rows of the check runs."""
        return slice(self.fitted, None)

    @property
    def third_level(self) -> slice:
        """The runs that are made on three levels."""
        return slice(self.fitted, self.fitted + len(self.second_change))

    @property
    def factors(self) -> np.ndarray:
        """The error as a multiple of the change, one per series: 1 / (1 − 2⁻ᵖ).

        p is the order from 1 to 4 by which base, phase or envelope of an output converge over three
        levels; where they show none, the error is that of the coarse runs alone, 1.
        """
        shape = -1, self.columns.width, self.change.shape[1] // self.columns.width
        if not len(self.second_change):
            return np.full(self.change.shape[1], SECOND_ORDER)
        before = self.change[self.third_level].reshape(shape)
        after = self.second_change.reshape(shape)
        products = np.einsum("rst,rst->s", before, after), np.einsum("rst,rst->s", before, before)
        for sums in products:  # an envelope is one complex number
            for first in range(self.columns.real, self.columns.width, self.columns.block):
                envelope = sums[first : first + 2 * self.columns.outputs].reshape(2, -1)
                envelope[:] = envelope.sum(axis=0)
        ratio = products[0] / np.maximum(products[1], 1e-300)
        converging = (ratio > 0.5 ** (MAX_ORDER + 0.5)) & (ratio < 0.5**0.5)
        order = np.round(-np.log2(np.where(converging, ratio, 0.25)))
        factors = np.where(converging, 1 / (1 - 0.5**order), 1.0)
        return np.repeat(factors, shape[2])


class Extrapolation(NamedTuple):
    """The correction of some outputs, and what it misses of runs that are held out of it."""

    changes: RunChanges  # of runs
    expansion: HybridExpansion  # the change of their parts
    factors: np.ndarray  # the error as a multiple of the change, (series,)
    shift: np.ndarray  # what the third level adds to the corrected parts, mean over runs, (series,)
    # what is missed of the check runs, since the correction is linear in the inputs, shape
    # (held, outputs, times)
    missed: np.ndarray
    # and of the runs on three levels, since the order is not exact, (finest, outputs, times)
    missed_order: np.ndarray
    levels: np.ndarray  # the runs on three levels, coarse first, (3, finest, outputs, times)

    @staticmethod
    def from_changes(
        changes: RunChanges, expand: SmallExpansion, runs: RefinedRuns
    ) -> Extrapolation:
        """Expand the change of the runs of the design, and extrapolate it."""
        factors = changes.factors
        join = changes.columns.join
        expansion = expand(changes.change[: changes.fitted])
        holdout = changes.holdout_rows
        third = changes.third_level
        single = join(changes.parts[holdout] + factors * changes.change[holdout])
        fitted = factors * expansion.evaluate(runs.coarse.xi[holdout], runs.coarse.eta[holdout])
        missed = single - join(changes.parts[holdout] + fitted)
        shift = (1 - factors) * changes.change[third] + factors * changes.second_change
        order = join(changes.parts[third] + factors * changes.change[third] + shift)
        fine = changes.parts[third] + changes.change[third]
        levels = changes.parts[third], fine, fine + changes.second_change
        return Extrapolation(
            changes,
            expansion,
            factors,
            shift.mean(axis=0) if len(shift) else np.zeros(shift.shape[1]),
            missed,
            order - single[: len(shift)],
            np.stack(list(map(join, levels))),
        )

    @property
    def correction(self) -> HybridExpansion:
        """The correction of the parts."""
        return self.expansion * self.factors

    @property
    def before(self) -> np.ndarray:
        """How far the coarse runs are from the finest, root mean square, (outputs,)."""
        coarse, _, finest = self.levels
        return rms(finest - coarse) if len(coarse) else np.zeros(coarse.shape[1])

    @property
    def after(self) -> np.ndarray:
        """How far corrected runs are from those extrapolated by three levels, (outputs,)."""
        if not len(self.missed_order):
            return self.before
        return np.hypot(rms(self.missed), rms(self.missed_order))

    @property
    def part(self) -> np.ndarray:
        """The error of corrected runs as a part of that of coarse ones, (outputs,).

        It is infinite for outputs that do not change, but for rounding, or hardly any more on the
        third level, as if this were no finer.
        """
        coarse, fine, finest = self.levels
        before = self.before
        second_change = rms(finest - fine)
        max_halvings = 7  # by which errors do not fall at once from one level to the next
        changes = (before > ROUNDING * rms(coarse)) & (second_change > 0.5**max_halvings * before)
        return np.where(changes, self.after / np.where(changes, before, 1.0), np.inf)
