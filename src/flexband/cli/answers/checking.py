"""Limits that are checked by a surrogate, and the files with the result."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import xarray as xr

import flexband as fb
from flexband.cli.files import save


def check(
    surrogate: Any,
    limits: Sequence[fb.Limit],
    place: Path,
    *,
    sigmas: float = 3.0,
    **options: Any,
) -> tuple[xr.Dataset, xr.Dataset | None]:
    """Return whether limits are kept, and how likely they are left if all inputs can tell.

    Both are written into a folder: limits.nc, probability.nc and limits.png.

    Parameters
    ----------
    options : of `failure_probability`.
    """
    from flexband.report.figures import limits_figure  # noqa: PLC0415
    from flexband.report.results import write_netcdf  # noqa: PLC0415

    checked, probability = fb.check_limits(surrogate, limits, sigmas=sigmas), None
    spaces = [one.space for one in getattr(surrogate, "surrogates", {"": surrogate}).values()]
    if all(space.random_dimension for space in spaces):
        probability = fb.failure_probability(surrogate, limits, **options)
    save(lambda: write_netcdf(checked, place / "limits.nc"))
    if probability is not None:
        save(lambda: write_netcdf(probability, place / "probability.nc"))
    if checked["margin"].ndim <= 2:
        save(lambda: limits_figure(checked, probability).savefig(place / "limits.png", dpi=150))
    return checked, probability
