"""Models that other people run: points go out as a file, results come back as one."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from flexband.basics.checks import check_finite
from flexband.basics.response import Response
from flexband.basics.words import value_text
from flexband.errors import InputError


@dataclass(frozen=True)
class Elsewhere(Response):
    """A response that is not called: its runs come from a store."""

    names: tuple[str, ...]
    outputs: tuple[str, ...] | None = None
    times: tuple[float, ...] | None = None

    elsewhere = True  # a study raises `RunsNeeded` with the points that the store does not have

    @property
    def __signature__(self) -> inspect.Signature:
        kind = inspect.Parameter.KEYWORD_ONLY
        return inspect.Signature([inspect.Parameter(name, kind) for name in self.names])

    @property
    def labels(self) -> xr.DataArray:
        """No runs, with the dims and the coordinates of results."""
        coords: dict[str, Any] = {}
        if self.outputs is not None:
            coords["output"] = "output", list(self.outputs)
        if self.times is not None:
            coords["time"] = "time", np.array(self.times), {"units": "s"}
        shape = [0, *(len(coordinate[1]) for coordinate in coords.values())]
        return xr.DataArray(np.empty(shape), coords, ("sample", *coords))

    def __call__(self, **values: Any) -> NoReturn:
        """Raise `InputError`: there is nothing to call."""
        raise InputError(
            f"a response elsewhere cannot be called; got {value_text(values)}. Fields among its "
            "inputs "
            "need a domain"
        )


def elsewhere(
    *names: str, outputs: Sequence[str] | None = None, times: ArrayLike | None = None
) -> Elsewhere:
    """Return a response that other people run, on another machine or in a laboratory.

    `propagate` with a store raises `RunsNeeded` with the next points. `flexband export-points`
    writes them into a file, and `flexband import-results` records their results, until the method
    has what it needs.

    Parameters
    ----------
    names : of the inputs.
    outputs : names of the outputs; None for one without a name.
    times : of the results [s], if they are functions of time.

    Raises
    ------
    InputError
        If names are no identifiers, are not different, or times do not increase.

    Examples
    --------
    >>> import flexband as fb
    >>> response = fb.models.elsewhere("speed", "load", outputs=["force", "wear"])
    """
    for name in names:
        if not isinstance(name, str) or not name.isidentifier():
            raise InputError(f"names must be those of inputs; got {value_text(name)}")
    output_names = None if outputs is None else _texts(outputs)
    for group in (names, output_names or ()):
        if len(set(group)) < len(group):
            raise InputError(f"names must differ; got {value_text(group)}")
    if not names:
        raise InputError("names must be those of inputs; got none")
    if times is None:
        return Elsewhere(names, output_names)
    steps = check_finite("times [s]", times, rank=None)
    if steps.ndim != 1 or np.any(np.diff(steps) <= 0):
        raise InputError(f"times [s] must be numbers that increase; got {value_text(times)}")
    return Elsewhere(names, output_names, tuple(steps.tolist()))


def _texts(outputs: Any) -> tuple[str, ...]:
    array = isinstance(outputs, np.ndarray) and outputs.ndim == 1
    names = tuple(outputs) if array or isinstance(outputs, list | tuple) else ()
    if not names or not all(isinstance(name, str) and name for name in names):
        raise InputError(
            f"outputs must be names such as ['force', 'wear']; got {value_text(outputs)}"
        )
    return names
