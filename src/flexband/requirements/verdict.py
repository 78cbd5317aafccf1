"""The verdict on a requirement, as data; sentences are made of it where it is shown."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, fields
from enum import StrEnum
from typing import Any

from flexband.remarks.collection import CollectedRemark
from flexband.requirements.criteria import Criterion, Probability, ShareOfParts
from flexband.requirements.requirement import Requirement


class Verdict(StrEnum):
    """Whether a requirement is met."""

    PASS = "PASS"
    FAIL = "FAIL"
    UNDECIDED = "UNDECIDED"


class Reason(StrEnum):
    """What a verdict rests on."""

    MARGIN = "margin"
    """The margin, or the probability, is farther from what is allowed than its error."""
    RUN = "run"
    """A run at these values violates the bounds, whatever the accuracy of the surrogate."""
    ERROR = "error"
    """The error is larger than the margin."""
    BETWEEN = "between times"
    """The bounds are left only between output times, where no error is stated."""
    RUNS_DIFFER = "runs differ"
    """A run violates bounds that the expansion meets, or none does, and it is not accurate."""
    NOT_JUDGED = "not judged"
    """No runs judge the surrogate, or its tail, so no error can be stated."""
    NOT_TRUSTED = "not trusted"
    """The method does not trust its result for this output."""
    NOT_CONFIRMED = "not confirmed"
    """Verification runs refute the stated error."""
    WITHHELD = "withheld"
    """No probability is stated, since the accuracy was missed."""
    OF_PARTS = "of parts"
    """Sampled parts tell the probability for tolerances that scatter, not for the worst ones."""
    REMARK = "remark"
    """Runs warn of what may change the output by more than the margin."""
    NOT_CHECKED = "not checked"
    """It could not be checked; `why` tells the cause."""


@dataclass(frozen=True)
class RequirementVerdict:
    """A verdict with its numbers.

    Attributes
    ----------
    text : the requirement in words, as `str` returns it.
    name, identifier, source, bounds : of the requirement.
    verdict, reason : whether it is met, and what that rests on.
    criterion, at_most : the name of the criterion, and the share that it allows, or NaN.
    sigmas : k of μ ± kσ; 0 without random inputs.
    margin, error, unit : least margin, its error (NaN if none is stated), in the unit of the
        requirement if it has one, else of the output.
    dim, dim_unit, place : where the margin is least; "" without a last dim.
    input, input_share : which input widens the error bar most there, and by which part of it; ""
        if that is not known.
    share : probability, or share of parts, that violates the bounds, with its interval; NaN if none
        is stated.
    why : why it could not be checked; "" if it was.
    remarks : what runs warn of that touches its output, what undecides it first.
    """

    text: str
    name: str
    identifier: str
    source: str
    bounds: str
    verdict: Verdict
    reason: Reason
    criterion: str
    at_most: float
    sigmas: float = 0.0
    margin: float = math.nan
    error: float = math.nan
    unit: str = ""
    dim: str = ""
    dim_unit: str = ""
    place: float | str = ""
    input: str = ""
    input_share: float = math.nan
    share: tuple[float, float, float] = (math.nan, math.nan, math.nan)
    why: str = ""
    remarks: tuple[CollectedRemark, ...] = ()

    @classmethod
    def not_checked(cls, requirement: Requirement, why: str) -> RequirementVerdict:
        """Return that a requirement is undecided, since it could not be checked."""
        return cls(
            text=str(requirement),
            name=requirement.name,
            identifier=requirement.identifier,
            source=requirement.source,
            bounds=requirement.bounds,
            verdict=Verdict.UNDECIDED,
            reason=Reason.NOT_CHECKED,
            criterion=type(requirement.criterion).__name__,
            at_most=allowed_share(requirement.criterion),
            why=why,
        )

    def as_json(self) -> dict[str, Any]:
        """Return it as plain data; numbers that are NaN are None."""
        plain = asdict(self) | {"remarks": [remark.as_json() for remark in self.remarks]}
        return {name: _plain(value) for name, value in plain.items()}

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> RequirementVerdict:
        """Return what `as_json` has made; raise `ValueError` if it is of another version."""
        values = {f.name: content[f.name] for f in fields(cls) if f.name in content}
        numbers = ("at_most", "sigmas", "margin", "error", "input_share")
        values |= {k: math.nan for k in numbers if values.get(k, 0.0) is None}
        try:
            return cls(
                **values
                | {
                    "verdict": Verdict(content["verdict"]),
                    "reason": Reason(content["reason"]),
                    "share": tuple(math.nan if x is None else x for x in content["share"]),
                    "remarks": tuple(map(CollectedRemark.from_json, content["remarks"])),
                }
            )
        except (TypeError, KeyError):
            raise ValueError(f"a verdict must have its numbers; got {content!r}") from None


def allowed_share(criterion: Criterion) -> float:
    """Return the share of parts, or the probability, that a criterion allows; NaN if it is none."""
    return criterion.at_most if isinstance(criterion, Probability | ShareOfParts) else math.nan


def _plain(value: Any) -> Any:
    if isinstance(value, tuple | list):
        return [_plain(entry) for entry in value]
    return None if isinstance(value, float) and math.isnan(value) else value


def worst_of(verdicts: Iterable[RequirementVerdict]) -> Verdict:
    """Return FAIL if one fails, else UNDECIDED if one is, else PASS."""
    outcomes = {verdict.verdict for verdict in verdicts}
    order = Verdict.FAIL, Verdict.UNDECIDED
    return next((verdict for verdict in order if verdict in outcomes), Verdict.PASS)
