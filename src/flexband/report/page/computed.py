"""How the numbers of a report were computed: the method, its runs, the discretization."""

from __future__ import annotations

import xarray as xr

from flexband.analysis.labelled_answers import AnswerRecord
from flexband.report.page.arrays import JsonRecord
from flexband.report.text.run_counts import run_count_text, run_purposes
from flexband.uncertainty.surrogates.bands import BandRecord


def heading(
    page_record: JsonRecord,
    bands: xr.Dataset,
    verification: xr.Dataset | None,
    margins: xr.Dataset | None,
) -> str:
    """Return the line below the title: method, runs, date."""
    runs = run_count_text(bands, verification, margins)
    return " · ".join(
        filter(None, [page_record["label"], runs, page_record["computed"].get("date", "")])
    )


def scatter_of(production: xr.Dataset | None) -> str:
    """Return how tolerances scatter for a yield; "" without one."""
    return "" if production is None else AnswerRecord.read(production).scatter


def computed_rows(
    page_record: JsonRecord,
    bands: xr.Dataset,
    verification: xr.Dataset | None,
    margins: xr.Dataset | None,
) -> list[tuple[str, str]]:
    """Return what the last table of a report says, by name."""
    record = BandRecord.read(bands)
    rows = [
        *page_record["computed"].items(),
        ("method", record.method or page_record["label"]),
        ("runs", run_purposes(bands, verification, margins)),
        ("discretization", record.discretization),
        ("versions", record.versions),
    ]
    return [(name, text) for name, text in rows if text]
