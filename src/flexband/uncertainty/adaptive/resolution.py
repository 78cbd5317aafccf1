"""The discretization that a tolerance asks for, where step or elements are left out.

The first runs of a coarse discretization, and a few of them on a finer one, tell its error in parts
of the error bar's width. What is too coarse is halved until this error is half of the tolerance;
the expansion has the other half. An output whose error no longer falls asks for nothing finer.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from flexband.errors import AssemblyError, InputError, RunError
from flexband.progress import listener
from flexband.uncertainty.adaptive.adaptation import Adaptation
from flexband.uncertainty.adaptive.refinement.correction import CorrectedPart
from flexband.uncertainty.adaptive.refinement.refined_runs import in_words
from flexband.uncertainty.methods.method import Evaluate
from flexband.uncertainty.surrogates.axes import names_of_outputs
from flexband.uncertainty.surrogates.diagnostics import DOUBT


class RefinementOptions(NamedTuple):
    """When step and elements are halved.

    Attributes
    ----------
    share : part of the tolerance that is for the discretization.
    order : order of convergence, by which several halvings at once are chosen; that of what a
        correction leaves is twice as high.
    resolved : below this error, in parts of the error bar's width, the order is taken for granted.
    fall_per_halving : an error that falls by less in every one of two halvings does not converge;
        order two gives 1/4.
    clear : two halvings show this of an error above this part of what the expansion misses.
    halvings_of_noise : so many show it of smaller errors, and of large ones in outputs that the
        expansion does not explain, or that vanish: the error is larger than the width of the error
        bar, which is halved with every halving. What it does explain may be a vibration that longer
        steps do not follow at all.
    max_at_once, max_halvings : halvings from one level to the next, and in all.
    max_failed : levels that fail in a row, after one that did not, before that is taken.
    """

    share: float = 0.5
    order: int = 2
    resolved: float = 0.3
    fall_per_halving: float = 0.5**0.5
    clear: float = 0.25
    halvings_of_noise: int = 4
    max_at_once: int = 3
    max_halvings: int = 9
    max_failed: int = 2


def solved(
    begin: Callable[[Evaluate], Adaptation],
    evaluate: Evaluate,
    tolerance: float,
    *,
    options: RefinementOptions = RefinementOptions(),
) -> tuple[Adaptation, dict[str, object]]:
    """Return the runs on the discretization that is fine enough, or on the one that is given.

    If finer ones fail, it is the finest of which the error is known.

    Parameters
    ----------
    begin : makes the first runs of a response.
    evaluate : the response on the coarsest discretization.
    """
    left_out = evaluate.left_out
    if not left_out:
        course = begin(evaluate)
        return course, {"stopped": course.run(tolerance), "runs_coarser": 0}
    levels, finished = Levels(left_out, options.share * tolerance, options), None
    halved, others, failed, names = 0, 0, 0, []
    while True:
        course, last = None, halved >= options.max_halvings
        try:
            course = begin(evaluate)
            halvings = levels.wanted(course, names)
            if last or not halvings:
                stopped = course.run((1 - options.share) * tolerance)
                halvings = levels.wanted(course, names)
                if last or not halvings:
                    details = levels.told(course) | {"stopped": stopped}
                    return course, {**details, "runs_coarser": others, "halved": names}
            finished, failed = (course, names), 0
        except (RunError, InputError, MemoryError) as error:
            failed += 1
            of_run, at_start = isinstance(error, RunError), isinstance(error, AssemblyError)
            cause = error.__cause__ if of_run else None
            raised = cause is not None and not isinstance(cause, RunError)
            of_step = of_run and not (raised or at_start)
            if at_start and not finished:
                raise  # no step has been taken
            if finished and not (of_step and failed < options.max_failed and not last):
                others += course.runs if course else 0
                course, names = finished
                others -= course.runs
                why = "; ".join((str(error) or type(error).__name__).splitlines()[:2])
                stopped = course.run((1 - options.share) * tolerance)
                details = {"not_refined": f"a finer one fails ({why})", "stopped": stopped}
                return course, {**details, "runs_coarser": others, "halved": names}
            if last or raised or not of_run:
                raise  # no shorter step avoids that a response raises another error
            halvings = {"step" if "step" in left_out else left_out[0]: 1}  # it may be too long
            levels.why = "runs fail"
        others += course.runs if course else 0
        for name, times in halvings.items():
            for _ in range(times):
                evaluate = evaluate.refinements()[name]
            names = [*names, *[name] * times]
        halved += max(halvings.values())
        finer, details = f"finer {' and '.join(halvings)}", in_words(evaluate)
        listener().stage(finer)
        listener().warn(f"{finer}{f' ({details})' * bool(details)}, since {levels.why}")


def _percent(part: float) -> str:
    return f"{100 * part:.{2 if part < 1 else 3}g} %" if part < 10 else f"{100 * part:.0f} %"


class OutputErrors(NamedTuple):
    """Errors of outputs on a level, in parts of the error bar's width.

    Attributes
    ----------
    values, corrected : each error, and whether it is what a correction leaves, (outputs,).
    """

    values: np.ndarray
    corrected: np.ndarray


class Levels:
    """The errors of all discretizations so far.

    Attributes
    ----------
    left_out : what is chosen.
    allowed : error of the discretization, in parts of the error bar's width.
    why : why something was to be halved last, in words.
    """

    def __init__(self, left_out: list[str], allowed: float, options: RefinementOptions):
        """Begin without levels."""
        self.left_out, self.allowed, self.options = left_out, allowed, options
        self.known: dict[str, dict[int, OutputErrors]] = {}
        self.widths: dict[int, np.ndarray] = {}
        self.stuck: dict[str, np.ndarray] = {}
        self.why = ""

    def wanted(self, course: Adaptation, names: list[str]) -> dict[str, int]:
        """Return how often what was left out must be halved; nothing if that is enough.

        Parameters
        ----------
        course : the runs on a level.
        names : what has been halved for it.
        """
        errors, largest, corrected = {}, {}, {}
        vanishing = self._vanishing(course.error.own_width, len(names))
        for name, correction in course.discretization().items():
            before = self.known.setdefault(name, {})
            of_outputs = course.error.of_outputs(correction.error)
            output_errors = OutputErrors(of_outputs, correction.kinds != CorrectedPart.NOTHING)
            corrected[name] = output_errors.corrected
            count = names.count(name)
            self.stuck[name] = self._stuck(output_errors, before, count, course.error.missed)
            self.stuck[name] |= vanishing & (output_errors.values > 1)
            before[count] = output_errors
            counted = np.where(self.stuck[name], 0.0, output_errors.values)
            errors[name], largest[name] = float(counted.max()), int(counted.argmax())
        if sum(errors.values()) <= self.allowed:
            return {}
        given = sum(error for name, error in errors.items() if name not in self.left_out)
        each = max(self.allowed - given, self.allowed / 2) / len(self.left_out)
        times = {}
        for name in self.left_out:
            ratio = errors.get(name, 0.0) / each
            if ratio > 1:
                most = self.options.max_at_once if errors[name] < self.options.resolved else 1
                order = self.options.order * (2 if corrected[name][largest[name]] else 1)
                times[name] = min(most, math.ceil(math.log(ratio, 2**order)))
        outputs = names_of_outputs(course.labels)
        self.why = " and ".join(
            f"the error of the {name} is {_percent(errors[name])} of the error bar of "
            f"{outputs[largest[name]]}"
            for name in times
        )
        self.why += f", and {_percent(each)} is allowed"
        return times

    def _vanishing(self, width: np.ndarray, halvings: int) -> np.ndarray:
        """Return of which outputs the error bar has been halved with every halving, (outputs,)."""
        mask = np.zeros(len(width), bool)
        for fewer, before in self.widths.items():
            more = halvings - fewer
            mask |= (more >= self.options.halvings_of_noise) & (width <= before * 0.5**more)
        self.widths[halvings] = width
        return mask

    def _stuck(
        self, now: OutputErrors, before: dict[int, OutputErrors], count: int, missed: np.ndarray
    ) -> np.ndarray:
        """Return which errors do not fall any more, shape (outputs,).

        Only errors are compared of which both or none are corrected.
        """
        errors, stuck = now.values, np.zeros(len(now.values), bool)
        for fewer, (values, corrected) in before.items():
            error = np.where(corrected == now.corrected, values, np.inf)
            halvings, resolved = count - fewer, error < self.options.resolved
            sure = resolved & (errors > self.options.clear * missed) & (halvings >= 2)
            long = (resolved | (missed >= DOUBT)) & (halvings >= self.options.halvings_of_noise)
            stuck |= (errors > error * self.options.fall_per_halving**halvings) & (sure | long)
        return stuck

    def told(self, course: Adaptation) -> dict[str, str]:
        """Return in words of which outputs the error is too large, but no longer falls.

        Members without damping carry waves along their axis, whose reactions converge at no
        affordable step.
        """
        outputs, lines = np.array(names_of_outputs(course.labels)), []
        for name, stuck in self.stuck.items():
            error = self.known[name][max(self.known[name])].values
            which = np.flatnonzero(stuck & (error > self.allowed))
            if name in self.left_out and len(which):
                shown = ", ".join(outputs[which[:3]]) + ", …" * (len(which) > 3)
                frequency = course.frequency_of_error(name, which[0])
                lines.append(
                    f"the error of {shown} that is due to the {name} no longer falls: it "
                    f"oscillates about {frequency:.3g} times per unit of time, as waves of the "
                    "mesh do; damp them (retardation_time, a smaller spectral_radius), or leave "
                    "such outputs out"
                )
        return {"not_refined": "; ".join(lines)} if lines else {}
