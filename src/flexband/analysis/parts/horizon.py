"""How long a motion is predictable: until a small change of an input has grown.

Two runs that differ little are compared at the same times, where outputs are positions. Velocities
and forces jump in an impact, which comes earlier in one of the runs, so their values at one time
tell nothing: they are integrated over time as often as their unit has a time in its denominator.
Impacts are compared in order, the k-th with the k-th.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import scipy
import xarray as xr
from scipy.special import ndtr

from flexband.analysis.parts.numbers import Quantities, check_quantities, numbers_of, units_by_name
from flexband.analysis.parts.part_runs import plain_runs
from flexband.analysis.verification.expanded_runs import Runs
from flexband.basics.checks import check_integer, check_numbers
from flexband.basics.progress import Progress, run_counter
from flexband.basics.response import ResponseFunction
from flexband.basics.rounding import unit_of_variable
from flexband.errors import InputError
from flexband.execution.executors import ExecutorLike
from flexband.execution.store import StoreLike
from flexband.requirements.units import unit_of
from flexband.uncertainty.inputs.evaluation import coordinates
from flexband.uncertainty.inputs.sampling import latin_hypercube_normals, of_normals
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.inputs.unfolding import GivenInputs
from flexband.uncertainty.runs import BATCH
from flexband.uncertainty.runs.evaluations import EvaluationOptions
from flexband.uncertainty.surrogates.axes import axes_of, series, units_of

LONG_NAMES = {
    "horizon": "time until a small change has grown, median over the points; inf if it does not",
    "horizon_low": "the same, exceeded by 90 % of the points",
    "horizon_high": "the same, exceeded by 10 % of the points",
    "predictable": "whether no change grows within the run at 90 % of the points",
    "quantity_change": "change of a number relative to its range, median over the points",
    "quantity_change_high": "the same, exceeded by 10 % of the points",
    "quantity_predictable": "whether the change is small at 90 % of the points",
}


@dataclass(frozen=True)
class HorizonOptions:
    """What counts as predictable."""

    points: int = 16
    """Points of the inputs."""
    change: float = 1e-4
    """Change of each input, relative to its range."""
    limit: float = 0.1
    """Change, relative to the band's width, at which motions are unpredictable."""
    least_width: float = 0.01
    """Least width of a band, relative to the largest one of the whole run."""
    deviations: float = 3.0
    """Half of the range of a random input, in standard deviations."""
    tail: float = 0.1
    """Part of the points beyond each end of the scatter."""

    def runs(self, space: Space) -> int:
        """Return the number of runs: of the points, and of them with each input changed."""
        return self.points * (1 + len(space.uncertain))

    def scatter(self, values: np.ndarray) -> np.ndarray:
        """Return the lower end, the median and the upper end of values (points, …), (3, …)."""
        parts = np.array([self.tail, 0.5, 1 - self.tail])
        ranks = np.ceil(parts * len(values) - 1e-9).astype(int) - 1
        return np.sort(values, axis=0)[ranks]


def predictability_horizon(
    response: ResponseFunction,
    inputs: GivenInputs,
    *,
    quantities: Quantities | None = None,
    points: int = 16,
    change: float = 1e-4,
    seed: int = 0,
    batch: int = BATCH,
    store: StoreLike = None,
    executor: ExecutorLike = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Return until when a motion is predictable: no small change of an input has grown.

    At some points of the inputs the response is run again with each input changed by a small part
    of its range. The horizon is the first time at which an output has changed by a tenth of its
    band's width: of the range of the runs at these points, the largest so far. What lasts for one
    time only, as where an impact comes a little later, does not count.

    An output that is an instant (unit s), as those of `contact.Contacts`, is compared as it is at
    the last time; its horizon is this instant. One whose unit has a time in its denominator, as a
    velocity or a force, is integrated over time as often, unless it only increases.

    Parameters
    ----------
    response, inputs : as in `propagate`, without choices.
    quantities : name -> quantity of one number, such as ``Peak("F")`` or ``Final("stop_number")``;
        by default the largest and the smallest value of each output. Each is predictable or not.
    points : number of points of the inputs, of a Latin hypercube.
    change : of each input, relative to its range: of an interval's width, or of ± 3 standard
        deviations.
    seed : of the points.
    batch, store, executor, progress : as in `propagate`.

    Returns
    -------
    Dataset with the dims of the outputs: `horizon` in the unit of time, the median over the points,
    and `horizon_low` and `horizon_high`, its scatter: 80 % of the points are between them. They are
    inf where no change grows within the run, and 0 for outputs without a time that change so much.
    `predictable` is whether `horizon_low` is inf. Along the dim "quantity" are `quantity_change`
    and `quantity_change_high`, relative to the range of the quantity, and `quantity_predictable`.
    ``attrs["runs"]`` is the number of runs.

    Raises
    ------
    InputError
        If there is a choice, a number is out of its range, a quantity is not a function, and as
        `propagate`.
    RunError, StoreError
        As `propagate` raises them.

    Examples
    --------
    A map that doubles an angle doubles small changes, too: from 1e-4 to a tenth in 10 steps.

    >>> def angles(x):
    ...     return (2.0 ** np.arange(20) * x[:, None]) % 1.0
    ...
    >>> result = fb.analysis.predictability_horizon(angles, {"x": fb.Interval(0.0, 1.0)})
    >>> int(result["horizon"]), result.attrs["runs"]
    (10, 32)
    """
    check_quantities(quantities)
    points = check_integer("points", points, 2)
    seed = check_integer("seed", seed, 0)
    part = float(check_numbers("change", change))
    if not 0 < part <= 0.01:
        raise InputError(f"change must be above 0 and at most 0.01; got {part:g}")
    with plain_runs(response, inputs, EvaluationOptions(batch, store, executor)) as plain:
        space, explored, runs_of = plain
        options = HorizonOptions(points, part)
        count = options.runs(space)
        result = horizon_of(runs_of(run_counter(progress, count)), space, quantities, seed, options)
    return result.assign_attrs(runs=count + explored)


def neighbours(space: Space, seed: int, options: HorizonOptions) -> tuple[np.ndarray, np.ndarray]:
    """Return ξ and η of points, then of them with the first input changed, with the second, ….

    An input with several variables is changed along a random direction.
    """
    n = space.random_dimension
    m = space.interval_dimension
    points = options.points
    change = options.change
    rng = np.random.default_rng(seed)
    normals = latin_hypercube_normals(points, n + m, seed)
    u = normals[:, :n]
    eta = 2 * ndtr(normals[:, n:]) - 1
    all_u = [u]
    all_eta = [eta]
    for random, step in ((True, 2 * options.deviations * change), (False, 2 * change)):
        for name, first in space.columns(random=random).items():
            columns = slice(first, first + space.inputs[name].dimension)
            changed = (u if random else eta).copy()
            direction = np.abs(rng.standard_normal(changed[:, columns].shape))
            direction /= np.linalg.norm(direction, axis=1, keepdims=True)
            changed[:, columns] -= step * direction * np.sign(changed[:, columns])  # stays inside
            all_u.append(changed if random else u)
            all_eta.append(eta if random else changed)
    return of_normals(np.concatenate(all_u), space.families), np.concatenate(all_eta)


def horizon_of(
    run: Runs, space: Space, quantities: Quantities | None, seed: int, options: HorizonOptions
) -> xr.Dataset:
    """Return what `predictability_horizon` does; `run` returns runs at points of a space."""
    evaluation = run(neighbours(space, seed, options))
    assert evaluation.values is not None
    lost = np.isin(np.arange(len(evaluation.values)), list(evaluation.failed)).reshape(
        -1, options.points
    )
    complete_points = ~lost.any(axis=0)  # points of which all runs succeeded
    runs = evaluation.values.isel(sample=np.tile(complete_points, len(lost)))
    options = replace(
        options, points=check_integer("points without failed runs", complete_points.sum(), 2)
    )
    # Find when each output is no longer predictable, and how much the quantities change.
    axes = axes_of(runs)
    values = series(runs)
    labelled = axes.time in runs.coords
    times = runs[axes.time].values.astype(float) if labelled else np.arange(float(axes.times))
    varies = units_of(runs).varies(np.ptp(values, axis=(0, 2)), np.abs(values).max(axis=(0, 2)))
    ends = np.full((options.points, values.shape[1]), np.inf)
    for output, unit in enumerate(units_by_name(runs)):
        if varies[output]:
            ends[:, output] = _ends(values[:, output], times, unit, options)
    low, median, high = options.scatter(ends)
    numbers = numbers_of(runs, quantities)
    shares = _shares(numbers.values[..., None], options)[..., 0]
    size = np.abs(numbers.values).max(axis=0)
    spread = np.ptp(numbers.values, axis=0)
    shares[:, ~units_of(numbers, ["quantity"]).varies(spread, size)] = 0.0
    _, middle, upper_share = options.scatter(shares)
    data = {"horizon": median, "horizon_low": low, "horizon_high": high}
    data["predictable"] = np.isinf(low)
    coords = {k: c for k, c in coordinates(runs).items() if set(c.dims) <= set(axes.dims)}
    attrs = {"points": options.points, "change": options.change, "seed": seed}
    variables = {k: (axes.dims, v.reshape(axes.shape)) for k, v in data.items()}
    variables["quantity_change"] = ("quantity",), middle
    variables["quantity_change_high"] = ("quantity",), upper_share
    variables["quantity_predictable"] = ("quantity",), upper_share < options.limit
    coords["quantity"] = numbers["quantity"].drop_vars("unit")
    result = xr.Dataset(variables, coords, attrs).drop_vars("unit", errors="ignore")
    unit = unit_of_variable(runs[axes.time]) if labelled else ""
    for name, words in LONG_NAMES.items():
        of_time = name.startswith("horizon") and unit
        result[name].attrs = {"long_name": words} | ({"units": unit} if of_time else {})
    return result


def _ends(values: np.ndarray, times: np.ndarray, unit: str, options: HorizonOptions) -> np.ndarray:
    """Return when an output (runs, times) is no longer predictable at each point, (points,)."""
    if unit == "s":
        shares = _shares(values[:, -1:], options)[:, 0]
        return np.where(shares >= options.limit, values[: options.points, -1], np.inf)
    if (np.diff(values, axis=1) < 0).any():
        for _ in range(_rates(unit)):
            values = scipy.integrate.cumulative_trapezoid(values, times, axis=1, initial=0)
    grown = _shares(values, options) >= options.limit
    if len(times) > 1:
        grown[:, :-1] &= grown[:, 1:]
    moving = (values != values[:, :1]).any(axis=0)  # the window of a sensor begins later
    grown[:, : max(0, moving.argmax() - 1)] = False
    return np.where(grown.any(axis=1), times[grown.argmax(axis=1)], np.inf)


def _rates(unit: str) -> int:
    """Return how often a unit has a time in its denominator; 0 for a text that is no unit."""
    try:
        return max(0, -unit_of("unit", unit).powers[2])
    except InputError:
        return 0


def _shares(values: np.ndarray, options: HorizonOptions) -> np.ndarray:
    """Return the changes of runs (runs, times) relative to the width so far, (points, times)."""
    at, *others = values.reshape(-1, options.points, *values.shape[1:])
    width = np.maximum.accumulate(np.ptp(at, axis=0), axis=-1)
    width = np.maximum(width, options.least_width * width[..., -1:])
    changes = np.abs(np.array(others) - at).max(axis=0)
    none = np.where(changes > 0, math.inf, 0.0)
    return np.divide(changes, width, out=none, where=width > 0)
