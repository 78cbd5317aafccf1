"""The page on inputs: its table and its pictures."""

import re
from pathlib import Path

from tests.public_names import PUBLIC

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "how-to" / "inputs.md").read_text(encoding="utf-8")


def test_every_kind_of_the_table_is_public():
    table = [line for line in PAGE.splitlines() if line.startswith("| ")]
    names = {name for line in table for name in re.findall(r"`([A-Z]\w+)", line)}
    assert len(names) > 12
    assert names <= PUBLIC.keys()


def test_pictures_are_there():
    for picture in re.findall(r"\]\((\.\./images/[^)]*)\)", PAGE):
        assert (DOCS / "how-to" / picture).is_file()
