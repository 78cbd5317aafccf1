"""From arrays over samples to blocks of lanes, for a run over given times."""

from __future__ import annotations

import numpy as np

from flexband.errors import InputError, finite
from flexband.lanes import to_lanes
from flexband.mechanics.assembly import System
from flexband.mechanics.equations import Values


def pack(system: System, times: np.ndarray) -> list[Values]:
    """Return the numbers of each block of samples, for a run over `times` [s].

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
    packed = {name: to_lanes(values) for name, values in rows.items()}
    blocks = max(len(v) for v in packed.values())
    return [
        Values(**{name: v[b if len(v) > 1 else 0] for name, v in packed.items()})
        for b in range(blocks)
    ]


# Weights of seven equidistant values for f, f′ and f″ at the first of them: motion starts there,
# so what the function does before does not count.
_DERIVATIVES = np.linalg.inv(np.vander(np.arange(7.0), increasing=True))[:3] * [[1.0], [1.0], [2.0]]


def _tabulate(system: System, times: np.ndarray) -> np.ndarray:
    """Return the functions at the times, the constant one first, shape (times, functions, n)."""
    values = [
        [np.atleast_1d(finite(f"function at t = {t:g} s", f(float(t)))) for f in system.functions]
        for t in times
    ]
    samples = max((len(v) for row in values for v in row), default=1)
    if samples not in (1, system.samples):
        raise InputError(
            f"a function of time returned {samples} values; the mechanism has "
            f"{system.samples} samples"
        )
    table = np.ones((len(times), len(system.functions) + 1, samples))
    for t, row in enumerate(values):
        for f, value in enumerate(row):
            table[t, f + 1] = value
    return table
