"""The documentation as a whole."""

import re
from pathlib import Path

import flexband as fb

DOCS = Path(__file__).parents[1] / "docs"


def test_the_reference_has_every_public_name():
    listed = {"flexband": [], "flexband.plot": []}
    for page in (DOCS / "api").glob("*.rst"):
        pattern = r"^\.\. (currentmodule|auto(?:class|function|exception)):: ([\w.]+)$"
        module = ""
        for kind, name in re.findall(pattern, page.read_text(encoding="utf-8"), re.MULTILINE):
            if kind == "currentmodule":
                module = name
            else:
                listed[module].append(name)
    assert sorted(listed["flexband"]) == sorted(fb.__all__)
    assert sorted(listed["flexband.plot"]) == sorted(fb.plot.__all__)
