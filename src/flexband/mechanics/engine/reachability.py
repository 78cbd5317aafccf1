"""Why a run diverged: whether the constraints can be met at all at the time."""

from __future__ import annotations

import numpy as np

from flexband.mechanics.assembly.packing import pack
from flexband.mechanics.assembly.system import System
from flexband.mechanics.engine.batch import begin, run
from flexband.mechanics.engine.entries import MARCH, START
from flexband.mechanics.engine.generalized_alpha import GeneralizedAlpha
from flexband.mechanics.kernels.failure_codes import FAILURE
from flexband.mechanics.kernels.lane_arrays import WIDTH

MAX_EXAMINED = 5
"""Samples that are examined; messages list no more."""


def find_out_of_reach(
    system: System,
    times: np.ndarray,
    integrator: GeneralizedAlpha,
    samples: np.ndarray,
    failures: np.ndarray,
) -> None:
    """Set the code of runs that diverged where their drives ask for what cannot be reached.

    Each is simulated once more up to the time before. From there the constraints of the next time
    are assembled. `failures` are those of these samples, shape (samples, 4), see `entries`.
    """
    if not np.any(system.structure.terms.f > 0):
        return
    method = integrator.coefficients(times[1] - times[0])._replace(attempts=2)
    for place in np.flatnonzero(failures[:, 0] == FAILURE.diverged)[:MAX_EXAMINED]:
        number = int(failures[place, 1])
        lane_samples = np.full(WIDTH, samples[place])
        packed = pack(system, times, lane_samples)
        values = packed(0)
        work, failure = begin(system, values)
        rounds = int(packed.schedule.last[number - 1, 0]) + 1
        series = np.zeros((rounds, system.sensor_row_count, WIDTH))
        run(MARCH, system, values, work, series, failure, method, float(integrator.tolerance))
        next_values = pack(
            system, times[number:] if number + 1 < len(times) else times[-2:], lane_samples
        )(0)
        run(START, system, next_values, work, failure=failure)
        if failure[0, 0]:
            failures[place, 0] = FAILURE.out_of_reach
