"""The commands that answer questions by the surrogate of a study."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
import xarray as xr

import flexband as fb
from flexband.cli.application import app
from flexband.cli.files import check_folder, save
from flexband.cli.messages import print_json, print_table, print_text, reported_errors
from flexband.errors import InputError
from flexband.uncertainty.answers.probability.texts import told

Saved = Annotated[Path, typer.Argument(help="Folder of a study, or a saved surrogate (.npz).")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON.")]
Sigmas = Annotated[float, typer.Option(help="k of the error bar μ ± kσ.")]
Side = Annotated[
    list[str] | None,
    typer.Option(help="OUTPUT=NUMBER, or a number if there is one output; can be repeated."),
]


@app.command("limits")
@reported_errors()
def limits(
    folder: Saved,
    below: Side = None,
    above: Side = None,
    during: Annotated[
        tuple[float, float] | None, typer.Option(help="First and last time of the limits.")
    ] = None,
    sigmas: Sigmas = 3.0,
    accuracy: Annotated[
        float, typer.Option(help="Relative standard error of probabilities.")
    ] = 0.025,
    seed: Annotated[int, typer.Option(help="Seed of the random numbers.")] = 0,
    as_json: Json = False,
) -> None:
    """Check whether outputs keep limits, and how likely they leave them, without new runs.

    The margin is that of μ ± kσ for all values of the interval inputs; the probability is that of
    leaving a limit at any time. limits.nc, probability.nc and limits.png are written.
    """
    from flexband.report.answers.limits import limits_figure  # noqa: PLC0415
    from flexband.report.results import write_netcdf  # noqa: PLC0415

    surrogate, place = saved(folder)
    wanted = limits_of(below or [], above or [], during)
    checked, probability = fb.check_limits(surrogate, wanted, sigmas=sigmas), None
    spaces = [one.space for one in getattr(surrogate, "surrogates", {"": surrogate}).values()]
    if all(space.random_dimension for space in spaces):
        probability = fb.failure_probability(surrogate, wanted, accuracy=accuracy, seed=seed)
    check_folder(place)
    save(lambda: write_netcdf(checked, place / "limits.nc"))
    if probability is not None:
        save(lambda: write_netcdf(probability, place / "probability.nc"))
    if checked["margin"].ndim <= 2:
        save(lambda: limits_figure(checked, probability).savefig(place / "limits.png", dpi=150))
    if as_json:
        print_json({"limits": as_rows(checked), "probability": as_rows(probability)})
        return
    print_table("Limits", table(checked, probability))
    told_of = [checked.attrs["verdict"]]
    told_of += [] if probability is None else [probability.attrs["verdict"]]
    print_text("\n".join(told_of))


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


def saved(folder: Path) -> tuple[Any, Path]:
    """Return a surrogate, and the folder for what is computed from it."""
    file = folder / "surrogate.npz" if folder.is_dir() else folder
    if not file.is_file():
        raise InputError(
            "the argument must be a folder with a surrogate.npz, which `flexband run` writes for "
            f"methods that expand the response, or such a file; got '{folder}'"
        )
    return fb.load_surrogate(file), file.parent


def limits_of(
    below: list[str], above: list[str], during: tuple[float, float] | None
) -> list[fb.Limit]:
    """Return one limit per output; raise `InputError` if a text is not OUTPUT=NUMBER."""
    sides: dict[str | None, dict[str, float]] = {}
    for side, texts in (("below", below), ("above", above)):
        for text in texts:
            name, _, number = text.rpartition("=")
            try:
                value = float(number)
            except ValueError:
                raise InputError(f"--{side} must be OUTPUT=NUMBER; got {text!r}") from None
            own = sides.setdefault(name or None, {})
            if side in own:
                raise InputError(f"--{side} must be given once for {name or 'the output'}")
            own[side] = value
    if not sides:
        raise InputError("limits requires --below or --above, as in --below F_X=345")
    return [fb.Limit(name, during=during, **own) for name, own in sides.items()]


def table(checked: xr.Dataset, probability: xr.Dataset | None) -> tuple[list[str], list[list[str]]]:
    """Return one row per limit: verdict, least margin, and the probability of leaving it."""
    header = ["limit", "verdict", "least margin", "expected error"]
    every = checked if probability is None else probability
    if probability is not None:
        header += ["probability, lower", "upper"]
    rows = []
    for k, name in enumerate(every["limit"].values.tolist()):
        row = [name, "", "", ""]
        if k < checked.sizes["limit"]:
            one = checked.isel(limit=k)
            numbers = [f"{float(one[v]):.4g}" for v in ("least_margin", "least_margin_error")]
            row = [name, str(one["verdict"].values), *numbers]
        if probability is not None:
            row += [told(probability.isel(limit=k, bound=b)) for b in range(2)]
        rows.append(row)
    return header, rows


def as_rows(result: xr.Dataset | None) -> Any:
    """Return attributes and the variables that do not depend on time, as plain data."""
    if result is None:
        return None
    dims = {"limit", "bound", "input"}
    own = {str(k): v.values.tolist() for k, v in result.variables.items() if set(v.dims) <= dims}
    return own | {str(k): v for k, v in result.attrs.items()}


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
