"""The entries of the engine: one for dynamics, one with steps that lanes choose, one for statics.

Every entry compiles all kernels that it calls, so tasks share an entry. The second and the third
are compiled when they are first used.
"""

from __future__ import annotations

import numpy as np

from flexband.mechanics.engine.free_steps.impacts import strike_at_start
from flexband.mechanics.engine.free_steps.march import march_freely
from flexband.mechanics.engine.initial_conditions import start
from flexband.mechanics.engine.march import march
from flexband.mechanics.engine.static_solver import settle
from flexband.mechanics.kernels.equations import loads, residual, sense, tangent
from flexband.mechanics.kernels.lanes import cached, splat

START, HOLD, MARCH, SETTLE, SENSE, RESIDUAL, LOADS, LINEARIZE, STRIKE = range(9)


@cached
def dynamics(task, structure, method, number, values, work, outputs, failure, stop):
    """Perform a task for one block of samples, whose state is `work.z`.

    Parameters
    ----------
    task : START fills the state at time zero, HOLD does so about the deformations in it; MARCH
        simulates from there.
    method : `Coefficients` of the integrator, for MARCH.
    number : tolerance of Newton's method, for MARCH; see `start` for HOLD.
    outputs : filled by MARCH, shape (times, rows, WIDTH).
    failure : shape (4, WIDTH): the code of the failure (0 for none), the number of its time, the
        row of Φ that caused it (negative for none), and how many multipliers the start left out.
    stop : one row; MARCH and SETTLE end early once it is not zero.
    """
    if task == START:
        start(structure, values, work, failure, False, 1.0)
    elif task == HOLD:
        start(structure, values, work, failure, True, number)
    else:
        march(structure, method, number, values, work, outputs, failure, stop)


@cached
def free_dynamics(task, structure, method, limits, number, values, work, outputs, failure, stop):
    """Perform a task for one block of samples whose lanes choose their steps.

    Parameters are those of `dynamics`, and `limits`, the `StepLimits` of the run. MARCH simulates
    from the start; `method` is that of a step of the output, and the last of the outputs are work
    space. STRIKE changes the velocities by an impact to those that agree with the joints.
    """
    if task == STRIKE:
        strike_at_start(structure, method, values, work, limits, failure)
    else:
        march_freely(structure, method, limits, number, values, work, outputs, failure, stop)


@cached
def statics(task, structure, method, number, values, work, outputs, failure, stop):
    """Perform a task for one block of samples at rest; parameters are those of `dynamics`.

    SETTLE moves to an equilibrium and reads the sensors on its way, see `settle`; SENSE reads them
    and fills the first outputs. RESIDUAL and LOADS set `work.r`. LINEARIZE sets the matrix to
    [M + K + number × C, Φ_qᵀ; Φ_q, 0].
    """
    now = np.int64(0)
    if task == SETTLE:
        settle(structure, values, work, outputs, failure, stop)
    elif task == SENSE:
        sense(structure, values, now, work.z, outputs[0], work.blocks)
    elif task == LOADS:
        loads(structure, values, now, work.z, work.r, work.blocks)
    else:
        residual(structure, values, now, work.z, work.r, work.blocks)
        if task == LINEARIZE:
            tangent(structure, values, now, work.z, splat(1.0), number, work.matrix, work.blocks)
