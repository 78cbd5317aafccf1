"""Vibrations that the start of a motion excites.

The nominal motion is compared with one that starts at rest, and whose time reaches its pace slowly.
Both follow the same drives and loads after half the time that this takes. What differs and
oscillates then is what the given start has excited: by strains that are not in equilibrium, or by
drives that move at full speed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray as xr

from flexband.analysis.selection import AnySurrogate, surrogates_of
from flexband.analysis.verification.expanded_runs import as_expanded
from flexband.basics.rounding import Units
from flexband.basics.warning import without_warnings
from flexband.errors import FlexbandWarning, InputError, RunError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from flexband.basics.response import Response
    from flexband.study.definition import StudyDefinition

PREFIX = "ringing_"
"""Of attributes of bands."""


class StartVibration(NamedTuple):
    """A vibration of an output that the start excites.

    Attributes
    ----------
    output : name of the output; "" where there is one only.
    frequency : [Hz].
    share : largest deviation from the motion without it, relative to the error bar's mean width.
    """

    output: str
    frequency: float
    share: float


def start_vibrations(
    study: StudyDefinition, surrogate: AnySurrogate, bands: xr.Dataset
) -> list[StartVibration]:
    """Return the vibrations of a nominal motion that its start excites, the largest first.

    There are none where the response is no simulation, or has no rest to start from.
    """
    case = next(iter(surrogates_of(surrogate).values()))
    values = case.space.arguments_at(*case.space.nominal())
    with without_warnings(FlexbandWarning):
        response = as_expanded(case, study.response)[0].source
        if response.started_softly(1.0) is None:
            return []
        try:
            motion = response(**values).isel(sample=0).sel(output=bands["output"].values)
            return _compare_starts(response, values, motion, bands)
        except (InputError, RunError):  # there is no rest, or no way from it
            return []


def _compare_starts(
    response: Response,
    values: Mapping[str, Any],
    motion: xr.DataArray,
    bands: xr.Dataset,
    *,
    parts: tuple[int, ...] = (40, 20, 10, 5),
    least_periods: float = 2.0,
    least_cycles: float = 4.0,
    least_share: float = 0.1,
) -> list[StartVibration]:
    """Compare a motion with slow starts that take these `parts` of the time, in turn.

    A vibration has `least_periods` in the slow start, which would excite it otherwise,
    `least_cycles` in the motion, and `least_share` of the error bar's mean width.
    """
    times = motion["time"].values
    step = times[1] - times[0]
    steps = len(times) - 1
    bar = bands["error_bar"].isel({d: 0 for d in bands["error_bar"].dims if d == "choice"})
    width = bar.sel(bound="upper") - bar.sel(bound="lower")
    width = width.mean([dim for dim in width.dims if dim != "output"]).values
    vibrations: dict[int, StartVibration] = {}
    sizes = abs(motion).max("time").values
    uncertain = set(np.flatnonzero(Units.along(motion, ["output"]).varies(width, sizes)).tolist())
    for half in dict.fromkeys(max(1, steps // (2 * part)) for part in parts):
        if uncertain <= vibrations.keys():
            break
        softly = response.started_softly(2 * half * step)
        assert softly is not None
        soft = softly(**values).isel(sample=0).sel(output=motion["output"].values)
        differences = (motion - soft.values).values[:, half:]
        for k in uncertain - vibrations.keys():
            share = float(np.abs(differences[k]).max() / width[k])
            frequency = _frequency(differences[k], step)
            if (
                share >= least_share
                and frequency * 2 * half * step >= least_periods
                and frequency * times[-1] >= least_cycles
            ):
                vibrations[k] = StartVibration(str(motion["output"].values[k]), frequency, share)
    return sorted(vibrations.values(), key=lambda vibration: -vibration.share)


def _frequency(values: np.ndarray, step: float) -> float:
    """Return the frequency at which values oscillate about zero [Hz]; 0 if they do not.

    It is the mean of their spectrum's peak. Half of the energy must be around it, or above.
    """
    count = 4 * len(values)
    energy = np.abs(np.fft.rfft(values, count)) ** 2
    peak = int(energy.argmax())
    if peak < 8 or energy[peak // 2 :].sum() < 0.5 * energy.sum():
        return 0.0
    around = slice(peak - 4, peak + 5)
    return float(np.average(np.fft.rfftfreq(count, step)[around], weights=energy[around]))


def attributes(vibrations: list[StartVibration]) -> dict[str, list[Any]]:
    """Return vibrations as attributes of bands; none if there are none."""
    columns = zip(StartVibration._fields, zip(*vibrations, strict=True), strict=False)
    return {f"{PREFIX}{name}": list(column) for name, column in columns}


def of_attributes(attrs: Mapping[str, Any]) -> list[StartVibration]:
    """Return the vibrations of the attributes of bands."""
    if f"{PREFIX}output" not in attrs:
        return []
    columns = [np.atleast_1d(attrs[PREFIX + k]).tolist() for k in ("output", "frequency", "share")]
    return [StartVibration(*row) for row in zip(*columns, strict=True)]
