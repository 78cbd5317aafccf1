"""The command that shows where a point can be."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

import flexband as fb
from flexband.cli.answers.frame import CommandOutput, SomeSigmas, answer_command, one_of
from flexband.cli.answers.saved_result import SavedResult
from flexband.cli.messages import usage

if TYPE_CHECKING:  # imported when a command is called
    import numpy as np

    from flexband.report.plot.figures import path_figure
    from flexband.report.text.band_tables import deviations


@answer_command("path")
def path(
    result: SavedResult,
    x: Annotated[str, typer.Argument(help="Output with the first coordinate.")],
    y: Annotated[str, typer.Argument(help="Output with the second coordinate.")],
    sigmas: SomeSigmas = None,
    probability: Annotated[
        float | None,
        typer.Option(
            "--probability", "-p", help="Probability of the random inputs, instead of μ ± kσ."
        ),
    ] = None,
    directions: Annotated[
        int, typer.Option(help="Number of directions, and of vertices of each region.")
    ] = 32,
) -> CommandOutput:
    """Bound the path of a point by a region at every time, without further runs.

    path.nc and path.png are written.
    """
    k = one_of(sigmas, probability, 1.0)
    with usage():
        regions = fb.analysis.path(
            result.surrogate, x, y, sigmas=k, probability=probability, directions=directions
        )  # fmt: skip
    display_regions = result.display.data(regions)
    radius = display_regions["radius"]
    widest = int(np.argmax(radius.values))
    last = str(radius.dims[0])
    at = float(regions[last][widest]) if last in regions.coords else float(widest)
    error = (
        float(display_regions["expected_error"].max())
        if "expected_error" in display_regions
        else None
    )
    about = {"sigmas": k} if probability is None else {"probability": probability}
    content = {"largest_radius": float(radius[widest]), "at": at, "expected_error": error}
    unit = f" {radius.attrs['units']}" if "units" in radius.attrs else ""
    inside = f"μ ± {deviations(regions)}"
    if probability is not None:
        inside = f"a box of probability {probability:g}"
    text = (
        f"Within {inside}, the point is at most {float(radius[widest]):.4g}{unit} from its nominal "
        f"path, at {last} {at:.4g}, by regions with {directions} vertices"
    )
    remark = f"; the largest estimated error is {error:.2g}{unit}" if error is not None else ""
    return CommandOutput(
        content | about | {"directions": directions},
        text=f"{text}{remark}",
        name="path",
        data=regions,
        figure=lambda: path_figure(display_regions),
    )
