"""A web page with a table and figures."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Collection, Sequence
from html import escape, unescape
from itertools import chain, count
from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote

from matplotlib.figure import Figure

from flexband.errors import warn
from flexband.files import replaced
from flexband.report.tables import Table

PICTURES = "flexband-pictures"
"""Name of the tag that lists the pictures of a page, separated by "|"."""

LONGEST_NAME = 100
"""Bytes of a file name, without its suffix."""

STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 70rem; margin: 2rem auto; padding: 0 1rem; }
table { border-collapse: collapse; margin: 1rem 0; }
th, td { border-bottom: 1px solid #ccc; padding: 0.25rem 0.8rem; text-align: right; }
th:first-child, td:first-child { text-align: left; }
img { max-width: 100%; }
"""


class Drawing(NamedTuple):
    """A figure that is still to be drawn.

    name : of the file, which `write_report` makes one that no other figure has.
    """

    name: str
    caption: str
    draw: Callable[[], Figure]


def write_report(
    folder: Path,
    title: str,
    table: Table,
    drawings: Sequence[Drawing],
    remarks: Sequence[str] = (),
) -> Path:
    """Write ``report.html`` and one PNG file per figure; return the path of the page.

    A figure that cannot be drawn is a remark. Pictures of a page that was there before are removed
    if the new page has none of their name, so that they are not taken for new ones.

    Parameters
    ----------
    remarks : paragraphs below the table.
    """
    folder.mkdir(parents=True, exist_ok=True)
    shown, remarks, taken, listed = [], list(remarks), set(), set()
    for name, caption, draw in drawings:
        file = file_name(name, taken)
        taken.add(file.casefold())
        try:
            _draw(draw, folder / f"{file}.png")
        except Exception as error:  # whatever Matplotlib raises
            remarks.append(f"The figure {caption!r} could not be drawn: {error}")
            warn(remarks[-1])
            continue
        listed.add(f"{file}.png")
        text = escape(caption)
        shown.append(f'<figure><img src="{quote(file)}.png" alt="{text}">')
        shown.append(f"<figcaption>{text}</figcaption></figure>")
    (header, rows), heading = table, escape(title)
    parts = [
        '<!doctype html>\n<html lang="en">\n<meta charset="utf-8">',
        f'<meta name="{PICTURES}" content="{escape("|".join(sorted(listed)))}">',
        f"<title>{heading}</title>\n<style>{STYLE}</style>\n<h1>{heading}</h1>\n<table>",
        *(_row("th", header), *(_row("td", row) for row in rows)),
        "</table>",
        *(f"<p>{escape(line)}</p>" for line in remarks),
        *shown,
    ]
    page = folder / "report.html"
    before = _listed(page)
    with replaced(page) as partial:
        text = "\n".join([*parts, "</html>\n"])
        partial.write_text(text, encoding="utf-8", errors="replace")
    for name in before - listed:
        (folder / name).unlink(missing_ok=True)
    return page


def _listed(page: Path) -> set[str]:
    """Return the pictures of a page, if there is one."""
    try:
        text = page.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return set()
    found = re.search(f'<meta name="{PICTURES}" content="([^"]*)">', text)
    names = unescape(found[1]).split("|") if found else []
    return {name for name in names if Path(name).name == name and Path(name).suffix == ".png"}


def file_name(name: str, taken: Collection[str] = ()) -> str:
    """Return a name as that of a file, other than those taken, which are in lower case."""
    words = "".join(c if c.isalnum() else " " for c in name).split()
    start = "_".join(words).encode()[:LONGEST_NAME].decode(errors="ignore") or "response"
    numbered = (f"{start}_{k}" for k in count(2))
    return next(own for own in chain([start], numbered) if own.casefold() not in taken)


def _draw(draw: Callable[[], Figure], file: Path) -> None:
    """Draw a figure into a file; characters that fonts do not have are boxes."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        figure = draw()
        with replaced(file) as partial:
            figure.savefig(partial, dpi=120, format="png")


def _row(tag: str, cells: Sequence[str]) -> str:
    return "<tr>" + "".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in cells) + "</tr>"
