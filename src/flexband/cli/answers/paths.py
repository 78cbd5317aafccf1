"""The command that shows where a point can be."""

from __future__ import annotations

from typing import Annotated

import numpy as np
import typer

import flexband as fb
from flexband.cli.answers.saved import Json, Saved, one_of, saved
from flexband.cli.application import app
from flexband.cli.files import check_folder, write_figure
from flexband.cli.messages import print_json, print_text, reported_errors, usage
from flexband.files import try_write
from flexband.report.text.tables import deviations
from flexband.study.results.answers import answer_file


@app.command("path")
@reported_errors()
def path(
    folder: Saved,
    x: Annotated[str, typer.Argument(help="Output that is the first coordinate.")],
    y: Annotated[str, typer.Argument(help="Output that is the second coordinate.")],
    sigmas: Annotated[
        float | None, typer.Option(help="k of the error bar μ ± kσ.  [default: 1.0]")
    ] = None,
    probability: Annotated[
        float | None,
        typer.Option("--probability", "-p", help="Of the random inputs, instead of μ ± kσ."),
    ] = None,
    directions: Annotated[int, typer.Option(help="Directions, and vertices of a region.")] = 32,
    as_json: Json = False,
) -> None:
    """Show the path of a point, and the region in which it is at every time, without new runs.

    path.nc and path.png are written.
    """
    from flexband.report.plot.figures import path_figure  # noqa: PLC0415
    from flexband.study.results.netcdf import write_netcdf  # noqa: PLC0415

    surrogate, place = saved(folder)
    k = one_of(sigmas, probability, 1.0)
    with usage():
        regions = fb.path(
            surrogate, x, y, sigmas=k, probability=probability, directions=directions
        )  # fmt: skip
    check_folder(place)
    try_write(lambda: write_netcdf(regions, answer_file(place, "path")))
    try_write(lambda: write_figure(path_figure(regions), place / "path.png", dpi=120))
    radius = regions["radius"]
    widest, last = int(np.argmax(radius.values)), str(radius.dims[0])
    at = float(regions[last][widest]) if last in regions.coords else float(widest)
    error = float(regions["expected_error"].max()) if "expected_error" in regions else None
    if as_json:
        about = {"sigmas": k} if probability is None else {"probability": probability}
        content = {"largest_radius": float(radius[widest]), "at": at, "expected_error": error}
        print_json(content | about | {"directions": directions})
        return
    unit = f" {radius.attrs['units']}" if "units" in radius.attrs else ""
    inside = f"μ ± {deviations(regions)}"
    if probability is not None:
        inside = f"a box of probability {probability:g}"
    text = (
        f"Within {inside}, the point is at most {float(radius[widest]):.4g}{unit} from its nominal "
        f"path, at {last} {at:.4g}, by regions with {directions} vertices"
    )
    remark = f"; the largest expected error is {error:.2g}{unit}" if error is not None else ""
    print_text(f"{text}{remark}\nWritten: {answer_file(place, 'path')}")
