"""The cheapest tolerances for a stated probability, which runs of the model may correct."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr
from scipy.special import ndtri

from flexband.analysis.allocation.allocation_table import chance_result
from flexband.analysis.allocation.chance import Chance
from flexband.analysis.allocation.infeasible import check_feasible
from flexband.analysis.allocation.tolerance_search import cheapest
from flexband.analysis.allocation.tolerances import Tolerances
from flexband.analysis.allocation.worst_case import WatchedPlaces, WorstCaseBounds
from flexband.analysis.probability.failure import RUNS
from flexband.analysis.probability.model import models
from flexband.basics.checks import check_numbers
from flexband.basics.response import ResponseFunction
from flexband.errors import InputError
from flexband.requirements.corridors import joint


def checked_probability(probability: float, tolerances: Tolerances) -> float:
    """Return a stated probability; raise `InputError` if none can be kept."""
    value = float(check_numbers("probability", probability))
    if not 1e-8 <= value <= 0.3:
        raise InputError(f"probability must be from 1e-08 to 0.3; got {value:g}")
    if not tolerances.space.random_dimension:
        raise InputError("probability needs an input that is random; all are intervals")
    if tolerances.compensators:
        raise InputError("probability cannot be stated where an input is a Compensator")
    if tolerances.grades:
        raise InputError("probability cannot be stated for Grades")
    return value


def allocated_by_chance(
    chance: Chance, response: ResponseFunction | None, options: Mapping[str, Any]
) -> xr.Dataset:
    """Return the cheapest tolerances for a stated probability.

    Where runs show another probability than the surrogate, another one is aimed at in its place.
    """
    solution = chance.cheapest(_first_tolerances(chance))
    correction = None
    runs = 0
    max_probability = chance.probability
    high = chance.tolerances.bounds[1]
    tuning = chance.options
    for k in range(tuning.max_corrections if response is not None else 0):
        narrow = chance.surrogate.narrowed(**chance.tolerances.inputs(solution.x))
        with models({"": narrow}, response, [RUNS], 1, None, **options) as models_by_label:
            model = models_by_label[""](RUNS)
            assert model is not None
            correction = chance.by_runs(solution, model)
        runs += correction.runs
        min_probability = 0.0 if np.all(solution.x >= high) else tuning.kept_share * max_probability
        if (
            min_probability <= correction.probability <= max_probability
            or k == tuning.max_corrections - 1
        ):
            break
        ratio = max_probability / max(correction.probability, 1e-300)
        ratio = float(np.clip(ratio, tuning.min_ratio, tuning.max_ratio))
        aim = min(tuning.aim * ratio * solution.estimate.probability, 0.5)
        try:
            solution = replace(chance, probability=aim).cheapest(solution.x)
        except InputError:  # no tolerances are that tight: what was found is not confirmed
            break
    return chance_result(chance, solution, correction, runs)


def _first_tolerances(chance: Chance) -> np.ndarray:
    """Return tolerances that meet requirements by μ ± kσ, k = −Φ⁻¹(P), or by a smaller k."""
    k = -float(ndtri(chance.probability))
    m = chance.surrogate.space.interval_dimension
    corridor = joint({str(k): limit for k, limit in enumerate(chance.corridors)})
    for sigmas in (k, k / 2, 0.1 * k):
        worst = WorstCaseBounds.from_surrogate(
            chance.surrogate, chance.tolerances, corridor, sigmas
        )
        try:
            check_feasible(chance.surrogate, worst, {"a limit": corridor})
            return cheapest(worst, WatchedPlaces.none(m)).x
        except InputError:
            if sigmas == 0.1 * k:
                raise
    raise AssertionError
