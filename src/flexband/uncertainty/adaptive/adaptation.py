"""The course of the adaptive method: fit, judge by check runs, extend, until it is enough."""

from __future__ import annotations

from enum import StrEnum
from itertools import chain
from typing import NamedTuple

import numpy as np

from flexband.basics.progress import listener
from flexband.errors import InputError, RunError
from flexband.uncertainty.adaptive.choice import BestFits, release
from flexband.uncertainty.adaptive.expected_error import ExpectedError
from flexband.uncertainty.adaptive.fits import BATCH, PartsFit, Split, compared_times
from flexband.uncertainty.adaptive.held_out_points import extreme_places, generic_points
from flexband.uncertainty.adaptive.nested_design import (
    MIN_RUNS,
    NestedDesign,
    fewest_fitted,
    first_design,
)
from flexband.uncertainty.adaptive.rare_values import RareValues
from flexband.uncertainty.adaptive.refinement.fit_correction import DiscretizationCorrection
from flexband.uncertainty.adaptive.refinement.refinement import CoarseRuns, Refinement
from flexband.uncertainty.adaptive.regression import SampledDesign
from flexband.uncertainty.adaptive.response_runs import (
    MIN_HELD,
    RareRuns,
    ResponseRuns,
    RunBuffer,
    evaluate_runs,
    successful_runs,
)
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.methods.method import Evaluate, quantities
from flexband.uncertainty.phases.decomposition import Stage, decompose
from flexband.uncertainty.surrogates.axes import series, units_of
from flexband.uncertainty.surrogates.diagnostics import share, step


class AdaptationOptions(NamedTuple):
    """Which runs are made, and which are held out."""

    growth: float = 0.25  # size of a batch, as a part of the fitted runs there are
    # runs that interpolation may start with; if it takes more, terms are found by regression
    max_interpolated: int = 48
    # of so many inputs, a few may matter: samples show these, unless all of so many leave more than
    # this part of the variation
    many_inputs: int = 10
    max_few: int = 7
    tried_samples: int = 56
    max_missed: float = 0.6
    max_rare_runs: int = 2 * BATCH  # runs at rare values of random variables
    # if the budget has at least so many batches, and the tolerance is not met, one of the last is
    # run at rare values
    min_batches_for_rare_runs: int = 10
    # with so many variables, one batch at least follows the first, which has few terms of each,
    # and hardly any of their products
    several_variables: int = 2


class StopReason(StrEnum):
    """Why there are no more runs; `text` is the sentence."""

    TOLERANCE_MET = "tolerance-met"
    BUDGET_USED = "budget-used"
    ORDERS_USED = "orders-used"

    @property
    def text(self) -> str:
        return {
            StopReason.TOLERANCE_MET: "the expansion meets its tolerance",
            StopReason.BUDGET_USED: "the budget is used up",
            StopReason.ORDERS_USED: "all orders are in use",
        }[self]


class Adaptation:
    """The runs of a response so far, and the best that can be made of them."""

    choice: BestFits
    error: ExpectedError  # what is expected of the chosen fits

    def __init__(
        self,
        space: Space,
        evaluate: Evaluate,
        budget: int,
        *,
        phase_resolved: bool,
        corrected_above: float = np.inf,
        options: AdaptationOptions = AdaptationOptions(),
    ):
        """Make the first runs; `budget` is the largest number of all runs.

        An error of the discretization is corrected if it is larger than `corrected_above`, in parts
        of the error bar's width.
        """
        self.space = space
        self.evaluate = evaluate
        self.budget = budget
        self.options = options
        self.details = f" ({text})" if (text := evaluate.discretization_in_words()) else ""
        listener().stage(f"the first runs{self.details}")
        # Choose the design, by how far the budget goes.
        m = space.interval_dimension
        families = space.families
        discs = space.discs
        spare = budget - fewest_fitted(m + len(families))
        # number of check runs at generic points; the others are at extremes
        self.generic = min(BATCH, max(MIN_HELD, spare // 2))
        self.design = first_design(
            m, families, budget - self.generic, options.max_interpolated, discs
        )
        # whether interpolation follows if samples do not show that few variables matter
        many = len(space.uncertain) >= options.many_inputs and not self.design.sampled
        self.tries_samples = many and budget >= options.tried_samples
        if self.tries_samples:
            self.design = SampledDesign(MIN_RUNS, m, families, discs)
        # Run it, with the held-out points that earlier runs do not cover.
        earlier_runs = evaluate.earlier_runs(self.generic)
        new = generic_points(0, self.generic - len(earlier_runs.xi), m, families, discs)
        xi, eta = map(np.concatenate, zip(self.design.points, new, strict=True))
        values = evaluate(xi, eta)
        count = len(self.design)
        self.labels = values[:0].copy()
        self.phase_resolved = phase_resolved
        self.dt = step(values) if phase_resolved else 1.0
        runs = ResponseRuns(xi, eta, series(values))
        self.quantities = quantities(evaluate, runs.values.shape[1])
        if len(earlier_runs.xi):
            earlier_values = earlier_runs.values.reshape(-1, *runs.values.shape[1:])
            runs = ResponseRuns.concatenate(
                runs, ResponseRuns(earlier_runs.xi, earlier_runs.eta, earlier_values)
            )
        self.made = RunBuffer(successful_runs(runs, count), count, budget)  # fitted, and held out
        self.generic = len(self.holdout.values)
        # Nothing is known yet of rare values, extremes and the discretization.
        self.rare = RareRuns.none(runs)
        self.rare_budget = self.options.max_rare_runs
        self.places = np.zeros((0, m))
        self.sloped = False
        self.refinement = Refinement(evaluate, corrected_above)
        # of the error of step and elements, by name; None until it is known
        self.corrections: dict[str, DiscretizationCorrection] | None = None
        self.counted = np.ones(runs.values.shape[1], bool)  # outputs that the tolerance is for
        self._judge(reuse_fits=False)

    def run(self, tolerance: float) -> StopReason:
        """Go on until the error is below the tolerance also at extremes; return why it ended."""
        listener().stage(f"runs until the expansion meets its tolerance{self.details}")
        confirmed = False
        width = np.array(np.inf)
        tested = sum(v.shape[1] for v in self.design.points) < self.options.several_variables
        while True:
            # Compare the error with the tolerance; runs at rare values may change it.
            width = 2 * width  # bands are searched only if they may be wide enough
            met = tested and self._relative(width) <= tolerance
            if met:
                width = self.error.width
                met = self._relative(width) <= tolerance
            last = self.remaining_runs - BATCH <= self._batch
            if tested and self._hold_rare(tolerance, met=met, last=last):
                continue
            # Extend the design, unless the tolerance is met.
            if met:
                reason: StopReason | None = StopReason.TOLERANCE_MET
            else:
                reason = self._extend()
                if reason is None:
                    tested = True
                    confirmed = False
                    continue
                if self._hold_rare(tolerance, met=met, last=True):
                    continue
            # Runs where bounds are attained confirm the end, or the course goes on.
            if confirmed or not self._hold_extremes(tolerance):
                return reason
            confirmed = True

    def _relative(self, width: np.ndarray) -> float:
        """Return the largest error of the outputs that count, relative to a width."""
        return self.error.relative(self.error.values, np.where(self.counted, width, np.inf))

    @property
    def design_runs(self) -> ResponseRuns:
        """The runs of the design, to which expansions are fitted."""
        return self.made.design_runs

    @property
    def holdout(self) -> ResponseRuns:
        """The check runs."""
        return self.made.holdout

    @property
    def check_run_count(self) -> int:
        """Number of runs that are not fitted."""
        return len(self.holdout.values) + len(self.rare.weight)

    @property
    def remaining_runs(self) -> int:
        """Runs that the budget still allows."""
        return self.budget - len(self.design_runs.values) - self.check_run_count

    @property
    def runs(self) -> int:
        """Number of runs."""
        return len(self.design_runs.values) + self.check_run_count + self.refinement.fine_run_count

    def _judge(self, *, reuse_fits: bool = True) -> None:
        """Fit the runs and choose the best of the new fits and, with `reuse_fits`, those in use."""
        self.corrections = None
        self.stages = []
        in_use = []
        if reuse_fits:
            in_use = self.choice.fits
            del self.choice, self.error  # the memory of what they missed is free
        F = self.made.all.values
        earlier_fits = len(in_use)
        stages = decompose(F, self.dt) if self.phase_resolved else [Stage([], F)]
        fits = chain(release(in_use), map(self._fit, stages))
        arguments = self.design_runs, self.holdout, self.generic, self.rare, self.design.weights
        self.choice = BestFits.from_fits(fits, *arguments, earlier_fits)
        m = self.places.shape[1]
        of = self.generic, F, self.dt, m, units_of(self.labels), self.quantities
        self.error = ExpectedError.from_choice(self.choice, *of)

    def _fit(self, stage: Stage) -> PartsFit:
        self.stages.append(compared_times(stage))
        return PartsFit.from_design(self.design, stage)

    @property
    def _batch(self) -> int:
        """Number of runs of the next batch."""
        return max(BATCH, BATCH * round(self.options.growth * len(self.design) / BATCH))

    def _extend(self) -> StopReason | None:
        """Run and fit the next batch; return why there is none.

        A batch is kept for runs at extremes.
        """
        fit_count = len(self.design)
        budget = self.remaining_runs - BATCH
        if budget < 1:
            return StopReason.BUDGET_USED
        variables = self.space.interval_dimension + self.space.random_dimension
        if self.tries_samples and budget > 2 * variables and self._many_matter(fit_count):
            self.tries_samples = False
            self._interpolate(budget)
            return None
        split = Split.from_stages(self.stages, self.choice.carriers, self.holdout, self.counted)
        design = self.design.extend(min(self._batch, budget), split)
        if len(design) == fit_count:
            return StopReason.ORDERS_USED
        xi, eta = (v[fit_count:] for v in design.points)
        self.made.fit(evaluate_runs(self.evaluate, xi, eta, len(xi)))
        self.design = design
        self._judge()
        return None

    def _many_matter(self, samples: int) -> bool:
        """Return whether so many samples show that many variables matter, or show nothing."""
        options = self.options
        missed = float(self.error.missed[self.counted].max(initial=0.0))
        if missed < options.max_missed:
            return int(np.count_nonzero(self.choice.orders)) > options.max_few
        return samples >= options.tried_samples

    def _interpolate(self, budget: int) -> None:
        """Begin again with runs to interpolate; the samples are held out from now on."""
        space = self.space
        sampled = self.design_runs
        holdout = self.holdout
        m = space.interval_dimension
        families = space.families
        discs = space.discs
        self.design = NestedDesign.first(m, families, budget, discs)
        new = evaluate_runs(self.evaluate, *self.design.points, len(self.design))
        parts = (
            holdout.which(slice(self.generic)),
            sampled,
            holdout.which(slice(self.generic, None)),
        )
        self.generic += len(sampled.values)
        runs = ResponseRuns.concatenate(new, *parts)
        self.made = RunBuffer(runs, len(new.values), self.budget)
        del self.choice, self.error
        self._judge(reuse_fits=False)

    def _hold_extremes(self, tolerance: float) -> bool:
        """Run and hold out a batch where bounds are attained; return whether these places are new.

        Without intervals, at further generic points. Without random inputs, fitted runs tell bounds
        as well: a run at their places would add nothing. A part of the first whole batch is at rare
        values of random inputs.
        """
        m = self.places.shape[1]
        families = self.space.families
        count = min(BATCH, self.remaining_runs)
        rare: RareValues | None = None
        if families and count == BATCH and not self.sloped:
            rare = RareValues.along_slopes(self.error.slopes(families), families, m)
            count -= len(rare.weight)
        places = np.zeros((min(1, count), 0))
        if m:
            run_places = (
                self.places if families else np.concatenate([self.places, self.design_runs.eta])
            )
            reached = self.error.bounds_at(run_places)
            places = extreme_places(self.error.extremes, count, reached, tolerance)
        if not len(places):
            return False
        self.places = np.concatenate([self.places, places])
        eta = np.repeat(places, count // len(places) if families else 1, axis=0)
        xi, _ = generic_points(len(self.holdout.values), len(eta), m, families)
        self.made.hold(evaluate_runs(self.evaluate, xi, eta))
        if rare:
            self.sloped = True
            self._run_rare(rare._replace(eta=np.resize(places, rare.eta.shape)))
        self._judge()
        return True

    def _hold_rare(self, tolerance: float, *, met: bool, last: bool) -> bool:
        """Run at rare values where the fit that misses least grows most; return whether there are.

        It is for fits that only their growth speaks against, and the last runs of all.
        """
        doubted = self.choice.doubted
        m = self.places.shape[1]
        count = min(len(doubted.values.weight), self.rare_budget, self.remaining_runs - BATCH)
        if count < 1 or (met and doubted.taken):
            return False
        part = np.where(self.counted, share(m) / self.error.width, 0.0)
        grows = np.max(part * doubted.overshoot) > tolerance >= np.max(part * doubted.missed)
        enough = self.budget >= self.options.min_batches_for_rare_runs * BATCH
        unseen = enough and self.rare_budget == self.options.max_rare_runs
        if not (grows or (last and unseen)):
            return False
        self.rare_budget -= count
        if made := self._run_rare(doubted.values.which(slice(count))):
            self._judge()
        return made

    def _run_rare(self, values: RareValues) -> bool:
        """Run at rare values of random inputs; return whether some of them have a meaning."""
        xi, eta, _, weight = values
        if not len(weight):
            return False
        try:
            responses = series(self.evaluate(xi, eta))
        except (RunError, InputError):
            alone = [values.which(slice(k, k + 1)) for k in range(len(weight))]
            return len(alone) > 1 and sum(map(self._run_rare, alone)) > 0
        finite_mask = np.isfinite(responses).all(axis=(1, 2))
        if not finite_mask.any():
            return False
        new = ResponseRuns(xi[finite_mask], eta[finite_mask], responses[finite_mask])
        weight = np.concatenate([self.rare.weight, weight[finite_mask]])
        self.rare = RareRuns(ResponseRuns.concatenate(self.rare.runs, new), weight)
        return True

    def discretization(self) -> dict[str, DiscretizationCorrection]:
        """Return what corrects each part of the discretization, with the error that is left.

        None are returned if a finer run fails, which is an error where the discretization is left
        to the method.
        """
        if self.corrections is None:
            few = self.design_runs.which(slice(self.design.few))
            holdout = self.holdout.which(slice(self.generic))
            coarse = CoarseRuns(few, holdout, self.design.small)
            self.corrections = self.refinement.corrections(coarse, self.error, self.dt)
        return self.corrections
