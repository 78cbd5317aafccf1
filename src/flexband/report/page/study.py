"""The report on a study: one page that answers, with all that it needs inside."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from flexband.analysis.margins import LeastMargin, LimitVerdict
from flexband.analysis.probability.texts import chance
from flexband.analysis.results import ERRORS
from flexband.execution.names import FileName
from flexband.report.page.answers import answers_in, limits_table
from flexband.report.page.charts import chart_data
from flexband.report.page.definitions import definitions
from flexband.report.page.inputs import with_shares
from flexband.report.page.matters import what_matters
from flexband.report.page.p_boxes import p_box_data
from flexband.report.page.paths import path_data
from flexband.report.page.template import write_page
from flexband.report.page.what_if import panel as what_if
from flexband.report.text import tables
from flexband.report.text.doubts import doubt_text
from flexband.report.text.numbers import number
from flexband.study.results.answers import read_answer
from flexband.study.results.reliability import Doubt, DoubtKind
from flexband.uncertainty.surrogates.choices import SurrogateOfChoices
from flexband.uncertainty.surrogates.surrogate import Surrogate
from flexband.words import number_of

SCRIPTS = (
    "arrays.js", "element.js", "colors.js", "numbers.js", "bands.js", "plots.js",
    "readings.js", "limit_axis.js", "charts.js",
    "motion_symbols.js", "motion_pen.js", "motion_scene.js", "motion.js", "paths.js", "p_boxes.js",
    *what_if.SCRIPTS,
    "start.js",
)  # fmt: skip
"""The last starts all parts, however long a browser pauses between two scripts."""

ROWS = 25
"""Of a table of numbers."""


def write_report(
    folder: Path,
    given: Mapping[str, Any],
    bands: xr.Dataset,
    checked: xr.Dataset | None = None,
    contributions: xr.Dataset | None = None,
    surrogate: Surrogate | SurrogateOfChoices | None = None,
) -> Path:
    """Write report.html into a folder, with the answers that are there; return its path.

    Parameters
    ----------
    given : what `given_by` returns, with `title`; `label` of the method; `computed`, command, date
        and the like by name; `remarks` on the result; and `doubts`, why it is not what was asked
        for.
    checked, contributions : results of `verify` and `contributions`.
    """
    answers, limits, probability = answers_in(folder)
    uncertain = uncertain_ones(contributions, given["inputs"])
    charts = chart_data(bands, nominal_of(surrogate), contributions, limits)
    if charts and any(row[1] == "compensator" for row in given["inputs"][1]):
        charts["limits"] = None  # margins are those after it is adjusted
    others, fixed = what_if.what_if(surrogate, bands, given.get("units", {}))
    attrs = {str(k): v for k, v in bands.attrs.items()}
    heading = [given["label"], number_of(attrs["runs"], "run"), given["computed"].get("date", "")]
    page = folder / FileName.REPORT
    write_page(
        page,
        "study.html.j2",
        SCRIPTS,
        title=given["title"],
        about=" · ".join(filter(None, heading)),
        doubts=given["doubts"]
        or given.get("unchecked")
        or (limits is not None and limits.attrs["kept"] != "kept"),
        verdict=verdict(given, bands, checked, uncertain, limits, probability),
        drawing=given.get("drawing"),
        description=given.get("description", ""),
        question=given.get("question"),
        inputs=with_shares(given["inputs"], uncertain),
        bands=tables.summary_table(bands, checked),
        limits=limits_table(limits, probability) if limits is not None else None,
        limits_of=tables.deviations(limits) if limits is not None else "",
        limit_remarks=[] if probability is None else [probability.attrs["verdict"]],
        charts=charts["x"]["name"] if charts else None,
        numbers=numbers(bands) if charts else [],
        answers=answers,
        fields=given.get("fields"),
        remarks=[*given["remarks"], *given["hidden"], *fixed],
        definitions=definitions(bands, given["inputs"], limits, probability),
        computed=[
            *given["computed"].items(),
            ("method", str(attrs.get("method", given["label"]))),
            ("runs", runs_in_words(attrs)),
            *((k, str(attrs[k])) for k in ("discretization", "versions") if attrs.get(k)),
        ],
        data={
            "charts": charts,
            "motion": given.get("motion"),
            "what_if": others,
            "path": path_data(read_answer(folder, "path")),
            "p_boxes": p_box_data(read_answer(folder, "p_boxes")),
        },
    )
    return page


def nominal_of(surrogate: Surrogate | SurrogateOfChoices | None) -> xr.DataArray | None:
    """Return the response of a surrogate with all inputs nominal, without its samples."""
    if not isinstance(surrogate, Surrogate):
        return None
    values = surrogate.standard(*surrogate.space.nominal())
    return (
        xr.DataArray(values, dims=surrogate.labels.dims)
        .isel(sample=0)
        .assign_coords(
            {k: c.variable for k, c in surrogate.labels.coords.items() if "sample" not in c.dims}
        )
    )


def uncertain_ones(contributions: xr.Dataset | None, inputs: tables.Table) -> xr.Dataset | None:
    """Return the contributions of inputs that are uncertain, and not chosen; None if none is."""
    chosen = {row[0] for row in inputs[1] if row[1] in ("size", "compensator")}
    if contributions is None:
        return None
    keep = [name not in chosen for name in contributions["name"].values.astype(str)]
    return contributions.isel(name=np.flatnonzero(keep)) if any(keep) else None


def verdict(
    given: Mapping[str, Any],
    bands: xr.Dataset,
    checked: xr.Dataset | None,
    contributions: xr.Dataset | None,
    limits: xr.Dataset | None,
    probability: xr.Dataset | None = None,
) -> list[str]:
    """Return what the first lines of the report say."""
    doubts: Sequence[Doubt] = given["doubts"]
    lines = [f"Doubtful: {doubt_text(doubt)}." for doubt in doubts]
    lines.append(tables.error_in_words(bands))
    if checked is not None:
        lines.append(f"{tables.told_by_new_runs(bands, checked, doubtful=bool(doubts))}.")
    unsure = "; this is NOT reliable." if any(doubt.unreliable for doubt in doubts) else "."
    if limits is not None:
        single_limits = [limits.isel(limit=k) for k in range(limits.sizes["limit"])]
        lines += [limit_in_words(limit) + unsure for limit in single_limits]
    if why := given.get("unchecked"):
        lines.append(f"The limits are not checked: {why}.")
    if probability is not None:
        last = probability.isel(limit=-1)  # of leaving any limit
        if any(doubt.kind is DoubtKind.TOLERANCE_NOT_MET for doubt in doubts):
            unsure = "; this is NOT reliable."
        lines.append(f"The probability of leaving a limit at any time is {chance(last)}{unsure}")
    if contributions is not None:
        lines.append(what_matters(contributions, limits))
    return lines


def limit_in_words(limit: xr.Dataset) -> str:
    """Return whether a limit is kept, and where its margin is least, without a full stop."""
    least = LeastMargin.of(limit)
    kept = {LimitVerdict.KEPT: "is kept", LimitVerdict.NOT_KEPT: "is NOT kept"}
    words = kept.get(least.verdict, "is not certainly kept")
    finer = " (a smaller output_step shows it)" * least.decided_between
    margin = f"{least.in_words(number)}{finer}"
    return f"The limit {least.limit} {words} by μ ± {tables.deviations(limit)}: {margin}"


def numbers(bands: xr.Dataset) -> list[tuple[str, tables.Table]]:
    """Return a table of numbers for every output, at some of its times."""
    titled_tables = []
    for name in tables.outputs_of(bands["mean"]):
        output_bands = tables.select(bands, name)
        (free,) = (d for d in output_bands["mean"].dims if d != "bound")
        some = output_bands.isel(
            {free: np.unique(np.linspace(0, output_bands.sizes[free] - 1, ROWS).astype(int))}
        )
        error = next((some[k].values for k in ERRORS if k in some), None)
        columns = [some[free].values]
        columns += [row for k in ("mean", "error_bar") for row in some[k].transpose("bound", free)]
        header = [str(free), "lowest mean", "highest mean", "bar from", "to"]
        if error is not None:
            columns, header = [*columns, error], [*header, "expected error"]
        scales = [0.0, *[float(abs(output_bands["error_bar"]).max())] * 4, 0.0]
        rows = [
            [number(v, 5, scale) for v, scale in zip(row, scales, strict=False)]
            for row in zip(*columns, strict=True)
        ]
        unit = f" [{output_bands['unit'].values}]" if "unit" in output_bands.coords else ""
        titled_tables.append((f"{name or 'response'}{unit}", (header, rows)))
    return titled_tables


def runs_in_words(attrs: Mapping[str, Any]) -> str:
    """Return how many runs were made, and what for."""
    kinds = {
        "runs_fitted": "fitted",
        "runs_checked": "held out",
        "runs_refined": "with half the step or twice the elements",
        "runs_coarser": "with other steps or elements",
        "runs_repeated": "made again, to see if it repeats",
        "runs_failed": "failed",
    }
    parts = [f"{int(attrs[k])} {words}" for k, words in kinds.items() if attrs.get(k)]
    text = f"{attrs['runs']}" + (f": {', '.join(parts)}" if parts else "")
    if attrs.get("runs_coarser") or attrs.get("runs_refined"):
        text += (
            ". The budget, max_runs, is for those that are fitted or held out on one discretization"
        )
    return text
