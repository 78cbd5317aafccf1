"""How the numbers of a report were computed: the method, its runs, the discretization."""

from __future__ import annotations

import xarray as xr

from flexband.analysis.labelled_answers import AnswerRecord
from flexband.basics.words import number_of
from flexband.report.page.arrays import JsonRecord
from flexband.uncertainty.surrogates.bands import BandRecord


def heading(page_record: JsonRecord, bands: xr.Dataset) -> str:
    """Return the line below the title: method, runs, date."""
    runs = number_of(BandRecord.read(bands).runs, "run")
    return " · ".join(
        filter(None, [page_record["label"], runs, page_record["computed"].get("date", "")])
    )


def scatter_of(production: xr.Dataset | None) -> str:
    """Return how tolerances scatter for a yield; "" without one."""
    return "" if production is None else AnswerRecord.read(production).scatter


def computed_rows(
    page_record: JsonRecord, bands: xr.Dataset, limits: xr.Dataset | None
) -> list[tuple[str, str]]:
    """Return what the last table of a report says, by name."""
    record = BandRecord.read(bands)
    worst = 0 if limits is None else BandRecord.read(limits).runs
    rows = [
        *page_record["computed"].items(),
        ("method", record.method or page_record["label"]),
        ("runs", runs_in_words(record, worst)),
        ("discretization", record.discretization),
        ("versions", record.versions),
    ]
    return [(name, text) for name, text in rows if text]


def runs_in_words(record: BandRecord, worst: int = 0) -> str:
    """Return how many runs were made, and what for; `worst` more at the worst tolerances."""
    kinds = {
        "runs_fitted": "fitted",
        "runs_checked": "to check the fit",
        "runs_refined": "with half the step or twice the elements",
        "runs_coarser": "with other steps or elements",
        "runs_repeated": "made again, to see if it repeats",
        "runs_nominal": "at the nominal values, for requirements",
        "runs_failed": "failed",
    }
    counts = [(getattr(record, name), words) for name, words in kinds.items()]
    parts = [f"{int(count)} {words}" for count, words in counts if count]
    text = f"{record.runs}" + (f": {', '.join(parts)}" if parts else "")
    if worst:
        text += f"; {worst} more at the worst tolerances, for requirements"
    if record.runs_coarser or record.runs_refined:
        text += ". max_runs limits the runs that are fitted or check the fit on one discretization"
    return text
