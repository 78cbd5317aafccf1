"""A study run into a folder, where every run is recorded and the results are written."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr

from flexband.analysis.sensitivity.contributions import contributions
from flexband.analysis.verification.verify import MAX_RUNS, RUNS, verify
from flexband.arguments import frozen
from flexband.error_text import error_text
from flexband.errors import (
    InputError,
    RunsNeeded,
    ToleranceWarning,
    check_flag,
    check_instance,
    check_integer,
    without_warnings,
)
from flexband.execution.store import Store
from flexband.progress import Progress, listener
from flexband.requirements.requirement import several
from flexband.requirements.verdict import RequirementVerdict
from flexband.study.compiling import compile_ahead
from flexband.study.folder import StudyFolder
from flexband.study.identity import identity
from flexband.study.nominal import bands_with_nominal
from flexband.study.progress import StudyProgress
from flexband.study.requirements import checked_requirements, sampled_parts
from flexband.study.results.files import ResultFiles
from flexband.study.results.result import StudyResult, doubts_about, finished_result
from flexband.uncertainty.runs.evaluations import BATCH, checked_policy, forget_failed
from flexband.uncertainty.surrogates.records import BandRecord

if TYPE_CHECKING:
    from flexband.analysis.selection import AnySurrogate
    from flexband.execution.executors import ExecutorLike
    from flexband.study.definition import StudyDefinition

    StudySurrogate = AnySurrogate | None


@frozen()
class RunOptions:
    """How a study is run.

    Attributes
    ----------
    batch : most runs in one call of the response.
    executor : where runs are made, as in `propagate`.
    failed : what is done about runs that fail, as in `propagate`.
    verification_runs : number of runs that verify the result, 0 for none; None for the usual
        number.
    record : whether runs are recorded in the folder, and those that are there used.
    allow_mismatch : whether runs in the folder that may come from another response are used.
    replace : whether runs that are in the folder are deleted before.
    retry_failed : whether recorded runs that failed are made again.

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

    def verifying(self, study: StudyDefinition) -> int:
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
    home, about = StudyFolder(Path(folder)), dict(about or {})
    with home.held(kept=options.record):
        claim = home.claimed(
            str(about.get("file") or ""),
            study.response,
            replace=options.replace,
            allow_mismatch=options.allow_mismatch,
        )
        store = Store(home.path, allow_mismatch=options.allow_mismatch) if options.record else None
        if store is not None:
            about["identity"] = identity(study, options.verifying(study), options.failed)
            if options.retry_failed:
                forget_failed(study.response, study.inputs, store)
            elif result := finished_result(home, about["identity"]):
                return result
        progress = StudyProgress(study, home, store, about, task)
        with progress.recorded(claim):
            compile_ahead(study)
            files = ResultFiles(home)
            surrogate, bands = _bands(progress, options, files)
            verification = _verification(progress, options, surrogate, files)
            verifying = options.verifying(study)
            seconds = progress.elapsed / (BandRecord.read(bands).runs + verifying)
            listener().stage("the answers")
            shares = _contributions(progress, surrogate, files)
            doubts = doubts_about(bands, verification, requested=bool(verifying))
            parts = sampled_parts(progress, surrogate, doubts, **options.execution)
            limits, why = checked_requirements(
                progress, surrogate, doubts, parts, **options.execution
            )
            result = StudyResult(
                folder=home.path,
                label=study.method.label,
                bands=bands,
                surrogate=surrogate,
                verification=verification,
                contributions=shares,
                limits=limits,
                unchecked=tuple(
                    RequirementVerdict.not_checked(requirement, why)
                    for requirement in several(study.requirements)
                    if limits is None
                ),
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


def _bands(
    progress: StudyProgress, options: RunOptions, files: ResultFiles
) -> tuple[StudySurrogate, xr.Dataset]:
    """Make the runs; write the surrogate, if the method makes one, and the bands."""
    study = progress.study
    listener().stage("runs")
    how = {"store": progress.store, **options.execution}
    task = progress.task(study.method.label)
    if study.expands:
        with without_warnings(ToleranceWarning):  # which is one of the doubts
            surrogate = study.expand(progress=task, **how)
        files.write_surrogate(surrogate)
        bands = bands_with_nominal(study, surrogate, progress.folder.path, **how)
    else:
        surrogate, bands = None, study.run(progress=task, **how)
        files.write_surrogate(None)
    files.write_bands(bands)
    return surrogate, bands


def _contributions(
    progress: StudyProgress, surrogate: StudySurrogate, files: ResultFiles
) -> xr.Dataset | None:
    """Write how much each input widens the error bars; warn and return None if that fails."""
    if surrogate is None:
        return None
    try:
        shares = contributions(surrogate, sigmas=progress.study.sigmas)
    except Exception as error:  # the bands are there
        progress.fail("contributions", f"which input matters is not known: {error_text(error)}")
        return None
    files.write_contributions(shares)
    return shares


def _verification(
    progress: StudyProgress, options: RunOptions, surrogate: StudySurrogate, files: ResultFiles
) -> xr.Dataset | None:
    """Write how verification runs judge a surrogate; warn and return None if they fail."""
    study, runs = progress.study, options.verifying(progress.study)
    if not runs or surrogate is None:
        return None
    listener().stage("verification runs")
    try:
        verification = verify(
            surrogate,
            study.response,
            sigmas=study.sigmas,
            runs=runs,
            store=progress.store,
            executor=options.executor,
            failed=options.failed,
            progress=progress.task("verification runs"),
        )
    except RunsNeeded:
        raise
    except Exception as error:  # whatever a response raises; the bands are there
        progress.fail("verification", f"the result is not verified: {error_text(error)}")
        return None
    files.write_verification(verification)
    return verification
