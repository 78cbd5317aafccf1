"""Allocated tolerances as a labelled dataset and in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from enum import StrEnum

import numpy as np
import xarray as xr

from flexband.analysis.allocation.chance import Chance, ExceedanceEstimate
from flexband.analysis.allocation.confirmation import Confirmed
from flexband.analysis.allocation.infeasible import limit_at, moment
from flexband.analysis.allocation.tolerances import Tolerances
from flexband.analysis.allocation.worst_case import SIGNS, WorstCaseBounds
from flexband.analysis.labelled_answers import (
    Variables,
    answer,
    doubts_of,
    expected_error,
    missed_tolerance,
    places,
)
from flexband.analysis.peaks import TimeAxis, least_between
from flexband.analysis.probability.probability_correction import Correction
from flexband.analysis.probability.statements import (
    ANYTHING,
    RARE,
    STATED,
    allowance,
    tails_are_judged,
    with_bounds,
    withheld,
)
from flexband.analysis.probability.texts import NOT_GIVEN
from flexband.basics.words import number_of
from flexband.requirements.corridors import Corridor
from flexband.uncertainty.surrogates.axes import axes_of
from flexband.uncertainty.surrogates.bands import BandRecord
from flexband.uncertainty.surrogates.surrogate import Surrogate

NO_RUNS = ". No runs were made to confirm it"
"""End of a verdict by the surrogate alone."""


class TolerancesConfirmed(StrEnum):
    """Whether runs confirm tolerances."""

    YES = "yes"
    NO = "no"
    INFERRED = "inferred"
    NOT_MADE = "no runs were made"


def result_of(
    surrogate: Surrogate,
    limits: Mapping[str, Corridor],
    worst: WorstCaseBounds,
    confirmation: Confirmed,
) -> xr.Dataset:
    """Return the tolerances, what limits them, and the margins that they leave."""
    tolerances = worst.tolerances
    allocation = confirmation.allocated
    labels = surrogate.labels
    narrow = surrogate.narrowed(**tolerances.inputs(allocation.x))
    points = allocation.points
    cost = tolerances.cost(allocation.x)
    pairs = list(zip(points.side.tolist(), points.series.tolist(), strict=True))
    names = np.array(
        [limit_at(limits, s, int(worst.numbers[k]), float(worst.bounds[s, k])) for s, k in pairs],
        dtype=str,
    )
    of_limit = [names == name for name in limits]
    shift = confirmation.shift[points.side, points.series]
    data, coords = _of_names(tolerances, allocation.x, cost)
    data |= {
        "contribution": (("name", "binding"), -allocation.gradients.T[: len(cost)]),
        "saving_at": ("binding", allocation.multipliers),
        "saving": ("limit", [allocation.multipliers[mask].sum() for mask in of_limit]),
        "shift": ("limit", [shift[mask].max(initial=0.0) for mask in of_limit]),
        "binding_limit": ("binding", names),
        "binding_side": ("binding", np.array(["above", "below"])[points.side]),
        "run_margin": ("binding", confirmation.run_margins),
    }
    if len(points):
        data |= places("binding_inputs", narrow.space, points.places, ["binding"], [len(points)])
    data |= _margins(narrow, limits, worst, confirmation)
    time = axes_of(labels).time
    if time is not None and time in labels.coords:
        at = worst.numbers[points.series] % labels.sizes[time]
        data["binding_at"] = "binding", labels[time].values[at]
    if grades := tolerances.grades:
        pairs_of_grades = zip(grades, tolerances.values(allocation.x), strict=True)
        data["grade"] = "name", [grade.name(t) for grade, t in pairs_of_grades]
    coords["limit"] = list(limits)
    if labels.dims[1:-1] == ("output",) and "unit" in labels.coords:
        outputs = [corridor.output for corridor in limits.values()]
        coords |= {"output": ("limit", outputs)}
        coords |= {"unit": ("limit", labels["unit"].sel(output=outputs).values.astype(str))}
    attrs = {
        "sigmas": worst.sigmas,
        "cost": float(cost.sum()),
        "runs": confirmation.runs,
        "confirmed": _confirmation_state(confirmation).value,
    }
    moments = [moment(labels, int(worst.numbers[k])) for _, k in pairs]
    binding = [*map(str.__add__, names.tolist(), moments)]
    attrs["outcome"] = _outcome(worst, confirmation, binding)
    for doubt in doubts_of(narrow, corrected=confirmation.runs > 0 and not confirmation.inferred):
        attrs["outcome"] += f". Not reliable: {doubt}"
    slack, grid_error = (np.array(data[k][1]) for k in ("slack", "grid_error"))  # pyright: ignore
    for k in np.flatnonzero((slack - grid_error < 0) & (slack >= 0)):
        attrs["outcome"] += (
            f". {list(limits)[k]} is met at the output times only: between them it is violated by "
            f"up to {grid_error[k] - slack[k]:.3g}. Choose a shorter output step"
        )
    attrs["verdict"] = f"{_in_words(tolerances, allocation.x, cost)}. {attrs['outcome']}"
    return answer(narrow, data, coords, attrs, LONG_NAMES, None, UNITLESS).drop_vars("bound")


def chance_result(
    chance: Chance, solution: ExceedanceEstimate, correction: Correction | None, runs: int
) -> xr.Dataset:
    """Return the tolerances for a stated probability, and the one that they lead to."""
    tolerances = chance.tolerances
    x = solution.x
    narrow = chance.surrogate.narrowed(**tolerances.inputs(x))
    cost = tolerances.cost(x)
    slope = chance.elasticity(solution)
    statement = _statement(chance, solution, by_runs=correction is not None)
    data, coords = _of_names(tolerances, x, cost)
    data["elasticity"] = "name", slope[: len(cost)]
    data |= {str(name): array.variable for name, array in statement.items()}
    if correction is not None:
        of_runs = correction.probability, *correction.confidence()
        data |= {f"run_{name}": ((), v) for name, v in zip(STATED, of_runs, strict=True)}
    data |= places("probability_at", narrow.space, solution.place[None], [], [])
    # Say whether runs confirm the probability.
    text = _chance_in_words(statement, chance, correction)
    outcome = TolerancesConfirmed.NOT_MADE
    if correction is None:
        text += NO_RUNS
    else:
        is_confirmed = correction.probability <= chance.probability
        outcome = TolerancesConfirmed.YES if is_confirmed else TolerancesConfirmed.NO
        text += f". {'Confirmed' if is_confirmed else 'NOT confirmed'} by {_new(runs)}, "
        text += "which tell {:.3g} ({:.3g} to {:.3g})".format(
            correction.probability, *correction.confidence()
        )
    for doubt in doubts_of(narrow, corrected=correction is not None):
        text += f". Not reliable: {doubt}"
    attrs = {
        "stated": chance.probability,
        "cost": float(cost.sum()),
        "runs": runs,
        "confirmed": outcome.value,
        "outcome": text,
        "verdict": f"{_in_words(tolerances, x, cost)}. {text}",
    }
    return answer(narrow, data, coords, attrs, LONG_NAMES, None, LONG_NAMES).drop_vars("bound")


def _of_names(
    tolerances: Tolerances, x: np.ndarray, cost: np.ndarray
) -> tuple[Variables, Variables]:
    """Return the variables and coordinates of inputs that any allocation has."""
    coords: Variables = {"name": tolerances.names}
    data: Variables = {
        "tolerance": ("name", tolerances.values(x)),
        "largest": ("name", tolerances.largest),
        "cost": ("name", cost),
    }
    if tolerances.sizes:
        coords["sizing"] = list(tolerances.sizes)
        data["size"] = "sizing", list(tolerances.nominal(x).values())
    return data, coords


def _statement(chance: Chance, solution: ExceedanceEstimate, *, by_runs: bool) -> xr.Dataset:
    """Return what is stated of the probability that the surrogate finds."""
    labels = chance.surrogate.labels
    inputs = chance.tolerances.inputs(solution.x)
    narrow = chance.surrogate.narrowed(**inputs)
    estimate = replace(solution.estimate, noise=solution.noise)
    ends = np.array(estimate.confidence())
    if not solution.exact and not tails_are_judged(narrow):
        ends = np.array(ANYTHING)
    elif not solution.exact:
        ends = np.minimum(1.0, ends * allowance(estimate))
    time_probability = np.full(max(1, int(np.prod(labels.shape[1:]))), np.nan)
    np.fmax.at(time_probability, chance.series, estimate.at_each[chance.inside])
    if not solution.exact:
        time_probability[time_probability < RARE] = np.nan
    statement = xr.Dataset({
        **dict(zip(STATED, [estimate.probability, *ends], strict=True)),
        "surrogate_probability": estimate.probability,
        "at_each_time": (labels.dims[1:], time_probability.reshape(labels.shape[1:])),
    })  # fmt: skip
    statement = with_bounds(statement, xr.DataArray(solution.exact), STATED)
    if missed_tolerance(narrow):
        names = (*STATED, "at_each_time", *["surrogate_probability"] * (not by_runs))
        statement = withheld(statement, names)
    return statement


def _chance_in_words(statement: xr.Dataset, chance: Chance, correction: Correction | None) -> str:
    """Return the probability that the surrogate finds, as a sentence."""
    value, low, high, surrogate_value = (
        float(statement[k]) for k in (*STATED, "surrogate_probability")
    )
    by_runs = "; runs of the model (response=…) " if correction is None else ""
    if np.isnan(value):
        text = f"The probability of violating limits is {NOT_GIVEN} by the surrogate, which missed "
        return f"{text}its tolerance{by_runs and by_runs + 'correct it'}"
    text = "Limits are violated with probability "
    if not value:
        text += f"below {high:.2g}"
        rare = (
            f"; the surrogate alone finds {surrogate_value:.2g}, too rare to be trusted without "
            "runs"
        )
        return text + rare * bool(surrogate_value)
    text += f"{value:.3g} ({low:.3g} to {high:.3g}) at most"
    beyond = bool(by_runs) and high > chance.probability
    return text + (f"{by_runs}tell whether it is above {chance.probability:g}" if beyond else "")


def _in_words(tolerances: Tolerances, x: np.ndarray, cost: np.ndarray) -> str:
    text = f"cost {cost.sum():.5g} with "
    if sizes := tolerances.nominal(x):
        text += f"sizes {', '.join(f'{k} {v:.6g}' for k, v in sizes.items())} and "
    pairs = zip(tolerances.names, tolerances.values(x), strict=True)
    return text + "tolerances " + ", ".join(f"{k} {t:.4g}" for k, t in pairs)


def _margins(
    narrow: Surrogate,
    limits: Mapping[str, Corridor],
    worst: WorstCaseBounds,
    confirmation: Confirmed,
) -> Variables:
    labels = narrow.labels
    impacts = bool(BandRecord.read(narrow.diagnostics).impacts)
    error = expected_error(narrow, worst.sigmas)
    low, high, _ = worst.bars(confirmation.allocated.x)
    columns: dict[str, list] = {"margin": [], "slack": [], "slack_at": [], "grid_error": []}
    errors = []
    # Find the margins of each limit, and where they are smallest.
    for corridor in limits.values():
        curve = np.full(labels.shape[1:], np.nan)
        bounds = corridor.curves.reshape(2, -1)[:, worst.numbers]
        curve.reshape(-1)[worst.numbers] = np.min(
            SIGNS[:, None] * (np.stack([low, high]) - bounds) - confirmation.shift, axis=0
        )
        curve = curve[corridor.where]
        margin = np.where(corridor.inside & np.isfinite(curve), curve, np.inf)
        at = int(margin.argmin())
        slack = margin.ravel()[at]
        columns["margin"].append(np.where(np.isfinite(margin), margin, np.nan))
        columns["slack"].append(slack)
        columns["slack_at"].append(at % margin.shape[-1] if margin.ndim else 0)
        columns["grid_error"].append(
            slack - _least_between(curve, labels, corridor, slack, impacts)
        )
        if error is not None:
            errors.append(error[corridor.where])
    # Collect the margins of all limits as variables.
    dims = [dim for dim in labels.dims[1:] if dim != "output"]
    data: Variables = {name: ("limit", values) for name, values in columns.items()}
    data["margin"] = ("limit", *dims), np.array(columns["margin"])
    if errors:
        data["expected_error"] = ("limit", *dims), np.array(errors)
    time = axes_of(labels).time
    if time is not None and time in labels.coords:
        data["slack_at"] = "limit", labels[time].values[columns["slack_at"]]
    return data


def _least_between(
    curve: np.ndarray, labels: xr.DataArray, corridor: Corridor, slack: float, impacts: bool
) -> float:
    """Return the least margin at and between the times of a curve, NaN at times not expanded."""
    axis = TimeAxis.from_labels(labels, corridor.window)
    if axis is None:
        return slack
    expanded_times = np.flatnonzero(np.isfinite(curve).reshape(-1, curve.shape[-1]).all(axis=0))
    if len(expanded_times) < 3:
        return slack
    part = slice(expanded_times[0], expanded_times[-1] + 1)
    minima = least_between(curve[..., part], axis.at(part), impacts=impacts)
    return min(slack, float(np.nanmin(minima.lowest)))


def _outcome(worst: WorstCaseBounds, confirmation: Confirmed, binding: Sequence[str]) -> str:
    """Return what limits the tolerances, and whether runs confirm them, as sentences."""
    allocation = confirmation.allocated
    status = _confirmation_state(confirmation)
    text = f"{'Binding' if allocation.binding else 'Nearest'}: {'; '.join(dict.fromkeys(binding))}"
    if status is TolerancesConfirmed.NOT_MADE:
        return text + NO_RUNS
    if status is TolerancesConfirmed.NO:
        by = -np.nanmin(confirmation.run_margins, initial=0.0)
        if worst.sigmas:  # no run is at the end of μ ± kσ, which the surrogate tells
            return (
                f"{text}. NOT confirmed: μ ± {worst.sigmas:g}σ of the surrogate, corrected with "
                f"{_new(confirmation.runs)}, violates limits by up to {by:.3g}"
            )
        verb = "violates" if confirmation.runs == 1 else "violate"
        return f"{text}. NOT confirmed: {_new(confirmation.runs)} {verb} limits by up to {by:.3g}"
    if status is TolerancesConfirmed.INFERRED:
        return (
            f"{text}. No limit is violated by {_new(confirmation.runs)}; that "
            f"μ ± {worst.sigmas:g}σ meets the requirements is inferred from the surrogate"
        )
    shift_text = "; the tolerances were corrected for the small differences they showed"
    shift_text = shift_text if confirmation.changed else ""
    return f"{text}. Checked by {_new(confirmation.runs)}{shift_text}"


def _confirmation_state(confirmation: Confirmed) -> TolerancesConfirmed:
    if not confirmation.runs:
        return TolerancesConfirmed.NOT_MADE
    if not confirmation.feasible:
        return TolerancesConfirmed.NO
    return TolerancesConfirmed.INFERRED if confirmation.inferred else TolerancesConfirmed.YES


def _new(runs: int) -> str:
    return number_of(runs, "verification run")


UNITLESS = "tolerance", "size", "largest", "cost", "saving", "binding_inputs"

LONG_NAMES = {
    "elasticity": "relative increase of the probability per relative increase of the tolerance",
    "probability": "probability of violating any limit at any time, where it is the largest",
    "confidence_low": "lower end of its confidence interval",
    "confidence_high": "upper end of its confidence interval",
    "surrogate_probability": "probability of the surrogate alone",
    "at_each_time": "probability of being outside at each time, there",
    "probability_at": "values of the interval inputs there",
    "run_probability": "probability corrected with runs",
    "run_confidence_low": "lower end of its confidence interval",
    "run_confidence_high": "upper end of its confidence interval",
    "tolerance": "half the width of an interval, radius of a play, or standard deviation",
    "size": "nominal size",
    "largest": "tolerance of the surrogate",
    "cost": "cost of the tolerance",
    "grade": "grade of the tolerance",
    "contribution": "part of the margin that the tolerance uses up",
    "saving_at": "by how much the cost falls per unit by which the limit is relaxed there",
    "saving": "by how much the cost falls per unit by which the limit is relaxed",
    "shift": "by how much the limit was tightened by what runs showed",
    "binding_limit": "limit that binds",
    "binding_side": "side of the limit that binds",
    "binding_inputs": "values of the interval inputs where the limit binds",
    "run_margin": "margin of a fresh run where the limit binds",
    "margin": "distance from the limit, for all values of the interval inputs",
    "slack": "least margin",
    "grid_error": "by how much the margin may be less between the times",
    "expected_error": "expected error of the margin",
}
