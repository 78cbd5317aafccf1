"""A web page with a table and figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path

from matplotlib.figure import Figure

from flexband.report.tables import Table

STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 70rem; margin: 2rem auto; padding: 0 1rem; }
table { border-collapse: collapse; margin: 1rem 0; }
th, td { border-bottom: 1px solid #ccc; padding: 0.25rem 0.8rem; text-align: right; }
th:first-child, td:first-child { text-align: left; }
img { max-width: 100%; }
"""


def write_report(
    folder: Path,
    title: str,
    table: Table,
    figures: Mapping[str, tuple[str, Figure]],
    remarks: Sequence[str] = (),
) -> Path:
    """Write ``report.html`` and one PNG file per figure; return the path of the page.

    Parameters
    ----------
    figures : file name without suffix -> (caption, figure).
    remarks : paragraphs below the table.
    """
    folder.mkdir(parents=True, exist_ok=True)
    (header, rows), heading = table, escape(title)
    parts = [
        '<!doctype html>\n<html lang="en">\n<meta charset="utf-8">',
        f"<title>{heading}</title>\n<style>{STYLE}</style>\n<h1>{heading}</h1>\n<table>",
        *(_row("th", header), *(_row("td", row) for row in rows)),
        "</table>",
        *(f"<p>{escape(line)}</p>" for line in remarks),
    ]
    for name, (caption, figure) in figures.items():
        figure.savefig(folder / f"{name}.png", dpi=120)
        text = escape(caption)
        parts.append(f'<figure><img src="{name}.png" alt="{text}"><figcaption>{text}</figcaption>')
        parts.append("</figure>")
    page = folder / "report.html"
    page.write_text("\n".join([*parts, "</html>\n"]), encoding="utf-8")
    return page


def _row(tag: str, cells: Sequence[str]) -> str:
    return "<tr>" + "".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in cells) + "</tr>"
