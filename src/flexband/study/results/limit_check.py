"""Whether limits are kept, as the folder of a study has it."""

from __future__ import annotations

from typing import NamedTuple

import xarray as xr

OF_STUDY, OF_QUESTION = "the study", "a question"
"""Values of attribute "of" of limits.nc: whose limits these are."""


class LimitCheck(NamedTuple):
    """Whether limits are kept.

    Attributes
    ----------
    margins : result of `check_limits`.
    probability : result of `failure_probability`; None where inputs are intervals only, or
        adjusted, and where the yield is that of sampled parts.
    written : whether they were written: limits of a question never replace those of the study.
    production : result of `production_yield`; None where no scatter of the tolerances is known.
    """

    margins: xr.Dataset
    probability: xr.Dataset | None
    written: bool
    production: xr.Dataset | None = None
