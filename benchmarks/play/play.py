"""Bounds over plays against exact kinematics of random linkages.

Each of the linkages, four-bars with four pins and Stephenson six-bars with seven, has plays of 0.1
to 1 % of a length in all its pins. Bounds of a coupler point at five crank angles by `AdaptivePCCI`
are compared with optima over the products of the exact discs: a dense scan and a polish.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

import flexband as fb
from benchmarks.harness import options
from benchmarks.play.linkages import Linkage, ends, four_bar, stephenson

SEED = 39_000


def compare_bounds(
    linkage: Linkage, radii: dict[str, float], method: fb.AdaptivePCCI
) -> tuple[float, float, int]:
    """Return the largest error of an end and the expected one, relative, and the runs."""

    def response(**pins: np.ndarray) -> xr.DataArray:
        values = linkage.outputs_at(pins)
        return xr.DataArray(values, dims=("sample", "output", "angle"))

    bands = fb.propagate(response, {name: fb.Play(r) for name, r in radii.items()}, method)

    def values(pairs: np.ndarray) -> np.ndarray:
        pins = dict(zip(radii, pairs, strict=True))
        return linkage.outputs_at(pins).reshape(pairs.shape[-1], -1)

    exact = ends(values, list(radii.values())).reshape(2, *bands["mean"].shape[1:])
    width = exact[1] - exact[0]
    error = float((np.abs(bands["mean"].values - exact) / width).max())
    return error, float(bands.attrs["expected_error"]), int(bands.attrs["runs"])


def main() -> None:
    """Print a row for each linkage."""
    arguments = options(__doc__, samples=40)
    rng = np.random.default_rng(SEED)
    errors = []
    print("| linkage | pins | runs | error of an end | expected |\n| --- | --- | --- | --- | --- |")
    for k in range(arguments.samples):
        linkage = four_bar(rng) if k % 2 == 0 else stephenson(rng)
        radii = dict.fromkeys(linkage.pins, 0.0)
        radii = {name: float(10 ** rng.uniform(-3, -2)) for name in radii}
        error, expected_error, runs = compare_bounds(linkage, radii, fb.AdaptivePCCI(1e-3))
        errors.append(error)
        print(f"| {k} | {len(radii)} | {runs} | {error:.2g} | {expected_error:.2g} |", flush=True)
    print(f"median {np.median(errors):.2g}, largest {max(errors):.2g} of the width")


if __name__ == "__main__":
    main()
