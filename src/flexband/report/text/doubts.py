"""Doubts about a result, in words."""

from __future__ import annotations

from flexband.report.text.numbers import percent
from flexband.study.results.reliability import Doubt, DoubtKind


def doubt_text(doubt: Doubt) -> str:
    """Return a doubt as a sentence without its full stop."""
    # Larger errors are not stated, since the error bar has no width
    largest_error = 10.0
    sentences = {
        DoubtKind.TOLERANCE_NOT_MET: "the tolerance is not met",
        DoubtKind.NOT_TRUSTED: "the result is not trusted",
        DoubtKind.NOT_CONFIRMED: "new runs do not confirm the result",
        DoubtKind.NOT_VERIFIED: "new runs failed, so that the result is not verified",
    }
    if doubt.error is None:
        return sentences[doubt.kind]
    more = "more than " * (doubt.error > largest_error)
    error = percent(min(doubt.error, largest_error))
    return f"new runs find an error of {more}{error} of the error bar's width"
