"""Verification runs: the widest bounds of a surrogate, computed again from new runs."""

from __future__ import annotations

from itertools import product

import numpy as np
import xarray as xr

from flexband.errors import function, instance, whole
from flexband.uncertainty.inputs.evaluation import evaluate
from flexband.uncertainty.inputs.sampling import latin_hypercube_normals, of_normals
from flexband.uncertainty.inputs.space import Response, check_names
from flexband.uncertainty.surrogates.bands import BOUNDS
from flexband.uncertainty.surrogates.surrogate import Surrogate

MOST_SAMPLES = 1_000_000


def verify(
    surrogate: Surrogate, response: Response, *, samples: int = 8, seed: int = 0
) -> xr.Dataset:
    """Return the widest bounds of the error bar by the surrogate and by new runs.

    For every output these are the lowest μ − σ and the highest μ + σ of all times. The response is
    run at the values of the interval inputs that belong to them, with Latin hypercube samples of
    the random inputs. The surrogate at the same points removes the noise of sampling: the mean of
    the surrogate is corrected by the difference of the samples' means, its standard deviation by
    the ratio of the samples' standard deviations.

    Parameters
    ----------
    samples : runs at each bound; one if no input is random.
    seed : seed of the samples.

    Returns
    -------
    Dataset with dims (bound, outputs …): `surrogate` and `simulated` bounds, their `difference`,
    the number `at` of the time on the last dimension, and `rms_difference` of runs and surrogate
    over all times. ``attrs["runs"]`` is the number of runs.

    Raises
    ------
    InputError
        As `propagate` does, and if the response has not the dims and coordinates of the surrogate.
    """
    instance("surrogate", surrogate, Surrogate)
    function("response", response)
    samples, seed = whole("samples", samples, 2, MOST_SAMPLES), whole("seed", seed, 0)
    space, labels = surrogate.space, surrogate.labels
    check_names(response, space.inputs)
    normals = latin_hypercube_normals(samples, space.random_dimension, seed)
    xi = of_normals(normals, space.families)
    _, *extremes = surrogate.extremes()
    outputs = extremes[0].values.shape[1]
    found = np.empty((4, 2, outputs))
    for (bound, sign), o in product(((0, -1), (1, 1)), range(outputs)):
        at = int(np.argmax(sign * extremes[bound].values[bound, o]))
        eta = extremes[bound].places[bound, o, at][None]
        points = xi, np.repeat(eta, len(xi), axis=0)
        runs = evaluate(response, space, *points, len(xi), lambda done: None, labels).values
        F, S = (v.reshape(len(xi), outputs, -1)[:, o] for v in (runs, surrogate.standard(*points)))
        mean, std = np.reshape(surrogate.standard_moments(eta), (2, outputs, -1))[:, o, at]
        spread, before = F[:, at].std(), S[:, at].std()
        corrected = std * (spread / before if before > 0 else 1.0)
        simulated = mean + (F - S)[:, at].mean() + sign * corrected
        difference = np.sqrt(np.mean((F - S) ** 2))
        found[:, bound, o] = mean + sign * std, simulated, at, difference
    dims = ("bound", *labels.dims[1:-1])
    expected, simulated, at, difference = found.reshape(4, 2, *labels.shape[1:-1])
    return xr.Dataset(
        {
            "surrogate": (dims, expected),
            "simulated": (dims, simulated),
            "difference": (dims, simulated - expected),
            "at": (dims, at.astype(int)),
            "rms_difference": (dims, difference),
        },
        coords={k: c for k, c in labels.coords.items() if set(c.dims) <= set(dims)}
        | {"bound": BOUNDS},
        attrs={"runs": 2 * outputs * len(xi)},
    )
