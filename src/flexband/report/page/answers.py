"""Answers that commands have written into the folder of a study, as parts of its report."""

from __future__ import annotations

from base64 import b64encode
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from flexband.analysis.labelled_answers import AnswerRecord
from flexband.analysis.limits.least_margin import LimitVerdict
from flexband.analysis.limits.limit_verdicts import LimitCheck
from flexband.analysis.probability.texts import bound_text, share_and_interval, verdict_on
from flexband.basics.files import read_unlinked
from flexband.basics.rounding import unit_of_variable
from flexband.report.text.band_tables import Table, deviations, summary_table
from flexband.report.text.drawable import is_likely
from flexband.report.text.numbers import number
from flexband.report.text.parts import parts_table, sampling_line
from flexband.study.presentation.display import Display
from flexband.study.results.answers import Unusable, read_answers

TITLES = {
    "allocation": "Allocated tolerances",
    "sobol": "Parts of the variance: Sobol' indices",
    "quantiles": "Quantiles",
    "p_box": "Distribution function",
    "range": "Range of values",
    "derived": "Quantities made of outputs",
    "parts": "Distribution over the parts",
    "narrowed": "Bands with narrower inputs",
}
"""Answers by the names of their files."""


class Answer(NamedTuple):
    """A part of a report."""

    title: str
    table: Table | None
    remarks: list[str]
    pictures: list[tuple[str, str]]


def answers_in(folder: Path, display: Display) -> tuple[list[Answer], LimitCheck | None]:
    """Return the valid answers in a folder, in display units, and whether requirements are met."""
    likely = (
        "Below: the probability of violating each limit at a time, for the worst values of the "
        "interval inputs"
    )
    margins = (
        "Margin of {} to each limit, for all values of the interval inputs: the requirement is met "
        "where it is above zero. A least margin too small to be seen beside the others is drawn "
        "again, enlarged, with dots at the output times"
    )
    usable, unusable = read_answers(folder, (*TITLES, "limits", "probability", "yield"))
    display_answers = {k: display.data(answer) for k, answer in usable.items() if k != "parts"}
    usable = {**usable, **display_answers}  # a table of parts has a unit in each row
    limits = usable.get("limits")
    probability = usable.get("probability")
    answers = [_part(folder, k, title, usable[k]) for k, title in TITLES.items() if k in usable]
    bar = "" if limits is None else f"μ ± {deviations(limits)}"
    sentences = [margins.format(bar), *[likely] * is_likely(probability), ""]
    if limits is not None and (
        pictures := _pictures(folder, "limits", ". ".join(sentences).strip())
    ):
        answers.insert(0, Answer("Margins over time", None, [], pictures))
    texts = [
        f"Answers {reason.value} are not shown: {', '.join(names)}. Ask again."
        for reason in Unusable
        if (names := [name for name, why in unusable.items() if why == reason])
    ]
    if texts:
        answers.append(Answer("Left out", None, texts, []))
    if limits is None:
        return answers, None
    return answers, LimitCheck(limits, probability, True, usable.get("yield"))


def _part(folder: Path, name: str, title: str, answer: xr.Dataset) -> Answer:
    inputs = "changes" if "changes" in answer.attrs else "inputs"
    verdict = "outcome" if "outcome" in answer.attrs else "verdict"
    texts = (answer.attrs.get(k) for k in (verdict, inputs, "sampling", "surrogate_not_reliable"))
    remarks = [str(text) for text in texts if text]
    tables = {
        "allocation": allocation_table, "narrowed": summary_table, "derived": derived_table,
        "parts": parts_table,
    }  # fmt: skip
    table = tables[name](answer) if name in tables else None
    if name == "parts":
        remarks.insert(0, sampling_line(answer))
    if "slack" in answer:
        remarks.append(margins_left(answer))
    if name == "sobol" and answer.sizes["name"] == 1:
        return Answer(title, None, [only_one(answer), *remarks], [])
    if name == "derived":
        unit = unit_of_variable(answer["mean"])
        title = f"{title}: {answer.attrs['quantity']}" + (f" [{unit}]" if unit else "")
    return Answer(title, table, remarks, _pictures(folder, name, _caption(name, answer)))


def _caption(name: str, answer: xr.Dataset) -> str:
    """Return what the picture of an answer shows, and what it was computed from."""
    # Of the pictures of answers
    captions = {
        "allocation": "Above: each tolerance as a fraction of the largest one allowed. Below: the "
        "margins to the limits with these tolerances; a requirement is met where its margin is "
        "above zero. Margins too small to be seen are drawn again, enlarged",
        "sobol": "Fraction of the variance in which each random input takes part: the lowest and "
        "the highest for all values of the interval inputs",
        "quantiles": "Lowest and highest quantiles of each output for all values of the interval "
        "inputs; the legend names their probabilities",
        "p_box": "Probability{} up to the one on the axis: the lowest and the highest for all "
        "values of the interval inputs",
        "range": "Lowest and highest values of each output for all values of the interval inputs "
        "and the stated share of the random ones",
        "derived": "Error bar of the quantity: the lowest μ − kσ and the highest μ + kσ for all "
        "values of the interval inputs",
    }
    caption = captions.get(name, TITLES[name])
    if name == "p_box":
        at = {k: c for k, c in answer.coords.items() if not c.ndim and k not in ("unit", "output")}
        where = "".join(
            f", at {k} {number(c) if c.dtype.kind == 'f' else c.values}" for k, c in at.items()
        )
        output = f" of {answer['output'].values}" if "output" in answer.coords else ""
        caption = caption.format(f" of values{output}{where},")
    made = AnswerRecord.read(answer).made
    return f"{caption}. From {made}." if made else f"{caption}."


def only_one(indices: xr.Dataset) -> str:
    """Return what Sobol' indices of a single random input tell."""
    return (
        f"{indices['name'].values[0]} is the only random input: all of the variance is due to it."
    )


def _pictures(folder: Path, name: str, caption: str) -> list[tuple[str, str]]:
    """Return the picture that the answer's command has drawn, as the address of an image."""
    file = folder / f"{name}.png"
    if not file.is_file():
        return []
    return [(caption, f"data:image/png;base64,{b64encode(read_unlinked(file)).decode()}")]


def allocation_table(allocation: xr.Dataset) -> Table:
    """Return one row per tolerance: itself, its cost, and its part in the nearest limit."""
    margins = "contribution" in allocation
    column = "share of the used margin" if margins else "share of the change of P"
    units = allocation["tolerance_unit"].values if "tolerance_unit" in allocation.coords else []
    header = ["input", "tolerance", "largest", *["unit"] * any(units), "cost", column]
    nearest = allocation["contribution"].isel(binding=0) if margins else allocation["elasticity"]
    share = nearest / nearest.sum()
    rows = []
    for k, name in enumerate(allocation["name"].values.tolist()):
        of_name = allocation.isel(name=k)
        ends = [number(of_name[end]) for end in ("tolerance", "largest")]
        rows.append([name, *ends, *units[k : k + any(units)], number(of_name["cost"])])
    return header, [[*row, f"{100 * float(p):.3g} %"] for row, p in zip(rows, share, strict=True)]


def margins_left(allocation: xr.Dataset) -> str:
    """Return the least margins of requirements with allocated tolerances."""
    names = allocation["limit"].values
    slack = allocation["slack"].values
    units = allocation["unit"].values if "unit" in allocation.coords else ""
    units = np.broadcast_to(units, len(names))
    scale = float(abs(allocation["margin"]).max())
    margins = [
        f"{name}, {number(margin, scale=scale)} {unit}".rstrip()
        for name, margin, unit in zip(names, slack, units, strict=True)
    ]
    return f"With these tolerances the margins are: {'; '.join(margins)}."


def derived_table(bands: xr.Dataset) -> Table:
    """Return the bounds of a quantity: the lowest and the highest over its values."""
    words = {
        "mean": "mean",
        "error_bar": f"error bar μ ± {deviations(bands)}",
        "range": f"range of {100 * bands.attrs['probability']:g} %",
    }
    rows = []
    for name, title in words.items():
        errors = [f"{name}_sampling_error", f"{name}_expected_error"]
        ends = bands[name].sel(bound="lower").min(), bands[name].sel(bound="upper").max()
        scale = float(abs(bands[name]).max())
        row = [title, *(number(v, 5, scale) for v in ends)]
        rows.append([*row, *(number(bands[k].max(), 2) if k in bands else "" for k in errors)])
    unit = f" [{bands['unit'].values}]" if "unit" in bands.coords and not bands["unit"].ndim else ""
    columns = ("lowest", "highest", "sampling error", "expected error")
    return ["", *(f"{column}{unit}" for column in columns)], rows


def limits_table(
    margins: xr.Dataset,
    probability: xr.Dataset | None = None,
    production: xr.Dataset | None = None,
) -> Table:
    """Return one row per requirement: worst case, probability of violating it, and yield."""
    header = ["requirement", "worst case", "least margin", "its expected error"]
    all_limits: Any = next(r for r in (probability, production, margins) if r is not None)
    if probability is not None:
        header += ["probability, lower (95 % confidence)", "upper"]
    rows = []
    for k, name in enumerate(all_limits["limit"].values.tolist()):
        row = [name, "", "", ""]
        if k < margins.sizes["limit"]:
            limit = margins.isel(limit=k)
            unit = f" {limit['unit'].values}" if str(limit.coords.get("unit", "")) else ""
            margin = number(limit["least_margin"]), number(limit["least_margin_error"], 2)
            row = [
                name,
                LimitVerdict(str(limit["verdict"].values)).word,
                *(f"{text}{unit}" for text in margin),
            ]
        if probability is not None:
            row += [bound_text(probability.isel(limit=k, bound=b)) for b in range(2)]
        if production is not None:
            part = production.isel(limit=k)
            row.append(yield_cell(part.isel(bound=-1) if "bound" in part.dims else part))
        rows.append(row)
    return header + ["yield (95 % confidence)"] * (production is not None), rows


def limit_remarks(probability: xr.Dataset | None) -> list[str]:
    """Return with which inputs probabilities of violating limits are reached."""
    return [] if probability is None else [verdict_on(probability)]


def yield_cell(part: xr.Dataset) -> str:
    """Return the share of the parts that meet a requirement, for a cell."""
    share, interval = share_and_interval(part)
    if not share:
        return "not given"
    return f"{share} ({interval})" if interval else share
