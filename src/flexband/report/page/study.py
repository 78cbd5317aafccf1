"""The report on a study: one page that answers, with all that it needs inside."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr

from flexband.analysis.limits.verdicts import requirement_verdicts
from flexband.analysis.results import AnswerRecord
from flexband.execution.names import FileName
from flexband.remarks.collection import remarks_of
from flexband.report.page.answers import answers_in, limit_remarks, limits_table
from flexband.report.page.charts import chart_data, nominal_of, numbers
from flexband.report.page.definitions import definitions
from flexband.report.page.inputs import with_shares
from flexband.report.page.p_boxes import p_box_data
from flexband.report.page.paths import path_data
from flexband.report.page.template import write_page
from flexband.report.page.verdict import uncertain_ones, verdict, why_unreliable
from flexband.report.page.what_if import panel as what_if
from flexband.report.text import tables
from flexband.report.text.remarks import remark_line, standing, untouched_by
from flexband.report.text.verdicts import verdict_text
from flexband.requirements.verdict import Verdict, worst_of
from flexband.study.presentation.display import Display
from flexband.study.presentation.title_block import FIELDS
from flexband.study.results.answers import read_answer
from flexband.uncertainty.surrogates.records import BandRecord
from flexband.words import number_of

if TYPE_CHECKING:
    from flexband.analysis.selection import AnySurrogate


HELD = (
    "Other inputs need new runs here, since the bands hold only until the motion is unpredictable."
)


def write_report(
    folder: Path,
    given: Mapping[str, Any],
    bands: xr.Dataset,
    checked: xr.Dataset | None = None,
    contributions: xr.Dataset | None = None,
    surrogate: AnySurrogate | None = None,
) -> Path:
    """Write report.html with a folder's answers; return its path.

    `given` is what `given_by` returns, with `title`; `label` of the method; `computed`, command,
    date and the like by name; `remarks`; and `doubts`, why the result is not what was asked for.
    """
    # The last starts all parts, however long a browser pauses between two scripts
    scripts = (
        "arrays.js", "element.js", "colors.js", "numbers.js", "bands.js", "plots.js",
        "readings.js", "limit_axis.js", "charts.js",
        "motion_pen.js", "motion_scene.js", "motion.js", "paths.js", "p_boxes.js",
        *what_if.SCRIPTS,
        "start.js",
    )  # fmt: skip
    display = Display(given.get("display_units", {}), given.get("units", {}))
    answers, check = answers_in(folder, display)
    limits, probability, production = None, None, None
    if check is not None:
        limits, probability, production = check.margins, check.probability, check.production
    raw = bands
    bands = display.data(bands)
    checked, contributions = (
        None if data is None else display.data(data) for data in (checked, contributions)
    )
    parts = read_answer(folder, "parts") if given.get("unpredictable") else None
    uncertain = uncertain_ones(contributions if parts is None else None, given["inputs"])
    predictable = tables.predictable_part(bands, parts)
    panel, fixed = what_if.what_if(surrogate, raw, display) if parts is None else (None, [HELD])
    time, nominal = tables.time_of(bands), nominal_of(surrogate)
    nominal = None if nominal is None else display.data(nominal)
    held = tables.before_horizon(bands, time, parts)
    if nominal is not None:
        nominal = tables.before_horizon(nominal, time, parts)
    if contributions is not None:
        contributions = tables.before_horizon(contributions, time, parts)
    charts = chart_data(held, nominal, contributions, limits, display.input_units())
    if charts and any(row[1] == "compensator" for row in given["inputs"][1]):
        charts["limits"] = None  # margins are those after it is adjusted
    verdicts = requirement_verdicts(check, uncertain, checked) if check else given["unchecked"]
    every = remarks_of(bands.attrs if checked is None else checked.attrs)
    untouched = untouched_by(verdicts, every)
    record = BandRecord.read(bands)
    heading = [given["label"], number_of(record.runs, "run"), given["computed"].get("date", "")]
    page = folder / FileName.REPORT
    write_page(
        page,
        "study.html.j2",
        scripts,
        title=given["title"],
        about=" · ".join(filter(None, heading)),
        title_block=[
            (name, given["title_block"][field])
            for field, name in FIELDS.items()
            if field != "title" and given.get("title_block", {}).get(field)
        ],
        unreliable=why_unreliable(given["doubts"]),
        doubts=given["doubts"] or worst_of(verdicts) is not Verdict.PASS,
        requirements=[
            (str(each.verdict), verdict_text(each), [remark_line(r) for r in standing(each)])
            for each in verdicts
        ],
        run_remarks=[remark_line(remark) for remark in untouched],
        verdict=verdict(given, bands, checked, uncertain, check),
        drawing=given.get("drawing"),
        description=given.get("description", ""),
        question=given.get("question"),
        inputs=with_shares(given["inputs"], uncertain),
        bands=([], []) if predictable is None else tables.summary_table(predictable, checked),
        limits=limits_table(*check[:2], production) if check is not None else None,
        limits_of=tables.deviations(limits)
        if limits is not None and "sigmas" in limits.attrs
        else "",
        limit_remarks=limit_remarks(probability),
        yield_of="" if production is None else AnswerRecord.read(production).scatter,
        charts=charts["x"]["name"] if charts else None,
        numbers=numbers(held) if charts else [],
        answers=answers,
        fields=given.get("fields"),
        remarks=[*given["remarks"], *given["hidden"], *fixed],
        definitions=definitions(bands, given["inputs"], limits, probability),
        computed=[
            *given["computed"].items(),
            ("method", record.method or given["label"]),
            ("runs", runs_in_words(record, 0 if limits is None else BandRecord.read(limits).runs)),
            *(
                (k, getattr(record, k))
                for k in ("discretization", "versions")
                if getattr(record, k)
            ),
        ],
        data={
            "charts": charts,
            "motion": given.get("motion"),
            "what_if": panel,
            "path": path_data(read_answer(folder, "path"), display),
            "p_boxes": p_box_data(read_answer(folder, "p_boxes"), raw, display),
        },
    )
    return page


def runs_in_words(record: BandRecord, worst: int = 0) -> str:
    """Return how many runs were made, and what for; `worst` more at the worst tolerances."""
    kinds = {
        "runs_fitted": "fitted",
        "runs_checked": "held out",
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
        text += (
            ". The budget, max_runs, is for those that are fitted or held out on one discretization"
        )
    return text
