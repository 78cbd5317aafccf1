"""From arrays over samples to blocks of lanes, for a run over given times."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from flexband.basics.checks import check_affordable
from flexband.basics.user_functions import evaluate_function
from flexband.basics.warning import without_warnings
from flexband.basics.words import number_of
from flexband.mechanics.assembly.stacking import map_tree
from flexband.mechanics.assembly.structure import Values
from flexband.mechanics.assembly.system import System
from flexband.mechanics.kernels.forms import COEFFICIENTS
from flexband.mechanics.kernels.lane_arrays import WIDTH, to_lanes, zeros
from flexband.mechanics.time_functions.schedule import Schedule
from flexband.mechanics.time_functions.tabulation import tabulate

AT_START = np.array([0.0, 1e-4])
"""Times [s] of a run that only starts: drives are differentiated over such a step."""


class Packed:
    """The numbers of the samples of a run by block, each made when it is called for."""

    def __init__(self, schedule: Schedule, values: Values, samples: np.ndarray | None):
        self.schedule = schedule.select(samples)

        def lanes(rows: np.ndarray) -> Callable[[int], np.ndarray]:
            """Return a function that gives a block; samples share an array of width 1."""
            if rows.shape[1] > 1:
                return partial(to_lanes, rows if samples is None else rows[:, samples])
            shared = to_lanes(rows, 0)
            return lambda number: shared

        self._blocks = map_tree(lanes, values)

    def __call__(self, number: int) -> Values:
        values: Values = map_tree(lambda rows: rows(number), self._blocks)
        rest = _writable(values.springs.rest)  # the engine writes it when it knows the start
        values = values._replace(springs=values.springs._replace(rest=rest))
        travels = _writable(values.friction.terms)  # and these while circles slide on each other
        values = values._replace(friction=values.friction._replace(terms=travels))
        for kind in ("beams", "cables"):  # and these with the temperature
            members = values.beams if kind == "beams" else values.cables
            if len(members.free_strain_factors):
                members = members._replace(stiffness=_writable(members.stiffness))
                values = values._replace(**{kind: members})
        if not len(values.polynomials):
            return values
        return values._replace(functions=_writable(values.functions), rates=_writable(values.rates))


def _writable(lanes: np.ndarray) -> np.ndarray:
    """Return a copy of lanes."""
    copy = zeros(len(lanes))
    copy[:] = lanes
    return copy


def pack(
    system: System,
    times: np.ndarray,
    samples: np.ndarray | None = None,
    tolerance: float | None = None,
) -> Packed:
    """Return the blocks of samples for a run over `times` [s].

    With the tolerance of steps that are chosen freely, functions of time are polynomials.
    """
    terms = system.structure.terms
    first = system.structure.state.multiplier
    entries = zip(terms.f.tolist(), terms.k.tolist(), strict=True)
    driven = {f: system.constraints[k - first] for f, k in reversed(list(entries)) if f > 0}
    schedule, functions, rates, polynomials = tabulate(
        system.functions, driven, system.samples, times, tolerance=tolerance
    )
    values = system.values._replace(
        functions=functions.reshape(-1, functions.shape[-1]),
        rates=rates.reshape(-1, rates.shape[-1]),
        parts=schedule.parts,
        numbers=schedule.numbers.astype(float),
        moments=schedule.times,
    )
    if polynomials is not None:
        values = values._replace(
            functions=functions[0],
            rates=rates[0].reshape(-1, rates.shape[-1]),
            polynomials=polynomials.reshape(-1, polynomials.shape[-1]),
        )
    return Packed(schedule, values, samples)


def pack_end(system: System, times: np.ndarray, samples: np.ndarray | None) -> Packed:
    """Return blocks of a run whose last functions of time are those at the end of `times` [s]."""
    with without_warnings():
        return pack(system, times[-5:], samples)


def check_memory(
    system: System, times: int, threads: int, substeps: int, *, polynomials: bool = False
) -> None:
    """Raise `InputError` if a simulation with so many times takes more memory than there is."""
    samples = system.samples
    outputs = len(system.outputs)
    tables = (3 + COEFFICIENTS * polynomials) * (1 + len(system.functions))
    lanes = WIDTH * min(threads, -(-samples // WIDTH))
    per_sample = any(np.size(evaluate_function(f, 0.0)) > 1 for f in system.functions)
    tabulated = tables * ((samples + lanes) if per_sample else 1 + WIDTH)
    per_time = (
        samples * outputs / substeps + lanes * (system.sensor_row_count + outputs) + tabulated
    )
    check_affordable(
        f"{number_of(samples, 'sample')} of {number_of(outputs, 'output')} at "
        f"{number_of(times, 'time')}",
        per_time * times,
    )
