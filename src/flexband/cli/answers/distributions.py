"""The command that bounds what is known of outputs beyond mean and scatter."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Any

import typer

import flexband as fb
from flexband.basics.words import number_of
from flexband.cli.answers.frame import CommandOutput, answer_command
from flexband.cli.answers.saved_result import SavedResult
from flexband.cli.messages import Table, UsageError, usage

if TYPE_CHECKING:  # imported when a command is called
    import xarray as xr

    from flexband.analysis.labelled_answers import AnswerRecord
    from flexband.basics.rounding import unit_of_variable
    from flexband.report.plot.figures import bounds_figure
    from flexband.report.text.band_tables import outputs_of, select, unit_of
    from flexband.report.text.drawable import drawable_outputs
    from flexband.report.text.numbers import number
    from flexband.study.presentation.display import Display


class Kind(StrEnum):
    """What is bounded."""

    quantiles = "quantiles"
    range = "range"
    p_box = "p-box"


@answer_command("distribution")
def distribution(
    result: SavedResult,
    output: Annotated[
        str | None, typer.Argument(help="Output of the distribution function.")
    ] = None,
    kind: Annotated[
        Kind,
        typer.Option(
            help="Quantiles; the range that a share of the random inputs gives; or the "
            "distribution function of an output at one time."
        ),
    ] = Kind.quantiles,
    probability: Annotated[
        list[float] | None,
        typer.Option(
            "--probability",
            "-p",
            help="Probability of a quantile, can be repeated (0.05, 0.5 and 0.95); or share of the "
            "random inputs that give a range (0.99).",
        ),
    ] = None,
    time: Annotated[
        float | None,
        typer.Option(
            help="Time of the distribution function; an index from 0 if the response has no times."
        ),
    ] = None,
    samples: Annotated[
        int | None, typer.Option(help="Number of samples of the random inputs.  [default: 4096]")
    ] = None,
    seed: Annotated[
        int | None, typer.Option(help="Seed of the random samples.  [default: 0]")
    ] = None,
) -> CommandOutput:
    """Bound quantiles, ranges or distribution functions of outputs over the interval inputs.

    No runs are made. quantiles.nc and quantiles.png are written, or range.nc and range.png, or
    p_box.nc and p_box.png.
    """
    check_options(
        kind,
        {"output": output, "--time": time, "--probability": probability or None,
         "--samples": samples, "--seed": seed},
    )  # fmt: skip
    count = 4096 if samples is None else samples
    sampling: dict[str, Any] = {"samples": count, "seed": seed or 0}
    with usage():
        if kind is Kind.quantiles:
            bounds = fb.analysis.quantiles(
                result.surrogate, probability or [0.05, 0.5, 0.95], **sampling
            )
            lowest = "lowest and highest over the interval inputs"
            title = f"Quantiles: {lowest}, {number_of(count, 'sample')}"
        elif kind is Kind.range:
            if probability and len(probability) > 1:
                raise UsageError("--probability of a range must be given once")
            box = probability[0] if probability else 0.99
            bounds = fb.analysis.value_range(result.surrogate, box)
            title = f"Range of values, random inputs in a box of probability {box:g}"
        else:
            bounds = fb.analysis.p_box(result.surrogate, output, time, **sampling)
            title = "Distribution function: lowest and highest probability of values up to"
    return answer_with(bounds, kind, title, result.display)


def check_options(kind: Kind, values: dict[str, object]) -> None:
    """Raise `UsageError` for an option that is given, and that the kind does not take."""
    takers = {
        "output": (Kind.p_box,),
        "--time": (Kind.p_box,),
        "--probability": (Kind.quantiles, Kind.range),
        "--samples": (Kind.quantiles, Kind.p_box),
        "--seed": (Kind.quantiles, Kind.p_box),
    }
    for option, value in values.items():
        if value is not None and kind not in takers[option]:
            kinds = " or ".join(takers[option])
            raise UsageError(f"{option} is one of --kind {kinds}; got --kind {kind}")


def answer_with(data: xr.Dataset, kind: Kind, title: str, display: Display) -> CommandOutput:
    """Return the table, the data and the figure of bounds."""
    bounds = display.data(data)
    name = "distribution" if kind is Kind.p_box else kind.value
    variable = bounds[name]
    outputs_to_draw = drawable_outputs(
        variable.isel(probability=0) if "probability" in variable.dims else variable
    )
    header, rows = value_table(bounds) if "value" in variable.dims else bounds_table(bounds, name)
    remark = AnswerRecord.read(bounds).surrogate_not_reliable
    return CommandOutput(
        {
            "title": title,
            "bounds": [dict(zip(header, row, strict=True)) for row in rows],
            "attrs": {str(k): v for k, v in bounds.attrs.items()},
        },
        [(f"{title}; errors are the largest", (header, rows))],
        f"Not reliable: {remark}" if remark else "",
        name=kind.name,
        data=data,
        figure=lambda: bounds_figure(bounds, name),
        drawable=bool(outputs_to_draw),
    )


def bounds_table(bounds: xr.Dataset, name: str) -> Table:
    """Return the lowest and the highest bounds of each output, and their largest errors."""
    header = ["output", "probability", "lowest", "highest", "sampling error", "estimated error"]
    rows: list[list[str]] = []
    for output in outputs_of(bounds[name]):
        selection = select(bounds, output)
        probabilities: Sequence[float | None] = [None]
        if "probability" in selection[name].dims:
            probabilities = selection["probability"].values.tolist()
        for p in probabilities:
            row_bounds = selection if p is None else selection.sel(probability=p)
            errors = [
                number(row_bounds[k].max(), 2) if k in row_bounds else ""
                for k in ("sampling_error", "expected_error")
            ]
            level = f"{bounds.attrs.get('probability', 1):g}" if p is None else f"{p:g}"
            scale = float(abs(selection[name]).max())
            ends = [number(v, 5, scale) for v in (row_bounds[name].min(), row_bounds[name].max())]
            rows.append([f"{output or 'response'}{unit_of(selection)}", level, *ends, *errors])
    return header, rows


def value_table(bounds: xr.Dataset) -> Table:
    """Return about 20 values, and the bounds of the probability of values up to these."""
    some = bounds.isel(value=slice(None, None, max(1, bounds.sizes["value"] // 20)))
    unit = unit_of_variable(bounds["value"])
    header = [f"value [{unit}]" if unit else "value", "lowest", "highest", "sampling error"]
    errors = some["sampling_error"].max("bound").values
    columns = zip(some["value"].values, *some["distribution"].values, errors, strict=True)
    return header, [[number(v) for v in row] for row in columns]
