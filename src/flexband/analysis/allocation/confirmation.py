"""Fresh runs of the response where limits bind, and what they correct.

Where a run differs from the surrogate, the limits are shifted by the difference, at the instants
for which the run is about the worst one, and the search goes on. They are made looser by no more
than three expected errors of the surrogate. Vertices whose margins on the surrogate are less than
this are run as well.

The random inputs of a run are where the response is μ ± kσ, to first order. Where the response is
far inside this there, as where it is bounded, the run shows that the requirement is met, and tells
nothing of μ ± kσ: that this meets the requirement is inferred by the surrogate.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np

from flexband.analysis.allocation.tolerance_search import Allocated
from flexband.analysis.allocation.worst_case import SAME, SIGNS, WatchedPlaces, WorstCaseBounds
from flexband.analysis.labelled_answers import expected_error
from flexband.analysis.verification.expanded_runs import RunsOf
from flexband.uncertainty.inputs.sampling import of_normals
from flexband.uncertainty.surrogates.surrogate import Surrogate

Search = Callable[[WorstCaseBounds, WatchedPlaces, np.ndarray | None], Allocated]
"""Returns tolerances that keep margins, given points where they are watched, and a start."""


@dataclass(frozen=True)
class ConfirmationOptions:
    """How runs confirm tolerances."""

    max_rounds: int = 5
    """Most times that runs are made."""
    max_runs: int = 6
    """Most runs at a time, at points that bind, and at vertices."""
    max_variables: int = 8
    """Interval variables up to which vertices are run."""
    agreement: float = 3e-6
    """Part of the scale up to which surrogate and runs agree."""
    margin_tolerance: float = 0.02
    """Part of the scale up to which the margin of a run counts as the least."""
    looser: float = 3.0
    """Expected errors by which limits are made looser at most."""
    difference: float = 1e-3
    """Step of differences in normal variables."""


@dataclass(frozen=True, eq=False)
class Confirmed:
    """Tolerances, and what runs where they bind have shown."""

    allocated: Allocated
    shift: np.ndarray  # by how much the search made limits tighter, or looser, (2, series)
    run_margins: np.ndarray  # of the last runs at the binding points, NaN without, (points,)
    runs: int = 0
    feasible: bool = False  # whether the last runs meet the requirements
    inferred: bool = False  # whether μ ± kσ keeps some of them by the surrogate alone
    changed: bool = False  # whether the runs have moved the tolerances


def confirm_tolerances(
    surrogate: Surrogate,
    worst: WorstCaseBounds,
    allocated: Allocated,
    runs_of: RunsOf,
    search: Search,
    *,
    options: ConfirmationOptions = ConfirmationOptions(),
) -> Confirmed:
    """Return tolerances that runs at the binding points confirm, after new searches if need be."""
    error = expected_error(surrogate, worst.sigmas)
    loosest = 0.0 * worst.scale if error is None else -options.looser * error.ravel()[worst.numbers]
    shift = np.zeros(worst.bounds.shape)
    runs = 0
    feasible = True
    inside = np.zeros(0, bool)
    run_margins = np.zeros(0)
    first = allocated.x
    for k in range(options.max_rounds):
        points = allocated.points
        if not len(points):
            return Confirmed(allocated, shift, np.zeros(0), runs, feasible=True)
        run_margins = np.full(len(points), np.nan)
        narrow = surrogate.narrowed(**worst.tolerances.inputs(allocated.x))
        order = np.argsort(-allocated.multipliers, kind="stable")[: options.max_runs]
        xi, eta, owner = _run_points(narrow, worst, allocated, order, options.difference)
        vertices = _doubtful(worst, allocated, shift, -loosest, eta, options)
        eta = np.concatenate([eta, vertices])
        xi = np.concatenate([xi, np.zeros((len(vertices), xi.shape[1]))])
        responses = runs_of(narrow, "", lambda *_: None)((xi, eta)).values
        assert responses is not None
        at_points = narrow.standard(xi, eta)
        values, discrepancies = (
            array.reshape(len(xi), -1)[:, worst.numbers]
            for array in (at_points, responses.values - at_points)
        )
        runs += len(xi)
        discrepancies = (
            SIGNS[:, None] * discrepancies[:, None]
        )  # how much larger margins of the run are
        margins = worst.margins(values[:, None])
        at = owner, points.side[order], points.series[order]
        bars = worst.values(allocated.x[None], points.select(order))[0]
        run = margins[at] + discrepancies[at]
        inside = (margins[at] > bars + options.margin_tolerance * worst.scale[at[2]]) & (run >= 0)
        run_margins[order] = np.where(inside, run, bars + discrepancies[at])
        feasible = np.all(run_margins[order] >= 0)
        if not surrogate.space.random_dimension:
            feasible = feasible and np.all(margins + discrepancies >= 0)
        new = np.maximum(
            _shift_margins(worst, allocated, shift, margins, discrepancies, options), loosest
        )
        shift_changes = np.abs(new - shift)[at[1:]]
        agree = np.all(shift_changes <= options.agreement * worst.scale[at[2]])
        if (feasible and agree) or k == options.max_rounds - 1:
            break
        shift = new
        allocated = search(worst.tighten_limits(shift), allocated.watched, allocated.x)
    changed = not np.allclose(allocated.x, first, rtol=1e-6, atol=0.0)
    return Confirmed(
        allocated, shift, run_margins, runs, bool(feasible), bool(np.any(inside)), changed
    )


def _run_points(
    narrow: Surrogate,
    worst: WorstCaseBounds,
    allocated: Allocated,
    order: np.ndarray,
    difference: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return ξ and η of runs at points, and the number of each point's run.

    Random inputs are where the value is that of μ ± kσ, to first order.
    """
    points = allocated.points.select(order)
    n = narrow.space.random_dimension
    u = np.zeros((len(points), n))
    steps = difference * np.concatenate([np.eye(n), -np.eye(n)])
    xi = of_normals(steps, narrow.space.families)
    for k in range(len(points) if n else 0):
        values = narrow.standard(xi, np.repeat(points.places[k : k + 1], 2 * n, axis=0))
        up, down = values.reshape(2, n, -1)[..., worst.numbers[points.series[k]]]
        slope = up - down
        size = np.linalg.norm(slope)
        u[k] = -SIGNS[points.side[k]] * worst.sigmas * slope / size if size else 0.0
    coordinates = np.concatenate([u, points.places], axis=1)
    _, first, owner = np.unique(
        coordinates.round(6), axis=0, return_index=True, return_inverse=True
    )
    return of_normals(u[first], narrow.space.families), points.places[first], owner.ravel()


def _doubtful(
    worst: WorstCaseBounds,
    allocated: Allocated,
    shift: np.ndarray,
    error: np.ndarray,
    run_places: np.ndarray,
    options: ConfirmationOptions,
) -> np.ndarray:
    """Return vertices at which the surrogate may be wrong about the limits, (places, m).

    `error` is what it may miss, (series,), and `run_places` are places of runs in any case.
    """
    tolerances = worst.tolerances
    m = run_places.shape[1]
    if worst.sigmas or tolerances.compensators or m > options.max_variables:
        return np.zeros((0, m))
    vertices = np.array(list(product((-1.0, 1.0), repeat=m))).reshape(2**m, m)
    eta = tolerances.center(allocated.x) + tolerances.radius(allocated.x) * vertices
    margins = worst.margins(worst.bars_at(eta, allocated.x)) - shift - error
    smallest_margins = (margins / worst.scale).min(axis=(1, 2))
    distance = np.abs(vertices[:, None] - run_places).max(axis=2).min(axis=1, initial=np.inf)
    smallest_margins[distance < SAME] = np.inf
    order = np.argsort(smallest_margins, kind="stable")[: options.max_runs]
    return vertices[order[smallest_margins[order] < 0]]


def _shift_margins(
    worst: WorstCaseBounds,
    allocated: Allocated,
    shift: np.ndarray,
    margins: np.ndarray,
    discrepancies: np.ndarray,
    options: ConfirmationOptions,
) -> np.ndarray:
    """Return new shifts, from margins and what they miss of runs, (runs, 2, series)."""
    shift = shift.copy()
    is_worst = margins - shift < allocated.margins + options.margin_tolerance * worst.scale
    use = np.isfinite(worst.bounds) & (is_worst | (margins + discrepancies < 0))
    run_margins = np.where(use, margins + discrepancies, np.inf)
    run = run_margins.argmin(axis=0)
    new = (
        -np.take_along_axis(discrepancies, run[None], axis=0)[0]
        + 0.25 * options.agreement * worst.scale
    )
    return np.where(use.any(axis=0), new, shift)
