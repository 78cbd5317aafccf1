"""Verification runs: the extremes that a surrogate finds, simulated afresh."""

from __future__ import annotations

import numpy as np
import xarray as xr

from flexband.errors import InputError, whole
from flexband.uncertainty.inputs.sampling import latin_hypercube_normals
from flexband.uncertainty.inputs.space import Response, evaluate
from flexband.uncertainty.surrogates.bands import BOUNDS
from flexband.uncertainty.surrogates.surrogate import Surrogate

FOUND = ("surrogate", "simulated", "at", "rms_difference")


def verify(
    surrogate: Surrogate, response: Response, *, samples: int = 8, seed: int = 0
) -> xr.Dataset:
    """Return the widest bounds of the error bar as the surrogate and as fresh runs have them.

    For every output the times are looked at where the lower bound μ − σ is lowest and the upper
    bound μ + σ highest. The response is run at the interval inputs' values there, with Latin
    hypercube samples of the random inputs. The samples of the surrogate at the same points take
    the noise of sampling out of the comparison: its mean is corrected by the mean difference, its
    standard deviation by the ratio of the samples' ones.

    Parameters
    ----------
    samples : runs at each bound; one where no input is random.
    seed : of the samples.

    Returns
    -------
    Dataset with dims (bound, outputs …): `surrogate` and `simulated` bounds, their `difference`,
    the number `at` of the time on the last dimension, and `rms_difference` of runs and surrogate
    over all times. ``attrs["runs"]`` is the number of runs.

    Raises
    ------
    InputError
        As `propagate` does, and where the response has another shape than the surrogate's.
    """
    whole("samples", samples, 2)
    whole("seed", seed, 0)
    space, labels = surrogate.space, surrogate.labels
    n = space.random_dimension
    xi = latin_hypercube_normals(samples, n, seed) if n else np.zeros((1, 0))
    _, low, high = surrogate.extremes()
    outputs = low.values.shape[1]
    found = {name: np.empty((2, outputs)) for name in FOUND}
    runs = 0
    for bound, (extreme, sign) in enumerate(((low, -1), (high, 1))):
        for o in range(outputs):
            at = int(np.argmax(sign * extreme.values[bound, o]))
            eta = extreme.places[bound, o, at][None]
            points = xi, np.repeat(eta, len(xi), axis=0)
            fresh = evaluate(response, space, *points, len(xi), lambda done: None)
            runs += len(xi)
            if fresh.shape[1:] != labels.shape[1:]:
                raise InputError(
                    f"response must be the surrogate's, of shape {labels.shape[1:]} a run; "
                    f"got {fresh.shape[1:]}"
                )
            F, S = (
                v.reshape(len(xi), outputs, -1)[:, o]
                for v in (fresh.values, surrogate.standard(*points))
            )
            mean, std = np.reshape(surrogate.standard_moments(eta), (2, outputs, -1))[:, o, at]
            spread = _ratio(F[:, at].std(), S[:, at].std())
            simulated = mean + (F - S)[:, at].mean() + sign * std * spread
            values = mean + sign * std, simulated, at, np.sqrt(np.mean((F - S) ** 2))
            for name, value in zip(FOUND, values, strict=True):
                found[name][bound, o] = value
    dims, outer = ("bound", *labels.dims[1:-1]), labels.shape[1:-1]
    coords = {k: c for k, c in labels.coords.items() if set(c.dims) <= set(dims)}
    result = xr.Dataset(
        {name: (dims, values.reshape(2, *outer)) for name, values in found.items()},
        coords={"bound": BOUNDS, **coords},
        attrs={"runs": runs},
    )
    return result.assign(
        at=result["at"].astype(int), difference=result["simulated"] - result["surrogate"]
    )


def _ratio(a: float, b: float) -> float:
    return a / b if b > 0 else 1.0
