"""The runs of a study: looked up in its store, or made, checked and recorded."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import xarray as xr

from flexband.basics.checks import check_arguments, check_integer, check_option
from flexband.basics.progress import Advance, Progress, RunListener, add_listener, listener
from flexband.basics.response import ResponseFunction, as_response
from flexband.basics.warning import warning_once
from flexband.basics.words import all_of, are, number_of, value_text
from flexband.errors import InputError, RunError, RunsNeeded, StrainWarning
from flexband.execution.calls import Outcome, Performing, in_process
from flexband.execution.executors import ExecutorLike, performer_of
from flexband.execution.record import RunRecorder
from flexband.execution.store import Store, StoreLike, as_store
from flexband.remarks.collection import remarks_in
from flexband.remarks.remark import Remark, RemarkKind
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.inputs.unfolding import GivenInputs, first_case
from flexband.uncertainty.methods.method import MAX_RUNS
from flexband.uncertainty.runs import BATCH
from flexband.uncertainty.runs.evaluated import Evaluated
from flexband.uncertainty.runs.reuse import locate_domains, recorder

OutputCheck = Callable[[xr.DataArray], object]
"""``check(outputs)``: raises an error if outputs, without samples, are not as they should be."""

POLICIES = ("stop", "half step", "skip")
"""What to do about a run that fails."""


@dataclass(frozen=True)
class EvaluationOptions:
    """How the runs of a study are made; errors are those of `propagate`."""

    batch: int = BATCH  # most runs in one call
    store: StoreLike = None  # folder, or `Store`, in which runs are recorded; None without one
    executor: ExecutorLike = None  # where runs are made, as in `propagate`
    failed: str = "stop"  # one of `POLICIES`
    most_runs: int = MAX_RUNS  # a method that takes more is refused
    check: OutputCheck | None = None  # called with the outputs after the first runs
    progress: Progress | None = None  # called as ``progress(done, total)``

    def __post_init__(self) -> None:
        object.__setattr__(self, "batch", check_integer("batch", self.batch, 1))
        object.__setattr__(self, "failed", checked_policy(self.failed))
        if self.progress is not None:
            check_arguments("progress", self.progress, "done", "total")
        if self.check is not None:
            check_arguments("check", self.check, "outputs")


def checked_policy(failed: str) -> str:
    """Return what to do about a run that fails.

    Raise `InputError` if it is none of `POLICIES`.
    """
    check_option("failed", failed, POLICIES)
    return failed


class FailedRun(NamedTuple):
    """Why a run failed."""

    reason: str
    error: Exception | None  # that the response raised
    seconds: float  # wall time [s]


@dataclass
class Evaluations:
    """Makes the runs of one study."""

    perform: Performing = in_process  # performs calls of the response, here or in other processes
    record: RunRecorder | None = None  # the open store; None without one
    failed: str = "stop"  # one of `POLICIES`
    batch: int = BATCH  # most runs in one call
    failures: int = 0  # number of failed runs that were left out
    probed: bool = False  # whether a response that failed has been tried with one sample
    halvings: int = 3  # how often the step is halved for a run that fails
    failures_before_stop: int = 8  # without a success, after which all runs are taken to fail

    def __call__(
        self,
        function: ResponseFunction,
        space: Space,
        setting: str,
        points: tuple[np.ndarray, np.ndarray],
        labels: xr.DataArray | None,
        advance: Advance,
        *,
        recorded: bool = True,
    ) -> Evaluated:
        """Return the response at points (ξ, η).

        Parameters
        ----------
        setting : what the values depend on besides the inputs' numbers: options, discretization.
        labels : earlier runs, whose dims and coordinates the response must have.
        advance : called when runs are finished, and while a call in this process goes on.
        recorded : whether runs are looked up in the store and recorded there.

        Raises
        ------
        InputError
            If the response does not return finite real numbers of shape (n, …), or if the dims or
            the coordinates of a batch are not those of the first one.
        RunError
            If a run fails, or all do.
        RunsNeeded
            If the response is run elsewhere, and runs are not in the store.
        """
        record = self.record if recorded else None
        response = as_response(function)
        if record is not None and labels is None:
            labels = record.labels
        arguments = response, space, setting, points, labels, record
        evaluation = Evaluated(*arguments, probed=self.probed)
        if record is not None:
            self._look_up(evaluation, record, advance)
        if response.elsewhere and len(evaluation.pending_runs):
            names = space.recorded_at(*space.nominal())
            raise RunsNeeded(evaluation.numbers[evaluation.pending_runs], names, setting)
        rounds = [self._parts(evaluation)]
        within = (lambda done, total: advance(0, done)) if self.perform is in_process else None
        while rounds:
            parts = rounds.pop()
            tasks = [lambda part=part: evaluation.arguments(part) for part in parts]
            unclear: list[np.ndarray] = []
            failures: dict[int, FailedRun] = {}
            # Take each call as it ends.
            with (
                add_listener(RunListener(within)),
                closing(self.perform(response.original, tasks)) as outcomes,
            ):
                for number, outcome in outcomes:
                    call_failures = self._take(evaluation, parts[number], outcome, advance)
                    if call_failures is None:
                        unclear.append(parts[number])
                    elif self.failed == "half step":
                        failures |= call_failures
                    else:
                        self._fail(evaluation, call_failures, advance)
            # Try failed runs with shorter steps.
            for run in list(failures):
                if self._with_shorter_steps(evaluation, np.array([run])):
                    del failures[run]
                    advance(1)
            self._fail(evaluation, failures, advance)
            # Halve the calls of which it is not known which runs fail, the first one first.
            rounds += [np.array_split(part, 2) for part in reversed(unclear)]
        if evaluation.values is None:
            reason = next(iter(evaluation.failed.values()))
            raise RunError(f"{all_of(len(points[0]), 'run')} failed; the first: {reason}", {})
        self.failures += len(evaluation.failed)
        self.probed = evaluation.probed
        return evaluation

    def _look_up(self, evaluation: Evaluated, record: RunRecorder, advance: Advance) -> None:
        """Take the runs that were made before; failed ones only if they are left out."""
        rows = record.find(evaluation.setting, evaluation.numbers)
        hits = np.flatnonzero(rows >= 0)
        if not len(hits) or record.labels is None:
            return
        values, reasons = record.read(rows[hits])
        successes = np.array([k for k in range(len(hits)) if k not in reasons], dtype=int)
        evaluation.stored = hits[successes]
        if len(successes):
            evaluation.take(evaluation.stored, values[successes])
            for run, text in zip(
                hits[successes], record.remarks(rows[hits[successes]]), strict=True
            ):
                evaluation.remarks[int(run)] = remarks_in(text)
        if self.failed == "skip":
            evaluation.leave_out({int(hits[k]): reason for k, reason in reasons.items()})
        advance(len(rows) - len(evaluation.pending_runs))

    def _parts(self, evaluation: Evaluated) -> list[np.ndarray]:
        """Return the numbers of the missing runs by call: runs of one have the same options."""
        size = 1 if evaluation.response.one_by_one else self.batch
        runs = evaluation.pending_runs
        groups = evaluation.space.groups_of_options(evaluation.points[0][runs])
        return [runs[group[k : k + size]] for group in groups for k in range(0, len(group), size)]

    def _take(
        self, evaluation: Evaluated, runs: np.ndarray, outcome: Outcome, advance: Advance
    ) -> dict[int, FailedRun] | None:
        """Take the outcome of a call; return its failed runs, or None if these are not known."""
        seconds = outcome.seconds / len(runs)
        evaluation.remark(runs, outcome.remarks)
        verdict = evaluation.judge_call(runs, outcome)
        if verdict.values is not None and len(verdict.good_runs):
            evaluation.take(verdict.good_runs, verdict.values)
            evaluation.write(verdict.good_runs, verdict.values, "", seconds)
            advance(len(verdict.good_runs))
        if verdict.error is not None and not verdict.failures:
            if self.failed == "stop":
                raise verdict.error
            return None
        return {
            run: FailedRun(reason, verdict.error, seconds)
            for run, reason in verdict.failures.items()
        }

    def _fail(
        self, evaluation: Evaluated, failures: Mapping[int, FailedRun], advance: Advance
    ) -> None:
        """Record failed runs, and raise the error of one unless they are left out."""
        for run, failure in failures.items():
            evaluation.write(np.array([run]), None, failure.reason, failure.seconds)
        evaluation.leave_out({run: failure.reason for run, failure in failures.items()})
        for failure in failures.values():
            error = failure.error or InputError(failure.reason)
            if self.failed != "skip":
                raise error
            if evaluation.values is None and len(evaluation.failed) >= self.failures_before_stop:
                raise RunError(
                    f"all of the first {number_of(len(evaluation.failed), 'run')} failed, so that "
                    f"no further one is made; one of them: {error}",
                    {},
                ) from error
        if failures:
            advance(len(failures))

    def _with_shorter_steps(self, evaluation: Evaluated, run: np.ndarray) -> bool:
        """Make a run with half the step, a quarter, …; return whether that succeeds."""
        response = evaluation.response
        for part in range(1, self.halvings + 1):
            refinements = response.refinements(**evaluation.arguments(run))
            if "step" not in refinements:
                raise InputError(
                    "failed='half step' requires a response whose `refinements` have a step, "
                    "as that of dynamic_response"
                )
            response = refinements["step"]
            tasks = [lambda: evaluation.arguments(run)]
            outcome = next(iter(self.perform(response.original, tasks)))[1]
            verdict = evaluation.judge_call(run, outcome)
            if verdict.values is not None and len(verdict.good_runs):
                is_labelled = isinstance(outcome.value, xr.DataArray)
                # by the response itself
                extra_halving = is_labelled and "halved_step" in outcome.value.attrs
                text = f"completed with 1/{2 ** (part + extra_halving)} of the step"
                remark = Remark(
                    RemarkKind.HALVED_STEP, f"a run was {text}", size=part + extra_halving
                )
                evaluation.remarks[int(run[0])] = [remark]
                evaluation.remark(run, outcome.remarks)
                evaluation.take(verdict.good_runs, verdict.values)
                evaluation.write(verdict.good_runs, verdict.values, text, outcome.seconds)
                return True
        return False


def setting(case: str, refined_parts: Iterable[str], branch: str = "") -> str:
    """Return as text what values depend on besides numbers: options, what is finer, the branch."""
    return "; ".join(
        filter(None, (case, branch, *(f"finer {name}" for name in sorted(refined_parts))))
    )


@contextmanager
def evaluations(
    response: ResponseFunction,
    inputs: GivenInputs,
    options: EvaluationOptions = EvaluationOptions(),
) -> Iterator[Evaluations]:
    """Give what makes the runs of a study; its store is closed with the context."""
    if options.failed == "half step" and not as_response(response).refines:
        raise InputError(
            "failed='half step' requires a response whose `refinements` have a step, as that of "
            f"dynamic_response; got {value_text(response)}"
        )
    store = as_store(options.store)
    with performer_of(options.executor) as perform, warning_once(StrainWarning):
        if store is None:
            yield Evaluations(perform, None, options.failed, options.batch)
            return
        record = recorder(store, response, Space(first_case(inputs)))
        try:
            yield Evaluations(perform, record, options.failed, options.batch)
        finally:
            record.close()


def forget_failed(response: ResponseFunction, inputs: GivenInputs, store: Store) -> None:
    """Let the failed runs of a store be made again, and report how many there are."""
    new_inputs, _ = locate_domains(response, inputs, store)
    with evaluations(response, new_inputs, EvaluationOptions(store=store)) as evaluate:
        assert evaluate.record is not None
        count = evaluate.record.forget_failed()
    listener().warn(f"{are(count, 'failed run')} made again if needed.")
