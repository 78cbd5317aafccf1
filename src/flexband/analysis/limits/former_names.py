"""The former name of `check_requirements`, which works for one release."""

from __future__ import annotations

import xarray as xr

from flexband.analysis.limits.margins import check_requirements
from flexband.analysis.selection import AnySurrogate
from flexband.basics.former_names import warn_of_former_name
from flexband.requirements.requirement import Requirements


def check_limits(
    surrogate: AnySurrogate, limits: Requirements, *, sigmas: float | None = None
) -> xr.Dataset:
    """Return what `check_requirements` does; use that itself."""
    former, new = "check_limits", "check_requirements"
    warn_of_former_name(f"flexband.analysis.{former}", f"flexband.analysis.{new}")
    return check_requirements(surrogate, limits, sigmas=sigmas)
