"""The first lines of a report: the verdict on each requirement, and what runs warn of."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import xarray as xr

from flexband.analysis.limits.limit_verdicts import LimitCheck, requirement_verdicts
from flexband.remarks.collection import remarks_of
from flexband.report.text.remarks import remark_line, standing_remarks, untouched_by
from flexband.report.text.requirement_verdicts import verdict_text
from flexband.requirements.verdict import RequirementVerdict, Verdict, worst_of


class JudgedRequirements(NamedTuple):
    """What a report says of requirements."""

    verdicts: list[RequirementVerdict]
    met: bool  # whether all are
    lines: list[tuple[str, str, list[str]]]  # verdict, its reason, and remarks that touch it
    other_remarks: list[str]  # which touch none of them


def judged_requirements(
    check: LimitCheck | None,
    unchecked: Sequence[RequirementVerdict],
    bands: xr.Dataset,
    contributions: xr.Dataset | None,
    verification: xr.Dataset | None,
) -> JudgedRequirements:
    """Return the verdicts of a check, or those `unchecked`, in words, and remarks on the runs."""
    verdicts = list(unchecked)
    if check is not None:
        verdicts = requirement_verdicts(check, contributions, verification)
    remarks = remarks_of(bands.attrs if verification is None else verification.attrs)
    return JudgedRequirements(
        verdicts,
        met=worst_of(verdicts) is Verdict.PASS,
        lines=[
            (
                str(verdict.verdict),
                verdict_text(verdict),
                list(map(remark_line, standing_remarks(verdict))),
            )
            for verdict in verdicts
        ],
        other_remarks=list(map(remark_line, untouched_by(verdicts, remarks))),
    )
