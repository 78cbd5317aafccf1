"""Pages of cells: what they show can be pasted, and what they hide executes just that."""

import ast
import builtins
import re
import runpy
import symtable
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
WITH_HIDDEN_CELLS = runpy.run_path(str(DOCS / "executed_blocks.py"))["with_hidden_cells"]
PAGES = {
    str(page.relative_to(DOCS)): page.read_text(encoding="utf-8")
    for page in sorted(DOCS.rglob("*.md"))
}
PAGES_OF_CELLS = [name for name, text in PAGES.items() if "{code-cell}" in text]
HIDDEN = "remove-cell", "remove-input"
EXTENSION = "%load_ext flexband\n"
"""What only notebooks understand; it is a cell of its own, on the page on notebooks."""


def cells(text):
    """Return the options and the content of each cell of a page."""
    pattern = r"^```\{code-cell\} python\n((?::.*\n)*)((?:.*\n)*?)```$"
    return re.findall(pattern, text, re.MULTILINE)


def files(text):
    """Return the name and the content of each file, or part of one, on a page."""
    return re.findall(r"^```python ([\w-]+\.py)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def shown_cells(text):
    """Return the content of each cell that is not hidden."""
    return [code for options, code in cells(text) if not any(tag in options for tag in HIDDEN)]


def missing_names(code):
    """Return the global names that some code uses and nowhere defines."""
    tables = [symtable.symtable(code, "page", "exec")]
    defined = {s.get_name() for s in tables[0].get_symbols() if s.is_assigned() or s.is_imported()}
    used = set()
    for table in tables:
        used |= {s.get_name() for s in table.get_symbols() if s.is_referenced() and s.is_global()}
        tables += table.get_children()
    return used - defined - set(dir(builtins))


@pytest.mark.parametrize("name", PAGES_OF_CELLS)
def test_what_is_shown_can_be_pasted(name):
    shown = shown_cells(PAGES[name])
    if name == "tutorials/notebook.md":
        shown.remove(EXTENSION)
    for code in shown + [content for _, content in files(PAGES[name])]:
        assert not re.search(r"^\s*[%!]", code, re.MULTILINE), code
        ast.parse(code)
    assert not missing_names("".join(shown))
    for file in {file for file, _ in files(PAGES[name])}:
        assert not missing_names("".join(text for one, text in files(PAGES[name]) if one == file))


@pytest.mark.parametrize("name", PAGES_OF_CELLS)
def test_what_is_hidden_only_sets_the_page_up(name):
    for options, code in cells(PAGES[name]):
        if any(tag in options for tag in HIDDEN):
            assert set(code.split("\n")) <= {"", "%run ../setup_page.py", EXTENSION.strip()}


@pytest.mark.parametrize("name", PAGES_OF_CELLS)
def test_files_and_commands_are_executed_as_they_are_shown(name):
    text = PAGES[name]
    executed = [code for options, code in cells(WITH_HIDDEN_CELLS(text)) if options]
    for file, content in files(text):
        assert f"\n%%writefile -a {file}\n{content}" in executed
    for commands in re.findall(r"^```sh\n(.*?)^```$", text, re.MULTILINE | re.DOTALL):
        assert f"\n%%sh\n{commands}" in executed


def test_a_file_has_its_name_above_it():
    text = WITH_HIDDEN_CELLS(PAGES["tutorials/four_bar.md"])
    captions = re.findall(r"^```\{code-block\} python\n:caption: (.*)\n\n", text, re.MULTILINE)
    assert captions == ["four_bar.py", "four_bar.py, at its end"]
    text = WITH_HIDDEN_CELLS(PAGES["how-to/studies.md"])
    assert "```{code-block} python\n:caption: throw.py\n\nimport math\n" in text
    assert "{code-cell}" not in text
