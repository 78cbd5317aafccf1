"""Verdicts on requirements, in words."""

from __future__ import annotations

import numpy as np

from flexband.report.text.numbers import number, percent
from flexband.report.text.remarks import remark_line
from flexband.requirements.criteria import Probability, ShareOfParts
from flexband.requirements.requirement import with_unit
from flexband.requirements.verdict import Reason, RequirementVerdict, Verdict


def verdict_line(verdict: RequirementVerdict) -> str:
    """Return a line such as "FAIL  angle (nominal ± 0.5°): violated by 0.107°; mostly due to …"."""
    return f"{verdict.verdict}  {verdict_text(verdict)}"


def verdict_text(verdict: RequirementVerdict) -> str:
    """Return the line of a verdict without its first word."""
    blame = (
        f"; mostly due to {verdict.input}"
        if verdict.input and verdict.verdict is not Verdict.PASS
        else ""
    )
    return f"{verdict.text}: {reason_text(verdict)}{blame}"


def reason_text(verdict: RequirementVerdict) -> str:
    """Return by how much a requirement is met or violated, or why that is not decided."""
    if verdict.reason is Reason.NOT_CHECKED:
        return f"not checked: {verdict.why}"
    if verdict.reason is Reason.REMARK:
        return f"{_probable(verdict)}, but {remark_line(verdict.remarks[0])}"
    if verdict.criterion in (Probability.__name__, ShareOfParts.__name__):
        return _share_text(verdict)
    size = _size(verdict)
    beyond = "violated by" if verdict.margin < 0 else "met with a margin of"
    if verdict.reason is Reason.RUN:
        return f"violated by {size}{_place(verdict)} in a run within the tolerances"
    if verdict.verdict is not Verdict.UNDECIDED:
        return f"{beyond} {size}{_where(verdict)}"
    error = with_unit(f"± {number(verdict.error, 2)}", verdict.unit)
    reasons = {
        Reason.ERROR: f"but its error is {error}",
        Reason.BETWEEN: "but only between output times, where no error is stated: give a shorter "
        "output_step",
        Reason.RUNS_DIFFER: f"but {'no' if verdict.margin < 0 else 'a'} run violates it, and "
        "here the expansion alone does not decide",
        Reason.NOT_JUDGED: "but no runs judge the surrogate",
        Reason.NOT_TRUSTED: "but the method does not trust this output",
        Reason.NOT_CONFIRMED: "but verification runs refute the stated accuracy",
    }
    return f"{_probable(verdict)}, {reasons[verdict.reason]}"


def _size(verdict: RequirementVerdict) -> str:
    return with_unit(number(abs(verdict.margin), 3), verdict.unit)


def _where(verdict: RequirementVerdict) -> str:
    of_random = f", {verdict.sigmas:g}σ" if verdict.sigmas else ""
    return f"{_place(verdict)} (worst tolerances{of_random})"


def _probable(verdict: RequirementVerdict) -> str:
    """Return what would be so, if nothing put it in doubt."""
    if verdict.criterion in (Probability.__name__, ShareOfParts.__name__):
        return f"probably {_share_text(verdict)}"
    beyond = "violated by" if verdict.margin < 0 else "met with a margin of"
    return f"probably {beyond} {_size(verdict)}{_where(verdict)}"


def _place(verdict: RequirementVerdict) -> str:
    """Return where the margin is least, after a blank; "" without a last dim."""
    if not verdict.dim:
        return ""
    place = verdict.place if isinstance(verdict.place, str) else number(verdict.place)
    name = "" if verdict.dim == "time" else f"{verdict.dim} "
    unit = verdict.dim_unit or ("s" if verdict.dim == "time" else "")
    return f" at {name}{place} {unit}".rstrip()


def _share_text(verdict: RequirementVerdict) -> str:
    value, low, high = verdict.share
    parts = verdict.criterion == ShareOfParts.__name__
    allowed = f"at most {_share(verdict.at_most, parts=parts)} allowed"
    if verdict.reason is Reason.OF_PARTS:
        return (
            "sampled parts do not tell the probability for the worst tolerances; "
            f"{allowed}. Require a share of the parts instead (ShareOfParts)"
        )
    if np.isnan(value):
        return (
            f"no {'yield' if parts else 'probability'}, the accuracy target was missed; {allowed}"
        )
    of_parts = " of the parts fail" if parts else ""
    if verdict.reason is Reason.NOT_JUDGED:
        amount = f"about {_share(value, parts=parts)}{of_parts} by the surrogate alone"
        return f"{'' if parts else 'probability '}{amount}, which no runs judge; {allowed}"
    if value:
        interval = f"{_share(low, parts=parts)} to {_share(high, parts=parts)}"
        amount = f"{_share(value, parts=parts)}{of_parts} (95 % confidence: {interval})"
    else:
        amount = f"less than {_share(high, parts=parts)}{of_parts}"
    return f"{'' if parts else 'probability '}{amount}, {allowed}"


def _share(value: float, *, parts: bool) -> str:
    return percent(value) if parts else f"{value:.2g}"
