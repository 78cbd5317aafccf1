"""The home page: two ways in, and how to cite."""

import re
import tomllib
from pathlib import Path

import pytest

import flexband as fb

ROOT = Path(__file__).parents[2]
HOME = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
CITATION = (ROOT / "docs" / "reference" / "citation.md").read_text(encoding="utf-8")
RECORD = (ROOT / "CITATION.cff").read_text(encoding="utf-8")


@pytest.mark.parametrize("reader", ["engineer", "researcher"])
def test_each_reader_has_three_or_four_pages_in_order(reader):
    section = re.search(rf"^## For the {reader} .*\n\n((?:\d\. .*\n)+)", HOME, re.MULTILINE)
    assert section is not None
    lines = section[1].splitlines()
    assert 3 <= len(lines) <= 4
    for number, line in enumerate(lines, 1):
        pages = re.findall(r"\]\(([\w/-]+\.md)\)", line)
        assert line.startswith(f"{number}. [")
        assert len(pages) == 1
        assert (ROOT / "docs" / pages[0]).is_file()


def test_the_home_page_leads_to_how_to_cite():
    assert "[How to cite flexband](reference/citation.md)" in HOME


def field(name, text):
    """Return a field of a BibTeX entry, on one line and as plain text."""
    found = re.search(rf"^  {name} *= \{{(.*?)\}},?$", text, re.MULTILINE | re.DOTALL)
    assert found is not None
    return " ".join(found[1].replace("--", "–").strip("{}").split())


def test_both_entries_are_those_of_the_record():
    software, paper = re.findall(r"^```bibtex\n@(.*?)^```$", CITATION, re.MULTILINE | re.DOTALL)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert field("version", software) == project["version"] == fb.__version__
    assert field("license", software) == project["license"]
    assert f'title: "{field("title", software)}"\n' in RECORD
    assert f"version: {field('version', software)}\n" in RECORD
    for name in ("title", "journal", "year", "doi"):
        assert re.search(rf"{name}: (?:>-\n +)?{re.escape(field(name, paper))}\n", RECORD), name
    families = [author.split(",")[0] for author in field("author", paper).split(" and ")]
    assert re.findall(r"- family-names: (.*)", RECORD) == families
