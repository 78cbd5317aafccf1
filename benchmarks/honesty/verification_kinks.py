"""Verdicts of `verify` on kinks and jumps of random place and share, and on smooth responses.

A response is linear in some inputs. To this it adds, in a share of 1 to 30 % of the samples, a kink
or a jump along a random direction of all inputs; smooth responses have an exponential along it
instead. Expansions of order 1 and the adaptive method are verified with several seeds. A claim is
small if the true error is larger, and wrong if it is more than 5 times as large and above 1 %. A
wrong claim is hidden by a verdict that confirms it and implies less than a fifth of the true error.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import xarray as xr

import flexband as fb
from benchmarks.harness import options, report
from flexband.uncertainty.expansions.hybrid import tensor_points
from flexband.uncertainty.inputs.sampling import latin_hypercube_normals
from flexband.uncertainty.surrogates.surrogate import Surrogate

SAMPLES = 20_000
GRID = 5
"""Samples and values of each interval for the true bands: their error is about 1 % of the width."""

FACTOR = 5.0
LEAST = 0.01
"""A claim is wrong if the true error is larger by this factor, and above this part of the width."""

TIMES = np.linspace(0.0, 1.0, 20)

Response = Callable[..., xr.DataArray]


def draw_response(seed: int, *, smooth: bool) -> tuple[Response, dict[str, Any], np.ndarray]:
    """Return a response, its inputs, and the true error bar, shape (2, times)."""
    rng = np.random.default_rng((seed, smooth))
    n, m = (int(k) for k in rng.integers(1, 4, 2))
    # The direction of the kink, and where it begins.
    direction = rng.normal(size=n + m)
    direction /= np.linalg.norm(direction)
    slopes = rng.normal(size=n + m) * rng.integers(0, 2, n + m)
    slopes[n + rng.integers(m)] = 1.0
    size = 10 ** rng.uniform(-0.5, 0.7)
    share = 10 ** rng.uniform(-2, -0.5)
    jump = rng.integers(2)
    z = latin_hypercube_normals(SAMPLES, n, seed)
    projections = z @ direction[:n] + rng.uniform(-1, 1, (SAMPLES, m)) @ direction[n:]
    start = np.quantile(projections, 1 - share)

    def values(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        excess = x @ direction - start
        kink_part = (excess > 0) * (1.0 if jump else excess)
        return x @ slopes, size * (np.exp(0.5 * excess - 1) if smooth else kink_part)

    # The response and its inputs.
    names = [f"x{k}" for k in range(n)] + [f"e{k}" for k in range(m)]
    inputs = {k: fb.Normal(0, 1) if k[0] == "x" else fb.Interval(-1, 1) for k in names}

    def response(**arguments: np.ndarray) -> xr.DataArray:
        linear_part, kink_part = values(np.stack([arguments[k] for k in names], axis=1))
        return xr.DataArray(
            linear_part[:, None] * (1 + TIMES) + kink_part[:, None] * TIMES,
            dims=("sample", "time"),
            coords={"time": TIMES},
        )

    # The true error bar, from samples on a grid of the intervals.
    ends = []
    for eta in tensor_points([np.linspace(-1, 1, GRID)] * m):
        linear_part, kink_part = values(np.concatenate([z, np.tile(eta, (SAMPLES, 1))], axis=1))
        covariance = np.cov(linear_part, kink_part)
        mean = linear_part.mean() * (1 + TIMES) + kink_part.mean() * TIMES
        parts = np.stack([1 + TIMES, TIMES])
        std = np.sqrt(np.einsum("at,ab,bt->t", parts, covariance, parts))
        ends.append([mean - std, mean + std])
    low, high = np.moveaxis(np.array(ends), 1, 0)
    return response, inputs, np.stack([low.min(axis=0), high.max(axis=0)])


def judge_response(
    seed: int, method: Any, seeds: int, *, smooth: bool
) -> list[tuple[str, str, float]]:
    """Return of every verdict the claim's kind, the verdict, and implied over true error."""
    response, inputs, true = draw_response(seed, smooth=smooth)
    surrogate = fb.expand(response, inputs, method)
    assert isinstance(surrogate, Surrogate)
    bar = surrogate.bands()["error_bar"].values
    width = float(np.mean(true[1] - true[0]))
    error = float(np.abs(bar - true).mean()) / width
    claim = float(surrogate.diagnostics["error_bar_expected_error"].mean()) / width
    large = error > LEAST
    kind = "wrong" if large and error > FACTOR * claim else "small" if error > claim else "right"
    verdicts = []
    for k in range(seeds):
        verification = fb.verify(surrogate, response, seed=k).verification
        implied_ratio = float((verification["implied_error"] / verification["bar_width"]).max())
        verdicts.append((kind, verification.attrs["confirmed"], implied_ratio / max(error, LEAST)))
    return verdicts


def hides_error(verdict: tuple[str, str, float]) -> bool:
    """Return whether a verdict hides that a claim is wrong."""
    claim, confirmation, ratio = verdict
    return claim == "wrong" and confirmation == "yes" and ratio < 1 / FACTOR


def main() -> None:
    arguments = options(__doc__, 30, seed=(0, "first seed"), verdicts=(4, "verdicts of each claim"))
    warnings.simplefilter("ignore")
    methods = {
        "PhaseResolvedPCCI(1, 1)": fb.methods.PhaseResolvedPCCI(1, 1),
        "AdaptivePCCI(0.01, 64)": fb.AdaptivePCCI(0.01, 64),
        "RegressionPCCI(1)": fb.methods.RegressionPCCI(1),
    }
    rows = []
    measurements = {}
    for smooth in (True, False):
        for name, method in methods.items():
            seeds = range(arguments.seed, arguments.seed + arguments.samples)
            verdicts = [
                v
                for k in seeds
                for v in judge_response(k, method, arguments.verdicts, smooth=smooth)
            ]
            kind = "smooth" if smooth else "kink or jump"
            measurements[f"{name}, {kind}"] = verdicts
            for claim in ("right", "small", "wrong"):
                of_claim = [v for v in verdicts if v[0] == claim]
                refuted_count = sum(v[1] == "no" for v in of_claim)
                hidden_count = sum(map(hides_error, of_claim))
                ratio = f"{np.median([v[2] for v in of_claim]):.2f}" if of_claim else ""
                row = [name, kind, claim, len(of_claim), refuted_count, hidden_count, ratio]
                rows.append([str(v) for v in row])
    header = ["method", "response", "claim", "verdicts", "not confirmed", "hidden"]
    header.append("implied / true, median")
    report(arguments.output, "verification_kinks", header, rows, measurements, [])


if __name__ == "__main__":
    main()
