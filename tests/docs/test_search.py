"""What readers search for is on a page, and the index of the site leads there."""

import re
import runpy
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
SEARCH = runpy.run_path(str(DOCS / "search_words.py"))
TERMS = [
    "3-D",
    "CAD",
    "URDF",
    "cite",
    "units",
    "worst corner",
    "violate",
    "fit",
    "calibrate",
    "animation",
    "stack",
    "ISO fit",
]
PAGES = {
    page.relative_to(DOCS).with_suffix("").as_posix(): page.read_text(encoding="utf-8")
    for page in DOCS.rglob("*.md")
    if page.stem != "changelog"
}


@pytest.mark.parametrize("term", TERMS)
def test_the_term_is_on_the_page_to_which_the_index_leads(term):
    pages = [
        page for page, words in SEARCH["WORDS"].items() if any(term in w for w in words.values())
    ]
    assert pages
    for page in pages:
        assert re.search(rf"\b{term}\b", PAGES[page], re.IGNORECASE), page


def test_words_are_entered_below_their_headings():
    for page, words in SEARCH["WORDS"].items():
        text = SEARCH["with_index"](page, PAGES[page])
        for heading, entries in words.items():
            directive = f"```{{index}} {', '.join(f'! {word}' for word in entries)}\n```\n"
            assert f" {heading}\n\n{directive}" in text
            text = text.replace(f"\n{directive}", "")
        assert text == PAGES[page]


def test_a_heading_that_is_not_there_is_refused():
    with pytest.raises(ValueError, match="Conventions"):
        SEARCH["with_index"]("reference/conventions", "# Other\n")


def test_every_word_leads_to_one_heading():
    words = [word for page in SEARCH["WORDS"].values() for own in page.values() for word in own]
    assert len(words) == len(set(words))
