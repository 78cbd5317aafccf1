"""The studies of the paper: methods against references, and a sweep over what it leaves open."""

from __future__ import annotations

import runpy
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr

import flexband as fb
from benchmarks.accuracy.mechanisms import slider_crank
from benchmarks.accuracy.references import Case
from benchmarks.harness import ROOT
from flexband.study.comparison import Comparison, compare, relative_error
from flexband.study.study import Study

RADII = (0.0, 0.5, 0.6, 0.7, 0.8, 0.9)
STEPS = (1e-3, 5e-4, 2e-4)
"""Spectral radii and steps [s] of the sweep."""

ELEMENTS = {"plain": fb.sections.FullIntegration(), "selective": fb.sections.SelectiveIntegration()}
ORDERS = (1, 1), (1, 2), (2, 2), (3, 3)
"""k and q of the paper: 16, 36, 81 and 256 runs."""

PHASES = (
    {"youngs_modulus": 2, "poissons_ratio": 0},
    {"crank_length": 2, "spring_stiffness": 1},
)
"""Orders with which phases are expanded in the sweep."""

WINDOWS = (0.0, 0.2), (0.2, 0.4), (0.4, 0.6)
"""Thirds of the simulated time [s]."""

SOFT = {"E": 6.9e9, "elements": 5, "displacement": True}
BANDS = "mean", "error_bar"

Numbers = dict[str, float]
"""A number for every band and output, by names such as "mean F_X"."""


@dataclass(frozen=True)
class Result:
    """A study with all methods, the reference first, and its converged bands."""

    case: Case
    comparisons: list[Comparison]
    truth: xr.Dataset

    def numbers(self) -> dict:
        """Return what the page tells of the study."""
        reference_bands = self.comparisons[0].bands
        return {
            "methods": [self._row(comparison) for comparison in self.comparisons],
            "widths": [mean_widths(reference_bands, window) for window in WINDOWS],
        }

    def _row(self, comparison: Comparison) -> dict:
        widths = mean_widths(comparison.bands)
        truth = mean_widths(self.truth)
        reference = self.comparisons[0].bands
        return {
            "label": comparison.method.label,
            "name": comparison.method.name,
            "runs": comparison.runs,
            "against LHS": errors(comparison.bands, reference) if comparison.errors else {},
            "against truth": errors(comparison.bands, self.truth),
            "in thirds": [errors(comparison.bands, self.truth, window) for window in WINDOWS],
            "wider": {key: 100 * (widths[key] / truth[key] - 1) for key in widths},
        }


def errors(
    band_set: xr.Dataset, truth: xr.Dataset, window: tuple[float, float] = (0.0, np.inf)
) -> Numbers:
    """Return ∫|Δ| dt / ∫|truth| dt in per cent."""
    times = slice(*window)
    a, b = (dataset.sel(time=times) for dataset in (band_set, truth))
    return _by_name({band: 100 * relative_error(a[band], b[band]) for band in BANDS})


def mean_widths(bands: xr.Dataset, window: tuple[float, float] = (0.0, np.inf)) -> Numbers:
    """Return the widths of interval mean and error bar, averaged over time."""
    window_bands = bands.sel(time=slice(*window))
    return _by_name({
        band: (window_bands[band].isel(bound=1) - window_bands[band].isel(bound=0)).mean("time")
        for band in BANDS
    })  # fmt: skip


def _by_name(values: Mapping[str, xr.DataArray]) -> Numbers:
    return {
        f"{band} {output}": float(series.sel(output=output))
        for band, series in values.items()
        for output in series.output.values.tolist()
    }


def full_study(case: Case, samples: int) -> Result:
    """Return a study with the paper's methods, those it argues against, and those of flexband."""
    methods = [kind(*orders) for orders in ORDERS for kind in (fb.PCCI, fb.ImprovedPCCI)]
    methods += [fb.methods.PerturbationChebyshev(q, improved=True) for q in (1, 3)]
    methods += [fb.methods.PhaseResolvedPCCI(*case.orders[-1]), fb.AdaptivePCCI(correct=False)]
    study = Study(case.response, case.inputs, fb.AdaptivePCCI(correct=False))
    comparisons = compare(study, fb.LHSScanning(samples, 10), methods)
    times = comparisons[0].bands.time
    return Result(case, comparisons, case.reference().assign_coords(time=times))


def converged_bands() -> xr.Dataset:
    """Return the bands with steps of 0.05 ms and the default element, every millisecond."""
    example = runpy.run_path(str(ROOT / "examples" / "slider_crank.py"))
    fine = example["response"].refined(2, element_parts=1)
    bands = fb.propagate(fine, example["inputs"], fb.AdaptivePCCI(0.001))
    return bands.isel(time=slice(None, None, 2))


def sweep(true: xr.Dataset) -> Iterator[dict]:
    """Yield the errors of PCCI and improved PCCI with other steps, radii and elements.

    They are compared with phase-resolved bands of the same discretization, and `claimed` is the
    error that is expected of these; `off` is how far they are from the converged answer.
    """
    for element, integration in ELEMENTS.items():
        for step in STEPS:
            for radius in RADII:
                case = slider_crank(radius, integration=integration, step=step)

                def propagate(method, case=case) -> xr.Dataset:
                    return fb.propagate(case.response, case.inputs, method)

                reference = propagate(fb.methods.PhaseResolvedPCCI(*PHASES))
                expected_error = reference["error_bar_expected_error"].mean("time")
                yield {
                    "element": element,
                    "step": step,
                    "radius": radius,
                    "widths": [mean_widths(reference, window) for window in WINDOWS],
                    "off": errors(reference, true),
                    "claimed": 100
                    * float(
                        (expected_error / abs(reference["error_bar"]).mean(("bound", "time"))).max()
                    ),
                } | {
                    f"{kind.name} {order}": errors(propagate(kind(order, order)), reference)
                    for kind in (fb.PCCI, fb.ImprovedPCCI)
                    for order in (1, 2, 3)
                }


def cost(case: Case, samples: int) -> dict[str, float]:
    """Return the processor time of a study by LHS–Scanning and by improved PCCI (3, 3) [s]."""
    seconds_by_method = {}
    for method in (fb.LHSScanning(samples, 10), fb.ImprovedPCCI(3, 3)):
        begin = time.process_time()
        fb.propagate(case.response, case.inputs, method)
        seconds_by_method[method.name] = time.process_time() - begin
    return seconds_by_method


def cosine() -> dict[str, list[float]]:
    """Return the bounds of cos πη by the methods of order 2, as in Eq. (20)."""
    methods = {"Chebyshev": fb.PCCI(0, 2), "improved Chebyshev": fb.ImprovedPCCI(0, 2)}
    inputs = {"x": fb.Interval(-1, 1)}
    return {
        name: fb.propagate(lambda x: np.cos(np.pi * x), inputs, method)["mean"].values.tolist()
        for name, method in methods.items()
    }
