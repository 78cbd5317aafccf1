"""The documentation: its code runs, its commands exist, and its reference is complete.

Tutorials and other pages of cells (`{code-cell}`) run when the site is built, by `make docs`.
"""

import ast
import csv
import re
import shlex
from pathlib import Path

import pytest
from typer.main import get_group
from typer.testing import CliRunner

import flexband as fb
from flexband.cli import app
from flexband.cli.commands import load

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = {
    str(page.relative_to(ROOT)): page.read_text(encoding="utf-8")
    for page in (ROOT / "README.md", *sorted(DOCS.glob("*.md")), *DOCS.glob("tutorials/*.md"))
}
OWN_TESTS = {
    "README.md": "test_examples.py",
    "docs/answers.md": "test_answers_page.py",
    "docs/extending.md": "test_extending.py",
    "docs/models.md": "models/test_page.py",
}
"""Pages whose code other tests run, with what it must give."""

TO_RUN = [
    name
    for name, text in PAGES.items()
    if "```python" in text and "{code-cell}" not in text and name not in OWN_TESTS
]


def blocks(text, *languages):
    """Return language, rest of the first line, and content of the fenced blocks that can run."""
    pattern = rf"^```({'|'.join(languages)})\b *(.*)\n((?:.*\n)*?)```$"
    return [one for one in re.findall(pattern, text, re.MULTILINE) if one[1] != "no-run"]


def commands(text):
    """Yield the arguments of the commands of flexband in some lines."""
    for line in text.splitlines():
        words = shlex.split(line, comments=True)
        if words and Path(words[0]).name == "flexband":
            yield words[1:]


def somebody_runs_the_model(folder):
    """Write the results of the points of docs/studies.md."""
    with open(folder / "wear" / "points.csv", encoding="utf-8") as file:
        points = list(csv.DictReader(file))
    rows = [f"{p['number']},{p['load']},{float(p['speed']) * float(p['load'])}" for p in points]
    (folder / "results.csv").write_text("\n".join(["number,force,wear", *rows]), encoding="utf-8")


@pytest.mark.parametrize("name", TO_RUN)
def test_code_and_commands_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for folder in (ROOT / "examples" / "paper", tmp_path):
        monkeypatch.syspath_prepend(folder)
    names = {"__name__": "page"}
    for language, file, content in blocks(PAGES[name], "python", "sh"):
        if file:
            text = content.replace("sleep(0.5)", "sleep(0)")
            (tmp_path / file).write_text(text, encoding="utf-8")
        elif language == "python":
            exec(content, names)
        else:
            for words in commands(content):
                if words[0] == "ingest":
                    somebody_runs_the_model(tmp_path)
                done = CliRunner().invoke(app, words)
                assert done.exit_code in (0, 4), f"{words}\n{done.output}"


@pytest.mark.parametrize("name", PAGES)
def test_commands_are_understood(name):
    """Every command in a block, or in backticks with arguments, is parsed."""
    found = [content for _, _, content in blocks(PAGES[name], "sh")]
    found += re.findall(r"`(flexband [^`]+)`", PAGES[name].replace("\n", " "))
    for words in (w for text in found for w in commands(text)):
        if words and not words[0].startswith("-"):
            load(words[:1])
            own = get_group(app).commands[words[0]]
            if len(words) > 1 and "--help" not in words:
                own.make_context(words[0], words[1:])


@pytest.mark.parametrize("name", [name for name, text in PAGES.items() if "{code-cell}" in text])
def test_cells_are_python(name):
    """The build of the site runs them; what it takes out of sight only sets the page up."""
    for options, content in re.findall(
        r"^```\{code-cell\} python\n((?::.*\n)*)((?:.*\n)*?)```$", PAGES[name], re.MULTILINE
    ):
        code = [line for line in content.splitlines() if not line.startswith("%")]
        if "%%sh" not in content:
            ast.parse("\n".join(code))
        assert "remove-cell" not in options or "setup_page" in content


def test_pages_with_own_tests():
    for page, test in OWN_TESTS.items():
        assert Path(page).name in (ROOT / "tests" / test).read_text(encoding="utf-8")


def test_every_page_is_in_the_contents():
    index = PAGES["docs/index.md"]
    for name in PAGES.keys() - {"README.md", "docs/index.md"}:
        page = name.removeprefix("docs/").removesuffix(".md")
        assert re.search(rf"^{page}$", index, re.MULTILINE), page


def test_the_reference_has_every_public_name():
    listed = {"flexband": [], "flexband.report.plot": []}
    for page in (DOCS / "api").glob("*.rst"):
        pattern = r"^\.\. (currentmodule|auto(?:class|function|exception)):: ([\w.]+)$"
        module = ""
        for kind, name in re.findall(pattern, page.read_text(encoding="utf-8"), re.MULTILINE):
            if kind == "currentmodule":
                module = name
            elif "." not in name:  # what only functions return has no public name
                listed[module].append(name)
    assert sorted(listed["flexband"]) == sorted(fb.__all__)
    assert sorted(listed["flexband.report.plot"]) == sorted(fb.plot.__all__)
