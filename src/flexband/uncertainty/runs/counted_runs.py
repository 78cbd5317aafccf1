"""The runs of a response: evaluated, counted, and checked for what no method can see."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from enum import Enum
from functools import cached_property
from typing import TypeVar

import numpy as np
import xarray as xr

from flexband.basics.checks import check_integer
from flexband.basics.progress import Advance, Budget, Progress
from flexband.basics.response import Description, Response
from flexband.basics.warning import without_warnings
from flexband.basics.words import number_of, value_text
from flexband.errors import InputError, ResolutionWarning, RunError
from flexband.remarks.collection import CollectedRemark, catch_remarks
from flexband.uncertainty.inputs.effects import all_have_effects
from flexband.uncertainty.inputs.evaluation import inputs_in_words
from flexband.uncertainty.inputs.one_sample import of_one_sample
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.inputs.unfolding import GivenInputs
from flexband.uncertainty.methods.method import (
    REFINEMENTS,
    EarlierRuns,
    Evaluate,
    Method,
    check_runs,
)
from flexband.uncertainty.runs.evaluated import Evaluated
from flexband.uncertainty.runs.evaluations import (
    EvaluationOptions,
    Evaluations,
    setting,
)
from flexband.uncertainty.runs.repetition import check_repetition, check_stored, middle
from flexband.uncertainty.runs.reuse import generic_runs
from flexband.uncertainty.surrogates.surrogate import Surrogate

Answer = TypeVar("Answer")


Call = tuple[np.ndarray, np.ndarray, np.ndarray]
"""ξ, η and values of evaluations."""


class Purpose(Enum):
    """What runs are made for."""

    DESIGN = "points of the method"
    """They are recorded and counted, and the method has them."""
    PROBE = "effects of inputs"
    """They are recorded and counted."""
    REPETITION = "comparison with runs that were made"
    """They are neither recorded nor counted."""


class CountedRuns:
    """Evaluations of the response and of its refinements, counted."""

    def __init__(
        self,
        response: Response,
        inputs: GivenInputs,
        method: Method,
        evaluations: Evaluations,
        options: EvaluationOptions,
        count: int,
        progress: Progress,
        *,
        case: str = "",
        labels: xr.DataArray | None = None,
        exploration_runs: int = 0,
    ) -> None:
        """Check the arguments of `propagate`.

        `count` is the number of combinations of options, each with runs of its own, `case` the
        label of this one. `labels` are earlier runs, whose dims and coordinates its runs must have;
        `exploration_runs` were made to find the domains of fields.
        """
        check_integer("most_runs", options.most_runs, 1)
        self.space = space = Space(inputs)
        self.done = 0
        self.total = method.runs(space)
        self.labels = labels
        check_runs(method, space, options.most_runs, count)
        self.most_runs = options.most_runs
        self.count = count
        self.total += 1  # one run is made again
        self.runs_per_level = self.total if response.refines else 0
        self.response = space.on_branch(response)
        self.method = method
        self.evaluations = evaluations
        self.progress = progress
        self.case = case
        self.exploration_runs = exploration_runs
        self.check = options.check
        self.stored: np.ndarray | None = None
        self.reused = 0
        self.start = self.base_level  # or what is finer, see `fine_enough`
        self.levels: list[Level] = []  # discretizations with runs
        self.repeated = 0
        self.remarks: dict[tuple[str, ...], list[CollectedRemark]] = {}  # by what is finer

    def check_left_out(self) -> None:
        """Raise `InputError` if the method cannot choose what is left out, or not correct it."""
        left_out = self.base_level.description.left_out
        if left_out and not self.method.chooses_discretization:
            raise InputError(
                f"{' and '.join(left_out)} must be given for {self.method!r}; "
                "only AdaptivePCCI chooses them"
            )
        method = self.method
        if method.correct and not method.chooses_discretization:
            refinement_count = len(self.base_level.refinements())
            if not refinement_count:
                raise InputError(
                    f"{method!r} needs {REFINEMENTS}; got {value_text(self.response.original)}"
                )
            check_runs(method, self.space, self.most_runs, self.count, refinement_count)
            self.total += method.finer_runs(self.space, refinement_count)

    @cached_property
    def base_level(self) -> Level:
        """The response on the discretization that a user gives."""
        return Level(self, self.response)

    def begin(self, count: int, purpose: Purpose) -> Advance:
        """Report that so many runs begin; return what takes their progress."""
        if purpose is not Purpose.REPETITION:
            self.total = max(self.total, self.done + count)
        if not self.done:
            self.progress(0, self.budget)
        return self._show if purpose is Purpose.REPETITION else self._advance

    def take(self, level: Level, evaluation: Evaluated, purpose: Purpose) -> xr.DataArray:
        """Return the values of runs that were made; raise `RunError` if all are needed."""
        assert evaluation.values is not None
        if evaluation.failed and not self.method.skips_failed:
            raise self._missing_runs(evaluation)
        first = self.labels is None
        self.labels = evaluation.values[:0].copy()  # a view would keep all values
        if first and self.check is not None:
            self.check(self.labels)
        if purpose is not Purpose.REPETITION:
            if self.stored is None:
                self.stored = evaluation.stored
            self.remark(level.refined_parts, evaluation.collected_remarks)
            if not self.levels:
                evaluation.check_size()
        if purpose is Purpose.DESIGN:
            self._keep(level, (*evaluation.points, evaluation.values.values))
        return evaluation.values

    def _missing_runs(self, evaluation: Evaluated) -> RunError:
        """Return the error of a method that needs the runs that failed."""
        run, reason = next(iter(evaluation.failed.items()))
        xi, eta = (v[[run]] for v in evaluation.points)
        return RunError(
            f"{self.method!r} needs every run of its design; {len(evaluation.failed)} of "
            f"{number_of(len(evaluation.points[0]), 'run')} failed, one of them: {reason}; "
            f"{inputs_in_words(self.space, xi, eta)}\n"
            "RegressionPCCI can do without them, and so can the scanning methods if other runs "
            "succeed at every point of the scan",
            {k: (0.0, why) for k, why in evaluation.failed.items()},
        )

    def remark(self, refined_parts: Iterable[str], remarks: Iterable[CollectedRemark]) -> None:
        """Keep remarks on runs with a finer discretization of some parts."""
        self.remarks.setdefault(tuple(sorted(refined_parts)), []).extend(remarks)

    def at_other_times(self, response: Response, xi: np.ndarray, eta: np.ndarray) -> xr.DataArray:
        """Return runs of a response at other times that succeed; they are not counted."""
        failures = self.evaluations.failures
        try:
            with without_warnings():
                evaluation = self.evaluations(
                    response, self.space, "", (xi, eta), None, lambda *_: None, recorded=False
                )
        finally:
            self.evaluations.failures = failures
        assert evaluation.values is not None
        return evaluation.values[np.setdiff1d(np.arange(len(xi)), list(evaluation.failed))]

    def _keep(self, level: Level, call: Call) -> None:
        """Keep runs that succeeded; of the first ones, one is made again."""
        if not self.levels:
            with catch_remarks() as remarks:
                self._repeat(level, *call)
            of_outputs = (remark for remark in remarks if remark.outputs)  # which are noisy
            self.remark(level.refined_parts, [CollectedRemark(remark, 1) for remark in of_outputs])
        success_mask = _is_success(call[2])
        if not success_mask.all():
            call = call[0][success_mask], call[1][success_mask], call[2][success_mask]
        if not level.calls:
            self.levels.append(level)
            level.all_have_effects = all_have_effects(self.space, call[:2], call[2])
        if level.all_have_effects:  # values, which may be large, are needed no more
            call = *call[:2], np.zeros(0)
        level.calls.append(call)

    def _repeat(self, level: Level, xi: np.ndarray, eta: np.ndarray, values: np.ndarray) -> None:
        """Make one of the runs again, alone, and refuse or remark what makes a difference.

        Of runs that a store has kept, two are made again, once for a store. They count as the one
        that was made again when these runs were made.
        """
        record = self.evaluations.record
        stored = self.stored
        if level.response.elsewhere:
            return
        assert self.labels is not None  # there are runs
        labels = self.labels
        success_mask = _is_success(values)
        old = np.zeros(0, int) if stored is None else stored[success_mask[stored]]
        # Compare runs of a store with new ones.
        if record is not None and len(old):
            if not record.confirmed:
                rerun_numbers = np.unique([old[0], old[-1]])
                with without_warnings():
                    new = level(xi[rerun_numbers], eta[rerun_numbers], Purpose.REPETITION).values
                check_stored(values[success_mask], values[rerun_numbers], new, labels, record.store)
                record.confirmed = True
            self._count_repeated(1)
            return
        # Otherwise, compare a run of the batch with the same run alone.
        if not success_mask.all():
            xi = xi[success_mask]
            eta = eta[success_mask]
            values = values[success_mask]
        run = middle(values)

        def again(copies: int) -> np.ndarray:
            points = [np.repeat(v[run : run + 1], copies, axis=0) for v in (xi, eta)]
            with without_warnings():
                values = level(points[0], points[1], Purpose.REPETITION).values
            self._count_repeated(copies)
            return values

        check_repetition(values, again, run, labels, noise_allowed=not self.method.expands)

    def _count_repeated(self, count: int) -> None:
        self.repeated += count
        self.total = max(self.total, self.done + count)
        self._advance(count)

    def _show(self, finished: int, under_way: int = 0) -> None:
        if not finished:
            self.progress(min(self.done + under_way, self.total), self.total)

    def _advance(self, finished: int, under_way: int = 0) -> None:
        self.done += finished
        self.progress(self.done + under_way, self.budget)

    @property
    def budget(self) -> int:
        """The number of all runs, or the most of a method that finds out how many it needs."""
        if self.method.chooses_discretization:
            return Budget.from_levels(self.total, self.runs_per_level)
        return self.total


def _is_success(values: np.ndarray) -> np.ndarray:
    return np.asarray(np.isfinite(values.reshape(len(values), -1)).all(axis=1))


class Level(Evaluate):
    """The response on one discretization, as a function of ξ and η."""

    def __init__(
        self, runs: CountedRuns, response: Response, name: str = "", coarse: Level | None = None
    ):
        """Give a response of which `name` is finer than in that of a coarse level."""
        self.runs = runs
        self.response = response
        self.refined_parts: tuple[str, ...] = (*coarse.refined_parts, name) if coarse else ()
        self.calls: list[Call] = []
        self.all_have_effects = False  # whether the first runs show effects of every input

    def __call__(
        self, xi: np.ndarray, eta: np.ndarray, purpose: Purpose = Purpose.DESIGN
    ) -> xr.DataArray:
        runs = self.runs
        advance = runs.begin(len(xi), purpose)
        is_advice = bool(runs.base_level.description.left_out)  # the method chooses what is coarse
        with without_warnings(ResolutionWarning, when=is_advice):
            evaluation = runs.evaluations(
                self.response,
                runs.space,
                setting(runs.case, self.refined_parts, self.response.branch),
                (xi, eta),
                runs.labels,
                advance,
                recorded=purpose is not Purpose.REPETITION,
            )
        return runs.take(self, evaluation, purpose)

    def earlier_runs(self, max_runs: int) -> EarlierRuns:
        """Return up to so many runs that a store has for other intervals."""
        runs = self.runs
        record = self.runs.evaluations.record
        if record is None:
            return EarlierRuns()
        earlier_runs = generic_runs(
            record,
            runs.space,
            setting(runs.case, self.refined_parts, self.response.branch),
            max_runs,
        )
        runs.remark(self.refined_parts, earlier_runs.remarks)
        runs.done += len(earlier_runs.xi)
        runs.reused += len(earlier_runs.xi)
        return earlier_runs

    def at_more_times(self, xi: np.ndarray, eta: np.ndarray) -> xr.DataArray | None:
        """Return runs at the times of all steps, which are not counted; None if one fails."""
        response = self.of_nominal(self.response.at_more_times)
        if response is None:
            return None
        try:
            good_runs = self.runs.at_other_times(response, xi, eta)
        except (RunError, InputError, MemoryError):
            return None
        return good_runs if len(good_runs) == len(xi) else None

    def correct_surrogate(
        self,
        surrogate: Surrogate,
        runs: tuple[np.ndarray, np.ndarray, np.ndarray],
        nodes: Sequence[np.ndarray] | None = None,
    ) -> Surrogate:
        from flexband.uncertainty.phase_resolved.given_runs import (  # noqa: PLC0415
            corrected_expansion,
        )

        return corrected_expansion(surrogate, runs, self, nodes)

    def refinements(self) -> dict[str, Level]:
        return self._finer_levels

    @cached_property
    def _finer_levels(self) -> dict[str, Level]:
        refinements = self.description.refinements().items()
        return {name: Level(self.runs, response, name, self) for name, response in refinements}

    @cached_property
    def description(self) -> Description:
        description = self.of_nominal(self.response.description)
        if self is self.runs.base_level:
            return description
        return description._replace(left_out=self.runs.base_level.description.left_out)

    def of_nominal(self, method: Callable[..., Answer]) -> Answer:
        """Return what a method of the response returns for inputs at their means and midpoints."""
        space = self.runs.space
        arguments = space.arguments_at(*space.nominal())
        try:
            return method(**arguments)
        except Exception as error:
            scalar = of_one_sample(self.response, arguments, error)
            if scalar is None:
                raise
            raise scalar from error
