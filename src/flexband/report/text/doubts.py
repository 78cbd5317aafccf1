"""Doubts about a result, in words."""

from __future__ import annotations

from flexband.report.text.numbers import percent
from flexband.study.results.reliability import Doubt, DoubtKind

SENTENCES = {
    DoubtKind.TOLERANCE_NOT_MET: "the tolerance is not met",
    DoubtKind.NOT_TRUSTED: "the result is not trusted",
    DoubtKind.NOT_CONFIRMED: "new runs do not confirm the result",
    DoubtKind.NOT_VERIFIED: "new runs failed, so that the result is not verified",
}

LARGEST_ERROR = 10.0
"""Larger errors are not stated, since the error bar has no width."""


def doubt_text(doubt: Doubt) -> str:
    """Return a doubt as a sentence without its full stop."""
    if doubt.error is None:
        return SENTENCES[doubt.kind]
    more = "more than " * (doubt.error > LARGEST_ERROR)
    error = percent(min(doubt.error, LARGEST_ERROR))
    return f"new runs find an error of {more}{error} of the error bar's width"
