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
from flexband.cli.files import check_folder, save
from flexband.cli.messages import print_json, print_table, print_text, reported_errors


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

    No runs are made. Quantiles are
    written to quantiles.nc and quantiles.png beside the surrogate.
    """
    p = probability or [0.05, 0.5, 0.95]
    surrogate, place = saved(folder)
    found = fb.quantiles(surrogate, p, samples=samples, seed=seed)
    title = f"Quantiles: lowest and highest over the interval inputs, {samples} samples"
    tell(found, "quantiles", title, place, as_json=as_json)


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

    No runs are made. The range is
    written to range.nc and range.png beside the surrogate.
    """
    surrogate, place = saved(folder)
    found = fb.value_range(surrogate, probability)
    title = f"Range of values, random inputs in a box of probability {probability:g}"
    tell(found, "range", title, place, as_json=as_json)


def tell(found: xr.Dataset, name: str, title: str, place: Path, *, as_json: bool) -> None:
    """Print the bounds of a variable; write the answer and its figure beside the surrogate."""
    from flexband.report.answers.quantiles import bounds_figure  # noqa: PLC0415
    from flexband.report.figures import drawable_outputs  # noqa: PLC0415
    from flexband.report.results import write_netcdf  # noqa: PLC0415

    check_folder(place)
    data, picture = place / f"{name}.nc", place / f"{name}.png"
    written = [data] * save(lambda: write_netcdf(found, data))
    one = found[name]
    if drawable_outputs(one.isel(probability=0) if "probability" in one.dims else one):
        written += [picture] * save(lambda: bounds_figure(found, name).savefig(picture, dpi=120))
    header, rows = bounds_table(found, name)
    remark = found.attrs.get("surrogate_not_trusted")
    if as_json:
        content = {
            "title": title,
            "bounds": [dict(zip(header, row, strict=True)) for row in rows],
            "attrs": {str(k): v for k, v in found.attrs.items()},
            "written": [str(file) for file in written],
        }
        print_json(content)
        return
    print_table(title, (header, rows))
    lines = [f"Not reliable: {remark}"] if remark else []
    print_text("\n".join([*lines, *(f"Written: {file}" for file in written)]))


def bounds_table(found: xr.Dataset, name: str) -> tuple[list[str], list[list[str]]]:
    """Return the lowest and the highest bounds of each output, and their largest errors."""
    from flexband.report.tables import outputs_of, select  # noqa: PLC0415

    header = ["output", "probability", "lowest", "highest", "sampling error", "expected error"]
    rows: list[list[str]] = []
    for output in outputs_of(found[name]):
        one = select(found, output)
        unit = f" [{one['unit'].values}]" if "unit" in one.coords else ""
        several: Sequence[Any] = [None]
        if "probability" in one[name].dims:
            several = one["probability"].values.tolist()
        for p in several:
            own = one if p is None else one.sel(probability=p)
            errors = [
                f"{float(own[k].max()):.2g}" if k in own else ""
                for k in ("sampling_error", "expected_error")
            ]
            level = f"{found.attrs['probability']:g}" if p is None else f"{p:g}"
            ends = [f"{float(v):.5g}" for v in (own[name].min(), own[name].max())]
            rows.append([f"{output or 'response'}{unit}", level, *ends, *errors])
    return header, rows
