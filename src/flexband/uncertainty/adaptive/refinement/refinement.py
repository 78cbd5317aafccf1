"""The finer runs of a response, made once, and what they correct of its expansions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexband.uncertainty.adaptive.expected_error import ExpectedError
from flexband.uncertainty.adaptive.refinement.changes import SECOND_ORDER, SmallExpansion
from flexband.uncertainty.adaptive.refinement.fit_correction import (
    CorrectedPart,
    DiscretizationCorrection,
    ExtrapolationOptions,
    corrections_of,
)
from flexband.uncertainty.adaptive.refinement.refined_runs import (
    RefinedRuns,
    refined_runs,
    refined_together,
)
from flexband.uncertainty.adaptive.refinement.spectrum import ErrorSpectrum
from flexband.uncertainty.adaptive.response_runs import ResponseRuns
from flexband.uncertainty.methods.method import Evaluate
from flexband.uncertainty.surrogates.axes import series
from flexband.uncertainty.surrogates.diagnostics import running_rms


class CoarseRuns(NamedTuple):
    """Runs on the discretization whose error is corrected."""

    few: ResponseRuns  # at points of the design, from which `expand` expands small series
    holdout: ResponseRuns  # held out, at generic points
    expand: SmallExpansion


class Refinement:
    """The runs on finer discretizations."""

    def __init__(
        self,
        evaluate: Evaluate,
        above: float,
        options: ExtrapolationOptions = ExtrapolationOptions(),
    ):
        """Make no runs yet.

        An error is corrected if it is larger than `above`, relative to the error bar's width; if
        that is infinite, it is only estimated.
        """
        self.evaluate = evaluate
        self.above = above
        self.options = options
        self.corrects = bool(np.isfinite(above))
        # by the name of what is finer; None until they are made
        self.runs: dict[str, RefinedRuns] | None = None
        # the first check run where all of this is finer at once; None until it is made
        self.together: np.ndarray | None = None
        self.spectra: dict[str, ErrorSpectrum] = {}  # by name, once they are known

    @property
    def fine_run_count(self) -> int:
        """Number of runs on finer discretizations."""
        alone = sum(runs.fine_run_count for runs in (self.runs or {}).values())
        return alone + (self.together is not None)

    def corrections(
        self, coarse: CoarseRuns, error: ExpectedError, dt: float
    ) -> dict[str, DiscretizationCorrection]:
        """Return what corrects each part of the discretization, with the error that is left.

        None are returned if a finer run fails, which is an error where the discretization is left
        to the method. The error is that of the expansions that are corrected, dt the step of the
        times.
        """
        options = self.options
        refinements = self.evaluate.refinements() if self.corrects else {}
        holdout = coarse.holdout.which(slice(options.holdout_runs))
        # Make the first refined runs, and those of the design where the error is large.
        if self.runs is None:
            first = holdout if self.corrects else coarse.few
            fitted = 0 if self.corrects else len(first.values)
            self.runs = refined_runs(self.evaluate, first.copy(), fitted)
        small: dict[str, DiscretizationCorrection] = {}
        for name, runs in self.runs.items():
            if self.corrects and not runs.fitted:
                change = SECOND_ORDER * runs.change
                if error.relative(change) <= self.above:
                    small[name] = DiscretizationCorrection.none(error.choice, change)
                    continue
                runs_with_design = runs.with_design(coarse.few.copy(), refinements[name], name)
                self.runs[name] = runs_with_design.with_finest(
                    options.finest, refinements[name], name
                )
        # Where several names are corrected at once, a run that is finer in all tells their product.
        large = {name: runs for name, runs in self.runs.items() if name not in small}
        m = holdout.eta.shape[1]
        arguments = error.choice, coarse.expand, large, dt, m
        corrections = corrections_of(*arguments, self.together, options=options)
        kinds = np.array([correction.kinds for correction in corrections.values()])
        joint_correction = len(kinds) > 1 and np.any(np.all(kinds != CorrectedPart.NOTHING, axis=0))
        if self.together is None and joint_correction:
            first = holdout.which(slice(1)).copy()
            self.together = refined_together(self.evaluate, first, list(large))
            corrections = corrections_of(*arguments, self.together, options=options)
        corrections |= small
        return {
            name: corrections[name]._replace(
                error=running_rms(corrections[name].error, error.window)
            )
            for name in self.runs
        }

    def spectrum(self, name: str, dt: float) -> ErrorSpectrum:
        """Return at which frequencies runs differ from those where what is named is finer.

        It is that of a check run at the times of all steps, or, if the response tells nothing of
        these, of all refined runs as far as their times, dt apart, show it.
        """
        if name not in self.spectra:
            assert self.runs is not None
            runs = self.runs[name]
            holdout = runs.coarse.which(slice(runs.fitted, None) if self.corrects else slice(1))
            change = runs.fine - runs.coarse.values
            at = (holdout.xi[:1], holdout.eta[:1])
            spectrum = ErrorSpectrum.from_change(change, dt, resolved=False)
            coarse = self.evaluate.at_more_times(*at)
            fine = self.evaluate.refinements()[name].at_more_times(*at)
            if coarse is not None and fine is not None:
                few = coarse.shape[-1] - 1
                many = fine.shape[-1] - 1
                if many % few == 0:
                    dt *= (change.shape[-1] - 1) / few
                    change = series(fine)[..., :: many // few] - series(coarse)
                    spectrum = ErrorSpectrum.from_change(change, dt, resolved=True)
            self.spectra[name] = spectrum
        return self.spectra[name]
