"""Ways to split a ringing response, compared on the same runs.

    python -m benchmarks.accuracy.decompositions

Values at fixed times (improved PCCI), local mean decomposition (Jiang and Bai, 2022) and flexband's
carriers are expanded from the runs of one tensor design. The table has what each expansion misses
of new runs at generic points: root mean square, in per cent of the variation between runs.
"""

from __future__ import annotations

import argparse

import numpy as np
import xarray as xr

import flexband as fb
from benchmarks.accuracy.cases import cases
from benchmarks.accuracy.local_mean import SplitExpansion
from flexband.uncertainty.adaptive.held_out_points import generic_points
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.phase_resolved.method import HELD
from flexband.uncertainty.surrogates.axes import series

COMPARED = (
    "cos ωt",
    "damped oscillator",
    "two carriers",
    "fades and returns",
    "no carrier",
    "chirp (trap)",
    "independent beating (trap)",
    "interior extreme (trap)",
    "bifurcation (trap)",
    "kink (trap)",
    "slider–crank, ρ∞ = 0.7",
    "soft link, displacement",
)
ORDER = 2
NEW = 64


def measure_misses(name: str) -> list[float]:
    """Return what values, local means and carriers miss of new runs, in per cent, and the runs."""
    case = cases()[name]()
    space = Space(case.inputs)

    def run(xi, eta):
        return xr.DataArray(case.response(**space.arguments_at(xi, eta)))

    random = [ORDER] * space.random_dimension
    method = fb.ImprovedPCCI
    nodes = [method.interval_nodes(ORDER)] * space.interval_dimension
    design = space.families, random
    values = series(run(*HybridExpansion.design(*design, nodes)))
    xi, eta = generic_points(HELD, NEW, space.interval_dimension, space.families)
    new = series(run(xi, eta))
    spread = new.std(axis=0)

    def largest_error(approximation: np.ndarray) -> float:
        per_output = np.sqrt(
            np.mean((approximation - new) ** 2, axis=(0, 2)) / np.mean(spread**2, axis=1)
        )
        return 100 * float(per_output.max())

    outputs = range(values.shape[1])
    direct = HybridExpansion.fit(values.reshape(len(values), -1), *design, nodes)
    local = [SplitExpansion(values[:, o], *design, nodes).evaluate(xi, eta) for o in outputs]
    resolved = fb.expand(case.response, case.inputs, fb.methods.PhaseResolvedPCCI(ORDER, ORDER))
    approximations = (
        direct.evaluate(xi, eta).reshape(new.shape),
        np.stack(local, axis=1),
        resolved.standard(xi, eta).reshape(new.shape),
    )
    return [*map(largest_error, approximations), len(values)]


def main() -> None:
    """Print the table."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    print("| response | runs | values | local means | carriers |")
    print("| --- | ---: | ---: | ---: | ---: |")
    for name in COMPARED:
        *parts, runs = measure_misses(name)
        print(f"| {name} | {runs:.0f} |", *(f"{float(f'{part:.2g}'):g} % |" for part in parts))


if __name__ == "__main__":
    main()
