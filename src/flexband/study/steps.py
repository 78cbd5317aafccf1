"""The steps of a study whose results are datasets: each writes its file as soon as it is done."""

from __future__ import annotations

from typing import Any

import xarray as xr

from flexband.analysis.labelled_answers import is_judged
from flexband.analysis.selection import AnySurrogate, surrogates_of
from flexband.analysis.sensitivity.contributions import contributions
from flexband.analysis.verification.verify import verify
from flexband.basics.error_text import error_text
from flexband.basics.progress import listener
from flexband.basics.warning import without_warnings
from flexband.errors import RunsNeeded, ToleranceWarning
from flexband.execution.executors import ExecutorLike
from flexband.study.free_pins import warn_of_free_pins
from flexband.study.nominal import bands_with_nominal
from flexband.study.progress import StudyProgress
from flexband.study.results.result_files import ResultFiles
from flexband.uncertainty.surrogates.bands import BandRecord


def write_bands(
    progress: StudyProgress, files: ResultFiles, verifying: int, **execution: Any
) -> tuple[AnySurrogate | None, xr.Dataset]:
    """Make the runs; write the surrogate, if the method makes one, and the bands."""
    study = progress.study
    warn_of_free_pins(study)
    listener().stage("runs")
    how = {"store": progress.store, **execution}
    task = progress.task(study.method.label)
    if study.expands:
        with without_warnings(ToleranceWarning):  # which is one of the doubts
            surrogate = study.expand(progress=task, **how)
        if verifying and not _judge(surrogate):
            files.write_unjudged(surrogate)
        else:
            files.write_surrogate(surrogate)
        bands = bands_with_nominal(study, surrogate, progress.folder.path, **how)
    else:
        surrogate = None
        bands = study.run(progress=task, **how)
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
    bands: xr.Dataset,
    files: ResultFiles,
    runs: int,
    *,
    executor: ExecutorLike,
    failed: str,
) -> tuple[AnySurrogate | None, xr.Dataset]:
    """Write how so many runs judge a surrogate; return it and its bands with what they say.

    Warn if the runs fail. Where the method estimates no error, the bands have that of these runs.
    """
    study = progress.study
    if not runs or surrogate is None:
        return surrogate, bands
    listener().stage("verification runs")
    try:
        verified = verify(
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
        return surrogate, bands
    if verified.verification is not None:
        files.write_verification(verified.verification)
    if not _judge(surrogate):
        files.write_surrogate(verified)
        judged = verified.bands(study.sigmas)
        bands = judged.assign_attrs(judged.attrs | bands.attrs)
        files.write_bands(bands)
    return verified, bands


def _judge(surrogate: AnySurrogate) -> bool:
    return all(map(is_judged, surrogates_of(surrogate).values()))


def runs_of(bands: xr.Dataset) -> int:
    """Return the number of runs that bands are made of."""
    return int(BandRecord.read(bands).runs)
