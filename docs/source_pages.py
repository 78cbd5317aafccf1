"""Links from the docs to the code: a page for every module, and links wherever a text names one."""

from __future__ import annotations

import inspect
import re
from html import escape
from importlib import import_module
from pathlib import Path
from typing import Any

from docutils import nodes
from pygments import highlight
from pygments.formatters import HtmlFormatter
from pygments.lexers import PythonLexer
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxRole
from sphinx.util.osutil import relative_uri

from flexband.basics.namespaces import NAMESPACES

SOURCE = Path(__file__).parents[1] / "src" / "flexband"
MODULES = {
    name: module
    for module in ("flexband", *(f"flexband.{namespace}" for namespace in NAMESPACES))
    for name in import_module(module).__all__
}
"""Where the public names are."""

PAGE = """<!doctype html>
<html lang="en"><meta charset="utf-8"><title>{title}</title>
<style>body {{ max-width: 60rem; margin: 2rem auto; padding: 0 1rem; }} pre {{ line-height: 1.4; }}
a:target + span, a:target {{ background: #ffd; }} {style}</style>
<h1><code>{title}</code></h1>{code}</html>
"""


def page_of(module: str, name: str) -> str | None:
    """Return the page and the line of an object that flexband defines."""
    own: Any = import_module(module)
    try:
        for part in name.split("."):
            own = getattr(own, part)
        own = inspect.unwrap(own.fget if isinstance(own, property) else own)
        file, line = Path(inspect.getfile(own)), inspect.getsourcelines(own)[1]
    except (AttributeError, TypeError, OSError):
        return None
    return f"{_uri(file)}#L-{line}" if file.is_relative_to(SOURCE) else None


class PublicName(SphinxRole):
    """Text in backticks of a docstring: a link if it is a public name, or code."""

    def run(self) -> tuple[list[nodes.Node], list[nodes.system_message]]:
        """Return the node."""
        code, name = nodes.literal(self.rawtext, self.text), self.text.removesuffix("()")
        module = MODULES.get(name)
        if module is None:
            return [code], []
        link = pending_xref(
            "", code, refdomain="py", reftype="obj", reftarget=f"{module}.{name}", refexplicit=True
        )
        return [link], []


def plain(_app: Sphinx, _what: str, _name: str, _own: object, _options: object, lines: list[str]):
    """Mark what docutils would take for markup: |x|, (*x.shape,), and the end of `std`²."""
    for k, line in enumerate(lines):
        escaped = re.sub(r"(?<=\()\*(?!\*)|\|", r"\\\g<0>", line)
        lines[k] = re.sub(r"(`\w+`)(?=[²³])", r"\1\\ ", escaped)


def link(app: Sphinx, tree: nodes.document, page: str) -> None:
    """Make a link of every `folder/module.py` and `flexband.folder.module` in a text."""
    for one in list(tree.findall(nodes.literal)):
        named = re.fullmatch(r"(?:src/flexband/)?([\w/]+)\.py|flexband\.([\w.]+)", one.astext())
        if named is None or isinstance(one.parent, nodes.reference):
            continue
        file = SOURCE / f"{named[1] or named[2].replace('.', '/')}.py"
        if file.is_file():
            uri = relative_uri(app.builder.get_target_uri(page), _uri(file))
            reference = nodes.reference("", "", refuri=uri, internal=True)
            one.replace_self(reference)
            reference += one


def summarize(_app: Sphinx, page: str, source: list[str]) -> None:
    """Write a table of the names on a page of the API, one line each, below its title."""
    head, directive, entries = source[0].partition("\n.. currentmodule::")
    if not page.startswith("reference/api/") or not directive:
        return
    module, names = "", []
    for kind, name in re.findall(r"^\.\. (\w+):: (\S+)", directive + entries, re.MULTILINE):
        module = name if kind == "currentmodule" else module
        path = name if name.startswith("flexband.") else f"{module}.{name}"
        names += [f"   ~{path}"] * kind.startswith("auto")
    table = "\n".join([".. autosummary::", "   :nosignatures:", "", *names, ""])
    source[0] = f"{head}\n{table}{directive}{entries}"


def write_pages(app: Sphinx, exception: Exception | None) -> None:
    """Write the pages of all modules."""
    formatter = HtmlFormatter(lineanchors="L")
    for file in SOURCE.rglob("*.py") if exception is None else ():
        title = escape(f"flexband/{file.relative_to(SOURCE)}")
        code = highlight(file.read_text(encoding="utf-8"), PythonLexer(), formatter)
        page = Path(app.outdir) / _uri(file)
        page.parent.mkdir(parents=True, exist_ok=True)
        text = PAGE.format(title=title, style=formatter.get_style_defs(), code=code)
        page.write_text(text, encoding="utf-8")


def _uri(file: Path) -> str:
    return f"source/{file.relative_to(SOURCE).with_suffix('.html')}"


def setup(app: Sphinx) -> dict[str, bool]:
    """Register what this module does."""
    app.add_role("public", PublicName())
    app.connect("source-read", summarize)
    app.connect("autodoc-process-docstring", plain)
    app.connect("doctree-resolved", link)
    app.connect("build-finished", write_pages)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
