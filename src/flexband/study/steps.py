"""The steps of a study whose results are datasets: each writes its file as soon as it is done."""

from __future__ import annotations

from typing import Any

import xarray as xr

from flexband.analysis.selection import AnySurrogate
from flexband.analysis.sensitivity.contributions import contributions
from flexband.analysis.verification.verify import verify
from flexband.error_text import error_text
from flexband.errors import RunsNeeded, ToleranceWarning, without_warnings
from flexband.execution.executors import ExecutorLike
from flexband.progress import listener
from flexband.study.nominal import bands_with_nominal
from flexband.study.progress import StudyProgress
from flexband.study.results.files import ResultFiles
from flexband.uncertainty.surrogates.bands import BandRecord


def write_bands(
    progress: StudyProgress, files: ResultFiles, **execution: Any
) -> tuple[AnySurrogate | None, xr.Dataset]:
    """Make the runs; write the surrogate, if the method makes one, and the bands."""
    study = progress.study
    listener().stage("runs")
    how = {"store": progress.store, **execution}
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


def write_contributions(
    progress: StudyProgress, surrogate: AnySurrogate | None, files: ResultFiles
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


def write_verification(
    progress: StudyProgress,
    surrogate: AnySurrogate | None,
    files: ResultFiles,
    runs: int,
    *,
    executor: ExecutorLike,
    failed: str,
) -> xr.Dataset | None:
    """Write how so many runs judge a surrogate; warn and return None if they fail."""
    study = progress.study
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
            executor=executor,
            failed=failed,
            progress=progress.task("verification runs"),
        )
    except RunsNeeded:
        raise
    except Exception as error:  # whatever a response raises; the bands are there
        progress.fail("verification", f"the result is not verified: {error_text(error)}")
        return None
    files.write_verification(verification)
    return verification


def runs_of(bands: xr.Dataset) -> int:
    """Return the number of runs that bands are made of."""
    return int(BandRecord.read(bands).runs)
