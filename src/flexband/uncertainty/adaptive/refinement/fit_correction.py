"""The error of step and mesh, and its correction by runs on finer discretizations.

A few runs of the design are made again on a discretization twice as fine. Their change is small and
nearly linear in the inputs, as values at fixed times, or as phases, envelopes and base. Without
further runs the bands with and without it tell the error. With some runs that are held out of it,
the first of them on a third level, it corrects the expansion (Richardson's extrapolation), for each
output as values or as phases if that removes most of the error in these runs; what is left in them
is then the error.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from flexband.uncertainty.adaptive.choice import BestFits
from flexband.uncertainty.adaptive.fits import PartsFit
from flexband.uncertainty.adaptive.refinement.changes import (
    SECOND_ORDER,
    Extrapolation,
    RunChanges,
    SmallExpansion,
)
from flexband.uncertainty.adaptive.refinement.refined_runs import RefinedRuns
from flexband.uncertainty.expansions.expansion import extremes_of
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.phases.expansion import expansion_of
from flexband.uncertainty.phases.layout import PartColumns
from flexband.uncertainty.surrogates.diagnostics import (
    at_all_times,
    mean_difference,
    rms,
    share,
    stack_extremes,
)


class ExtrapolationOptions(NamedTuple):
    """When the error of step and mesh is corrected."""

    holdout_runs: int = 2  # runs that are held out of the correction
    finest: int = 1  # how many of them are made on a third level
    threshold: float = 0.1  # errors below this part of the tolerance are not corrected
    # an output is corrected if less than this part of its error is left in the runs that were held
    # out: a correction that leaves more is worth less than the same time spent on a finer
    # discretization
    most_left: float = 0.25
    max_times: int = 600  # at which bands are compared


class CorrectedPart(StrEnum):
    """What of an output is corrected."""

    NOTHING = "nothing"
    VALUES = "values"
    PHASES = "phases"


class FitCorrection(NamedTuple):
    """The correction of the outputs of a fit."""

    fit: PartsFit  # of coarse runs
    kinds: np.ndarray  # what of each output is corrected
    # by kind; that of phases only if the fit has carriers, and they can be followed
    extrapolations: Mapping[CorrectedPart, Extrapolation]

    @staticmethod
    def from_fit(
        fit: PartsFit,
        expand: SmallExpansion,
        runs: RefinedRuns,
        dt: float,
        options: ExtrapolationOptions,
    ) -> FitCorrection:
        """Decide by runs on three levels, if there are any, what of each output is corrected."""
        changes = {CorrectedPart.VALUES: RunChanges.of_values(fit, runs)}
        phases = RunChanges.of_phases(fit, runs, dt) if fit.frequencies else None
        if phases is not None:
            changes[CorrectedPart.PHASES] = phases
        extrapolations = {
            kind: Extrapolation.from_changes(change, expand, runs)
            for kind, change in changes.items()
        }
        kinds = np.full(len(fit.outputs), CorrectedPart.NOTHING)
        smallest_part = np.full(len(fit.outputs), options.most_left)
        for kind, extrapolation in extrapolations.items() if len(runs.finest) else ():
            better = extrapolation.part < smallest_part
            kinds[better] = kind
            smallest_part[better] = extrapolation.part[better]
        return FitCorrection(fit, kinds, extrapolations)

    @staticmethod
    def none(fit: PartsFit) -> FitCorrection:
        """Return that nothing is corrected."""
        return FitCorrection(fit, np.full(len(fit.outputs), CorrectedPart.NOTHING), {})

    @property
    def corrects(self) -> np.ndarray:
        """Which outputs are corrected."""
        return self.kinds != CorrectedPart.NOTHING

    @property
    def before(self) -> np.ndarray:
        """The error of each output in the runs on three levels, root mean square, (outputs,)."""
        return self.extrapolations[CorrectedPart.VALUES].before

    @property
    def after(self) -> np.ndarray:
        """What is left of it."""
        after = self.before
        for kind, extrapolation in self.extrapolations.items():
            mask = self.kinds == kind
            after = np.where(mask, extrapolation.after, after)
        return after

    def in_fit_columns(
        self,
        kind: CorrectedPart,
        expansion: HybridExpansion,
        outputs: np.ndarray,
        times: slice = slice(None),
    ) -> HybridExpansion:
        """Return an expansion of a kind's parts of some outputs, by place, in columns of the fit.

        Values are bases.
        """
        columns = self.extrapolations[kind].changes.columns
        some = expansion.of_rows(columns.width, columns.of_outputs(outputs), times)
        fit_columns = PartColumns.from_outputs(len(outputs), self.fit.columns.carriers)
        if fit_columns.carriers == columns.carriers:
            return some
        return some.embed_rows(len(outputs), fit_columns.width, np.arange(len(outputs)))

    def error(self, m: int, times: int, options: ExtrapolationOptions) -> np.ndarray:
        """Return the error expected of mean and error bar, (2, outputs, times)."""
        thin = slice(None, None, -(-times // options.max_times))
        error = np.empty((2, len(self.kinds), times))
        for kind in map(CorrectedPart, np.unique(self.kinds)):
            outputs = np.flatnonzero(self.kinds == kind)
            fit = self.fit.of_outputs(self.fit.outputs[outputs]).at(thin)
            first = fit.hybrid
            if kind == CorrectedPart.NOTHING:
                last_kind = list(self.extrapolations)[-1]  # phases, if they can be followed
                change = self.extrapolations[last_kind].expansion
                factor = SECOND_ORDER
                second = first + self.in_fit_columns(last_kind, change, outputs, thin)
            else:
                extrapolation = self.extrapolations[kind]
                factor = 1.0
                shift = extrapolation.expansion.constant(extrapolation.shift)
                first += self.in_fit_columns(kind, extrapolation.correction, outputs, thin)
                second = first + self.in_fit_columns(kind, shift, outputs, thin)
            bounds = (
                stack_extremes(extremes_of([expansion_of(fit.outputs, parts, fit.columns)]))
                for parts in (first, second)
            )
            moved = factor * at_all_times(mean_difference(*bounds), thin, times)
            if kind != CorrectedPart.NOTHING:
                missed = self.extrapolations[kind].missed[:, outputs]
                moved = np.hypot(moved, share(m) * np.sqrt(np.mean(missed**2, axis=0)))
            error[:, outputs] = moved
        return error


class DiscretizationCorrection(NamedTuple):
    """The correction of all outputs by what is finer, and the error that is left."""

    fits: list[FitCorrection]  # of each fit
    error: np.ndarray  # expected of mean and error bar, (2, outputs, times)

    @staticmethod
    def none(choice: BestFits, error: np.ndarray) -> DiscretizationCorrection:
        """Return no correction; the error of both bands, (outputs, times), is at most so large."""
        fits = [FitCorrection.none(fit) for fit in choice.fits]
        return DiscretizationCorrection(fits, np.stack([error, error]))

    @property
    def kinds(self) -> np.ndarray:
        """What of each output is corrected."""
        kinds = np.full(self.error.shape[1], CorrectedPart.NOTHING)
        for fit in self.fits:
            kinds[fit.fit.outputs] = fit.kinds
        return kinds


def corrections_of(
    choice: BestFits,
    expand: SmallExpansion,
    runs: Mapping[str, RefinedRuns],
    dt: float,
    m: int,
    together: np.ndarray | None = None,
    *,
    options: ExtrapolationOptions = ExtrapolationOptions(),
) -> dict[str, DiscretizationCorrection]:
    """Return what corrects each part of the discretization, by name.

    Parameters
    ----------
    choice : fits of coarse runs.
    expand : makes the expansion of changes in the runs at points of the design.
    runs : refined ones.
    m : number of interval variables.
    together : the first run on three levels, where all is finer at once, (outputs, times).
    """
    if not runs:
        return {}
    # Decide for each fit what is corrected of its outputs.
    outputs, times = choice.missed.shape[1:]
    missed = np.zeros((outputs, times))
    by_fit = []
    for fit in choice.fits:
        parts = [FitCorrection.from_fit(fit, expand, some, dt, options) for some in runs.values()]
        of_fit = np.zeros((len(fit.outputs), times))
        if together is not None:
            of_fit = SECOND_ORDER**2 * _missed_together(parts, together[fit.outputs])
        by_fit.append(_decide_corrections(parts, of_fit, options))
        missed[fit.outputs] = np.where(by_fit[-1][0].corrects[:, None], of_fit, 0.0)
    # Collect the corrections and their errors by name.
    corrections = {}
    for name, fits in zip(runs, zip(*by_fit, strict=True), strict=True):
        error = np.empty((2, outputs, times))
        for fit in fits:
            error[:, fit.fit.outputs] = fit.error(m, times, options)
        corrections[name] = DiscretizationCorrection(list(fits), np.hypot(error, missed))
        missed = np.zeros_like(missed)  # it counts once
    return corrections


def _missed_together(parts: list[FitCorrection], together: np.ndarray) -> np.ndarray:
    """Return what the sum of the changes misses of a run where all is finer, (outputs, times).

    It is zero for outputs of which not all is corrected.
    """
    missed = np.zeros_like(together)
    kinds = np.array([part.kinds for part in parts])
    for pattern in np.unique(kinds, axis=1).T:
        outputs = np.flatnonzero(np.all(kinds == pattern[:, None], axis=0))
        if CorrectedPart.NOTHING in pattern:
            continue
        pairs = list(zip(parts, map(CorrectedPart, pattern), strict=True))
        changes = [part.extrapolations[kind].changes for part, kind in pairs]
        values = parts[0].extrapolations[CorrectedPart.VALUES].changes.first([])
        for kind in CorrectedPart.VALUES, CorrectedPart.PHASES:
            same = [change for change, which in zip(changes, pattern, strict=True) if which == kind]
            if same:
                values = values + same[0].first(same) - same[0].first([])
        missed[outputs] = together[outputs] - values[outputs]
    return missed


def _decide_corrections(
    parts: list[FitCorrection], missed: np.ndarray, options: ExtrapolationOptions
) -> list[FitCorrection]:
    """Return corrections of a fit of those outputs only of which little error is left in all.

    The sum of the corrections missed so much, (outputs, times).
    """
    before = sum(part.before for part in parts)
    after = sum(part.after for part in parts) + rms(missed[None])
    mask = after < options.most_left * before
    return [
        part._replace(kinds=np.where(mask, part.kinds, CorrectedPart.NOTHING)) for part in parts
    ]


def divide_by_correction(
    fits: Sequence[PartsFit], corrections: Sequence[DiscretizationCorrection]
) -> list[tuple[PartsFit, HybridExpansion | None]]:
    """Return fits, divided so that each is corrected as a whole, each with how its parts change.

    There is a correction for each part of the discretization. None stands for no change. Outputs of
    a fit share phases, which are corrected of all or none.
    """
    if not corrections:
        return [(fit, None) for fit in fits]
    divided = []
    for k, fit in enumerate(fits):
        by_name = [correction.fits[k] for correction in corrections]
        kinds = np.array([correction.kinds for correction in by_name]).reshape(-1, len(fit.outputs))
        patterns, group = np.unique(kinds == CorrectedPart.PHASES, axis=1, return_inverse=True)
        for number in range(patterns.shape[1]):
            outputs = np.flatnonzero(group.ravel() == number)
            divided.append((fit.of_outputs(fit.outputs[outputs]), _change(by_name, outputs)))
    return divided


def _change(corrections: Sequence[FitCorrection], outputs: np.ndarray) -> HybridExpansion | None:
    """Return the sum of the corrections of outputs that share phases."""
    total = None
    for correction in corrections:
        kinds = correction.kinds[outputs]
        if np.all(kinds == CorrectedPart.NOTHING):
            continue
        kind = CorrectedPart.PHASES if CorrectedPart.PHASES in kinds else CorrectedPart.VALUES
        change = correction.in_fit_columns(
            kind, correction.extrapolations[kind].correction, outputs
        )
        if kind == CorrectedPart.VALUES:
            columns = PartColumns.from_outputs(len(outputs), correction.fit.columns.carriers)
            mask = np.pad(kinds == kind, (0, columns.width - len(outputs)))
            change *= np.repeat(mask, change.coefficients.shape[1] // columns.width)
        total = change if total is None else total + change
    return total
