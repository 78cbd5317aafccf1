"""From arrays over samples to blocks of lanes, for a run over given times."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flexband.errors import InputError
from flexband.mechanics.assembly.structure import (
    AngleValues,
    BeamValues,
    CableValues,
    LawValues,
    SpringValues,
    Values,
)
from flexband.mechanics.assembly.system import System
from flexband.mechanics.kernels.lanes import to_lanes

AT_START = np.array([0.0, 1e-4])
"""Times [s] of a run that only starts: drives are differentiated over such a step."""

WRITTEN = ("springs.rest_length", "laws.parameter")
"""What is known after assembly only: each block needs rows of its own."""


def pack(
    system: System, times: np.ndarray, samples: np.ndarray | None = None
) -> Callable[[int], Values]:
    """Return a function that gives the numbers of a block of samples, for a run over `times` [s].

    The blocks are those of all samples, or of the samples with these numbers.
    Blocks are made when they are asked for, so that only those at work take memory.

    Raises
    ------
    InputError
        Where a function of time returns what is not finite or not one number a sample.
    """
    step = times[1] - times[0]
    functions = _tabulate(system, times)
    rates = np.einsum("dt,tfn->dfn", _DERIVATIVES, _tabulate(system, np.arange(7) * step / 4))
    rates /= (step / 4) ** np.arange(3)[:, None, None]
    rows = system.rows | {
        "functions": functions.reshape(-1, functions.shape[-1]),
        "rates": rates.reshape(-1, rates.shape[-1]),
    }
    if samples is not None:
        rows = {k: v if v.shape[1] == 1 else v[:, samples] for k, v in rows.items()}
    shared = {k: to_lanes(v, 0) for k, v in rows.items() if v.shape[1] == 1 and k not in WRITTEN}

    def block(number: int) -> Values:
        own = {name: values for name, values in rows.items() if name not in shared}
        return _values(shared | {name: to_lanes(v, number) for name, v in own.items()})

    return block


def _values(rows: dict[str, np.ndarray]) -> Values:
    """Return the numbers of a block from names with dots for parts."""

    def part(prefix: str) -> dict[str, np.ndarray]:
        return {k.removeprefix(prefix): v for k, v in rows.items() if k.startswith(prefix)}

    return Values(
        **{name: v for name, v in rows.items() if "." not in name},
        beams=BeamValues(**part("beams.")),
        cables=CableValues(**part("cables.")),
        springs=SpringValues(**part("springs.")),
        angles=AngleValues(**part("angles.")),
        laws=LawValues(**part("laws.")),
    )


# Weights of seven equidistant values for f, f′ and f″ at the first of them: motion starts there,
# so what the function does before does not count.
_DERIVATIVES = np.linalg.inv(np.vander(np.arange(7.0), increasing=True))[:3] * [[1.0], [1.0], [2.0]]


def _tabulate(system: System, times: np.ndarray) -> np.ndarray:
    """Return the functions at the times, the constant one first, shape (times, functions, n)."""
    columns = [np.ones((len(times), 1))]
    for function in system.functions:
        values = [function(float(t)) for t in times]
        counts = {np.size(v) for v in values} - {1, system.samples}
        if counts:
            raise InputError(
                f"a function of time returned {max(counts)} values; the mechanism has "
                f"{system.samples} samples"
            )
        if any(np.size(v) > 1 for v in values):
            values = [np.broadcast_to(v, system.samples) for v in values]
        columns.append(np.array(values, dtype=float).reshape(len(times), -1))
        if not np.all(np.isfinite(columns[-1])):
            bad = times[np.flatnonzero(~np.isfinite(columns[-1]).all(axis=1))[0]]
            raise InputError(f"a function of time must be finite; it is not at t = {bad:g} s")
    samples = max(c.shape[1] for c in columns)
    return np.stack([np.broadcast_to(c, (len(times), samples)) for c in columns], axis=1)
