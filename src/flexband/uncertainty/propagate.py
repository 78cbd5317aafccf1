"""Propagate uncertainty through any vectorized function."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace

import xarray as xr

from flexband.basics.progress import Progress
from flexband.basics.response import ResponseFunction
from flexband.errors import InputError
from flexband.execution.executors import ExecutorLike
from flexband.execution.store import StoreLike
from flexband.uncertainty.inputs.unfolding import GivenInputs
from flexband.uncertainty.methods.method import MAX_RUNS, ExpansionMethod, Method, as_method
from flexband.uncertainty.runs import BATCH
from flexband.uncertainty.runs.between import between_times
from flexband.uncertainty.runs.cases import runs_of_cases
from flexband.uncertainty.runs.counted_runs import CountedRuns
from flexband.uncertainty.runs.evaluations import EvaluationOptions, OutputCheck
from flexband.uncertainty.runs.summary import attributes, warn_of_idle_inputs
from flexband.uncertainty.surrogates.bands import with_names_and_units
from flexband.uncertainty.surrogates.choices import SurrogateOfChoices, over_choices
from flexband.uncertainty.surrogates.sigmas import checked_sigmas
from flexband.uncertainty.surrogates.surrogate import Surrogate


def propagate(
    response: ResponseFunction,
    inputs: GivenInputs,
    method: Method,
    *,
    sigmas: float = 1.0,
    batch: int = BATCH,
    most_runs: int = MAX_RUNS,
    store: StoreLike = None,
    executor: ExecutorLike = None,
    failed: str = "stop",
    check: OutputCheck | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Return interval mean and interval error bar of a response.

    Over all values of the interval inputs, the interval mean is the range of the mean μ, and the
    interval error bar the range from the lowest μ − σ to the highest μ + σ, or μ ± kσ.

    Parameters
    ----------
    response : function that takes every input by name, as an array of shape (n,) (a random field as
        a function of position), and returns an array of shape (n, ...). The last axis is time, so
        that an array of shape (n, k) is a series of one output; a `xarray.DataArray` whose last dim
        is named "output", or has texts as labels, has outputs without a time, each of which is
        judged on its own. Its labels are passed on to the result.
    inputs : name -> `Interval`, `Normal` or another distribution, `RandomField` or another `Input`;
        a number, which is a constant; `Choice`; or `Correlated`, under any name.
    method : `AdaptivePCCI`, `PhaseResolvedPCCI`, `ImprovedPCCI`, `PCCI`, `RegressionPCCI`,
        `PerturbationChebyshev`, `LHSScanning`, `SobolScanning` or `MonteCarlo`.
    sigmas : k of the error bar.
    batch : largest number of runs in one call of the response. Bands do not depend on it.
    most_runs : a method that takes more runs is refused before it starts.
    store : folder, or `Store`, in which every run is recorded as soon as it is finished. Runs that
        are there are not made again: a study that was stopped or killed continues, and another
        method or other bounds use what there is.
    executor : where runs are made: None for this process, `Processes` for several on this machine,
        an executor of `concurrent.futures`, or a Dask client or its address. Bands do not depend on
        it.
    failed : what to do about a run that fails, by an error or by values that are not finite:
        "stop"; try "half step", a quarter and an eighth, and stop if these fail too; or "skip"
        it and continue without, which regression and the scanning methods can, others only for
        check runs.
    check : called after the first runs with the outputs, a DataArray without samples. What it
        raises ends the study before more is run.
    progress : called as ``progress(done, total)`` after every batch, and, in this process, within a
        batch of `dynamic_response`.

    Returns
    -------
    Dataset with variables `mean` and `error_bar`, first dim "bound" (lower, upper), Eqs. (3) and
    (5), and more: see `flexband.uncertainty.surrogates.bands.bands`. ``attrs["runs"]`` is the
    number of evaluations of the response, ``attrs["method"]`` the method, ``attrs["sigmas"]`` k;
    ``attrs["inputs"]`` and ``attrs["versions"]`` are texts. One run is made again, alone, and
    counted in ``attrs["runs_repeated"]`` too: a sample must not depend on others of its batch.
    Runs of a store that are made again to check it are not counted.
    If the response is known between its times, as a motion in steps shorter than these, 8 further
    runs, ``attrs["runs_between"]``, tell `above_between` and `below_between`: by how much outputs
    leave the range of two neighbouring values between the times.

    Raises
    ------
    InputError
        If inputs and the response's arguments do not match, the method takes too many runs,
        `sigmas` is not a positive number, or the response returns NaN, numbers above 1e150, an
        output that is not zero but below 1e-120 in all runs, no real numbers, the wrong shape, or
        not the same dims and coordinates in every call (another order is put in order); if samples
        of a batch change each other, or the same inputs give other values each time.
    RunError
        If runs fail that are not left out. It tells the inputs of the runs; an error that the
        response raised is its ``__cause__``.
    StoreError
        If the store cannot be used: see `Store`.

    Examples
    --------
    >>> inputs = {"force": fb.Interval(90.0, 110.0), "compliance": fb.Normal(2e-3, 1e-4)}
    >>> bands = fb.propagate(lambda force, compliance: force * compliance, inputs, fb.PCCI(1, 1))
    >>> bands["mean"].values.round(4)  # lowest and highest mean
    array([0.18, 0.22])
    >>> bands["error_bar"].values.round(4)  # lowest μ − σ, highest μ + σ
    array([0.171, 0.231])
    """
    sigmas = checked_sigmas(sigmas)
    method = as_method(method)
    options = EvaluationOptions(batch, store, executor, failed, most_runs, check, progress)

    results: dict[str, xr.Dataset] = {}
    with closing(runs_of_cases(response, inputs, method, options)) as all_runs:
        for runs in all_runs:
            bands = method.solve(runs.space, runs.start, sigmas)
            results[runs.case] = with_names_and_units(_with_run_counts(runs, bands))
    return results[""] if len(results) == 1 else over_choices(inputs, results)


def expand(
    response: ResponseFunction,
    inputs: GivenInputs,
    method: Method,
    *,
    batch: int = BATCH,
    most_runs: int = MAX_RUNS,
    store: StoreLike = None,
    executor: ExecutorLike = None,
    failed: str = "stop",
    check: OutputCheck | None = None,
    progress: Progress | None = None,
) -> Surrogate | SurrogateOfChoices:
    """Return the surrogate of a response, which evaluates, saves, and computes moments and bands.

    Parameters, what the axes of the response mean, and errors are those of `propagate`; the method
    is one that expands the response: any but the scanning methods. ``expand(…).bands(sigmas)``
    equals the result of `propagate`. With a `Choice` it is a `SurrogateOfChoices`.

    Examples
    --------
    >>> inputs = {"force": fb.Interval(90.0, 110.0), "compliance": fb.Normal(2e-3, 1e-4)}
    >>> surrogate = fb.expand(lambda force, compliance: force * compliance, inputs, fb.PCCI(1, 1))
    >>> surrogate.bands(sigmas=2.0)["error_bar"].values.round(4)
    array([0.162, 0.242])
    """
    method = as_method(method)
    if not isinstance(method, ExpansionMethod):
        raise InputError(f"method must be one that expands the response; got {method!r}")

    options = EvaluationOptions(batch, store, executor, failed, most_runs, check, progress)

    surrogates: dict[str, Surrogate] = {}
    with closing(runs_of_cases(response, inputs, method, options)) as all_runs:
        for runs in all_runs:
            surrogate = method.expand(runs.space, runs.start)
            diagnostics = _with_run_counts(runs, surrogate.diagnostics)
            surrogates[runs.case] = replace(surrogate, diagnostics=diagnostics)
    return surrogates[""] if len(surrogates) == 1 else SurrogateOfChoices(inputs, surrogates)


def _with_run_counts(runs: CountedRuns, result: xr.Dataset) -> xr.Dataset:
    """Return a result with the counts of its runs, and what they did between the output times.

    Inputs that change no output are warned of.
    """
    warn_of_idle_inputs(runs)
    counts = attributes(runs, result.attrs)
    between = between_times(runs, result)
    return result.assign(between.variables).assign_attrs(counts | between.attrs)
