"""The command that bounds quantities made of outputs, such as the largest value of a motion."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

import flexband as fb
from flexband.cli.answers.frame import CommandOutput, Samples, Seed, Sigmas, answer_command
from flexband.cli.answers.saved_result import SavedResult
from flexband.cli.messages import UsageError, usage

if TYPE_CHECKING:  # imported when a command is called
    import xarray as xr

    from flexband.analysis.selection import labels_of
    from flexband.basics.rounding import unit_of_variable
    from flexband.report.page.answers import derived_table
    from flexband.report.plot.figures import derived_figure
    from flexband.study.presentation.display import ONLY_OUTPUT, Display, names_and_units
    from flexband.uncertainty.surrogates.axes import axes_of, names_of_outputs


class Quantity(StrEnum):
    """What is made of an output."""

    peak = "peak"
    trough = "trough"
    peak_time = "peak-time"
    rms = "rms"
    spectrum = "spectrum"


@answer_command("derived")
def derived(
    result: SavedResult,
    quantity: Annotated[Quantity, typer.Argument(help="Quantity to compute.")],
    output: Annotated[
        list[str] | None,
        typer.Argument(
            help="Output, or two outputs for their magnitude. Not needed if the response has only "
            "one."
        ),
    ] = None,
    period: Annotated[
        float | None,
        typer.Option(help="Length of a turn, such as 360 for degrees; gives one number per turn."),
    ] = None,
    sigmas: Sigmas = 1.0,
    probability: Annotated[
        float,
        typer.Option("--probability", "-p", help="Probability of the values within the range."),
    ] = 0.99,
    samples: Samples = 2048,
    seed: Seed = 0,
) -> CommandOutput:
    """Bound the peak of an output, or another quantity computed from it.

    No runs are made. derived.nc is written, and derived.png for a spectrum.
    """
    surrogate = result.surrogate
    made_of = _output(output or [], labels_of(surrogate))
    kinds = {
        Quantity.peak: fb.analysis.Peak,
        Quantity.trough: fb.analysis.Trough,
        Quantity.peak_time: fb.analysis.PeakTime,
        Quantity.rms: fb.analysis.RootMeanSquare,
        Quantity.spectrum: fb.analysis.Spectrum,
    }
    with usage():
        bounds = fb.analysis.derived(
            surrogate, kinds[quantity](made_of, period), sigmas=sigmas, probability=probability,
            samples=samples, seed=seed,
        )  # fmt: skip
    names = ("mean", "error_bar", "range")
    ends = {k: [float(bounds[k][0].min()), float(bounds[k][1].max())] for k in names}
    errors = {k: float(bounds[k].max()) for k in map(str, bounds) if k.endswith("_error")}
    bounds = _with_output(bounds, output or [], labels_of(surrogate), result.display)
    display_bounds = result.display.data(bounds)
    unit = unit_of_variable(display_bounds["mean"])
    name = " and ".join(output or ["the response"])
    title = f"{quantity.value} of {name}" + (f" [{unit}]" if unit else "")
    turns = [display_bounds.isel(turn=k) for k in range(display_bounds.sizes.get("turn", 0))]
    tables = [(f"{title}, turn {k + 1}", derived_table(turn)) for k, turn in enumerate(turns)]
    return CommandOutput(
        ends | errors | {str(k): v for k, v in bounds.attrs.items()},
        tables or [(title, derived_table(display_bounds))],
        name="derived",
        data=bounds,
        figure=lambda: derived_figure(display_bounds),
        drawable=bounds["range"].ndim == 2 and not turns,
    )


def _output(names: list[str], labels: xr.DataArray) -> str | fb.analysis.Magnitude | None:
    """Return what a quantity is made of: an output, the magnitude of two, None for the only one."""
    if len(names) > 2:
        raise UsageError(f"derived takes one output, or two; got {', '.join(names)}")
    if len(names) == 2:
        return fb.analysis.Magnitude(names[0], names[1])
    if not names and math.prod(axes_of(labels).shape) > 1:
        allowed = ", ".join(names_of_outputs(labels))
        if "output" not in labels.coords:
            allowed = 'name them by the labels of a dim "output" of a DataArray'
        raise UsageError(f"derived takes one of several outputs: {allowed}; got none")
    return names[0] if names else None


def _with_output(
    bounds: xr.Dataset, names: list[str], labels: xr.DataArray, display: Display
) -> xr.Dataset:
    """Return bounds with the output whose unit and display unit they have, if they have these."""
    units = names_and_units(labels)
    outputs = [name or ONLY_OUTPUT for name in names or [""]]
    computed_units = {units.get(output) for output in outputs}
    display_units = {display.display_units.get(output) for output in outputs}
    unit = unit_of_variable(bounds["mean"])
    if not unit or computed_units != {unit} or len(display_units) > 1:
        return bounds
    return bounds.assign_coords(output=outputs[0], unit=unit)
