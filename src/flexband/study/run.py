"""A study run into a folder, where every run is recorded and the results are written."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flexband.analysis.verification.verify import MAX_RUNS, RUNS
from flexband.basics.arguments import frozen
from flexband.basics.checks import check_flag, check_instance, check_integer
from flexband.basics.progress import Progress, listener
from flexband.errors import InputError
from flexband.execution.store import Store
from flexband.study.compiling import compile_ahead
from flexband.study.folder import StudyFolder
from flexband.study.progress import StudyProgress
from flexband.study.requirements import checked_requirements, sampled_parts
from flexband.study.result_hash import identity
from flexband.study.results.result import StudyResult, doubts_about, finished_result
from flexband.study.results.result_files import ResultFiles
from flexband.study.steps import runs_of, write_bands, write_contributions, write_verification
from flexband.uncertainty.runs.evaluations import BATCH, checked_policy, forget_failed

if TYPE_CHECKING:
    from flexband.execution.executors import ExecutorLike
    from flexband.study.definition import StudyDefinition


@frozen()
class RunOptions:
    """How a study is run.

    Attributes
    ----------
    batch : largest number of runs in one call of the response.
    executor : where runs are made, as in `propagate`.
    failed : what to do if a run fails, as in `propagate`.
    verification_runs : number of runs that verify the result, 0 for none; None for the usual
        number.
    record : whether runs are recorded in the folder, and recorded ones used.
    allow_mismatch : whether recorded runs are used even if the response has changed.
    replace : whether recorded runs are deleted first.
    retry_failed : whether failed runs are repeated.

    Raises
    ------
    InputError
        If `batch` or `verification_runs` is not a whole number that is allowed, `failed` is no
        policy, or another option is neither True nor False.
    """

    batch: int = BATCH
    executor: ExecutorLike = None
    failed: str = "stop"
    verification_runs: int | None = None
    record: bool = True
    allow_mismatch: bool = False
    replace: bool = False
    retry_failed: bool = False

    def __post_init__(self) -> None:
        check_integer("batch", self.batch, 1)
        object.__setattr__(self, "failed", checked_policy(self.failed))
        if self.verification_runs is not None:
            check_integer("verification_runs", self.verification_runs, 2, MAX_RUNS, or_zero=True)
        for name in ("record", "allow_mismatch", "replace", "retry_failed"):
            check_flag(name, getattr(self, name))

    @property
    def execution(self) -> dict[str, Any]:
        """How runs are made, as arguments of `expand`, `verify` and others."""
        return {"batch": self.batch, "executor": self.executor, "failed": self.failed}

    def verification_count(self, study: StudyDefinition) -> int:
        """Return the number of runs that verify the result of a study.

        Raise `InputError` if there are to be some, but the method makes no surrogate.
        """
        if not study.expands:
            if self.verification_runs:
                raise InputError(
                    "verification_runs requires a method with a surrogate; "
                    f"got {study.method.label}"
                )
            return 0
        if self.verification_runs is not None:
            return self.verification_runs
        return 0 if study.runs_elsewhere else RUNS


def run_study(
    study: StudyDefinition,
    folder: str | Path,
    options: RunOptions | None = None,
    *,
    about: Mapping[str, Any] | None = None,
    task: Callable[[str], Progress] = lambda name: lambda done, total: None,
) -> StudyResult:
    """Run a study into a folder, and return its result.

    Recorded runs that match are not made again, so that a study which was stopped goes on where it
    was. If the folder has the result of this study already, it is read.

    Parameters
    ----------
    study : what is run.
    folder : for runs and results. It is made if it does not exist.
    options : how the study is run.
    about : what study.json says beside the progress: `file` of the study, `command`, and options.
    task : begins a task by its name; returns what takes the numbers of runs that are done, and of
        all.

    Raises
    ------
    StoreError
        If another process runs a study in the folder, or if it has another study's results.
    RunsNeeded
        If the response is run elsewhere, and runs are missing. Their points are in points.csv.
    InputError, RunError
        As `expand` and `propagate` raise them.
    """
    options = RunOptions() if options is None else options
    check_instance("options", options, RunOptions)
    home = StudyFolder(Path(folder))
    about = dict(about or {})
    with home.hold_lock(keep_lock=options.record):
        claim = home.prepare_claim(
            str(about.get("file") or ""),
            study.response,
            replace=options.replace,
            allow_mismatch=options.allow_mismatch,
        )
        # A result of the same study is read; otherwise, recorded runs are reused.
        store = Store(home.path, allow_mismatch=options.allow_mismatch) if options.record else None
        if store is not None:
            about["identity"] = identity(study, options.verification_count(study), options.failed)
            if options.retry_failed:
                forget_failed(study.response, study.inputs, store)
            elif result := finished_result(home, about["identity"]):
                return result
        progress = StudyProgress(study, home, store, about, task)
        with progress.record_study(claim):
            compile_ahead(study)
            # Make the runs: those of the method, and those that verify it.
            files = ResultFiles(home)
            verifying = options.verification_count(study)
            surrogate, bands = write_bands(progress, files, verifying, **options.execution)
            surrogate, bands = write_verification(
                progress,
                surrogate,
                bands,
                files,
                verifying,
                executor=options.executor,
                failed=options.failed,
            )
            verification = None if surrogate is None else surrogate.verification
            seconds = progress.wall_time / (runs_of(bands) + verifying)
            # Answer from them, and judge the requirements.
            listener().stage("the answers")
            shares = write_contributions(progress, surrogate, files)
            doubts = doubts_about(bands, verification, requested=bool(verifying))
            parts = sampled_parts(progress, surrogate, doubts, **options.execution)
            limits, unchecked = checked_requirements(
                progress, surrogate, doubts, parts, verifying=bool(verifying), **options.execution
            )
            result = StudyResult(
                folder=home.path,
                label=study.method.label,
                bands=bands,
                surrogate=surrogate,
                verification=verification,
                contributions=shares,
                limits=limits,
                unchecked=unchecked,
                doubts=doubts,
                parts=parts,
                seconds_per_run=seconds,
                files=tuple(files.names),
                stale=tuple(files.stale()),
                computed=progress.provenance,
                failures=tuple(progress.failures),
            )
            if store is not None:
                progress.write("finished", result=result.record())
    return result
