"""The documentation: its code runs, its commands exist, and its reference is complete.

Tutorials and other pages of cells (`{code-cell}`) run when the site is built, by `make docs`.
"""

import csv
import re
import shlex
from importlib import import_module
from pathlib import Path

import pytest
from typer.main import get_group
from typer.testing import CliRunner

from flexband.cli import app
from flexband.cli.commands import load
from tests.public_names import PLACES

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = {
    str(page.relative_to(ROOT)): page.read_text(encoding="utf-8")
    for page in (ROOT / "README.md", *sorted(DOCS.rglob("*.md")))
}
OWN_TESTS = {
    "README.md": "tests/test_examples.py",
    "docs/how-to/answers.md": "tests/docs/test_answers.py",
    "docs/how-to/extending.md": "tests/docs/test_extending.py",
    "docs/how-to/models.md": "tests/models/test_page.py",
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
    return [block for block in re.findall(pattern, text, re.MULTILINE) if block[1] != "no-run"]


def commands(text):
    """Yield the arguments of the commands of flexband in some lines."""
    for line in text.splitlines():
        words = shlex.split(line.partition("||")[0], comments=True)
        if words and Path(words[0]).name == "flexband":
            yield words[1:]


def somebody_runs_the_model(folder):
    """Write the results of the points of docs/how-to/studies.md."""
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
                if words[0] == "import-results":
                    somebody_runs_the_model(tmp_path)
                result = CliRunner().invoke(app, words)
                assert result.exit_code in (0, 4), f"{words}\n{result.output}"


@pytest.mark.parametrize("name", PAGES)
def test_commands_are_understood(name):
    """Every command in a block, or in backticks with arguments, is parsed."""
    texts = [content for _, _, content in blocks(PAGES[name], "sh")]
    texts += re.findall(r"`(flexband [^`]+)`", PAGES[name].replace("\n", " "))
    for words in (w for text in texts for w in commands(text)):
        if words and not words[0].startswith("-"):
            load(words[:1])
            command = get_group(app).commands[words[0]]
            if len(words) > 1 and not any(word.startswith("--help") for word in words):
                command.make_context(words[0], words[1:])


def paths_in(text):
    """Yield the paths of pages, of code and of tests that a text names."""
    pattern = (
        r"\b(?:docs|src|tests|benchmarks|examples|validation)/[\w./-]*\w\.(?:md|py|png|json)\b"
    )
    yield from re.findall(pattern, text)


@pytest.mark.parametrize("name", PAGES)
def test_links_lead_somewhere(name):
    folder = (ROOT / name).parent
    for target in re.findall(r"\]\(([^)\s]+)\)", re.sub(r"```.*?```", "", PAGES[name], flags=re.S)):
        if not re.match(r"[a-z]+:|#|[\d.,(]+$|\d", target):
            path, _, heading = target.partition("#")
            page = (folder / path).resolve()
            assert page.exists(), target
            if heading and page.suffix == ".md":
                titles = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
                anchors = {
                    re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-") for title in titles
                }
                assert heading in anchors, target
    for path in paths_in(PAGES[name]):
        assert (ROOT / path).exists(), path


@pytest.mark.parametrize("folder", ["src", "tests", "benchmarks", "examples", "validation", ".ci"])
def test_files_that_code_names_exist(folder):
    for file in (ROOT / folder).rglob("*.py"):
        for path in paths_in(file.read_text(encoding="utf-8")):
            assert (ROOT / path).exists(), f"{file.relative_to(ROOT)}: {path}"


def test_pages_with_own_tests():
    for page, test in OWN_TESTS.items():
        assert Path(page).name in (ROOT / test).read_text(encoding="utf-8")


def test_every_page_is_in_the_contents():
    index = PAGES["docs/index.md"]
    for name in PAGES.keys() - {"README.md", "docs/index.md"}:
        page = name.removeprefix("docs/").removesuffix(".md")
        assert re.search(rf"^{page}$", index, re.MULTILINE), page


def test_the_reference_has_every_public_name():
    by_module = {name: [] for name in (*PLACES, "flexband.plot")}
    for page in (DOCS / "reference" / "api").glob("*.rst"):
        pattern = r"^\.\. (currentmodule|auto(?:class|function|exception)):: ([\w.]+)$"
        module = ""
        for kind, name in re.findall(pattern, page.read_text(encoding="utf-8"), re.MULTILINE):
            if kind == "currentmodule":
                module = name
            elif "." not in name:  # what only functions return has no public name
                by_module[module].append(name)
    for module, names in by_module.items():
        assert sorted(names) == sorted(import_module(module).__all__), module
