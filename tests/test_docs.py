"""The documentation as a whole."""

import re
from pathlib import Path

import flexband as fb

DOCS = Path(__file__).parents[1] / "docs"


def test_the_reference_has_every_public_name():
    pages = "".join(page.read_text(encoding="utf-8") for page in (DOCS / "api").glob("*.rst"))
    listed = re.findall(r"^\.\. auto(?:class|function|exception):: (\w+)$", pages, re.MULTILINE)
    assert sorted(listed) == sorted(fb.__all__)
