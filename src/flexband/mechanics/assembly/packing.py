"""From arrays over samples to blocks of lanes, for a run over given times."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from flexband.errors import InputError, named, returned
from flexband.mechanics.assembly.derivatives import derivatives
from flexband.mechanics.assembly.events import resolved_loads, warn_of_rate_jumps
from flexband.mechanics.assembly.jumps import refuse_jumps
from flexband.mechanics.assembly.stacking import mapped
from flexband.mechanics.assembly.structure import Values
from flexband.mechanics.assembly.system import System
from flexband.mechanics.forms import Composed, TimeFunction
from flexband.mechanics.kernels.lane_type import to_lanes, zeros
from flexband.smoothness import prescribing
from flexband.words import number_of

AT_START = np.array([0.0, 1e-4])
"""Times [s] of a run that only starts: drives are differentiated over such a step."""


def pack(
    system: System, times: np.ndarray, samples: np.ndarray | None = None
) -> Callable[[int], Values]:
    """Return a function that gives the numbers of a block of samples, for a run over `times` [s].

    The blocks are those of all samples, or of the samples with these numbers. A block is made when
    it is needed, so that only the blocks at work take memory.

    Raises
    ------
    InputError
        If a function of time returns values that are not finite or not one number per sample, or
        one that prescribes a motion jumps.
    """
    functions, rates = _tabulate(system, times)
    values = system.values._replace(
        functions=functions.reshape(-1, functions.shape[-1]),
        rates=rates.reshape(-1, rates.shape[-1]),
    )

    def lanes(rows: np.ndarray) -> Callable[[int], np.ndarray]:
        """Return a function that gives a block of an array; samples share an array of width 1."""
        if rows.shape[1] > 1:
            return partial(to_lanes, rows if samples is None else rows[:, samples])
        shared = to_lanes(rows, 0)
        return lambda number: shared

    blocks = mapped(lanes, values)

    def block(number: int) -> Values:
        own: Values = mapped(lambda rows: rows(number), blocks)
        rest = zeros(len(own.springs.rest))  # the engine writes it when it knows the start
        rest[:] = own.springs.rest
        return own._replace(springs=own.springs._replace(rest=rest))

    return block


def _tabulate(system: System, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return 1 and the functions of time, shape (times, 1 + functions, n), and f′ and f″ of each.

    The derivatives, shape (times, 2, 1 + functions, n), are those of the functions in constraints.
    Those of all other functions, which may jump, are not needed and zero.
    """
    driven = set(system.structure.terms.f.tolist())
    half = (times[1] - times[0]) / 2
    fine = times[0] + half * np.arange(max(2 * len(times) - 1, 7))
    values, rates = [np.ones((len(times), 1))], [np.zeros((len(times), 2, 1))]
    inner: dict[TimeFunction, np.ndarray] = {}
    motions: dict[TimeFunction, tuple[str, int]] = {}
    many = len(times) > len(AT_START)
    for f, function in enumerate(system.functions, start=1):
        if f in driven:
            name = _prescribed_by(system, f)
            with prescribing(name):
                if isinstance(function, Composed):
                    own = function.inner
                    if own not in inner:
                        inner[own] = _values(own, system.samples, fine, function.name)
                    table = function.outer(inner[own])
                else:
                    table = _values(function, system.samples, fine)
            refuse_jumps(name, function, fine, table)
            motion = function.inner if isinstance(function, Composed) else function
            motions[motion] = name, table.shape[1]
            values.append(table[::2][: len(times)])
            rates.append(derivatives(table, half)[: len(times)])
        else:
            table = _values(function, system.samples, times)
            values.append(resolved_loads(function, times, table) if many else table)
            rates.append(np.zeros((len(times), 2, 1)))
    for motion, (name, columns) in motions.items() if many else ():
        with prescribing(name):
            warn_of_rate_jumps(name, motion, times, columns)
    most = max(column.shape[-1] for column in values)
    return (
        np.stack([np.broadcast_to(v, (len(times), most)) for v in values], axis=1),
        np.stack([np.broadcast_to(r, (len(times), 2, most)) for r in rates], axis=2),
    )


def _prescribed_by(system: System, f: int) -> str:
    """Return the name of the constraint in which a function of time enters."""
    terms, state = system.structure.terms, system.structure.state
    return system.constraints[terms.k[np.flatnonzero(terms.f == f)[0]] - state.multiplier]


def _values(function: TimeFunction, samples: int, times: np.ndarray, name: str = "") -> np.ndarray:
    """Return a function of time at the times, shape (times, n) or (times, 1)."""
    values = [returned(function, time, name) for time in times.tolist()]
    counts = {np.size(v) for v in values if type(v) is not float} - {1}
    if counts - {samples}:
        raise InputError(
            f"{named(function)} returned {number_of(max(counts), 'value')}; the mechanism has "
            f"{number_of(samples, 'sample')}"
        )
    if counts:
        values = [np.broadcast_to(v, samples) for v in values]
    table = np.array(values, dtype=float).reshape(len(times), -1)
    if not np.all(np.isfinite(table)):
        bad = times[np.flatnonzero(~np.isfinite(table).all(axis=1))[0]]
        raise InputError(f"{named(function)} must be finite; it is not at t = {bad:g} s")
    return table
