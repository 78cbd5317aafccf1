"""Which share of sampled parts meets requirements."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from flexband.analysis.parts.estimates import share_of
from flexband.analysis.probability.failure import ANY
from flexband.analysis.requirements.production import with_yield
from flexband.analysis.requirements.requirement import Requirement, by_name


def margins_of(
    requirements: Sequence[Requirement], response: xr.DataArray, numbers: xr.DataArray
) -> np.ndarray:
    """Return the least margins of samples, (requirements, samples).

    Parameters
    ----------
    requirements : on outputs, or on numbers with the dim "quantity".
    """
    as_outputs, names = numbers.rename(quantity="output"), numbers["quantity"].values.tolist()
    margins = []
    for requirement in requirements:
        values = as_outputs if requirement.output in names else response
        inside = requirement.corridor(values).margin(values.values, values.values)
        margins.append(inside.reshape(len(values), -1).min(axis=1))
    return np.reshape(margins, (len(margins), len(numbers)))


def yields(
    requirements: Sequence[Requirement], margins: np.ndarray, confidence: float, lost: int
) -> xr.Dataset:
    """Return the variables of `production_yield` of samples, of which some are lost."""
    names = list(by_name(requirements))
    if len(names) > 1:
        margins, names = np.vstack([margins, margins.min(axis=0)]), [*names, ANY]
    count = margins.shape[1]
    shares = [share_of(int(np.sum(row < 0)), count, confidence, lost) for row in margins]
    ends = dict(zip(("failing", "failing_low", "failing_high"), np.transpose(shares), strict=True))
    data = {name: ("limit", values) for name, values in ends.items()}
    return with_yield(xr.Dataset(data, {"limit": names}, {"confidence": confidence}))
