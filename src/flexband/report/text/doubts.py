"""Doubts about a result, in words."""

from __future__ import annotations

from flexband.report.text.numbers import percent
from flexband.study.results.reliability import Doubt, DoubtKind


def doubt_text(doubt: Doubt) -> str:
    """Return a doubt as a sentence without its full stop."""
    largest_error = 10.0  # larger errors are not stated, since the error bar has no width
    sentences = {
        DoubtKind.TOLERANCE_NOT_MET: "the accuracy target was missed",
        DoubtKind.NOT_TRUSTED: "the method does not trust its result",
        DoubtKind.NOT_CONFIRMED: "verification runs refute the estimated accuracy",
        DoubtKind.NOT_VERIFIED: "the verification runs failed",
    }
    if doubt.error is None:
        return sentences[doubt.kind]
    if doubt.kind is DoubtKind.TOLERANCE_NOT_MET:
        return f"{sentences[doubt.kind]}{_missed_by(doubt)}"
    qualifier = "more than " if doubt.error > largest_error else ""
    error = percent(min(doubt.error, largest_error))
    return f"verification runs find an error of {qualifier}{error} of the band's width"


def _missed_by(doubt: Doubt) -> str:
    """Return the error and the tolerance, in brackets; "" if they are not known."""
    if doubt.error is None:
        return ""
    target = "" if doubt.target is None else f" instead of {percent(doubt.target)}"
    return f" ({percent(doubt.error)}{target})"


def doubt_line(doubt: Doubt) -> str:
    """Return a doubt as a line of its own."""
    if doubt.unreliable:
        return f"Not reliable: {doubt_text(doubt)}."
    if doubt.kind is DoubtKind.TOLERANCE_NOT_MET:
        return f"Accuracy target missed{_missed_by(doubt)}."
    return f"{doubt_text(doubt).capitalize()}."
