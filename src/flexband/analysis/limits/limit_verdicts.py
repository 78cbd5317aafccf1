"""From margins, probabilities and yields to the verdict on each requirement."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr

from flexband.analysis.labelled_answers import NOT_JUDGED
from flexband.analysis.limits.least_margin import (
    LeastMargin,
    LimitVerdict,
    MarginRecord,
)
from flexband.analysis.probability.statements import ANYTHING
from flexband.analysis.selection import AnySurrogate, surrogates_of
from flexband.remarks.collection import CollectedRemark, remarks_of
from flexband.requirements.criteria import Probability, ShareOfParts
from flexband.requirements.scatter import OF_SAMPLES
from flexband.requirements.verdict import Reason, RequirementVerdict, Verdict


class LimitCheck(NamedTuple):
    """Whether requirements are met.

    Attributes
    ----------
    margins : result of `check_requirements`.
    probability : result of `failure_probability`; None where inputs are intervals only, or
        adjusted, and where the yield is that of sampled parts.
    written : whether they were written: limits of a question never replace those of the study.
    production : result of `production_yield`; None where no scatter of the tolerances is known.
    """

    margins: xr.Dataset
    probability: xr.Dataset | None
    written: bool
    production: xr.Dataset | None = None


def requirement_verdicts(
    check: LimitCheck, contributions: xr.Dataset | None, verification: xr.Dataset | None
) -> list[RequirementVerdict]:
    """Return the verdict on every requirement that was checked.

    Contributions are those of uncertain inputs alone; `verify` returns the verification.
    """
    margins = check.margins
    return [_verdict(check, k, contributions, verification) for k in range(margins.sizes["limit"])]


def uncertain_inputs(
    contributions: xr.Dataset | None, surrogate: AnySurrogate
) -> xr.Dataset | None:
    """Return the contributions of inputs that nobody chooses; None if there is none."""
    if contributions is None:
        return None
    spaces = [case.space for case in surrogates_of(surrogate).values()]
    design_names = {name for space in spaces for name in space.design_inputs}
    indices = [
        k for k, name in enumerate(contributions["name"].values) if str(name) not in design_names
    ]
    return contributions.isel(name=indices) if indices else None


def _verdict(
    check: LimitCheck, k: int, contributions: xr.Dataset | None, verification: xr.Dataset | None
) -> RequirementVerdict:
    limit = check.margins.isel(limit=k)
    least_margin = LeastMargin.from_result(limit)
    run_remarks = remarks_of(check.margins.attrs if verification is None else verification.attrs)
    criterion = str(limit["criterion"].values) if "criterion" in limit else "WorstCase"
    at_most = float(limit["at_most"]) if "at_most" in limit else np.nan
    # Decide by a share or by the margin.
    share = _share(check, k, criterion)
    if criterion in (Probability.__name__, ShareOfParts.__name__):
        verdict, reason = _by_share(share, at_most)
        if verdict is Verdict.UNDECIDED and _of_worst(check, criterion):
            reason = Reason.OF_PARTS
        error = least_margin.error
    else:
        verdict, reason, error = _by_margin(limit, least_margin, check.margins, verification)
    scale = float(limit["stated_scale"]) if "stated_scale" in limit else 1.0
    requirement_unit = str(limit["stated_unit"].values) if "stated_unit" in limit else ""
    worst = least_margin.margin_between if least_margin.decided_between else least_margin.margin
    if reason is Reason.RUN:
        worst = min(worst, float(limit["run_margin"]))
    # A remark on the runs may undecide the verdict.
    remarks, undecided = _remarks(limit, run_remarks, abs(worst))
    if undecided and verdict is not Verdict.UNDECIDED:
        verdict = Verdict.UNDECIDED
        reason = Reason.REMARK
    most_important = "", np.nan
    if contributions is not None and "width" in contributions:
        most_important = largest_around(contributions, limit, _output(limit))[:2]
    texts = {
        name: str(limit[name].values) if name in limit else ""
        for name in ("requirement", "identifier", "source", "bounds")
    }
    return RequirementVerdict(
        text=least_margin.limit,
        name=texts["requirement"] or least_margin.limit,
        identifier=texts["identifier"],
        source=texts["source"],
        bounds=texts["bounds"],
        verdict=verdict,
        reason=reason,
        criterion=criterion,
        at_most=at_most,
        sigmas=_sigmas(limit, check.margins),
        margin=worst / scale,
        error=error / scale,
        unit=requirement_unit or least_margin.unit,
        dim=least_margin.dim,
        dim_unit=least_margin.dim_unit,
        place=least_margin.place_before if least_margin.decided_between else least_margin.place,
        input=most_important[0],
        input_share=most_important[1],
        share=share,
        remarks=remarks,
    )


def _remarks(
    limit: xr.Dataset, remarks: tuple[CollectedRemark, ...], margin: float
) -> tuple[tuple[CollectedRemark, ...], bool]:
    """Return the remarks that touch the output of a limit, and whether one undecides its verdict.

    That is so where its error exceeds the margin, or is not known.
    """
    extent = float(limit["extent"]) if "extent" in limit else np.nan
    touching = [remark for remark in remarks if remark.worst.touches(_output(limit))]
    undecides = [not remark.worst.error * extent <= margin for remark in touching]
    order = np.argsort(np.logical_not(undecides), kind="stable")
    return tuple(touching[k] for k in order), any(undecides)


def _sigmas(limit: xr.Dataset, margins: xr.Dataset) -> float:
    """Return k of the error bar of a requirement; 0 where no input is random."""
    record = MarginRecord.read(margins)
    if not record.random:
        return 0.0
    return float(limit.get("deviations", record.sigmas))


def _by_margin(
    limit: xr.Dataset,
    least_margin: LeastMargin,
    margins: xr.Dataset,
    verification: xr.Dataset | None,
) -> tuple[Verdict, Reason, float]:
    """Return the verdict of the worst case, what it rests on, and the error of the margin."""
    if float(limit.get("run_margin", np.nan)) < 0:
        return Verdict.FAIL, Reason.RUN, least_margin.error
    error = least_margin.error
    if MarginRecord.read(margins).error == NOT_JUDGED:
        return Verdict.UNDECIDED, Reason.NOT_JUDGED, np.nan
    if (
        verification is not None
        and "confirmed" in verification
        and not bool(_of_output(verification["confirmed"], limit, worst="min"))
    ):
        return Verdict.UNDECIDED, Reason.NOT_CONFIRMED, error
    limit_verdict = least_margin.verdict
    runs = float(limit.get("recorded_margin", np.nan)) if limit.get("run_required", 0) else np.nan
    within = limit_verdict is LimitVerdict.KEPT and least_margin.margin_between - error >= 0
    beyond = limit_verdict is LimitVerdict.NOT_KEPT and least_margin.at_most + error < 0
    if within and not runs < 0:
        return Verdict.PASS, Reason.MARGIN, error
    if beyond and not runs >= 0:
        return Verdict.FAIL, Reason.MARGIN, error
    if within or beyond:
        reason = Reason.RUNS_DIFFER
    elif (
        limit_verdict is not LimitVerdict.KEPT
        and least_margin.margin_between + error < 0 <= least_margin.at_most + error
    ):
        reason = Reason.BETWEEN
    elif (
        limit_verdict is LimitVerdict.UNDECIDED
        and not least_margin.margin + error >= 0 >= least_margin.margin_between - error
    ):
        reason = Reason.NOT_TRUSTED
    else:
        reason = Reason.ERROR
    return Verdict.UNDECIDED, reason, error


def _by_share(share: tuple[float, float, float], at_most: float) -> tuple[Verdict, Reason]:
    """Return the verdict of a probability or a share of parts that is allowed."""
    _, low, high = share
    if np.isnan(low):
        return Verdict.UNDECIDED, Reason.WITHHELD
    if (low, high) == ANYTHING:
        return Verdict.UNDECIDED, Reason.NOT_JUDGED
    if high <= at_most:
        return Verdict.PASS, Reason.MARGIN
    return (Verdict.FAIL, Reason.MARGIN) if low > at_most else (Verdict.UNDECIDED, Reason.ERROR)


def _of_worst(check: LimitCheck, criterion: str) -> bool:
    """Return whether worst tolerances count, but samples are of parts whose tolerances scatter."""
    sampled = check.production is not None and check.production.attrs.get(OF_SAMPLES)
    return criterion == Probability.__name__ and bool(sampled)


def _share(check: LimitCheck, k: int, criterion: str) -> tuple[float, float, float]:
    """Return which share violates the bounds with the worst intervals, and its interval.

    That of sampled parts is a mean over their tolerances: the worst ones have the same or more.
    """
    of_samples = check.production is not None and OF_SAMPLES in check.production.attrs
    parts = of_samples or criterion == ShareOfParts.__name__
    result = check.production if parts else check.probability
    if result is None:
        return np.nan, np.nan, np.nan
    limit = result.isel(limit=k)
    worst = limit.isel(bound=-1) if "bound" in limit.dims else limit
    name = "failing" if parts else "between_times"
    high = 1.0 if _of_worst(check, criterion) else float(worst[f"{name}_high"])
    return float(worst[name]), float(worst[f"{name}_low"]), high


def _of_output(values: xr.DataArray, limit: xr.Dataset, worst: str = "max") -> xr.DataArray:
    """Return the largest, or least, of what verification runs tell of the output of a limit."""
    if "output" in values.dims and "output" in limit.coords:
        values = values.sel(output=limit["output"].values)
    return values.max() if worst == "max" else values.min()


def _output(limit: xr.Dataset) -> str:
    """Return the name of the output of a limit; "" if there is one only."""
    return str(limit["output"].values) if "output" in limit.coords else ""


def largest_around(
    contributions: xr.Dataset, limit: xr.Dataset, output: str
) -> tuple[str, float, float | None]:
    """Return the input that matters most around the least margin of a limit, its share, and where.

    The share is the part by which the error bar is narrower without its uncertainty. It is around a
    value of the last dim, None if it is a mean. The limited output is "" without dim "output".
    """
    width = contributions["width"]
    parts = contributions["contribution"]
    if output and "output" in width.dims:
        number = width["output"].values.astype(str).tolist().index(output)
        width = width.isel(output=number)
        parts = parts.isel(output=number)
    last = width.dims[-1] if width.dims else ""
    where = None
    if "least_margin_at" in limit and limit["least_margin_at"].dtype.kind == "f" and last:
        where = float(limit["least_margin_at"])
        index = int(np.abs(width[last].values - where).argmin())
        reach = int(0.025 * width.sizes[last])
        around = {last: slice(max(0, index - reach), index + reach + 1)}
        width = width.isel(around)
        parts = parts.isel(around)
    share = parts.mean([d for d in parts.dims if d != "name"]) / (float(width.mean()) or np.inf)
    best = int(np.argmax(share.values))
    return str(parts["name"].values[best]), float(share[best]), where
