"""Blocks that a page shows as they are pasted, and that the build of the site executes.

A block whose first line names a file, such as "python engine.py", has that name above it. On pages
with cells it is also appended to the file, and a block "sh" is run, with its output below it; the
cells that do so are hidden. "no-run" in the place of the name keeps a block from being run.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sphinx.application import Sphinx

FILE = re.compile(r"^```(\w+) ([\w-]+\.\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
COMMANDS = re.compile(r"^```sh\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def with_hidden_cells(text: str) -> str:
    """Return the text of a page with the names of its files and the cells that execute blocks."""
    has_cells = "\n```{code-cell}" in text
    files: set[str] = set()

    def file(block: re.Match[str]) -> str:
        language, name, content = block.groups()
        caption = f"{name}, at its end" if name in files else name
        files.add(name)
        shown = f"```{{code-block}} {language}\n:caption: {caption}\n\n{content}```"
        return shown + _cell("remove-cell", f"%%writefile -a {name}", content) * has_cells

    def commands(block: re.Match[str]) -> str:
        return block[0] + _cell("remove-input", "%%sh", block[1])

    text = FILE.sub(file, text)
    return COMMANDS.sub(commands, text) if has_cells else text


def _cell(tag: str, magic: str, content: str) -> str:
    return f"\n\n```{{code-cell}} python\n:tags: [{tag}]\n\n{magic}\n{content}```"


def replace_text(_app: Sphinx, _page: str, source: list[str]) -> None:
    """Give a page that is read its names of files and its hidden cells."""
    source[0] = with_hidden_cells(source[0])


def setup(app: Sphinx) -> dict[str, bool]:
    """Register what this module does."""
    app.connect("source-read", replace_text)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
