"""Words that readers search for, and the headings below which they are answered.

The search of the site lists first what is in its index. Each of these words is entered there, below
its heading, when the page is read.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sphinx.application import Sphinx

WORDS = {
    "how-to/how-do-i": {
        "Build and move a mechanism": ["3-D", "3D", "CAD", "STEP", "URDF", "animation", "animate"],
        "Say what is uncertain": ["fit", "ISO fit", "stack", "tolerance stack"],
        "Compute and trust bands": ["calibrate", "calibration", "worst corner"],
        "Sign a requirement": ["violate", "violation"],
    },
    "reference/citation": {
        "How to cite flexband": ["cite", "citation", "BibTeX"],
    },
    "reference/conventions": {
        "Conventions": ["unit", "units"],
    },
}
"""The words of each page by heading."""


def with_index(page: str, text: str) -> str:
    """Return the text of a page with its words of the index.

    Raises
    ------
    ValueError
        If the page has no such heading.
    """
    for heading, words in WORDS.get(page, {}).items():
        entries = ", ".join(f"! {word}" for word in words)  # those with ! are listed first
        directive = f"\n```{{index}} {entries}\n```\n"
        line = re.search(rf"^#+ {re.escape(heading)}\n", text, re.MULTILINE)
        if line is None:
            raise ValueError(f"{page} has no heading {heading!r}")
        text = text[: line.end()] + directive + text[line.end() :]
    return text


def enter_words(_app: Sphinx, page: str, source: list[str]) -> None:
    """Enter the words of a page that is read into the index."""
    source[0] = with_index(page, source[0])


def setup(app: Sphinx) -> dict[str, bool]:
    """Register what this module does."""
    app.connect("source-read", enter_words)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
