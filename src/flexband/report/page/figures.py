"""A page with a table and figures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from matplotlib.figure import Figure

from flexband.errors import warn
from flexband.report.page.template import picture, write_page
from flexband.report.text.tables import Table


class Drawing(NamedTuple):
    """A figure that is still to be drawn."""

    caption: str
    draw: Callable[[], Figure]


def write_figures(
    file: Path,
    title: str,
    about: str,
    table: Table,
    drawings: Sequence[Drawing],
    remarks: Sequence[str] = (),
) -> Path:
    """Write a page with a table, remarks and figures; return its path.

    A figure that cannot be drawn is a remark.
    """
    pictures, remarks = [], list(remarks)
    for caption, draw in drawings:
        try:
            pictures.append((caption, picture(draw(), "png", dpi=120)))
        except Exception as error:  # whatever Matplotlib raises
            remarks.append(f"The figure {caption!r} could not be drawn: {error}")
            warn(remarks[-1])
    write_page(
        file, "figures.html.j2", title=title, about=about, rows=table, remarks=remarks,
        pictures=pictures,
    )  # fmt: skip
    return file
