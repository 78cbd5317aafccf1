"""Answers that commands have written into the folder of a study, as parts of its report."""

from __future__ import annotations

from base64 import b64encode
from pathlib import Path
from typing import Any, NamedTuple

import xarray as xr

from flexband.report.numbers import number
from flexband.report.tables import Table, deviations, summary_table
from flexband.uncertainty.answers.probability.texts import told

TITLES = {
    "allocation": "Allocated tolerances",
    "sobol": "Parts of the variance: Sobol' indices",
    "quantiles": "Quantiles",
    "p_box": "Distribution function",
    "range": "Range of values",
    "derived": "Quantities made of outputs",
    "narrowed": "Bands with narrower inputs",
}
"""Answers by the names of their files."""

MARGINS = (
    "How far {} stays inside each limit, for all values of the interval inputs: the limit is kept "
    "where this margin is above zero. A chart of probabilities follows if there are any."
)

STALE = "stale"
"""Attribute of answers of earlier results."""


class Answer(NamedTuple):
    """A part of a report."""

    title: str
    table: Table | None
    remarks: list[str]
    pictures: list[tuple[str, str]]


def answers_in(folder: Path) -> tuple[list[Answer], xr.Dataset | None, xr.Dataset | None]:
    """Return the answers in a folder, with the limits and the probabilities of leaving them.

    Answers of earlier results are left out, and named.
    """
    found, older = [], []
    limits, probability = (read_answer(folder, name, older) for name in ("limits", "probability"))
    for name, title in TITLES.items():
        answer = read_answer(folder, name, older)
        if answer is None:
            continue
        inputs = "changes" if "changes" in answer.attrs else "inputs"
        texts = (answer.attrs.get(k) for k in ("verdict", inputs, "surrogate_not_trusted"))
        remarks = [str(text) for text in texts if text]
        tables = {"allocation": allocation_table, "narrowed": summary_table}
        table = tables[name](answer) if name in tables else None
        found.append(Answer(title, table, remarks, _pictures(folder, name, title)))
    bar = "" if limits is None else f"μ ± {deviations(limits)}"
    if limits is not None and (pictures := _pictures(folder, "limits", MARGINS.format(bar))):
        found.insert(0, Answer("Limits over time", None, [], pictures))
    if older:
        text = f"Answers of earlier results are left out: {', '.join(older)}. Ask again."
        found.append(Answer("Left out", None, [text], []))
    return found, limits, probability


def read_answer(folder: Path, name: str, older: list[str] | None = None) -> xr.Dataset | None:
    """Return an answer in a folder; None if it is missing, or one of earlier results.

    The name of such a one is added to `older`.
    """
    file = folder / f"{name}.nc"
    try:
        with xr.open_dataset(file, engine="scipy", decode_times=False) as found:
            answer = found.load()
    except (OSError, ValueError, TypeError):  # missing, or no such file
        return None
    if STALE in answer.attrs:
        if older is not None:
            older.append(name)
        return None
    return answer


def _pictures(folder: Path, name: str, caption: str) -> list[tuple[str, str]]:
    """Return the picture that the answer's command has drawn, as the address of an image."""
    file = folder / f"{name}.png"
    if not file.is_file():
        return []
    return [(caption, f"data:image/png;base64,{b64encode(file.read_bytes()).decode()}")]


def allocation_table(found: xr.Dataset) -> Table:
    """Return one row per tolerance: itself, its cost, and its part in the nearest limit."""
    margins = "contribution" in found
    told = "of the margin at the nearest limit" if margins else "of the relative change of P"
    header = ["input", "tolerance", "largest", "cost", told]
    nearest = found["contribution"].isel(binding=0) if margins else found["elasticity"]
    share = nearest / nearest.sum()
    rows = [
        [
            str(one["name"].values),
            *(number(one[k]) for k in ("tolerance", "largest", "cost")),
        ]
        for one in (found.isel(name=k) for k in range(found.sizes["name"]))
    ]
    return header, [[*row, f"{100 * float(p):.3g} %"] for row, p in zip(rows, share, strict=True)]


def limits_table(checked: xr.Dataset, probability: xr.Dataset | None) -> Table:
    """Return one row per limit: verdict, least margin, and the probability of leaving it."""
    header = ["limit", "verdict", "least margin", "its expected error"]
    every: Any = checked if probability is None else probability
    if probability is not None:
        header += ["probability, lower", "upper"]
    rows = []
    for k, name in enumerate(every["limit"].values.tolist()):
        row = [name, "", "", ""]
        if k < checked.sizes["limit"]:
            one = checked.isel(limit=k)
            numbers = [number(one["least_margin"]), number(one["least_margin_error"], 2)]
            row = [name, str(one["verdict"].values), *numbers]
        if probability is not None:
            row += [told(probability.isel(limit=k, bound=b)) for b in range(2)]
        rows.append(row)
    return header, rows
