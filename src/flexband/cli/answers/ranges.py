"""The commands that bound quantiles and values of outputs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
import xarray as xr

import flexband as fb
from flexband.cli.answers.saved import Json, Saved, saved
from flexband.cli.application import app
from flexband.cli.files import check_folder, draw
from flexband.cli.messages import print_json, print_table, print_text, reported_errors, usage
from flexband.files import try_write
from flexband.report.text.numbers import number
from flexband.study.results.answers import answer_file
from flexband.words import number_of

ROWS = 20
"""Of a table of a distribution function, about."""


@app.command()
@reported_errors()
def quantiles(
    folder: Saved,
    probability: Annotated[
        list[float] | None,
        typer.Option("--probability", "-p", help="Of a quantile; may be repeated."),
    ] = None,
    samples: Annotated[int, typer.Option(help="Samples of the random inputs.")] = 4096,
    seed: Annotated[int, typer.Option(help="Seed of the samples.")] = 0,
    as_json: Json = False,
) -> None:
    """Bound the quantiles of all outputs over the interval inputs.

    No runs are made. quantiles.nc and quantiles.png are written.
    """
    p = probability or [0.05, 0.5, 0.95]
    surrogate, place = saved(folder)
    with usage():
        bounds = fb.quantiles(surrogate, p, samples=samples, seed=seed)
    title = (
        f"Quantiles: lowest and highest over the interval inputs, {number_of(samples, 'sample')}"
    )
    tell(bounds, "quantiles", title, place, as_json=as_json)


@app.command("range")
@reported_errors()
def value_range(
    folder: Saved,
    probability: Annotated[
        float, typer.Option("--probability", "-p", help="Of the random inputs in the box.")
    ] = 0.99,
    as_json: Json = False,
) -> None:
    """Bound the values of all outputs over all intervals and a part of the random inputs.

    No runs are made. range.nc and range.png are written.
    """
    surrogate, place = saved(folder)
    with usage():
        bounds = fb.value_range(surrogate, probability)
    title = f"Range of values, random inputs in a box of probability {probability:g}"
    tell(bounds, "range", title, place, as_json=as_json)


@app.command("p-box")
@reported_errors()
def p_box(
    folder: Saved,
    output: Annotated[str | None, typer.Argument(help="Name of the output.")] = None,
    time: Annotated[
        float | None,
        typer.Option(
            help="At which time; at which position, from 0, if the response has no times."
        ),
    ] = None,
    samples: Annotated[int, typer.Option(help="Samples of the random inputs.")] = 4096,
    seed: Annotated[int, typer.Option(help="Seed of the samples.")] = 0,
    as_json: Json = False,
) -> None:
    """Bound the distribution function of an output at a time over the interval inputs.

    No runs are made. p_box.nc and p_box.png are written.
    """
    surrogate, place = saved(folder)
    with usage():
        bounds = fb.p_box(surrogate, output, time, samples=samples, seed=seed)
    title = "Distribution function: lowest and highest probability of values up to"
    tell(bounds, "distribution", title, place, as_json=as_json, file="p_box")


def tell(
    bounds: xr.Dataset, name: str, title: str, place: Path, *, as_json: bool, file: str = ""
) -> None:
    """Print the bounds of a variable; write the answer and its figure beside the surrogate."""
    from flexband.report.plot.figures import bounds_figure, drawable_outputs  # noqa: PLC0415
    from flexband.study.results.netcdf import write_netcdf  # noqa: PLC0415

    check_folder(place)
    data, picture = answer_file(place, file or name), place / f"{file or name}.png"
    written = [data] * try_write(lambda: write_netcdf(bounds, data))
    variable = bounds[name]
    outputs_to_draw = drawable_outputs(
        variable.isel(probability=0) if "probability" in variable.dims else variable
    )
    written += [picture] * draw(
        lambda: bounds_figure(bounds, name), picture, wanted=bool(outputs_to_draw)
    )
    header, rows = (
        value_table(bounds) if "value" in bounds[name].dims else bounds_table(bounds, name)
    )
    remark = bounds.attrs.get("surrogate_not_reliable")
    if as_json:
        content = {
            "title": title,
            "bounds": [dict(zip(header, row, strict=True)) for row in rows],
            "attrs": {str(k): v for k, v in bounds.attrs.items()},
            "written": [str(file) for file in written],
        }
        print_json(content)
        return
    print_table(f"{title}; errors are the largest", (header, rows))
    lines = [f"Not reliable: {remark}"] if remark else []
    print_text("\n".join([*lines, *(f"Written: {file}" for file in written)]))


def bounds_table(bounds: xr.Dataset, name: str) -> tuple[list[str], list[list[str]]]:
    """Return the lowest and the highest bounds of each output, and their largest errors."""
    from flexband.report.text.tables import outputs_of, select  # noqa: PLC0415

    header = ["output", "probability", "lowest", "highest", "sampling error", "expected error"]
    rows: list[list[str]] = []
    for output in outputs_of(bounds[name]):
        selection = select(bounds, output)
        unit = f" [{selection['unit'].values}]" if "unit" in selection.coords else ""
        several: Sequence[Any] = [None]
        if "probability" in selection[name].dims:
            several = selection["probability"].values.tolist()
        for p in several:
            row_bounds = selection if p is None else selection.sel(probability=p)
            errors = [
                number(row_bounds[k].max(), 2) if k in row_bounds else ""
                for k in ("sampling_error", "expected_error")
            ]
            level = f"{bounds.attrs.get('probability', 1):g}" if p is None else f"{p:g}"
            scale = float(abs(selection[name]).max())
            ends = [number(v, 5, scale) for v in (row_bounds[name].min(), row_bounds[name].max())]
            rows.append([f"{output or 'response'}{unit}", level, *ends, *errors])
    return header, rows


def value_table(bounds: xr.Dataset) -> tuple[list[str], list[list[str]]]:
    """Return some values, and the bounds of the probability of values up to these."""
    some = bounds.isel(value=slice(None, None, max(1, bounds.sizes["value"] // ROWS)))
    unit = bounds["value"].attrs.get("units")
    header = [f"value [{unit}]" if unit else "value", "lowest", "highest", "sampling error"]
    errors = some["sampling_error"].max("bound").values
    columns = zip(some["value"].values, *some["distribution"].values, errors, strict=True)
    return header, [[number(v) for v in row] for row in columns]
