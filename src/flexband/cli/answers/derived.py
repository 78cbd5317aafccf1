"""The command that bounds quantities made of outputs, such as the largest value of a motion."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import Annotated, Any

import typer
import xarray as xr

import flexband as fb
from flexband.analysis.selection import labels_of
from flexband.cli.answers.saved import Json, Saved, Sigmas, saved
from flexband.cli.application import app
from flexband.cli.files import check_folder, draw
from flexband.cli.messages import (
    UsageError,
    print_json,
    print_table,
    print_text,
    reported_errors,
    usage,
)
from flexband.files import try_write
from flexband.study.results.answers import answer_file
from flexband.uncertainty.surrogates.axes import axes_of, names_of_outputs


class Quantity(StrEnum):
    """What is made of an output."""

    peak = "peak"
    trough = "trough"
    peak_time = "peak-time"
    rms = "rms"
    spectrum = "spectrum"


KINDS = {
    Quantity.peak: fb.Peak,
    Quantity.trough: fb.Trough,
    Quantity.peak_time: fb.PeakTime,
    Quantity.rms: fb.RootMeanSquare,
    Quantity.spectrum: fb.Spectrum,
}


@app.command("derived")
@reported_errors()
def derived(
    folder: Saved,
    quantity: Annotated[Quantity, typer.Argument(help="What is made of the output.")],
    output: Annotated[
        list[str] | None,
        typer.Argument(
            help="Name of the output; of two, that of their magnitude. A response with one output "
            "needs none."
        ),
    ] = None,
    sigmas: Sigmas = 1.0,
    probability: Annotated[
        float, typer.Option("--probability", "-p", help="Of the values in the range.")
    ] = 0.99,
    samples: Annotated[int, typer.Option(help="Samples of the random inputs.")] = 2048,
    seed: Annotated[int, typer.Option(help="Seed of the samples.")] = 0,
    as_json: Json = False,
) -> None:
    """Bound the largest value of an output over time, or another quantity made of it.

    No runs are made. derived.nc is written, and derived.png of a spectrum.
    """
    from flexband.report.page.answers import derived_table  # noqa: PLC0415
    from flexband.report.plot.figures import derived_figure  # noqa: PLC0415
    from flexband.study.results.netcdf import write_netcdf  # noqa: PLC0415

    surrogate, place = saved(folder)
    made_of = _output(output or [], labels_of(surrogate))
    with usage():
        bounds = fb.derived(
            surrogate, KINDS[quantity](made_of), sigmas=sigmas, probability=probability,
            samples=samples, seed=seed,
        )  # fmt: skip
    check_folder(place)
    try_write(lambda: write_netcdf(bounds, answer_file(place, "derived")))
    figure = place / "derived.png"
    draw(lambda: derived_figure(bounds), figure, wanted=bounds["range"].ndim == 2)
    if as_json:
        names = ("mean", "error_bar", "range")
        ends = {k: [float(bounds[k][0].min()), float(bounds[k][1].max())] for k in names}
        errors = {k: float(bounds[k].max()) for k in map(str, bounds) if k.endswith("_error")}
        print_json(ends | errors | {str(k): v for k, v in bounds.attrs.items()})
        return
    unit = bounds["mean"].attrs.get("units")
    name = " and ".join(output or ["the response"])
    title = f"{quantity.value} of {name}" + (f" [{unit}]" if unit else "")
    print_table(title, derived_table(bounds))
    print_text(f"Written: {place / 'derived.nc'}")


def _output(names: list[str], labels: xr.DataArray) -> Any:
    """Return what a quantity is made of: an output, the magnitude of two, None for the only one."""
    if len(names) > 2:
        raise UsageError(f"derived takes one output, or two; got {', '.join(names)}")
    if len(names) == 2:
        return fb.Magnitude(names[0], names[1])
    if not names and math.prod(axes_of(labels).shape) > 1:
        allowed = ", ".join(names_of_outputs(labels))
        if "output" not in labels.coords:
            allowed = 'name them by the labels of a dim "output" of a DataArray'
        raise UsageError(f"derived takes one of several outputs: {allowed}; got none")
    return names[0] if names else None
