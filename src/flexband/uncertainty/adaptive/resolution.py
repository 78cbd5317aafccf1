"""The discretization that a tolerance asks for, where step or elements are left out.

The first runs of a coarse discretization, and a few of them on a finer one, tell its error in parts
of the error bar's width. What is too coarse is halved until this error is half of the tolerance;
the expansion has the other half. An output whose error no longer falls asks for nothing finer.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from flexband.basics.progress import listener
from flexband.errors import AssemblyError, InputError, RunError
from flexband.uncertainty.adaptive.adaptation import Adaptation
from flexband.uncertainty.adaptive.refinement.fit_correction import CorrectedPart
from flexband.uncertainty.methods.method import Evaluate
from flexband.uncertainty.phases.carriers import CarrierOptions
from flexband.uncertainty.surrogates.axes import names_of_outputs
from flexband.uncertainty.surrogates.diagnostics import DOUBT
from flexband.uncertainty.surrogates.unconverged import Cause, Unconverged, attributes


class RefinementOptions(NamedTuple):
    """When step and elements are halved."""

    share: float = 0.5  # part of the tolerance that is for the discretization
    # order of convergence, by which several halvings at once are chosen; that of what a correction
    # leaves is twice as high
    order: int = 2
    resolved: float = 0.3  # error relative to the bar's width below which this order is relied on
    # an error that falls by less in every one of two halvings does not converge; order two gives
    # 1/4
    fall_per_halving: float = 0.5**0.5
    # two halvings show this of an error above this part of what the expansion misses
    clear: float = 0.25
    # so many halvings show it of smaller errors, and of large ones in outputs that the expansion
    # does not explain, or that vanish: the error is larger than the width of the error bar, which
    # is halved with every halving. What it does explain may be a vibration that longer steps do not
    # follow at all
    halvings_of_noise: int = 4
    max_at_once: int = 3  # halvings from one level to the next
    max_halvings: int = 9  # halvings in all
    # halvings in all for vibrations of members that are too fast for the times of the response, so
    # that no correction and no expansion can follow them
    max_for_waves: int = 7
    # phase error [rad] below which a vibration is followed from one level to the next; if it is
    # larger, it explains that the error does not fall yet
    followed: float = 0.3
    least_steps: float = 5.0  # per period, from which on the frequency of a vibration is known
    margin: float = 2.0  # by which an error after further halvings may exceed its prediction
    max_failed: int = 2  # levels that fail in a row before the last that did not is taken


def solve_with_refinement(
    begin: Callable[[Evaluate], Adaptation],
    evaluate: Evaluate,
    tolerance: float,
    *,
    options: RefinementOptions = RefinementOptions(),
) -> tuple[Adaptation, dict[str, object]]:
    """Return the runs on the discretization that is fine enough, or on the one that is given.

    If finer ones fail, it is the finest of which the error is known. `begin` makes the first runs
    of a response; `evaluate` is the response on the coarsest discretization.
    """
    left_out = list(evaluate.description.left_out)
    if not left_out:
        course = begin(evaluate)
        return course, {"stopped": course.run(tolerance), "runs_coarser": 0}
    # Solve on finer and finer levels, until the error of the discretization is small enough.
    levels = Levels(left_out, options.share * tolerance, options)
    finished = None
    halved = 0
    coarser_runs = 0
    failed = 0
    names = []
    while True:
        course = None
        last = halved >= options.max_halvings
        try:
            course = begin(evaluate)
            halvings = levels.needed_halvings(course, names)
            if last or not halvings:
                course.counted = ~levels.waves
                stopped = course.run((1 - options.share) * tolerance)
                halvings = levels.needed_halvings(course, names)
                if last or not halvings:
                    details = levels.convergence_failures(course) | {"stopped": stopped}
                    return course, {**details, "runs_coarser": coarser_runs, "halved": names}
            finished = (course, names)
            failed = 0
        except (RunError, InputError, MemoryError) as error:
            failed += 1
            # they cannot avoid an error at the start, or one that the response raises itself
            in_steps = isinstance(error, RunError) and not isinstance(error, AssemblyError)
            response_error = error.__cause__ is not None and not isinstance(
                error.__cause__, RunError
            )
            shorter_steps_may_help = in_steps and not response_error and not last
            # Return to the last level that did not fail, unless shorter steps may help.
            if finished and not (shorter_steps_may_help and failed < options.max_failed):
                coarser_runs += course.runs if course else 0
                course, names = finished
                coarser_runs -= course.runs
                why = "; ".join((str(error) or type(error).__name__).splitlines()[:2])
                stopped = course.run((1 - options.share) * tolerance)
                details = {"not_refined": f"a finer one fails ({why})", "stopped": stopped}
                return course, {**details, "runs_coarser": coarser_runs, "halved": names}
            if not shorter_steps_may_help:
                raise
            halvings = {"step" if "step" in left_out else left_out[0]: 1}
            levels.why = "runs fail"
        # Go on to the next level.
        coarser_runs += course.runs if course else 0
        for name, times in halvings.items():
            for _ in range(times):
                evaluate = evaluate.refinements()[name]
            names = [*names, *[name] * times]
        halved += max(halvings.values())
        stage = f"finer {' and '.join(halvings)}"
        details = evaluate.discretization_in_words()
        listener().stage(stage)
        listener().warn(f"{stage}{(f' ({details})' if details else '')}, since {levels.why}")


def _percent(part: float) -> str:
    return f"{100 * part:.{2 if part < 1 else 3}g} %" if part < 10 else f"{100 * part:.0f} %"


class OutputErrors(NamedTuple):
    """Errors of outputs on a level."""

    values: np.ndarray  # relative to the error bar's width, (outputs,)
    corrected: np.ndarray  # of which outputs they are what a correction leaves, (outputs,)


class Levels:
    """The errors of all discretizations so far."""

    def __init__(self, left_out: list[str], allowed: float, options: RefinementOptions):
        """Begin without levels of what is `left_out`, and so chosen.

        The error that is `allowed` is relative to the error bar's width.
        """
        self.left_out = left_out
        self.allowed = allowed
        self.options = options
        # by name and number of halvings
        self.errors_by_level: dict[str, dict[int, OutputErrors]] = {}
        self.widths: dict[int, np.ndarray] = {}  # of the error bars, by number of halvings
        self.stuck: dict[str, np.ndarray] = {}  # outputs whose error no longer falls, by name
        # which outputs vibrate as no affordable step resolves, and the frequency that is left of
        # each after all affordable halvings, (outputs,)
        self.waves = np.zeros(1, bool)
        self.fastest = np.zeros(1)
        self.why = ""  # why something had to be halved last, in words

    def needed_halvings(self, course: Adaptation, names: list[str]) -> dict[str, int]:
        """Return how often what was left out must be halved; nothing if that is enough.

        The course has the runs on a level, for which `names` have been halved.
        """
        # Record the errors of this level, and of which outputs they no longer fall.
        errors = {}
        largest = {}
        corrected = {}
        vanishing = self._halving_mask(course.error.component_width, len(names))
        corrections = course.discretization()
        for name, correction in corrections.items():
            before = self.errors_by_level.setdefault(name, {})
            of_outputs = course.error.of_outputs(correction.error)
            now = OutputErrors(of_outputs, correction.kinds != CorrectedPart.NOTHING)
            corrected[name] = now.corrected
            count = names.count(name)
            slow_outputs, stuck = self._stuck(now, before, count, course.error.missed)
            if name == "step":
                unresolved, self.waves = self._waves(course, now, slow_outputs, count)
                stuck &= ~unresolved
            self.stuck[name] = stuck | (vanishing & (now.values > 1))
            before[count] = now
        # Only outputs whose errors still fall count.
        for name in corrections:
            values = self.errors_by_level[name][names.count(name)].values
            counted = np.where(self.stuck[name] | self.waves, 0.0, values)
            errors[name] = float(counted.max())
            largest[name] = int(counted.argmax())
        if sum(errors.values()) <= self.allowed:
            return {}
        # Predict the halvings from the order of convergence.
        fixed_error = sum(error for name, error in errors.items() if name not in self.left_out)
        allowance = max(self.allowed - fixed_error, self.allowed / 2) / len(self.left_out)
        times = {}
        for name in self.left_out:
            ratio = errors.get(name, 0.0) / allowance
            if ratio > 1:
                max_count = self.options.max_at_once if errors[name] < self.options.resolved else 1
                order = self.options.order * (2 if corrected[name][largest[name]] else 1)
                times[name] = min(max_count, math.ceil(math.log(ratio, 2**order)))
        outputs = names_of_outputs(course.labels)
        self.why = " and ".join(
            f"the error of the {name} is {_percent(errors[name])} of the error bar of "
            f"{outputs[largest[name]]}"
            for name in times
        )
        self.why += f", and {_percent(allowance)} is allowed"
        return times

    def _halving_mask(self, width: np.ndarray, halvings: int) -> np.ndarray:
        """Return the mask of outputs whose error bar was halved by every halving, (outputs,)."""
        mask = np.zeros(len(width), bool)
        for fewer, before in self.widths.items():
            halvings_since = halvings - fewer
            mask |= (halvings_since >= self.options.halvings_of_noise) & (
                width <= before * 0.5**halvings_since
            )
        self.widths[halvings] = width
        return mask

    def _stuck(
        self, now: OutputErrors, before: dict[int, OutputErrors], count: int, missed: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return which errors fall too slowly, and of which this is sure, each of shape (outputs,).

        Only errors are compared of which both or none are corrected.
        """
        errors = now.values
        stuck = np.zeros(len(now.values), bool)
        slow_outputs = np.zeros(len(errors), bool)
        for fewer, (values, corrected) in before.items():
            error = np.where(corrected == now.corrected, values, np.inf)
            halvings = count - fewer
            resolved = error < self.options.resolved
            sure = resolved & (errors > self.options.clear * missed) & (halvings >= 2)
            long = (resolved | (missed >= DOUBT)) & (halvings >= self.options.halvings_of_noise)
            falls_slowly = errors > error * self.options.fall_per_halving**halvings
            slow_outputs |= falls_slowly & (halvings > 0)
            stuck |= falls_slowly & (sure | long)
        return slow_outputs, stuck

    def _waves(
        self, course: Adaptation, now: OutputErrors, slow_outputs: np.ndarray, count: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return which outputs vibrate with phases that the step does not resolve, each (outputs,).

        Those that it does not resolve yet come first, then those that no affordable step does.
        The errors of `slow_outputs` fall too slowly; `count` is the number of halvings of the step.
        """
        options = self.options
        none = np.zeros(len(slow_outputs), bool)
        asked = slow_outputs & ~now.corrected & (now.values > self.allowed)
        numbers = course.evaluate.description.discretization
        if "step" not in numbers or not asked.any():
            return none, none
        spectrum = course.refinement.spectrum("step", course.dt)
        step = numbers["step"]
        if not spectrum.resolved:
            return none, none
        lag = spectrum.lag(course.dt * (course.design_runs.values.shape[-1] - 1), step)
        unresolved = asked & (spectrum.energy[:, lag > options.followed].sum(axis=-1) > 0.5)
        energy = spectrum.after(options.max_for_waves - count, lag)
        fastest = spectrum.frequency[energy.argmax(axis=-1)]
        waves = unresolved & (options.margin * now.values * np.sqrt(energy.sum(-1)) > self.allowed)
        waves &= fastest > CarrierOptions().max_frequency / course.dt
        waves &= (fastest * step * options.least_steps < 1) & (len(numbers) > 1)  # of members
        of = course.quantities.of
        waves |= asked & np.isin(of, of[waves])  # components of a vector
        self.fastest = fastest
        return unresolved & ~waves, waves

    def convergence_failures(self, course: Adaptation) -> dict[str, list[Any]]:
        """Return attributes that name the outputs whose error is too large, but no longer falls."""
        names = names_of_outputs(course.labels)
        outputs = []
        for part, stuck in self.stuck.items():
            error = self.errors_by_level[part][max(self.errors_by_level[part])].values
            waves = self.waves if part == "step" else np.zeros_like(self.waves)
            which = np.flatnonzero((stuck & ~self.waves | waves) & (error > self.allowed))
            if part not in self.left_out or not len(which):
                continue
            spectrum = course.refinement.spectrum(part, course.dt)
            step = course.evaluate.description.discretization.get("step", np.nan)
            for k in which:
                cause = Cause.WAVES if self.waves[k] else Cause.STAGNANT
                f = float(self.fastest[k] if self.waves[k] else spectrum.largest[k])
                steps = 1 / (f * step) if f * step > 0 else np.nan
                outputs.append(Unconverged(names[k], part, cause, f, steps, float(error[k])))
        return attributes(outputs)
