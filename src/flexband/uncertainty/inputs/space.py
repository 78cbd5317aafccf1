"""The space of standard variables of all inputs, and the response as a function on it."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from flexband.errors import InputError
from flexband.uncertainty.expansions.hybrid import tensor_points
from flexband.uncertainty.inputs.inputs import FunctionOfPosition, Input, Interval, RandomField

Response = Callable[..., Any]
"""``response(**values)``: one array of shape (n,) an input, or a function of position for a field;
returns an array of shape (n, ...)."""


@dataclass(frozen=True)
class Space:
    """Named inputs and their standard variables, in order."""

    inputs: Mapping[str, Input]

    @property
    def random_dimension(self) -> int:
        """Number n of variables ξ."""
        return sum(i.dimension for i in self.inputs.values() if i.random)

    @property
    def interval_dimension(self) -> int:
        """Number m of variables η."""
        return sum(i.dimension for i in self.inputs.values() if not i.random)

    @property
    def intervals(self) -> dict[str, Interval]:
        """The interval inputs."""
        return {k: i for k, i in self.inputs.items() if isinstance(i, Interval)}

    def values(self, xi: np.ndarray, eta: np.ndarray) -> dict[str, np.ndarray | FunctionOfPosition]:
        """Return the inputs' values for ξ of shape (runs, n) and η of shape (runs, m)."""
        columns = {True: 0, False: 0}
        values = {}
        for name, one in self.inputs.items():
            first = columns[one.random]
            columns[one.random] += one.dimension
            standard = xi if one.random else eta
            values[name] = one.value(standard[:, first : first + one.dimension])
        return values

    def standardized(self, values: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
        """Return ξ and η of the inputs' values, shapes (runs, n) and (runs, m).

        Parameters
        ----------
        values : of every input by name, shape (runs,) or one number; of a random field its standard
            variables, shape (runs, terms).

        Raises
        ------
        InputError
            Where names are not those of the inputs, shapes do not fit or a value cannot be.
        """
        if values.keys() != self.inputs.keys():
            raise InputError(
                f"values must be given for {', '.join(self.inputs) or 'nothing'}; "
                f"got {', '.join(values) or 'nothing'}"
            )
        columns: dict[bool, list[np.ndarray]] = {True: [], False: []}
        for name, one in self.inputs.items():
            try:
                columns[one.random].append(one.standard(np.asarray(values[name], dtype=float)))
            except (InputError, ValueError, TypeError) as error:
                raise InputError(f"{name}: {error}") from None
            if not np.isfinite(columns[one.random][-1]).all():
                raise InputError(f"{name}: values must be finite; got {values[name]}")
        counts = {len(c) for own in columns.values() for c in own} - {1}
        if len(counts) > 1:
            raise InputError(f"values must be equally many; got {sorted(counts)}")
        runs = counts.pop() if counts else 1
        xi, eta = (
            np.concatenate(
                [np.zeros((runs, 0)), *(np.broadcast_to(c, (runs, c.shape[1])) for c in own)],
                axis=1,
            )
            for own in (columns[True], columns[False])
        )
        return xi, eta


def check_names(response: Response, inputs: Mapping[str, Input]) -> None:
    """Raise `InputError` where the response's arguments and the inputs do not match."""
    if not inputs:
        raise InputError("inputs must name at least one input; got none")
    for name, one in inputs.items():
        if not callable(getattr(one, "value", None)):
            raise InputError(
                f"input {name!r} must be an Interval, a Normal, a Uniform or a RandomField; "
                f"got {one!r}"
            )
    parameters = inspect.signature(response).parameters.values()
    open_ended = any(p.kind is p.VAR_KEYWORD for p in parameters)
    named = {p.name: p for p in parameters if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)}
    unknown = [name for name in inputs if name not in named]
    if unknown and not open_ended:
        raise InputError(
            f"inputs name {', '.join(unknown)}, which the response does not take; "
            f"it takes {', '.join(named) or 'nothing'}"
        )
    missing = [n for n, p in named.items() if p.default is p.empty and n not in inputs]
    if missing:
        raise InputError(f"the response needs {', '.join(missing)}, which inputs do not name")


def locate_fields(response: Response, inputs: Mapping[str, Input]) -> tuple[dict[str, Input], int]:
    """Give fields without a domain the positions that the response asks them for.

    The response is run with random inputs at their means and intervals at all their ends (at the
    ends of one at a time where there are more than four). Returns the inputs and the number of
    runs it took, 0 where every field has its domain.

    Raises
    ------
    InputError
        Where the response asks a field for no two positions.
    """
    loose = {
        name: one
        for name, one in inputs.items()
        if isinstance(one, RandomField) and one.domain is None
    }
    if not loose:
        return dict(inputs), 0
    asked: dict[str, list[np.ndarray]] = {name: [] for name in loose}

    def nominal(name: str, mean: float) -> FunctionOfPosition:
        def value(x: np.ndarray) -> np.ndarray:
            asked[name].append(np.asarray(x))
            return np.full(np.atleast_2d(x).shape, mean)

        return value

    given = Space({name: one for name, one in inputs.items() if name not in loose})
    m = given.interval_dimension
    ends = np.array([-1.0, 1.0])
    eta = tensor_points([ends] * m) if m <= 4 else np.concatenate([np.eye(m), -np.eye(m)])
    values = given.values(np.zeros((len(eta), given.random_dimension)), eta)
    response(**values, **{name: nominal(name, one.mean) for name, one in loose.items()})
    located = dict(inputs)
    for name, one in loose.items():
        places = np.concatenate([x.ravel() for x in asked[name]] or [np.zeros(1)])
        if np.ptp(places) == 0:
            raise InputError(f"{name}: RandomField needs a domain; the response asks for no range")
        located[name] = one.on((float(places.min()), float(places.max())))
    return located, len(eta)


def evaluate(
    response: Response,
    space: Space,
    xi: np.ndarray,
    eta: np.ndarray,
    batch: int,
    progress: Callable[[int], object],
) -> xr.DataArray:
    """Return the response at all points, dims (sample, ...), in batches of runs.

    Raises
    ------
    InputError
        Where the response returns no numbers of shape (n, ...), or NaN.
    """
    collected = None
    for first in range(0, len(xi), batch):
        here = slice(first, min(first + batch, len(xi)))
        values = space.values(xi[here], eta[here])
        part = _labelled(response(**values), here.stop - first, values)
        if collected is None:
            empty = np.empty((len(xi), *part.shape[1:]))
            coords = {k: c for k, c in part.coords.items() if "sample" not in c.dims}
            collected = xr.DataArray(empty, dims=part.dims, coords=coords)
        collected[here] = part.values
        progress(here.stop - first)
    assert collected is not None  # a design has at least one point
    return collected


def _labelled(result: Any, runs: int, values: dict) -> xr.DataArray:
    """Return a response as a `DataArray` with first dim "sample"."""
    if not isinstance(result, xr.DataArray):
        if np.iscomplexobj(result):
            raise InputError("the response must return real numbers; got complex ones")
        array = np.asarray(result, dtype=float)
        names = [f"dim_{k}" for k in range(1, array.ndim)]
        if array.ndim:
            result = xr.DataArray(array, dims=["sample", *names])
    if not isinstance(result, xr.DataArray) or result.shape[0] != runs:
        shape = np.shape(result)
        raise InputError(f"the response must return shape ({runs}, ...); got shape {shape}")
    bad = ~np.isfinite(result.values.reshape(runs, -1)).all(axis=1)
    if bad.any():
        k = int(np.flatnonzero(bad)[0])
        shown = ", ".join(f"{n} = {v[k]:.9g}" for n, v in values.items() if not callable(v))
        raise InputError(f"the response is not finite in {bad.sum()} of {runs} runs, e.g. {shown}")
    return result.rename({result.dims[0]: "sample"}) if result.dims[0] != "sample" else result
