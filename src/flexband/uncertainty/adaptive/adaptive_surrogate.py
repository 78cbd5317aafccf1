"""The surrogate that the adaptive method returns, with what its runs tell of its errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from flexband.basics.warning import warn
from flexband.basics.words import number_of
from flexband.uncertainty.adaptive.adaptation import Adaptation, StopReason
from flexband.uncertainty.adaptive.choice import in_place_of_runs
from flexband.uncertainty.adaptive.expected_error import ExpectedError
from flexband.uncertainty.adaptive.refinement.fit_correction import (
    CorrectedPart,
    DiscretizationCorrection,
    divide_by_correction,
)
from flexband.uncertainty.adaptive.response_runs import ResponseRuns
from flexband.uncertainty.inputs.evaluation import coordinates, extremes_in_words
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.methods.method import Evaluate
from flexband.uncertainty.surrogates.axes import names_of_outputs
from flexband.uncertainty.surrogates.diagnostics import diagnostics, share, trust
from flexband.uncertainty.surrogates.held_out import HeldOut
from flexband.uncertainty.surrogates.sigmas import growth
from flexband.uncertainty.surrogates.surrogate import Surrogate
from flexband.uncertainty.surrogates.unconverged import INTEGRATION, in_words, why_not_finer
from flexband.uncertainty.surrogates.verification_verdict import in_percent


def surrogate_of(course: Adaptation) -> Surrogate:
    """Return the best surrogate of the runs; `AdaptivePCCI.expand` lists what it tells.

    The course ends: its coefficients may take the memory of its runs.
    """
    choice = course.choice
    error = course.error
    corrections = course.discretization()
    of_mean = growth(0) if course.space.families else 1.0  # without σ, the mean is the error bar
    band_errors = np.stack([of_mean * error.values, error.values])
    finer_runs = course.refinement.fine_run_count
    dataset = expectations(
        course.labels, error, band_errors, corrections, course.evaluate, finer_runs
    )
    dataset = dataset.assign(orders=("variable", choice.orders))
    dataset = dataset.assign_coords(variable=_variables(course.space)).assign_attrs(
        largest_miss=_largest_miss(course),
        runs_fitted=len(course.design_runs.values),
        runs_checked=course.check_run_count,
        runs_generic=course.generic
        if course.space.interval_dimension
        else len(course.holdout.values),
    )
    _warn_of_unexplained(course)
    arguments = course.space, course.labels, error, course.holdout
    return corrected_surrogate(*arguments, dataset, list(corrections.values()))


def corrected_surrogate(
    space: Space,
    labels: xr.DataArray,
    error: ExpectedError,
    holdout: ResponseRuns,
    dataset: xr.Dataset,
    corrections: Sequence[DiscretizationCorrection],
) -> Surrogate:
    """Return the surrogate of chosen fits with the corrections of their discretization.

    It has the diagnostics of the `dataset`, and may take the memory of the runs.
    """
    choice = error.choice
    overshoot = share(space.interval_dimension) * np.hypot(choice.overshoot, choice.later)
    judges = HeldOut(holdout.xi, holdout.eta, choice.missed, overshoot, error.window)
    expansions, correction = in_place_of_runs(divide_by_correction(choice.fits, corrections))
    return Surrogate(space, labels, expansions, dataset, judges, correction)


def expectations(
    labels: xr.DataArray,
    error: ExpectedError,
    of_expansion: np.ndarray,
    corrections: Mapping[str, DiscretizationCorrection],
    evaluate: Evaluate,
    finer_runs: int,
) -> xr.Dataset:
    """Return what is expected of bands: their error with its parts, and what is corrected of it.

    Parameters
    ----------
    labels : a response of shape (runs, …).
    error : what is known of the expansions.
    of_expansion : the error of mean and error bar that is due to them, (2, outputs, times).
    corrections : of the discretization, by name.
    finer_runs : number of runs on finer discretizations.
    """
    # The errors of both bands, in total and by their causes.
    choice = error.choice
    discretization_errors = {name: part.error for name, part in corrections.items()}
    integration = error.of_integration
    parts = {"expansion": np.maximum(of_expansion, error.steps) + integration}
    also = {"integration": integration} if choice.carriers.any() else {}
    if discretization_errors:
        parts["discretization"] = np.sum(list(discretization_errors.values()), axis=0)
    total = np.sum(list(parts.values()), axis=0)
    trusted = trust(labels, error.missed)
    relative = error.of_outputs(total)
    dataset = diagnostics(labels, total, relative, choice.carriers, trusted, choice.frequencies)
    for name, errors in (parts | also).items():
        for band, band_error in zip(("mean", "error_bar"), errors, strict=True):
            dataset[f"{band}_{name}_error"] = labels.dims[1:], band_error.reshape(labels.shape[1:])
    numbers = evaluate.description.discretization
    dataset = dataset.assign_attrs(
        {"discretization_error": "not estimated"}
        | {
            f"{name}_error": error.relative(band_errors)
            for name, band_errors in (discretization_errors | parts | also).items()
        },
        expected_error=error.relative(total),
        runs_refined=finer_runs,
        refined=list(discretization_errors),
        discretization=evaluate.discretization_in_words(),
        steps_per_period=[
            1 / (frequency * numbers["step"])
            for frequency in choice.frequencies
            if frequency * numbers.get("step", 0.0) > 0
        ],
    )
    # In words, what is corrected, and which outputs are judged in another way.
    names = np.array(names_of_outputs(labels))
    by_kind = (
        (name, kind, names[correction.kinds == kind])
        for name, correction in corrections.items()
        for kind in (CorrectedPart.VALUES, CorrectedPart.PHASES)
    )
    texts = [f"{name} of {', '.join(of)} by {kind}" for name, kind, of in by_kind if len(of)]
    if texts:
        dataset.attrs["corrected"] = "; ".join(texts)
    of_names = {"small_components": error.small, "same_counts": error.steps.any(axis=-1)}
    for name, where in of_names.items():
        if where.any():
            output_names = names[where]
            dataset.attrs[name] = ", ".join(output_names[:3]) + (
                ", …" if len(output_names) > 3 else ""
            )
    return dataset


def orders_used(course: Adaptation) -> list[str]:
    """Return the variables whose highest order is in use, each with this order."""
    orders = zip(_variables(course.space), course.choice.orders, course.design.highest, strict=True)
    return [f"{name} ({order})" for name, order, highest in orders if order >= highest]


def advice(course: Adaptation, stopped: StopReason) -> str:
    """Return what helps where the tolerance is not met."""
    variables_at_limit = orders_used(course)
    if variables_at_limit or stopped is StopReason.ORDERS_USED:
        where = f" in {', '.join(variables_at_limit)}" if variables_at_limit else ""
        return (
            f"more runs hardly help, since the highest order is in use{where}. Where the response "
            "jumps or has a corner, LHSScanning, SobolScanning or MonteCarlo (--method "
            "lhs-scanning) need no smoothness; or omit the outputs that converge too slowly"
        )
    sampled = course.space.advice_on_fields if course.design.sampled else ""
    return (
        "allow more runs (max_runs, or --max-runs), or omit the outputs that converge too "
        f"slowly{sampled}"
    )


def what_helps(attrs: Mapping[str, Any]) -> str:
    """Return what helps against the larger part of an error, expansion's or discretization's."""
    if attrs.get("integration_error", 0.0) > attrs["expansion_error"] / 2:
        return f"most of it is due to {INTEGRATION}"
    of_discretization = attrs["refined"] and (
        attrs["discretization_error"] > attrs["expansion_error"] or in_words(attrs)
    )
    if not of_discretization:
        return f"{attrs['advice']}. The largest prediction error is {attrs['largest_miss']}"
    worst = max(attrs["refined"], key=lambda name: attrs[f"{name}_error"])
    helps = f"give a finer {worst}"
    helps += ", or omit it to let flexband choose it" if "step" in attrs["refined"] else ""
    if "halved" in attrs:
        helps = why_not_finer(attrs)
    return f"most of it is due to {worst}; {helps}"


def _warn_of_unexplained(course: Adaptation) -> None:
    """Warn of outputs that vary, but whose bands have no width."""
    names = names_of_outputs(course.labels)
    lost = [names[k] for k in np.flatnonzero(course.error.zero_width_mask)]
    if lost:
        suffix = ", …" if len(lost) > 3 else ""
        warn(
            f"{', '.join(lost[:3])}{suffix}: the bands have no width although the runs differ, "
            f"since {number_of(len(course.design_runs.values), 'run')} show no terms of "
            "an expansion; LHSScanning, SobolScanning and MonteCarlo need no terms"
        )


def _variables(space: Space) -> list[str]:
    """Return the names of all variables, η first."""
    return [
        name if uncertain_input.dimension == 1 else f"{name}[{k}]"
        for random in (False, True)
        for name, uncertain_input in space.of_kind(random=random).items()
        for k in range(uncertain_input.dimension)
    ]


def _largest_miss(course: Adaptation) -> str:
    """Return in words which check run is missed by the most, and which input is the hardest."""
    missed = course.choice.missed
    width = course.error.width[:, None]
    run = int(np.argmax([np.max(np.abs(errors) / width) for errors in missed]))
    part = np.abs(missed[run]) / width
    output, time = np.unravel_index(np.argmax(part), part.shape)
    values = course.space.numbers_at(course.holdout.xi, course.holdout.eta)
    inputs = extremes_in_words(values, run, 4)
    place = _place(course.labels, int(output) * part.shape[1] + int(time))
    orders = course.choice.orders
    hardest = _variables(course.space)[int(np.argmax(orders))]
    return (
        f"{place}{(' at ' if inputs else '')}{inputs}: {in_percent(part[output, time])} of the "
        f"error bar's width; the highest order is {orders.max()}, in {hardest}"
    )


def _place(labels: xr.DataArray, number: int) -> str:
    """Return "of output F, time 0.1" for the number of a value of a response."""
    where = zip(labels.dims[1:], np.unravel_index(number, labels.shape[1:]), strict=True)
    coords = coordinates(labels)
    words = []
    for dim, k in where:
        value = coords[str(dim)].values[k] if dim in coords else k
        words.append(f"{dim} {value:.4g}" if isinstance(value, float) else f"{dim} {value}")
    return f"of {', '.join(words)}" if words else "of the response"
