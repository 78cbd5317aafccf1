"""The command that writes the runs of a study for other programs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flexband.basics.files import replace_file
from flexband.basics.words import number_of
from flexband.cli.application import app
from flexband.cli.folders import Folder
from flexband.cli.messages import UsageError, print_text, reported_errors
from flexband.errors import InputError

if TYPE_CHECKING:  # imported when a command is called
    import numpy as np
    import xarray as xr

    from flexband.execution.store import open_runs
    from flexband.study.exchange.columns import column_names, different, write_csv


@app.command()
@reported_errors()
def export(
    folder: Folder,
    to: Annotated[Path, typer.Option(help="File to write: .nc (NetCDF), .csv or .parquet.")],
) -> None:
    """Export the runs in FOLDER: inputs, status and outputs, one row per run.

    This also works while the study runs.
    """
    kinds = (".nc", ".csv", ".parquet")
    if to.suffix not in kinds:
        raise UsageError(f"--to must be a file whose name ends with {', '.join(kinds)}; got '{to}'")
    runs = open_runs(folder)
    if to.suffix == ".nc":
        from flexband.study.results.netcdf import write_netcdf  # noqa: PLC0415

        write_netcdf(in_plain_numbers(runs), to)
    elif to.suffix == ".csv":
        write_csv(
            to, header(runs), (row for block in blocks(runs) for row in zip(*block, strict=True))
        )
    else:
        write_parquet(runs, to)
    print_text(f"{number_of(runs.sizes.get('run', 0), 'run')}: {to}")


def header(runs: xr.Dataset) -> list[str]:
    """Return the names of the columns."""
    fixed_names = ["run", "status", "reason", "setting", "seconds", "finished"]
    outputs = column_names(runs["outputs"].rename(None)) if "outputs" in runs else []
    return different([*fixed_names, *map(str, runs["input"].values), *outputs])


def blocks(runs: xr.Dataset, size: int = 1024) -> Iterator[list[list]]:
    """Yield the columns of so many runs after the other."""
    meanings = runs["status"].attrs["flag_meanings"].split()
    for first in range(0, runs.sizes["run"], size):
        block = runs.isel(run=slice(first, first + size)).load()
        count = block.sizes["run"]
        finished = np.datetime_as_string(block["finished"].values.astype("M8[ms]"), timezone="UTC")
        columns: list[list] = [
            list(range(first, first + count)),
            [meanings[k] for k in block["status"].values],
            *(block[name].values.tolist() for name in ("reason", "setting", "seconds")),
            finished.tolist(),
            *block["inputs"].values.T.tolist(),
        ]
        if "outputs" in block:
            columns += block["outputs"].values.reshape(count, -1).T.tolist()
        yield columns


def in_plain_numbers(runs: xr.Dataset) -> xr.Dataset:
    """Return the runs without what NetCDF 3 does not have: dates become seconds since 1970."""
    dataset = runs.load()
    for name, variable in dataset.variables.items():
        if variable.dtype.kind == "T":
            texts = np.array(variable.values.tolist(), dtype=str)
            dataset[name] = variable.dims, texts, variable.attrs
        elif variable.dtype.kind == "M":
            seconds = variable.values.astype("M8[ns]").astype("int64") / 1e9
            dataset[name] = variable.dims, seconds, {"long_name": "seconds since 1970-01-01"}
        elif variable.dtype.kind == "m":
            dataset[name] = variable.dims, variable.values / np.timedelta64(1, "s"), {"units": "s"}
    return dataset


def write_parquet(runs: xr.Dataset, file: Path) -> None:
    """Write a Parquet file; raise `InputError` if pyarrow is missing."""
    try:
        import pyarrow as pa  # noqa: PLC0415  # pyright: ignore[reportMissingImports]
        import pyarrow.parquet as pq  # noqa: PLC0415  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise InputError(f"--to {file} requires pyarrow: pip install 'flexband[parquet]'") from None
    names = header(runs)
    parts = list(blocks(runs))
    columns = [[value for part in parts for value in part[k]] for k in range(len(names))]
    with replace_file(file) as partial:
        pq.write_table(pa.table(dict(zip(names, columns, strict=True))), partial)
