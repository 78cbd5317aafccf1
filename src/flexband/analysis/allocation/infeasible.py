"""Why limits cannot be kept: where, and because of which inputs."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from flexband.analysis.allocation.sizes import starts
from flexband.analysis.allocation.tolerances import Tolerances
from flexband.analysis.allocation.worst_case import WorstCaseBounds
from flexband.analysis.sensitivity.contributions import groups
from flexband.basics.rounding import unit_of_variable
from flexband.errors import InputError
from flexband.requirements.corridors import Corridor, joint
from flexband.uncertainty.surrogates.surrogate import Surrogate


def check_feasible(
    surrogate: Surrogate, worst: WorstCaseBounds, limits: Mapping[str, Corridor]
) -> None:
    """Raise `InputError` if requirements are not met with the least tolerances.

    If sizes are free, this is decided at the best ones of a search.
    """
    text = "requirements cannot be met"
    if worst.tolerances.sizes:
        best = starts(worst)[0]
        sizes = ", ".join(f"{k} {v:.6g}" for k, v in worst.tolerances.nominal(best).items())
        text += f" with any sizes that were tried, the best of which are {sizes}"
        surrogate, worst = _with_sizes(surrogate, worst, best, limits)
    margins, _ = worst.least_margins(worst.tolerances.bounds[0])
    side, series = map(int, np.unravel_index(np.argmin(margins), margins.shape))
    violation = -margins[side, series]
    if violation <= 0:
        return
    number = int(worst.numbers[series])
    bound = worst.bounds[side, series]
    name = limit_at(limits, side, number, bound)
    tolerances = worst.tolerances
    tolerance_text = ", ".join(
        f"{k} {t:.3g}" for k, t in zip(tolerances.names, tolerances.smallest, strict=True)
    )
    text = (
        f"{text}, even with the least tolerances ({tolerance_text}): "
        f"{name} is violated by {violation:.4g}{moment(surrogate.labels, number)}"
    )
    raise InputError(f"{text}, {_reason(groups(surrogate), worst, side, series, violation)}")


def _reason(
    together: Mapping[str, list[str]],
    worst: WorstCaseBounds,
    side: int,
    series: int,
    violation: float,
) -> str:
    """Return why a limit is violated with the least tolerances.

    `together` has the inputs that are fixed together, by name.
    """

    def violation_at_nominal(fix: set[str]) -> float:
        """Return the violation if some inputs have their nominal values."""
        return worst.violation([k for name in fix for k in together[name]], side, series)

    nominal = violation_at_nominal(set(together))
    min_factor = 1.01  # factor by which a violation due to inputs is larger than the nominal one
    if violation <= min_factor * nominal:
        return "as it is with all inputs at their nominal values"
    also = f"; {nominal:.4g} of it with all inputs at their nominal values" if nominal > 0 else ""
    costly = {name for name in together if name in worst.tolerances.costs}
    residual = violation_at_nominal(costly)
    threshold = (min_factor - 1) * violation
    parts = {
        name: residual - violation_at_nominal(costly | {name}) for name in together.keys() - costly
    }
    causes = [
        f"{k} ({v:.3g})" for k, v in sorted(parts.items(), key=lambda p: -p[1]) if v > threshold
    ]
    if causes:
        return (
            "because of inputs without costs; each would lower the violation, without its "
            f"tolerance, by: {', '.join(causes)}{also}"
        )
    if residual - nominal > threshold:
        return (
            "because of inputs without costs, which violate it together, and none alone: "
            f"{', '.join(sorted(parts))}{also}"
        )
    size = max(abs(worst.bounds[side, series]), worst.scale[series])
    if abs(nominal) <= 1e-9 * size:
        return (
            "because the response is at the limit with all inputs at their nominal values: any "
            "tolerance or scatter violates it"
        )
    if nominal > 0:
        return f"because of these tolerances{also}"
    return (
        f"because of these tolerances: the margin is only {-nominal:.4g} with all inputs at their "
        "nominal values"
    )


def _with_sizes(
    surrogate: Surrogate, worst: WorstCaseBounds, x: np.ndarray, limits: Mapping[str, Corridor]
) -> tuple[Surrogate, WorstCaseBounds]:
    """Return a surrogate and its margins with sizes that are not free any more."""
    all_tolerances = worst.tolerances
    inputs = all_tolerances.inputs(all_tolerances.looser(x))
    narrow = surrogate.narrowed(**{name: inputs[name] for name in all_tolerances.sizes})
    tolerances = Tolerances.from_costs(narrow.space, all_tolerances.costs)
    k = worst.sigmas or 1.0
    return narrow, WorstCaseBounds.from_surrogate(narrow, tolerances, joint(limits), k)


def limit_at(limits: Mapping[str, Corridor], side: int, number: int, bound: float) -> str:
    """Return the name of the limit that has a bound at a series of the response."""
    bounds = {k: np.ravel((c.lower, c.upper)[side])[number] for k, c in limits.items()}
    return min(bounds, key=lambda name: abs(bounds[name] - bound))


def moment(labels: xr.DataArray, number: int) -> str:
    """Return the instant of a series in words: " at time 0.1 s"."""
    words = []
    place = np.unravel_index(number, labels.shape[1:]) if labels.ndim > 1 else ()
    for dim, k in zip(labels.dims[1:], place, strict=True):
        if dim == "output":
            continue
        coordinate = labels[dim] if dim in labels.coords else None
        value = k if coordinate is None else coordinate.values[k]
        number_text = f"{value:.6g}" if np.asarray(value).dtype.kind in "iuf" else str(value)
        unit = "" if coordinate is None else unit_of_variable(coordinate)
        words.append(f"{dim} {number_text} {unit}".rstrip())
    return f" at {', '.join(words)}" if words else ""
