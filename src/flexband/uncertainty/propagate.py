"""Propagate uncertainty through any vectorized function."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import xarray as xr

from flexband.errors import InputError, whole
from flexband.uncertainty.inputs import Input
from flexband.uncertainty.methods import Method
from flexband.uncertainty.space import Response, Space, check_names, evaluate, locate_fields


def propagate(
    response: Response,
    inputs: Mapping[str, Input],
    method: Method,
    *,
    batch: int = 2048,
    most_runs: int = 1_000_000,
    progress: Callable[[int, int], object] | None = None,
) -> xr.Dataset:
    """Return interval mean and interval error bar of a response.

    Parameters
    ----------
    response : function that takes every input by name, as an array of shape (n,) (a random field:
        as a function of position), and returns an array of shape (n, ...). A labelled array
        (`xarray.DataArray`) passes its labels on to the result.
    inputs : name -> `Interval`, `Normal`, `Uniform` or `RandomField`; one kind alone will do.
    method : `PhaseResolvedPCCI`, `ImprovedPCCI`, `PCCI`, `LHSScanning` or `MonteCarlo`.
    batch : most runs in one call of the response. Bands do not depend on it.
    most_runs : a method that takes more is refused before it begins.
    progress : called as ``progress(done, total)`` after every batch.

    Returns
    -------
    Dataset with variables `mean` and `error_bar`, first dim "bound" (lower, upper), Eqs. (3) and
    (5), and more: see `flexband.uncertainty.bands.bands`. ``attrs["runs"]`` is the number of
    evaluations of the response, ``attrs["method"]`` the method.

    Raises
    ------
    InputError
        Where inputs and the response's arguments do not match, the method takes too many runs, or
        the response returns NaN or the wrong shape.
    """
    whole("batch", batch, 1)
    if isinstance(method, type) or not callable(getattr(method, "solve", None)):
        raise InputError(f"method must be one like ImprovedPCCI(2, 2); got {method!r}")
    check_names(response, inputs)
    located, explored = locate_fields(response, inputs)
    space = Space(located)
    total = method.runs(space)
    if total > most_runs:
        raise InputError(
            f"{method!r} would take {total} runs, with {space.random_dimension} random and "
            f"{space.interval_dimension} interval variables; most_runs is {most_runs}"
        )
    done = 0

    def advance(runs: int) -> None:
        nonlocal done
        done += runs
        if progress is not None:
            progress(done, total)

    def run(xi: np.ndarray, eta: np.ndarray) -> xr.DataArray:
        return evaluate(response, space, xi, eta, batch, advance)

    result = method.solve(space, run)
    return result.assign_attrs(runs=done + explored, method=repr(method))
