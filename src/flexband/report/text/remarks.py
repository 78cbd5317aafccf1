"""Remarks on runs, in words."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from flexband.basics.words import number_of
from flexband.remarks.collection import CollectedRemark
from flexband.requirements.verdict import Reason, RequirementVerdict


def remark_line(remark: CollectedRemark) -> str:
    """Return what is remarked, in how many runs, and the inputs of the worst one."""
    where = ", the worst with " + remark.inputs if remark.inputs else ""
    runs = f" ({number_of(remark.runs, 'run')}{where})" if remark.runs else ""
    return remark.worst.text + runs


def standing_remarks(verdict: RequirementVerdict) -> Sequence[CollectedRemark]:
    """Return the remarks that touch a verdict and are not in its own line."""
    return verdict.remarks[1:] if verdict.reason is Reason.REMARK else verdict.remarks


def untouched_by(
    verdicts: Iterable[RequirementVerdict], remarks: Iterable[CollectedRemark]
) -> list[CollectedRemark]:
    """Return the remarks that touch none of these verdicts."""
    topics = {remark.worst.topic for verdict in verdicts for remark in verdict.remarks}
    return [remark for remark in remarks if remark.worst.topic not in topics]
