"""What outputs do between the times of a response: a few runs at more times.

A motion is integrated in steps that may be much shorter than the time between two outputs. A
response tells of these times by a method `at_more_times`, which returns the same response at them,
or None if there are none.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from flexband.basics.warning import warn
from flexband.basics.words import number_of
from flexband.errors import InputError, RunError
from flexband.uncertainty.inputs.sampling import points_at_ends
from flexband.uncertainty.runs.counted_runs import CountedRuns
from flexband.uncertainty.surrogates.axes import axes_of
from flexband.uncertainty.surrogates.bands import BandRecord


def between_times(
    runs: CountedRuns, diagnostics: xr.Dataset, *, count: int = 8, seed: int = 0
) -> xr.Dataset:
    """Return by how much outputs leave the range of two neighbouring values, between their times.

    Parameters
    ----------
    runs : of the response, at whose times there are bands.
    diagnostics : of these; ``attrs["halved"]`` names what is finer than in the response.
    count : number of further runs, as many as are simulated at once: the nominal one, and others at
        the ends of all intervals, where most bounds are.
    seed : of the random inputs.

    Returns
    -------
    Variables with the dims of the outputs, from each time to the next: `above_between` and
    `below_between`, the largest of all runs, and `above_between_least` and `below_between_least`.
    ``attrs["runs_between"]`` counts the runs. Nothing, if nothing is known between the times.
    """
    space = runs.space
    labels = runs.labels
    assert labels is not None
    level = runs.start
    for name in BandRecord.read(diagnostics).halved or []:
        level = level.refinements()[name]
    response = level.of_nominal(level.response.at_more_times)
    if response is None:
        return xr.Dataset()
    xi, eta = points_at_ends(count, space.interval_dimension, space.families, seed)
    try:
        good_runs = runs.at_other_times(response, xi, eta)
        above, below = _beyond(good_runs, labels)
    except (RunError, InputError, MemoryError) as error:
        why = (str(error) or type(error).__name__).splitlines()[0]
        warn(f"what outputs do between their times is not known: {why}")
        return xr.Dataset()
    variables = {
        "above_between": above.max(axis=0), "above_between_least": above.min(axis=0),
        "below_between": below.max(axis=0), "below_between_least": below.min(axis=0),
    }  # fmt: skip
    dims = labels.dims[1:]
    data = {k: (dims, v) for k, v in variables.items()}
    return xr.Dataset(data, attrs={"runs_between": len(good_runs)})


def parts_between(values: xr.DataArray, labels: xr.DataArray) -> int:
    """Return into how many parts the times of some runs divide each step between those of others.

    Raise `InputError` if these are not as many everywhere.
    """
    if axes_of(labels).time is None:
        return 1
    count = labels.shape[-1]
    fine_count = values.shape[-1]
    parts = max(1, (fine_count - 1) // max(1, count - 1))
    if values.dims[1:] != labels.dims[1:] or parts * (count - 1) + 1 != fine_count:
        raise InputError(
            "at_more_times must divide each step between the response's times into as many; got "
            f"{number_of(fine_count, 'time')} for {count}"
        )
    return parts


def _beyond(values: xr.DataArray, labels: xr.DataArray) -> tuple[np.ndarray, np.ndarray]:
    """Return how far runs go above and below both neighbouring values, (runs, …, times).

    `values` are runs at more times; `labels` are those of the response.
    """
    count = labels.shape[-1]
    parts = parts_between(values, labels)
    at = values.values[..., ::parts]
    inner = values.values[..., :-1]
    inner = inner.reshape(*inner.shape[:-1], count - 1, parts)
    before = at[..., :-1]
    after = at[..., 1:]
    above = np.zeros(at.shape)
    below = np.zeros(at.shape)
    above[..., :-1] = np.maximum(inner.max(axis=-1) - np.maximum(before, after), 0.0)
    below[..., :-1] = np.maximum(np.minimum(before, after) - inner.min(axis=-1), 0.0)
    return above, below
