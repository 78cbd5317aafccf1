"""How many runs a result took, and how many of them check it: the same wherever it is said."""

from __future__ import annotations

import xarray as xr

from flexband.basics.words import number_of
from flexband.uncertainty.surrogates.bands import BandRecord
from flexband.uncertainty.surrogates.verification_verdict import VerificationRecord


def run_count_text(
    bands: xr.Dataset, verification: xr.Dataset | None, margins: xr.Dataset | None
) -> str:
    """Return how many runs were made, and how many of them check the result."""
    verifying, at_worst = _further(verification, margins)
    record = BandRecord.read(bands)
    made = number_of(record.runs + verifying + at_worst, "run")
    checks = int(record.runs_checked) + verifying
    return f"{made}, {checks} of them to check the result" if checks else made


def run_purposes(
    bands: xr.Dataset, verification: xr.Dataset | None, margins: xr.Dataset | None
) -> str:
    """Return how many runs were made, and what each was for."""
    record = BandRecord.read(bands)
    kinds = {
        "runs_fitted": "fitted",
        "runs_checked": "to check the fit",
        "runs_refined": "with half the step or twice the elements",
        "runs_coarser": "with other steps or elements",
        "runs_repeated": "made again, to see if it repeats",
        "runs_nominal": "at the nominal values, for requirements",
        "runs_failed": "failed",
    }
    counts = [(int(getattr(record, name)), words) for name, words in kinds.items()]
    verifying, at_worst = _further(verification, margins)
    counts += [
        (verifying, "new ones that verify the result"),
        (at_worst, "at the worst tolerances, for requirements"),
    ]
    parts = [f"{count} {words}" for count, words in counts if count]
    text = f"{record.runs + verifying + at_worst}" + (f": {', '.join(parts)}" if parts else "")
    if record.runs_coarser or record.runs_refined:
        text += ". max_runs limits the runs that are fitted or check the fit on one discretization"
    return text


def _further(verification: xr.Dataset | None, margins: xr.Dataset | None) -> tuple[int, int]:
    """Return how many runs verify the result, and how many are at the worst tolerances."""
    verifying = 0 if verification is None else int(VerificationRecord.read(verification).runs)
    at_worst = 0 if margins is None else int(BandRecord.read(margins).runs)
    return verifying, at_worst
