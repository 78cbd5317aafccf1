"""The report on a study: one page that answers, with all that it needs inside."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import xarray as xr

from flexband.execution.names import FileName
from flexband.report.page.answers import answers_in, limit_remarks, limits_table
from flexband.report.page.arrays import JsonRecord
from flexband.report.page.charts import chart_data, nominal_of, numbers
from flexband.report.page.computed import computed_rows, heading, scatter_of
from flexband.report.page.definitions import definitions
from flexband.report.page.inputs import with_shares
from flexband.report.page.p_boxes import p_box_data
from flexband.report.page.paths import path_data
from flexband.report.page.requirements import judged_requirements
from flexband.report.page.template import write_page
from flexband.report.page.verdict import uncertain_ones, why_unreliable
from flexband.report.page.what_if import panel as what_if
from flexband.report.text import band_tables
from flexband.report.text.headline import background, headline
from flexband.study.presentation.display import Display
from flexband.study.presentation.title_block import FIELDS
from flexband.study.results.answers import read_answer

if TYPE_CHECKING:
    from flexband.analysis.selection import AnySurrogate


HELD = (
    "Other inputs need new runs here, since the bands hold only until the motion is unpredictable."
)


def write_report(
    folder: Path,
    page_record: JsonRecord,
    bands: xr.Dataset,
    verification: xr.Dataset | None = None,
    contributions: xr.Dataset | None = None,
    surrogate: AnySurrogate | None = None,
) -> Path:
    """Write report.html with a folder's answers; return its path.

    `page_record` is what `given_by` returns, with `title`; `label` of the method; `computed`, such
    as command and date by name; `remarks`; and `doubts`, why the result is not what was asked for.
    """
    # The last starts all parts, however long a browser pauses between two scripts
    scripts = (
        "arrays.js", "element.js", "colors.js", "numbers.js", "bands.js", "plots.js",
        "readings.js", "limit_axis.js", "charts.js",
        "motion_pen.js", "motion_scene.js", "motion.js", "paths.js", "p_boxes.js",
        *what_if.SCRIPTS,
        "start.js",
    )  # fmt: skip
    display = Display(page_record.get("display_units", {}), page_record.get("units", {}))
    answers, check = answers_in(folder, display)
    limits = None
    probability = None
    production = None
    if check is not None:
        limits = check.margins
        probability = check.probability
        production = check.production
    raw = bands
    bands = display.data(bands)
    verification, contributions = (
        None if data is None else display.data(data) for data in (verification, contributions)
    )
    parts = read_answer(folder, "parts") if page_record.get("unpredictable") else None
    uncertain = uncertain_ones(contributions if parts is None else None, page_record["inputs"])
    predictable = band_tables.predictable_part(bands, parts)
    panel, fixed = what_if.what_if(surrogate, raw, display) if parts is None else (None, [HELD])
    time = band_tables.time_of(bands)
    nominal = nominal_of(surrogate)
    nominal = None if nominal is None else display.data(nominal)
    bands_before_horizon = band_tables.before_horizon(bands, time, parts)
    if nominal is not None:
        nominal = band_tables.before_horizon(nominal, time, parts)
    if contributions is not None:
        contributions = band_tables.before_horizon(contributions, time, parts)
    charts = chart_data(bands_before_horizon, nominal, contributions, limits, display.input_units())
    if charts and any(row[1] == "compensator" for row in page_record["inputs"][1]):
        charts["limits"] = None  # margins are those after it is adjusted
    judged = judged_requirements(check, page_record["unchecked"], bands, uncertain, verification)
    page = folder / FileName.REPORT
    write_page(
        page,
        "study.html.j2",
        scripts,
        title=page_record["title"],
        about=heading(page_record, bands, verification, limits),
        title_block=[
            (name, page_record["title_block"][field])
            for field, name in FIELDS.items()
            if field != "title" and page_record.get("title_block", {}).get(field)
        ],
        unreliable=why_unreliable(page_record["doubts"]),
        doubts=page_record["doubts"] or not judged.met,
        requirements=judged.lines,
        run_remarks=judged.other_remarks,
        headline=headline(
            page_record["doubts"],
            judged.verdicts,
            bands,
            verification,
            uncertain,
            check,
            unpredictable=page_record.get("unpredictable", ""),
        ),
        drawing=page_record.get("drawing"),
        description=page_record.get("description", ""),
        question=page_record.get("question"),
        inputs=with_shares(page_record["inputs"], uncertain),
        bands=([], [])
        if predictable is None
        else band_tables.summary_table(predictable, verification),
        limits=limits_table(*check[:2], production) if check is not None else None,
        limits_of=band_tables.deviations(limits)
        if limits is not None and "sigmas" in limits.attrs
        else "",
        limit_remarks=limit_remarks(probability),
        yield_of=scatter_of(production),
        charts=charts["x"]["name"] if charts else None,
        numbers=numbers(bands_before_horizon) if charts else [],
        answers=answers,
        fields=page_record.get("fields"),
        remarks=[
            *([] if parts is not None else background(check)),
            *page_record["remarks"],
            *page_record["hidden"],
            *fixed,
        ],
        definitions=definitions(bands, page_record["inputs"], limits, probability),
        computed=computed_rows(page_record, bands, verification, limits),
        data={
            "charts": charts,
            "motion": page_record.get("motion"),
            "what_if": panel,
            "path": path_data(read_answer(folder, "path"), display),
            "p_boxes": p_box_data(read_answer(folder, "p_boxes"), raw, display),
        },
    )
    return page
