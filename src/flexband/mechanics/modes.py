"""Natural frequencies and mode shapes about a configuration, subject to the constraints.

Small motions about an equilibrium satisfy M δq̈ + K δq + Φ_qᵀ δλ = 0 and Φ_q δq = 0, where K
includes the curvature of the constraints under their multipliers. On the null space of Φ_q this is
a symmetric eigenproblem.
"""

from __future__ import annotations

from functools import partial
from typing import Literal

import numpy as np
import xarray as xr
from scipy.linalg import eigh, null_space

from flexband.errors import known, whole
from flexband.mechanics.assembly.packing import AT_START, pack
from flexband.mechanics.assembly.structure import Values, Work
from flexband.mechanics.assembly.system import System, assemble
from flexband.mechanics.engine.batch import begin, derive, run
from flexband.mechanics.engine.entries import LINEARIZE, SENSE
from flexband.mechanics.engine.failures import raise_failures
from flexband.mechanics.engine.redundancy import RANK
from flexband.mechanics.engine.threads import interruptible, while_compiling
from flexband.mechanics.equilibrium import rest
from flexband.mechanics.kernels.factorization import to_dense
from flexband.mechanics.kernels.lanes import WIDTH
from flexband.mechanics.mechanism import Mechanism

NUDGE = 1e-6
"""Displacement of the central differences that differentiate the sensors."""


def modes(
    mechanism: Mechanism,
    count: int,
    *,
    about: Literal["start", "equilibrium"] = "equilibrium",
    steps: int = 1,
) -> xr.Dataset:
    """Compute the lowest natural frequencies of a mechanism, without damping.

    Parameters
    ----------
    count : number of modes; all are returned if there are fewer.
    about : "equilibrium" (as `equilibrium` finds it) or "start", the assembled guess.
    steps : as in `equilibrium`.

    Returns
    -------
    Dataset with `frequency` [Hz], dim (mode,), in ascending order: negative if a small motion
    grows, and 0 up to rounding if it is free; and `shape`, dims (mode, output): the change of the
    sensors' outputs with a mode of modal mass 1 kg. There is a first dim "sample" if a parameter is
    an array of more than one value.

    Raises
    ------
    InputError
        If a number is out of its range or numbers of samples do not fit.
    AssemblyError
        If the constraints cannot be met or no equilibrium is found for a sample.
    """
    whole("count", count, 1)
    known("about", about, ["start", "equilibrium"])
    system = assemble(mechanism)
    packed = pack(system, AT_START)
    failures = np.zeros((system.samples, 4))
    found = []
    for block in range(-(-system.samples // WIDTH)):
        values, own = packed(block), np.arange(system.samples)[block * WIDTH :][:WIDTH]
        work, failure, M, K, Phi = while_compiling(partial(_linear, system, values, about, steps))
        failures[own] = failure.T[: len(own)]
        for lane in range(len(own)):
            if failures[own[lane], 0] == 0:
                one = partial(_solve, M[lane], K[lane], Phi[lane], count)
                squares, vectors = interruptible(one)
                found.append((squares, _shapes(system, values, work, lane, vectors)))
    raise_failures(failures, system, np.zeros(1))
    squares, shapes = (np.stack(parts) for parts in zip(*found, strict=True))
    frequency = np.sign(squares) * np.sqrt(np.abs(squares)) / (2 * np.pi)
    result = xr.Dataset(
        {
            "frequency": (("sample", "mode"), frequency, {"units": "Hz"}),
            "shape": (("sample", "mode", "output"), shapes),
        },
        coords={"output": system.outputs, "unit": ("output", system.units)},
    )
    return result if system.samples > 1 else result.isel(sample=0)


def _solve(M: np.ndarray, K: np.ndarray, Phi: np.ndarray, count: int):
    """Return the lowest ω², and their vectors as columns, normalized by the mass matrix."""
    free = null_space(Phi, rcond=RANK) if len(Phi) else np.eye(len(M))
    last = min(count, free.shape[1]) - 1
    squares, vectors = eigh(free.T @ K @ free, free.T @ M @ free, subset_by_index=[0, last])
    return squares, free @ vectors


def _shapes(system: System, values, work: Work, lane: int, vectors: np.ndarray):
    """Return the outputs' derivatives along each vector, shape (modes, outputs)."""
    rows, z = np.zeros((system.sensed, WIDTH)), work.z.copy()
    shapes = []
    for vector in vectors.T:
        size = NUDGE / np.abs(vector).max()
        sides = []
        for sign in (1.0, -1.0):
            z[1 : 1 + len(vector), lane] = work.z[1 : 1 + len(vector), lane] + sign * size * vector
            run(SENSE, system, values, work._replace(z=z), rows[None])
            sides.append(derive(system, rows[:, None].copy())[:, 0, lane])
        shapes.append((sides[0] - sides[1]) / (2 * size))
    return np.stack(shapes)


def _linear(system: System, values: Values, about: str, steps: int):
    """Return the state, failures, and M, K and Φ_q for every lane, shapes (WIDTH, …)."""
    if about == "equilibrium":
        _, failure, work = rest(system, values, steps)
    else:
        work, failure = begin(system, values)
    count, dense = system.structure.state.coordinates, []
    for weight in (0.0, 1.0):
        run(LINEARIZE, system, values, work, failure=failure, number=weight)
        dense.append(to_dense(system.structure.pattern, work.matrix))
    q, multipliers = slice(0, count), slice(count, None)
    K = (dense[1] - dense[0])[:, q, q]
    return work, failure, dense[0][:, q, q], K, dense[0][:, multipliers, q]
