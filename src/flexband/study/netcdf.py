"""Datasets written as NetCDF files."""

from __future__ import annotations

from pathlib import Path

import xarray as xr


def write_netcdf(dataset: xr.Dataset, file: Path) -> None:
    """Write a dataset as a NetCDF file, which appears only once it is complete."""
    file.parent.mkdir(parents=True, exist_ok=True)
    partial = file.with_suffix(".partial")
    dataset.to_netcdf(partial, engine="scipy", format="NETCDF3_64BIT")
    partial.replace(file)
