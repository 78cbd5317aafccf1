"""Results written into a folder: data, and the report on a comparison of methods."""

from __future__ import annotations

import warnings
from base64 import b64encode
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from io import BytesIO
from pathlib import Path

from matplotlib.figure import Figure

from flexband.basics.warning import warn
from flexband.execution.names import FileName
from flexband.report.page.given import field_axes
from flexband.report.page.template import write_page
from flexband.report.plot import figures
from flexband.report.text import band_tables
from flexband.report.text.drawable import bounds, drawable_outputs
from flexband.study.comparison import Comparison
from flexband.study.study import Study
from flexband.uncertainty.adaptive.method import AdaptivePCCI
from flexband.uncertainty.inputs.fields.random_field import RandomField
from flexband.uncertainty.methods.pcci import PCCI, ImprovedPCCI

Drawing = tuple[str, Callable[[], Figure]]
"""The caption of a figure, and what draws it."""


def write_comparison_report(
    folder: Path,
    title: str,
    study: Study,
    results: Sequence[Comparison],
    orders: Iterable[tuple[int, int]],
) -> Path:
    """Write figures and report.html on methods, the reference first; return the path.

    PCCI and improved PCCI are drawn for the orders k and q, with the reference and adaptive PCCI.
    """
    bands = "Interval mean and interval error bar"
    fields = study.fields()
    response = study.nominal()
    drawn = list[Drawing]()
    adaptive = AdaptivePCCI(correct=False)
    # Figures of the problem: its fields, and its response without uncertainty.
    along = field_axes(study.source, study.inputs) if fields else {}
    if random := {k: field for k, field in fields.items() if isinstance(field, RandomField)}:
        caption = "Variance error of the random fields after discretization"
        draw = partial(figures.variance_error_figure, random, along)
        drawn.append((caption, draw))
    if fields:
        draw = partial(figures.fields_figure, fields, along)
        drawn.append(("Realizations of the fields", draw))
    if outputs := drawable_outputs(response):
        draw = partial(figures.response_figure, response, outputs)
        drawn.append(("Response without uncertainty", draw))
    # Figures of the methods: bands for each pair of orders, and errors against runs.
    for name in outputs:
        for k, q in dict.fromkeys(orders):
            compared = results[0].method, PCCI(k, q), ImprovedPCCI(k, q), adaptive
            bands_by_method = {r.method.label: r.bands for r in results if r.method in compared}
            caption = f"{bands} of {name}, k = {k}, q = {q}"
            draw = partial(figures.bands_figure, bands_by_method, name)
            drawn.append((caption, draw))
        caption = f"Relative errors of {name} against runs"
        draw = partial(figures.errors_figure, results, name)
        drawn.append((caption, draw))
    definitions = ". ".join(bounds(results[0].bands).values()) + "."
    text = [*band_tables.comparison_remarks(fields), definitions]
    about = f"{len(results)} methods, compared with {results[0].method.label}"
    file = folder / FileName.REPORT
    return write_figures(file, title, about, band_tables.error_table(results), drawn, text)


def data_file(folder: Path, result: Comparison) -> Path:
    """Return the file for the bands of one of several methods."""
    longest_name = 100  # bytes of a file name, without its suffix
    words = "".join(c if c.isalnum() else " " for c in result.method.label.lower()).split()
    name = "_".join(words).encode()[:longest_name].decode(errors="ignore") or "response"
    return folder / f"{name}.nc"


def write_figures(
    file: Path,
    title: str,
    about: str,
    table: band_tables.Table,
    drawings: Sequence[Drawing],
    remarks: Sequence[str] = (),
) -> Path:
    """Write a page with a table, remarks and figures that can be drawn; return its path."""
    pictures = []
    remarks = list(remarks)
    for caption, draw in drawings:
        try:
            pictures.append((caption, _picture(draw())))
        except Exception as error:  # whatever Matplotlib raises
            remarks.append(f"The figure {caption!r} could not be drawn: {error}")
            warn(remarks[-1])
    write_page(
        file, "figures.html.j2", title=title, about=about, rows=table, remarks=remarks,
        pictures=pictures,
    )  # fmt: skip
    return file


def _picture(figure: Figure) -> str:
    image = BytesIO()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # characters that fonts do not have are boxes
        figure.savefig(image, format="png", dpi=120)
    return f"data:image/png;base64,{b64encode(image.getvalue()).decode()}"
