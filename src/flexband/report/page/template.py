"""Pages from templates, one file each with all that it needs inside, and their prints as PDF."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import cache
from importlib import resources
from importlib.metadata import version
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup

from flexband.basics.files import replace_file
from flexband.report.text.numbers import with_minus

ASSETS = resources.files("flexband.report.page").joinpath("assets")


def write_page(file: Path, template: str, scripts: Sequence[str] = (), **values: Any) -> None:
    """Write a web page from a template in assets, complete at once; `data` is for scripts."""
    data = values.pop("data", None)
    if data is not None:
        text = json.dumps(data, allow_nan=False, separators=(",", ":"))
        values["data"] = Markup(text.replace("<", "\\u003c"))
        values["scripts"] = [_plotly(), *map(_script, scripts)]
    names = ("style.css", "motion.css", "what_if.css")
    styles = (ASSETS.joinpath(name).read_text(encoding="utf-8") for name in names)
    page = _templates().get_template(template)
    html = page.render(style=Markup("".join(styles)), version=version("flexband"), **values)
    with replace_file(file) as partial:
        partial.write_text(html, encoding="utf-8", errors="replace")


@cache
def _templates() -> jinja2.Environment:
    loader = jinja2.FunctionLoader(lambda name: ASSETS.joinpath(name).read_text(encoding="utf-8"))
    undefined = jinja2.StrictUndefined
    templates = jinja2.Environment(
        loader=loader, autoescape=True, undefined=undefined, trim_blocks=True
    )
    templates.filters["minus"] = with_minus
    return templates


def _script(name: str) -> Markup:
    text = ASSETS.joinpath(name).read_text(encoding="utf-8")
    assert "</script" not in text
    return Markup(text)


@cache
def _plotly() -> Markup:
    file = resources.files("plotly").joinpath("package_data/plotly.min.js")
    return Markup(file.read_text(encoding="utf-8").replace("</script", "<\\/script"))
