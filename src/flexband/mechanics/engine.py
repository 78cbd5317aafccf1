"""The one entry of the engine.

Whatever calls the kernels has all of them compiled once more, so there is one entry for all tasks
and not one for each.
"""

from __future__ import annotations

import numpy as np

from flexband.lanes import cached, filled
from flexband.mechanics.equations import sense, tangent
from flexband.mechanics.generalized_alpha import march
from flexband.mechanics.initial import start
from flexband.mechanics.settle import settle

START, MARCH, SETTLE, LINEARIZE, SENSE = range(5)


@cached
def run_block(task, structure, method, number, values, work, outputs, failure):
    """Do a task for one block of samples, whose state is `work.z`.

    Parameters
    ----------
    task : START fills the state at time zero; MARCH simulates from there; SETTLE moves to an
        equilibrium; LINEARIZE sets the matrix to that of Newton's method at rest; SENSE reads the
        sensors.
    method : `Coefficients` of the integrator, for MARCH.
    number : tolerance of Newton's method for MARCH, weight of the stiffness for LINEARIZE.
    outputs : filled by MARCH, shape (times, rows, WIDTH), and, the first time, by SETTLE and SENSE.
    failure : shape (4, WIDTH): code of the failure, 0 for none, the number of its time, the row of
        Φ to blame, −1 or less for none, and a multiplier that is not unique.
    """
    now = np.int64(0)
    if task == START:
        start(structure, values, work, failure)
    elif task == MARCH:
        march(structure, method, number, values, work, outputs, failure)
    elif task == SETTLE:
        settle(structure, values, work, outputs[0], failure)
    elif task == LINEARIZE:
        weight = filled(number)
        tangent(structure, values, now, work.z, weight, 0.0, work.matrix, work.blocks)
    else:
        sense(structure, values, now, work.z, outputs[0])
