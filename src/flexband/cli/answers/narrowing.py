"""The commands that ask what tighter tolerances would bring."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, is_dataclass, replace
from math import isnan
from typing import TYPE_CHECKING, Annotated, Any

import typer

import flexband as fb
from flexband.basics.words import with_article
from flexband.cli.answers.frame import CommandOutput, Sigmas, answer_command
from flexband.cli.answers.saved_result import SavedResult
from flexband.cli.command_options import Trust
from flexband.cli.messages import Table, UsageError, print_text, usage
from flexband.errors import InputError

if TYPE_CHECKING:  # imported when a command is called
    import numpy as np
    import xarray as xr

    from flexband.analysis.labelled_answers import AnswerRecord
    from flexband.analysis.limits.least_margin import LimitVerdict
    from flexband.analysis.probability.texts import NOT_GIVEN
    from flexband.analysis.selection import labels_of
    from flexband.report.page.inputs import known_of
    from flexband.report.text.band_tables import (
        CONSTANT,
        accuracy_line,
        constants,
        deviations,
        mean_error_text,
        outputs_of,
        select,
        unit_of,
    )
    from flexband.report.text.numbers import number, percent_to_tenth
    from flexband.study.presentation.display import Display
    from flexband.study.results.answers import read_answer
    from flexband.study.results.limits import has_probability
    from flexband.uncertainty.inputs.distributions.random_option import RandomOption
    from flexband.uncertainty.inputs.pbox import PBox, Score
    from flexband.uncertainty.surrogates.axes import axes_of
    from flexband.uncertainty.surrogates.bands import BandRecord


@answer_command("narrow")
def narrow(
    result: SavedResult,
    changes: Annotated[
        list[str],
        typer.Argument(
            help="NAME=LOWER..UPPER for an interval, NAME=NUMBER or NAME=OPTION to fix an input, "
            "NAME.std=NUMBER or NAME.cv=NUMBER for less scatter."
        ),
    ],
    sigmas: Sigmas = 1.0,
    probability: Annotated[
        bool,
        typer.Option(
            "--probability",
            help="Also show the probabilities of violating the study's requirements.",
        ),
    ] = False,
    trust: Trust = False,
) -> CommandOutput:
    """Show the bands for tighter tolerances or less scatter, without further runs.

    If the study in FOLDER has requirements, their least margins (μ ± 3σ) before and after are shown
    as well. The result is written to narrowed.nc, in place of an earlier one.
    """
    surrogate = result.surrogate
    place = result.folder
    if not isinstance(surrogate, fb.Surrogate):
        raise InputError("a surrogate with choices is narrowed in Python, one option at a time")
    with usage():
        new_inputs = changes_of(surrogate, changes)
        surrogates = surrogate, surrogate.narrowed(**new_inputs)
        before, after = (expansion.bands(sigmas) for expansion in surrogates)
    # Margins of the limits by both surrogates.
    requirements = result.limits(trust=trust)
    limits = limits_before_and_after(surrogates, requirements, result.display, likely=probability)
    display = result.display
    # The changes in words; an earlier answer to others is replaced.
    units = result.display.input_units()
    words = {name: known_of(new, display.scale(name))[1] for name, new in new_inputs.items()}
    changed = "; ".join(f"{k}: {text} {units.get(k, '')}".rstrip() for k, text in words.items())
    after = after.assign_attrs(changes=changed)
    earlier = read_answer(place, "narrowed")
    if earlier is not None and AnswerRecord.read(earlier).changes != changed:
        others = AnswerRecord.read(earlier).changes or "other inputs"
        print_text(f"The earlier narrowed.nc is replaced ({others})", error=True)
    # Widths of the error bars, before and after.
    widths = [_widths(before), _widths(after)]
    error = after.attrs.get("expected_error", "not estimated")
    display_bands = [result.display.data(bands) for bands in (before, after)]
    display_widths = [_widths(bands) for bands in display_bands]
    of_unit = {name: unit_of(select(display_bands[0], name)) for name in widths[0]}
    pairs = {name: (old, display_widths[1][name]) for name, old in display_widths[0].items()}
    still = constants(before)
    rows = []
    for name, (old, new) in pairs.items():
        cells = [CONSTANT, "", ""]
        if name not in still:
            cells = [number(old), number(new), percent_to_tenth(new / old)]
        rows.append([f"{name or 'response'}{of_unit[name]}", *cells])
    width = f"width of the error bar{mean_error_text(before)}"
    header = ["output", width, "narrowed", "of what it was"]
    printed = [(f"Narrowed inputs: error bar μ ± {deviations(after)}", (header, rows))]
    if limits:
        printed.append(("Requirements, margins of μ ± 3σ", limits_table(limits)))
    estimated = "expected_error" in after.attrs
    sentence = accuracy_line(after, None) if estimated else f"Estimated error: {error}."
    mean_widths = dict(zip(("mean_width_before", "mean_width"), widths, strict=True))
    content = {
        "sigmas": sigmas,
        "changes": changed,
        "inputs": BandRecord.read(after).inputs,
        **mean_widths,
    }
    by_limit = {row["limit"]: {k: v for k, v in row.items() if k != "limit"} for row in limits}
    return CommandOutput(
        {**content, "expected_error": error, "limits": by_limit},
        printed,
        f"{changed}\n{sentence}",
        name="narrowed",
        data=after,
    )


def limits_before_and_after(
    surrogates: tuple[fb.Surrogate, fb.Surrogate],
    limits: Sequence[fb.Requirement],
    display: Display,
    *,
    likely: bool,
) -> list[dict[str, Any]]:
    """Return the least margin of each limit by two surrogates, and how likely it is left.

    A probability is that at the worst interval inputs, None where no input scatters; where it is
    only bounded, it is 0, with `confidence_high`. Raise `UsageError` if one is asked for, but there
    is none.
    """
    if likely and not (limits and has_probability(surrogates[0])):
        raise UsageError(
            "--probability requires random inputs, no Compensator, and requirements of the study"
        )
    if not limits:
        return []
    checks = [
        display.data(fb.analysis.check_requirements(surrogate, limits)) for surrogate in surrogates
    ]
    units = checks[0].coords.get("unit", xr.DataArray("")).values
    units = np.broadcast_to(units, len(limits)).astype(str).tolist()
    rows = [
        {"limit": str(name), "unit": units[k],
         "least_margin": [float(check["least_margin"][k]) for check in checks],
         "verdict": [str(check["verdict"][k].values) for check in checks]}
        for k, name in enumerate(checks[0]["limit"].values)
    ]  # fmt: skip
    if likely:
        risk = fb.analysis.failure_probability
        risks = [
            risk(surrogate, limits) if has_probability(surrogate) else None
            for surrogate in surrogates
        ]
        rows += [{"limit": "any limit"}] * (len(limits) > 1)
        for k, row in enumerate(rows):
            for name in ("probability", "confidence_high"):
                row[name] = [
                    None if risk is None else float(risk[name].sel(bound="upper")[k])
                    for risk in risks
                ]
    return rows


def limits_table(limits: list[dict[str, Any]]) -> Table:
    """Return one row per requirement, before and after inputs are narrowed."""
    header = ["requirement", "least margin", "narrowed", "verdict"]
    likely = "probability" in limits[0]
    header += ["probability, at most", "narrowed"] * likely
    rows = []
    for entry in limits:
        unit = entry.get("unit", "")
        margins = [f"{number(v)} {unit}".rstrip() for v in entry.get("least_margin", [])]
        margins = margins or ["", ""]
        before, after = (
            LimitVerdict(word).word if word else "" for word in entry.get("verdict", ["", ""])
        )
        changed = before if before == after else f"{before} → {after}"
        row = [entry["limit"], *margins, changed]
        if likely:
            pairs = zip(entry["probability"], entry["confidence_high"], strict=True)
            row += [_likely(*pair) for pair in pairs]
        rows.append(row)
    return header, rows


def _likely(probability: float | None, upper_bound: float | None) -> str:
    """Return a probability, or what it is at most, as text; none where no input scatters."""
    if probability is None or upper_bound is None:
        return ""
    if isnan(probability):
        return NOT_GIVEN
    return number(probability, 3) if probability else f"below {number(upper_bound, 2)}"


@answer_command("tolerance")
def tolerance(
    result: SavedResult,
    name: Annotated[str, typer.Argument(help="Name of the input.")],
    share: Annotated[float, typer.Option(help="Fraction of the width to reach.")] = 0.5,
    sigmas: Sigmas = 1.0,
) -> CommandOutput:
    """Find the tolerance that reduces the error bars to a given fraction.

    The width is the largest over time, as in the report's panel "What if". All other inputs stay as
    they are. No runs are made, and no file is written.
    """
    surrogate = result.surrogate
    with usage():
        tolerances = fb.analysis.tolerance_for(surrogate, name, share, sigmas=sigmas)
    names = ("width", "least_width", "factor", "tolerance")
    if tolerances["width"].ndim > ("output" in tolerances.dims):
        raise InputError(
            f"tolerance takes outputs over time alone; got dims {tolerances['width'].dims}"
        )
    # Numbers by output, and the outputs whose bars can become as narrow as is wanted.
    table = {
        output: [float(select(tolerances[k], output)) for k in names]
        for output in outputs_of(tolerances)
    }
    still = [output for output in table if not bool(select(tolerances["varies"], output))]
    reached = [output for output in table if np.isfinite(table[output][3]) and output not in still]
    header = ["output", "largest width", "without its uncertainty", "part of the width"]
    if reached:
        header += [f"tolerance for {percent_to_tenth(share)}", "part of the present one"]
    # A row for each output, in display units.
    rows = []
    factors = result.display.data(tolerances)
    scale = result.display.scale(name)
    for output, (_, _, factor, size) in table.items():
        width, min_width = (float(select(factors[k], output)) for k in ("width", "least_width"))
        if output in still:
            rows.append([output or "response", CONSTANT, *[""] * (len(header) - 2)])
            continue
        least_share = percent_to_tenth(min_width / width)
        row = [f"{output or 'response'}{unit_of(select(factors, output))}"]
        row += [*(number(v, scale=width) for v in (width, min_width)), least_share]
        if reached:
            unit = result.display.input_units().get(name, "")
            with_unit = f"{number(size * scale)} {unit}".rstrip()
            row += [with_unit, percent_to_tenth(factor)] if output in reached else ["none", ""]
        rows.append(row)
    time = axes_of(labels_of(surrogate)).time
    largest = f", the largest over {time}" if time else ""
    title = (
        f"Tolerance of {name}, all others as they are; widths are those of μ ± "
        f"{deviations(tolerances)}{largest}"
    )
    moving = {output: values for output, values in table.items() if output not in still}
    options = {"share": share, "sigmas": sigmas}
    return CommandOutput(
        {
            output: dict(zip(names, values, strict=True)) | options
            for output, values in table.items()
        },
        [(title, (header, rows))],
        out_of_reach(name, share, moving) if len(reached) < len(moving) else "",
    )


def out_of_reach(name: str, share: float, table: dict[str, list[float]]) -> str:
    """Return how narrow the error bars become that no tolerance of an input makes narrow enough."""
    lost = {k: v[1] / v[0] for k, v in table.items() if np.isnan(v[3])}
    narrowest = min(lost, key=lambda output: lost[output])
    which = "no error bar becomes"
    if len(lost) < len(table):
        which = f"the error bar of {', '.join(lost)} does not become"
        if len(lost) > 1:
            which = f"the error bars of {', '.join(lost)} do not become"
    reachable_share = percent_to_tenth(lost[narrowest]) + (f", of {narrowest}" if narrowest else "")
    return (
        f"However small the tolerance of {name}, {which} as narrow as {percent_to_tenth(share)} of "
        f"the present width. What can be reached is {reachable_share}; for less, narrow other "
        "inputs, too."
    )


def changes_of(surrogate: fb.Surrogate, texts: list[str]) -> dict[str, Any]:
    """Return narrower inputs; raise `InputError` if a text is none of the allowed forms."""
    changes: dict[str, Any] = {}
    changed_names: set[str] = set()
    inputs = surrogate.space.inputs
    for text in texts:
        name, equals, value = text.partition("=")
        lower, dots, upper = value.partition("..")
        # An option by its name, or else a number or two.
        if isinstance(option := inputs.get(name), RandomOption):
            changes[name] = next(
                (candidate for candidate in option.options if str(candidate) == value), value
            )
            continue
        try:
            numbers = [float(lower), float(upper)] if dots else [float(value)]
        except ValueError:
            numbers = []
        if not equals or not numbers:
            forms = "NAME=LOWER..UPPER, NAME=NUMBER, NAME.std=NUMBER or NAME.cv=NUMBER"
            raise InputError(f"a change must be {forms}; got {text!r}")
        if name in changed_names:
            raise InputError(f"a change must be given once for {name}; got {text!r}")
        changed_names.add(name)
        # A parameter of a distribution, or a whole input.
        owner, _, parameter = name.rpartition(".")
        uncertain_input: Any = inputs.get(owner)
        own_fields = fields(uncertain_input) if is_dataclass(uncertain_input) else ()
        names = [field.name for field in own_fields if field.init]
        if name not in inputs and uncertain_input is not None and names and parameter not in names:
            raise InputError(f"{narrowed_by(owner, uncertain_input, names)}; got {text!r}")
        if name not in inputs and parameter in names:
            changed: dict[str, Any] = {parameter: numbers[0]}
            spreads = {"std", "cv"}
            if parameter in spreads:  # one of them alone is given
                changed = dict.fromkeys(spreads & {*names}) | changed
            changes[owner] = replace(changes.get(owner, uncertain_input), **changed)
        else:
            changes[name] = fb.Interval(*numbers) if dots else numbers[0]
    return changes


def narrowed_by(name: str, uncertain_input: Any, names: Sequence[str]) -> str:
    """Return in words how an input is narrowed; `names` are its parameters."""
    if isinstance(uncertain_input, Score):
        return f"{name} cannot be narrowed, since it is correlated with others"
    distribution = (
        uncertain_input.distribution if isinstance(uncertain_input, PBox) else uncertain_input
    )
    kind = f"{name} is {with_article(type(distribution).__name__)}"
    fixed = f"{name}=NUMBER fixes it"
    if uncertain_input.intervals:
        ends = " and ".join(
            f"{name}.{parameter}=LOWER..UPPER" for parameter in uncertain_input.intervals
        )
        return f"{kind} with parameters that are intervals, which are narrowed by {ends}"
    if isinstance(uncertain_input, fb.Distribution):
        forms = " or ".join(f"{name}.{field}=NUMBER" for field in names)
        return f"{kind}, which is narrowed by {forms}; {fixed}"
    if isinstance(uncertain_input, fb.RandomField):
        return f"{kind}, which is narrowed by its standard deviation alone, {name}.std=NUMBER"
    return f"{kind}, which is narrowed by its two ends, {name}=LOWER..UPPER; {fixed}"


def _widths(bands: xr.Dataset) -> dict[str, float]:
    """Return the width of the error bar of every output, mean over time."""
    width = bands["error_bar"].sel(bound="upper") - bands["error_bar"].sel(bound="lower")
    return {name: float(select(width, name).mean()) for name in outputs_of(width)}
