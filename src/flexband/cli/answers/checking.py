"""Limits that are checked by a surrogate, and the files with the result."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import xarray as xr

import flexband as fb
from flexband.cli.files import draw, save
from flexband.cli.messages import print_remark
from flexband.uncertainty.answers.allocation.adjustment import compensators
from flexband.uncertainty.answers.selection import surrogates_of

OF_STUDY = "the study"
"""Attribute "of" of limits.nc: whose limits these are."""


def has_limits_of_study(place: Path) -> bool:
    """Return whether the limits that were checked in a folder are those of its study.

    Raise `InputError` if the file is not as written.
    """
    from flexband.report.results import read_netcdf  # noqa: PLC0415

    try:
        return read_netcdf(place / "limits.nc").attrs.get("of") == OF_STUDY
    except FileNotFoundError:
        return False


def has_probability(surrogate: Any) -> bool:
    """Return whether leaving limits has a probability: inputs scatter, and none is adjusted."""
    spaces = [one.space for one in surrogates_of(surrogate).values()]
    return all(space.random_dimension and not compensators(space) for space in spaces)


def check(
    surrogate: Any,
    limits: Sequence[fb.Limit],
    place: Path,
    *,
    of_study: bool = True,
    sigmas: float = 3.0,
    **options: Any,
) -> tuple[xr.Dataset, xr.Dataset | None]:
    """Return whether limits are kept, and how likely they are left if all inputs can tell.

    Both are written into a folder: limits.nc, probability.nc and limits.png. Limits that are not of
    the study never take the place of those that are, since the report shows what is there.

    Parameters
    ----------
    of_study : whether the limits are those of the study.
    options : of `failure_probability`.
    """
    from flexband.report.figures import limits_figure  # noqa: PLC0415
    from flexband.report.results import write_netcdf  # noqa: PLC0415

    checked, probability = fb.check_limits(surrogate, limits, sigmas=sigmas), None
    kept = of_study or not has_limits_of_study(place)
    if kept:
        checked.attrs["of"] = OF_STUDY if of_study else "a question"
        save(lambda: write_netcdf(checked, place / "limits.nc"))
    if has_probability(surrogate):
        probability = fb.failure_probability(surrogate, limits, **options)
    if not kept:
        print_remark("the report keeps the limits of the study; others must be in its `limits`")
        return checked, probability
    if probability is not None:
        save(lambda: write_netcdf(probability, place / "probability.nc"))
    else:
        (place / "probability.nc").unlink(missing_ok=True)
    figure = place / "limits.png"
    draw(lambda: limits_figure(checked, probability), figure, wanted=checked["margin"].ndim <= 2)
    return checked, probability
