"""Tables and remarks on bands and on methods, as text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeVar

import numpy as np
import xarray as xr

from flexband.basics.rounding import ROUNDING, rounding_levels, unit_of_variable
from flexband.basics.words import number_of
from flexband.report.text.advice import advice_on
from flexband.report.text.numbers import digits_for, number, percent
from flexband.study.comparison import Comparison
from flexband.uncertainty.inputs.fields.field import Field
from flexband.uncertainty.surrogates.axes import axes_of
from flexband.uncertainty.surrogates.bands import BandRecord
from flexband.uncertainty.surrogates.diagnostics import unnoticed_text, unseen_share
from flexband.uncertainty.surrogates.sigmas import bars_vary, relative_errors, with_relative_errors
from flexband.uncertainty.surrogates.verification_verdict import Confirmation, VerificationRecord

Table = tuple[list[str], list[list[str]]]
"""A header and rows."""


CONSTANT = "constant"
"""In place of the width of an output that is constant, or nothing but rounding errors."""


Data = TypeVar("Data", xr.DataArray, xr.Dataset)


def outputs_of(data: xr.DataArray | xr.Dataset) -> list[str]:
    """Return the names along dim "output", or one empty name without this dim."""
    return [str(name) for name in data["output"].values] if "output" in data.dims else [""]


def select(data: Data, name: str) -> Data:
    return data.isel(output=outputs_of(data).index(name)) if "output" in data.dims else data


def deviations(bands: xr.Dataset) -> str:
    """Return the error bar's multiple of σ as text: σ, 2σ, 2.5σ."""
    if "deviations" in bands and "sigmas" not in bands.attrs:
        return "kσ"  # requirements have different ones
    sigmas = BandRecord.read(bands).sigmas
    return "σ" if sigmas == 1 else f"{sigmas:g}σ"


def summary_table(bands: xr.Dataset, verification: xr.Dataset | None = None) -> Table:
    """Return one row per output: its bands over all times, and the largest width of its error bar.

    Their ends have so many digits that they are told apart from a limit which is near. The next
    column is the expected error relative to the width, both as means over time, or, for PCCI
    methods, the largest truncation indicator relative to the largest width; the last one is whether
    verification runs confirm it. Of an output that is constant there is none of these.
    """
    bar = f"error bar μ ± {deviations(bands)}"
    shares = expected_errors(bands)
    rows = []
    kind = "expected error" if shares else "truncation indicator"
    header = ["output", "interval mean", bar, "largest width", "at", kind]
    header += ["confirmed"] * (verification is not None and "confirmed" in verification)
    resolved = 0.01  # part of the largest width of an error bar that the digits of its ends tell
    still = constants(bands)
    largest = _largest_of_units(bands)
    for name in outputs_of(bands):
        output_bands = select(bands, name)
        unit = unit_of(output_bands)
        bar = output_bands["error_bar"]
        width = bar.sel(bound="upper") - bar.sel(bound="lower")
        # The ends of the bands, with as many digits as the width needs.
        widest = float(width.max())
        scale = float(abs(bar).max())
        scale = largest[unit] if unit and name in still else scale
        finest = 0.0 if name in still else resolved * widest
        ends = [
            number(v, digits_for(v, finest), scale)
            for v in (float(end) for b in (output_bands["mean"], bar) for end in (b.min(), b.max()))
        ]
        spans = [" … ".join(ends[:2]), " … ".join(ends[2:])]
        rows.append([f"{name or 'response'}{unit}", *spans])
        # Where the bar is widest, and the estimated error; neither of a constant output.
        at = ""
        error = ""
        new = _confirmation_cell(name, output_bands, verification, constant=name in still)
        if name in still:
            rows[-1] += [CONSTANT, at, error, *new]
            continue
        if (last := axes_of(bands["mean"]).time) in width.coords:
            unit_of_last = unit_of_variable(width[last], ("s" if last == "time" else ""))
            at = f"{float(width[last][int(width.values.argmax())]):.4g} {unit_of_last}".rstrip()
        if shares:
            error = percent(shares[name])
        elif "truncation" in output_bands:
            error = percent(float(output_bands["truncation"].max()) / widest)
        rows[-1] += [number(widest, scale=scale), at, error, *new]
    return header, rows


def _confirmation_cell(
    name: str, output_bands: xr.Dataset, verification: xr.Dataset | None, *, constant: bool
) -> list[str]:
    """Return the cell that tells whether new runs confirm the bands of an output; none without."""
    # Of an output whose expected error new runs confirm, although it is too large for trust
    and_yet = "not trusted"
    if verification is None or "confirmed" not in verification:
        return []
    if not select(verification["confirmed"], name).values.all():
        return ["NO"]
    trusted = "trusted" not in output_bands or output_bands["trusted"].values.all()
    return ["" if constant else "yes" if trusted else and_yet]


def unit_of(output_bands: xr.Dataset) -> str:
    """Return the unit of an output in brackets, after a blank; or nothing."""
    return f" [{output_bands['unit'].values}]" if "unit" in output_bands.coords else ""


def _largest_of_units(bands: xr.Dataset) -> dict[str, float]:
    """Return the largest error bar per unit, by `unit_of`; rounding is `ROUNDING` times that."""
    levels = rounding_levels(bands["unit"]) if "unit" in bands.coords else {}
    largest = {f" [{unit}]": level / ROUNDING for unit, level in levels.items()}
    for name in outputs_of(bands):
        output_bands = select(bands, name)
        largest[unit_of(output_bands)] = max(
            largest.get(unit_of(output_bands), 0.0), float(abs(output_bands["error_bar"]).max())
        )
    return largest


def constants(bands: xr.Dataset) -> list[str]:
    """Return the outputs that are constant, or nothing but rounding errors."""
    bar = bands["error_bar"].transpose("bound", ...)
    moving = bands["mean"].isel(bound=0, drop=True)
    time = axes_of(bar).time
    moving = moving if time is None else moving.isel({time: 0}, drop=True)
    moving = moving.transpose(*axes_of(bar).dims).copy(data=bars_vary(bar))
    return [name for name in outputs_of(moving) if not select(moving, name).values.any()]


def expected_errors(bands: xr.Dataset) -> dict[str, float]:
    """Return expected errors of outputs relative to the widths, means over time; or nothing."""
    # Factor between an error relative to an output's own width and of that it is judged by,
    # beyond which the former is told. Where both widths are the output's, they differ by a
    # little, since the latter is found at fewer times
    min_ratio = 1.25
    judged = judged_errors(bands)
    if not {"mean_expected_error", "error_bar_expected_error"} <= set(bands):
        return judged
    bar = bands["error_bar"].transpose("bound", ...)
    relative = xr.DataArray(relative_errors(bands, "expected_error", bar), dims=axes_of(bar).dims)
    if "output" in bar.coords:
        relative = relative.assign_coords(output=bar["output"])
    errors = {name: float(select(relative, name).max()) for name in judged}
    return {
        name: errors[name] if errors[name] > min_ratio * share else share
        for name, share in judged.items()
    }


def judged_errors(bands: xr.Dataset) -> dict[str, float]:
    """Return the expected errors of outputs as the method judges them; or nothing.

    Those of components of a tensor, and of far smaller ones of a vector, are relative to the width
    of the largest one.
    """
    bar = bands["error_bar"].transpose("bound", ...)
    errors = with_relative_errors(bands, bar)  # of an earlier version, or of a method of one's own
    if "relative_expected_error" not in errors:
        return {}
    names = outputs_of(bands["mean"])
    share = errors["relative_expected_error"]
    return {name: float(select(share, name).max()) for name in names}


def accuracy_line(bands: xr.Dataset, verification: xr.Dataset | None) -> str:
    """Return the estimated accuracy of the ends of the error bars, and which runs checked it."""
    shares = judged_errors(bands)
    if not shares:
        return "The accuracy of these bands is not estimated by this method."
    worst = max(shares, key=lambda name: shares[name])
    text = f"Estimated accuracy: ± {percent(shares[worst])} of the band's width"
    if len(shares) > 1:
        text += f" for {worst}, the least accurate output"
    if verification is None:
        return f"{text}."
    record = VerificationRecord.read(verification)
    if record.confirmed != Confirmation.CONFIRMED:
        return f"{text}. {verification.attrs['verdict']}."
    any_excess = (verification["implied_error"] > verification["expected_error"]).values.any()
    runs = number_of(record.runs - record.runs_failed, "new run")
    return f"{text}, {'not contradicted' if any_excess else 'checked'} by {runs}."


def worst_time(bands: xr.Dataset) -> str:
    """Return how far an error bar may be off at the worst time, with output and time, in words.

    It is relative to the width by which the method judges the output, mean over time.
    """
    axes = axes_of(bands["error_bar"].transpose("bound", ...))
    shares = judged_errors(bands)
    if axes.times == 1 or "pointwise_error" not in bands or not any(shares.values()):
        return ""
    time = axes.time
    parts = {}
    for name, share in shares.items():
        series = select(bands, name)
        of_mean = ("mean_expected_error", "error_bar_expected_error")
        mean = max(float(series[band].mean(time).max()) for band in of_mean)
        errors = series["pointwise_error"] * (share / mean if mean else 0.0)
        parts[name] = errors.max([dim for dim in errors.dims if dim != time])
    worst = max(parts, key=lambda name: float(parts[name].max()))
    at = int(np.argmax(parts[worst].values))
    unit = "" if time not in bands.coords else unit_of_variable(bands[time])
    value = bands[time].values[at] if time in bands.coords else at
    stamp = number(value) if np.issubdtype(np.asarray(value).dtype, np.number) else value
    of_output = f"{worst} at " if len(shares) > 1 else ""
    return f"{percent(float(parts[worst].max()))} ({of_output}{time} {stamp} {unit}".rstrip() + ")"


def mean_error_text(bands: xr.Dataset) -> str:
    """Return over what expected errors are averaged, in words after a comma; or nothing."""
    time = time_of(bands)
    return "" if time is None else f", mean over {time}"


def time_of(bands: xr.Dataset) -> str | None:
    """Return the dim of bands that is time; None without one."""
    return axes_of(bands["mean"].transpose("bound", ...)).time


def predictable_part(bands: xr.Dataset, parts: xr.Dataset | None) -> xr.Dataset | None:
    """Return trusted bands of outputs that no sampled part shows to be unpredictable, or None."""
    if parts is None:
        return bands
    predictable = parts["predictable"] & bands.get("trusted", True)
    predictable = predictable.all([dim for dim in predictable.dims if dim != "output"])
    if "output" not in predictable.dims:
        return bands if predictable.all() else None
    return bands.isel(output=np.flatnonzero(predictable.values)) if predictable.any() else None


def before_horizon(data: Data, time: str | None, parts: xr.Dataset | None) -> Data:
    """Return numbers of outputs over time, NaN past the horizon that sampled parts tell."""
    if parts is None or time not in data.dims:
        return data
    if isinstance(data, xr.Dataset):
        variables = {k: before_horizon(values, time, parts) for k, values in data.items()}
        return data.assign(variables)
    end = parts["horizon_low"]
    end = end.min("choice") if "choice" in end.dims else end
    return data.where(data[time] <= end).transpose(*data.dims) if data.dtype == float else data


def failures(bands: xr.Dataset) -> list[str]:
    """Return how many runs failed, as a sentence; none if none did."""
    record = BandRecord.read(bands)
    failed = record.runs_failed
    runs = record.runs
    if not failed:
        return []
    return [
        f"{failed} of {number_of(runs, 'run')} failed and {'was' if failed == 1 else 'were'} "
        f"left out, {percent(failed / runs)}; `flexband status` lists what failed"
    ]


def remarks(bands: xr.Dataset, verification: xr.Dataset | None = None) -> list[str]:
    """Return what diagnostics and the result of `verify` mean, as sentences."""
    lines = [] if verification is None else [VerificationRecord.read(verification).verdict]
    record = BandRecord.read(bands)
    lines += failures(bands)
    if "orders" in bands:
        orders = zip(bands["variable"].values, bands["orders"].values, strict=True)
        lines.append("Orders: " + ", ".join(f"{name} {order}" for name, order in orders))
    # The expected error, and what it consists of.
    if record.expected_error is not None:
        generic = record.runs_generic
        checks = record.runs_checked
        source = number_of(checks, "check run")
        if record.judged_by:
            source = "the verification runs that are missed most"
        lines.append(
            f"Expected error{mean_error_text(bands)}: {percent(record.expected_error)} of the "
            f"error bar's width ({source})"
        )
        lines += [
            f"At single times it may be up to {worst}" for worst in [worst_time(bands)] if worst
        ]
        if record.integration_error > 0.1 * (record.expansion_error or 0.0):
            lines.append(
                f"Of this, the integration of the moments: {percent(record.integration_error)}"
            )
        if len(record.refined):
            parts = {name: bands.attrs[f"{name}_error"] for name in record.refined}
            errors = ", ".join(f"{name} {percent(error)}" for name, error in parts.items())
            lines.append(
                f"Of this, the expansion {percent(record.expansion_error or 0.0)}, {errors} "
                f"({number_of(record.runs_refined, 'run')} on finer discretizations)"
            )
            remaining = f"Corrected by these runs: {record.corrected}; the errors are what remains"
            uncorrected = "Not corrected: the runs have the error of their step and elements"
            lines.append(remaining if record.corrected else uncorrected)
        else:
            lines.append("The error of the discretization (step, elements) is not estimated")
        if verification is None and not record.judged_by:
            lines.append(unnoticed_text(checks if generic is None else generic))
        # The discretization, and whose errors are judged by other measures.
        if record.discretization:
            origin = " (chosen by the method)" if record.halved is not None else ""
            lines.append(f"Discretization: {record.discretization}{origin}")
        if record.small_components:
            lines.append(
                f"{record.small_components}: the tolerance is relative to the wider error bar "
                "of another component of the same tensor or vector; errors in the table are "
                "relative to its own width"
            )
        if record.same_counts:
            of_all = percent(unseen_share(record.runs_fitted + checks))
            lines.append(
                f"{record.same_counts}: all runs count the same at all times, but up to {of_all} "
                "of all parts may count a change earlier or later"
            )
        # Whether the steps resolve the vibrations.
        carriers = (  # NetCDF has a number in place of one that is alone
            np.atleast_1d(values)
            for values in (record.carrier_frequencies, record.steps_per_period)
        )
        lines += [
            f"A vibration of {frequency:.4g} Hz has {steps:.3g} steps per period"
            for frequency, steps in zip(*carriers, strict=False)
        ]
    # What to do, and which options are the worst.
    lines += advice_on(bands, verification)
    if "choice" in bands.dims:
        for name in outputs_of(bands):
            ends = select(bands["error_bar_choice"], name).values.reshape(2, -1)
            lower, upper = (" and ".join(dict.fromkeys(options.tolist())) for options in ends)
            lines.append(
                f"Choices: the error bar of {name or 'the response'} is lowest with {lower}, and "
                f"highest with {upper}"
            )
    return [*lines, *between_remarks(bands), *_restrictions(record)]


def _restrictions(record: BandRecord) -> list[str]:
    """Return for what bands hold, and which are not reliable."""
    names = ", ".join(np.atleast_1d(record.constant_offsets).tolist())
    texts = {
        "For constant offsets of pins and guides:": names,
        "The bands are": record.remark,
        "Not reliable:": record.not_trusted,
    }
    return [f"{begin} {text}" for begin, text in texts.items() if text]


def between_remarks(bands: xr.Dataset) -> list[str]:
    """Return which outputs leave their bands' range between the times in all runs looked at."""
    # Part of its range by which an output may leave it between the times without a remark
    tolerance = 0.01
    if "above_between" not in bands:
        return []
    lines = []
    last = bands["above_between"].dims[-1]
    sizes = _largest_of_units(bands)
    for name in outputs_of(bands):
        output_bands = select(bands, name)
        unit = f" {output_bands['unit'].values}" if "unit" in output_bands.coords else ""
        unit_of_last = f" {bands[last].attrs['units']}" if "units" in bands[last].attrs else ""
        low, high = output_bands["error_bar"].transpose("bound", ...).values
        largest = max(high.max() - low.min(), ROUNDING * sizes[unit_of(output_bands)])
        for side, end, sign in (("above", high, 1.0), ("below", -low, -1.0)):
            overshoot = output_bands[f"{side}_between_least"].values[..., :-1]
            reach = np.maximum(end[..., :-1], end[..., 1:]) + overshoot
            if reach.max() <= end.max() + tolerance * largest:
                continue
            at = number(bands[last].values[np.unravel_index(reach.argmax(), reach.shape)[-1]])
            way = "up" if sign > 0 else "down"
            lines.append(
                f"Between the output times, {name or 'the response'} goes {way} to "
                f"{number(sign * reach.max())}{unit}, after {at}{unit_of_last}, {side} every band "
                f"at these times ({number_of(bands.attrs['runs_between'], 'run')} at more times): "
                "a smaller output_step shows it"
            )
    return lines


def error_table(results: Sequence[Comparison]) -> Table:
    """Return runs, wall times and relative errors in per cent, one row per method and output."""
    header = ["method", "runs", "time [s]", "output", "mean [%]", "error bar [%]"]
    rows = []
    for result in results:
        head = [result.method.label, str(result.runs), f"{result.seconds:.2f}"]
        if not result.errors:
            rows.append([f"{head[0]} (reference)", *head[1:], "", "", ""])
            continue
        for name in outputs_of(result.bands):
            values = [float(select(result.errors[v], name)) for v in ("mean", "error_bar")]
            rows.append([*head, name, *("–" if np.isnan(v) else f"{100 * v:.2f}" for v in values)])
            head = ["", "", ""]
    return header, rows


def field_remarks(fields: Mapping[str, Field]) -> list[str]:
    """Return what each field is made of, and how well it is represented, as sentences."""
    return [f"{name}: {field.summary}" for name, field in fields.items()]


def comparison_remarks(fields: Mapping[str, Field]) -> list[str]:
    """Return what fields are made of, and what runs and wall times include, as sentences."""
    repeated = "Numbers of runs do not include the one that is made again to see that it repeats."
    model = (
        "All methods are compared on one model with its step and elements, on purpose: none of "
        "them corrects their error (correct=False), and no column has it."
    )
    return [*field_remarks(fields), "Times do not include compilation.", repeated, model]
