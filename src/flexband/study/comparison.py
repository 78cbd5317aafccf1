"""Methods compared with a reference: runs, wall times and relative errors."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, is_dataclass, replace

import numpy as np
import xarray as xr

from flexband.basics.checks import check_function, check_instance
from flexband.basics.progress import Progress
from flexband.basics.warning import warn, without_warnings
from flexband.errors import InputError, ToleranceWarning
from flexband.study.discretized import with_discretization
from flexband.study.study import Study
from flexband.uncertainty.adaptive.method import AdaptivePCCI
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.inputs.unfolding import cases, first_case
from flexband.uncertainty.methods.least_squares import RegressionPCCI
from flexband.uncertainty.methods.method import (
    Evaluate,
    ExpansionMethod,
    Method,
    as_method,
    check_runs,
)
from flexband.uncertainty.methods.pcci import PCCI, ImprovedPCCI
from flexband.uncertainty.methods.perturbation import PerturbationChebyshev
from flexband.uncertainty.methods.scanning import LHSScanning, MonteCarlo, Scanning, SobolScanning
from flexband.uncertainty.phase_resolved.method import PhaseResolvedPCCI
from flexband.uncertainty.surrogates.bands import BandRecord


@dataclass(frozen=True)
class Comparison:
    """The result of one method.

    Attributes
    ----------
    method : the method.
    bands : its bands.
    seconds : wall time of the study, without compilation.
    errors : relative error of each output, by variable, "mean" and "error_bar"; empty for the
        reference.
    """

    method: Method
    bands: xr.Dataset
    seconds: float
    errors: dict[str, xr.DataArray]

    @property
    def runs(self) -> int:
        """Number of evaluations of the response, without the one that is made again."""
        record = BandRecord.read(self.bands)
        return record.runs - record.runs_repeated


def relative_error(
    bounds: xr.DataArray, reference: xr.DataArray, round_off: float = 1e-10
) -> xr.DataArray:
    """Return ∫|Δ| dt / ∫|reference| dt over both bounds, for every output.

    The integral runs over all dims except "output". Outputs that are zero up to `round_off`, in
    parts of the largest output, have the error NaN.
    """
    dims = [d for d in bounds.dims if d != "output"]
    size = abs(reference).sum(dims)
    return (abs(bounds - reference).sum(dims) / size).where(size > round_off * size.max())


def compare(
    study: Study,
    reference: Method,
    methods: Sequence[Method],
    *,
    progress: Callable[[Method], Progress] | None = None,
    finished: Callable[[Comparison], object] | None = None,
) -> list[Comparison]:
    """Run the study with the reference and with every method; the reference comes first.

    Everything is compiled before the first method is timed. Methods that would take too many runs
    are left out, with a warning. All methods have the same step and elements, those that the
    adaptive method chooses if the response leaves them out; none corrects their error
    (``correct=False``).

    Parameters
    ----------
    study : the response and its inputs; its own method is not used.
    reference : method that the others are compared with, such as `LHSScanning`.
    methods : to compare.
    progress : called with each method before it starts; returns the function that is called as
        ``(done, total)`` after every batch of runs.
    finished : called with the result of each method before the next one starts.

    Returns
    -------
    One `Comparison` per method, with `method`, `bands`, `runs`, `seconds` (without compilation) and
    `errors`: for "mean" and "error_bar", ∫|Δ| dt / ∫|reference| dt over both bounds, by output.

    Raises
    ------
    InputError
        If the study, the reference or a method is of another type, or the reference would take too
        many runs.
    """
    check_instance("study", study, Study)
    check_instance("methods", methods, list | tuple, "a list of methods")
    for method in (reference, *methods):
        as_method(method)
    for name, callback in (("progress", progress), ("finished", finished)):
        if callback is not None:
            check_function(name, callback)
    # Methods that can be afforded, on one discretization for all; compile before any is timed.
    study = study.with_domains()
    space = Space(first_case(study.inputs))
    count = len(cases(study.inputs))
    check_runs(reference, space, count=count)
    reference, *methods = (_without_correction(method) for method in (reference, *methods))
    methods = [method for method in methods if _affordable(method, space, count)]
    study = with_discretization(study)
    warm_up(study, (reference, *methods))
    # The reference comes first, since errors are those against it.
    results: list[Comparison] = []
    for method in (reference, *methods):
        report = progress(method) if progress else None
        begin = time.perf_counter()
        with without_warnings(ToleranceWarning):  # errors are compared, that of the step is common
            bands = study.with_method(method).run(progress=report)
        seconds = time.perf_counter() - begin
        variables = ("mean", "error_bar") if results else ()
        errors = {v: relative_error(bands[v], results[0].bands[v]) for v in variables}
        results.append(Comparison(method, bands, seconds, errors))
        if finished:
            finished(results[-1])
    return results


def usual_methods(
    study: Study, reference: Scanning, orders: Sequence[tuple[int, int]]
) -> list[Method]:
    """Return the methods to compare with a reference.

    PCCI and improved PCCI have the orders (k, q), perturbation–Chebyshev the orders q, and
    regression the total orders max(k, q). The phase-resolved method has the first of the orders;
    the other scanning methods have a quarter of the samples of the reference, if any input is
    random.
    """
    methods: list[Method] = [kind(k, q) for kind in (PCCI, ImprovedPCCI) for k, q in orders]
    methods += [PhaseResolvedPCCI(*orders[0]), AdaptivePCCI(correct=False)]
    methods += [RegressionPCCI(p) for p in dict.fromkeys(max(pair) for pair in orders)]
    methods += [PerturbationChebyshev(q) for q in dict.fromkeys(q for _, q in orders)]
    if Space(first_case(study.with_domains().inputs)).random_dimension:
        fewer = max(2, reference.samples // 4)
        kinds = (LHSScanning, SobolScanning, MonteCarlo)
        methods += [
            kind(fewer, reference.points, reference.seed)
            for kind in kinds
            if not isinstance(reference, kind)
        ]
    return methods


def _without_correction(method: Method) -> Method:
    if isinstance(method, ExpansionMethod) and is_dataclass(method) and method.correct:
        return replace(method, correct=False)
    return method


def _affordable(method: Method, space: Space, count: int) -> bool:
    """Return whether a method can be run for so many combinations of options; warn if not."""
    try:
        check_runs(method, space, count=count)
    except InputError as error:
        warn(f"left out: {error}")
        return False
    return True


def warm_up(study: Study, methods: Iterable[Method]) -> None:
    """Compile the code of a study's response and of methods.

    The response is run once. Of each class of methods that make a surrogate, the one with the
    fewest runs is applied to a small ringing response of the same inputs, which exercises the
    compiled code that finds bounds.
    """
    study.nominal()
    space = Space(first_case(study.with_domains().inputs))
    expanding = [method for method in methods if as_method(method).expands]
    fewest = sorted(expanding, key=lambda method: method.runs(space), reverse=True)
    for method in {type(method): method for method in fewest}.values():
        resolves = isinstance(method, PhaseResolvedPCCI | AdaptivePCCI)
        method.solve(space, _Oscillation(256 if resolves else 2))


class _Oscillation(Evaluate):
    """An oscillation whose frequency depends on the first ξ and η, at its first times.

    Two times compile all that a polynomial needs.
    """

    def __init__(self, times: int) -> None:
        super().__init__()
        self.times = np.linspace(0.0, 1.0, 256)[:times]

    def __call__(self, xi: np.ndarray, eta: np.ndarray) -> xr.DataArray:
        frequencies = 30.0 * (1.0 + 0.05 * (xi[:, :1].sum(axis=1) + eta[:, :1].sum(axis=1)))
        values = np.cos(2.0 * np.pi * frequencies[:, None] * self.times)
        return xr.DataArray(values, dims=("sample", "time"), coords={"time": self.times})
