"""The commands that rank the inputs: by what they widen, and by what they scatter."""

from __future__ import annotations

from collections.abc import Callable
from math import isnan
from typing import TYPE_CHECKING, Annotated

import typer

import flexband as fb
from flexband.cli.answers.frame import CommandOutput, Sigmas, answer_command
from flexband.cli.answers.saved_result import SavedResult
from flexband.cli.messages import Table, usage

if TYPE_CHECKING:  # imported when a command is called
    import numpy as np
    import xarray as xr

    from flexband.analysis.labelled_answers import AnswerRecord
    from flexband.analysis.selection import surrogates_of
    from flexband.report.page.answers import only_one
    from flexband.report.page.inputs import mean_share_text
    from flexband.report.plot.figures import bounds_figure, contributions_figure
    from flexband.report.text.band_tables import CONSTANT, deviations, outputs_of, select
    from flexband.report.text.drawable import drawable_outputs
    from flexband.report.text.numbers import percent_to_tenth


@answer_command("contributions")
def contributions(
    result: SavedResult,
    sigmas: Sigmas = 1.0,
    shapley: Annotated[
        bool, typer.Option(help="Use Shapley values, which add up to the width.")
    ] = False,
) -> CommandOutput:
    """Rank the inputs by how much they widen the error bar, without further runs.

    With --shapley, the contributions of all inputs add up to the whole width; that allows at most
    eight inputs. contributions.nc and contributions.png are written.
    """
    with usage():
        data = fb.analysis.contributions(result.surrogate, sigmas=sigmas, shapley=shapley)
    ranking = data
    kinds = ["mean_share", "share_at_widest"]
    drawn = "contribution"
    title = f"How much narrower μ ± {deviations(ranking)} is with the input at its nominal value"
    if shapley:
        kinds = [f"shapley_{kind}" for kind in kinds]
        drawn = "shapley"
        title = f"Parts of the width of μ ± {deviations(ranking)} by Shapley's values"
        share = ranking[kinds[0]]
        largest = share.max([dim for dim in share.dims if dim != "name"]).values
        ranking = ranking.isel(name=np.argsort(-largest, kind="stable"))
    names = [str(name) for name in ranking["name"].values]
    shares = {kind: _by_output(ranking[kind].where(ranking["varies"])) for kind in kinds}
    mean, widest = shares.values()
    averaged = mean_share_text(ranking).removeprefix(", ")
    parts = {averaged: mean}
    if averaged:
        parts["where the bar is widest"] = widest
    return CommandOutput(
        {"sigmas": sigmas, "inputs": names, **shares},
        _tables(title, names, parts, _part),
        name="contributions",
        data=data,
        figure=lambda: contributions_figure(result.display.data(ranking), drawn),
        drawable=bool(averaged),
    )


def _part(share: float) -> str:
    """Return a part of the width; NaN is that of an output without any."""
    return CONSTANT if isnan(share) else percent_to_tenth(share)


def _tables(
    title: str, names: list[str], parts: dict[str, dict], cell: Callable
) -> list[tuple[str, Table]]:
    """Return what parts, (kind of number, output, inputs), tell: one table, or one of each kind."""
    outputs = list(next(iter(parts.values())))
    if len(outputs) == 1 and len(parts) > 1:
        columns = {kind: by_output[outputs[0]] for kind, by_output in parts.items()}
        tables = {title: columns}
    else:
        tables = {
            f"{title}, {kind}".rstrip(", "): {of or "response": by_output[of] for of in outputs}
            for kind, by_output in parts.items()
        }
    titled_tables = []
    for heading, columns in tables.items():
        cells = ([cell(part) for part in column] for column in columns.values())
        rows = list(map(list, zip(names, *cells, strict=True)))
        titled_tables.append((heading, (["input", *columns], rows)))
    return titled_tables


def _by_output(share: xr.DataArray) -> dict[str, list[float]]:
    """Return the shares of all inputs, by the output's name."""
    others = [dim for dim in share.dims if dim != "name"]
    flat = share.transpose("name", *others).values.reshape(share.sizes["name"], -1)
    labels = share.stack(own=others)["own"].values if others else [""]
    names = [
        ", ".join(map(str, label)) if isinstance(label, tuple) else str(label) for label in labels
    ]
    return {name: flat[:, k].tolist() for k, name in enumerate(names)}


@answer_command("sobol")
def sobol(result: SavedResult) -> CommandOutput:
    """Rank the random inputs by their Sobol' indices, without further runs.

    Each index is a fraction of the variance at the time at which σ is largest, printed with its
    lowest and highest value over the interval inputs. sobol.nc and sobol.png have the indices at
    all times.
    """
    indices = fb.analysis.sobol_indices(result.surrogate)
    outputs_to_draw = indices["defined"].ndim and drawable_outputs(indices["total"].isel(name=0))
    names = [str(name) for name in indices["name"].values]
    kinds = ("first_order", "total")
    ends = {
        kind: {
            output: _where_widest(select(indices[kind], output), select(indices["std"], output))
            for output in outputs_of(indices["defined"])
        }
        for kind in kinds
    }
    where = ", where it is largest" if indices["defined"].ndim else ""
    spaces = [case_surrogate.space for case_surrogate in surrogates_of(result.surrogate).values()]
    intervals = any(space.interval_dimension for space in spaces)
    span = "; lowest to highest for any values of the interval inputs" if intervals else ""
    title = f"Part of the variance due to each random input{where}{span}"
    parts = {"alone": ends["first_order"], "with interactions": ends["total"]}
    remarks = [indices.attrs[k] for k in ("sampling", "undefined") if k in indices.attrs]
    alone = len(names) == 1
    return CommandOutput(
        {"inputs": names, **ends, "undefined": AnswerRecord.read(indices).undefined},
        [] if alone else _tables(title, names, parts, _from_to),
        only_one(indices) if alone else "\n".join(remarks),
        name="sobol",
        data=indices,
        figure=lambda: bounds_figure(indices, "total"),
        drawable=bool(outputs_to_draw),
    )


def _where_widest(index: xr.DataArray, std: xr.DataArray) -> list[list[float]]:
    """Return the lower and the upper index of every input where σ is largest."""
    if std.ndim:
        index = index.isel({dim: int(k) for dim, k in std.argmax(...).items()})
    return index.transpose("name", "bound").values.tolist()


def _from_to(ends: list[float]) -> str:
    if any(map(isnan, ends)):
        return "no variance"
    return f"{100 * ends[0]:.1f} to {100 * ends[1]:.1f} %"
