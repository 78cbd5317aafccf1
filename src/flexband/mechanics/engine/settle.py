"""Static equilibrium of one block of samples, on lanes: Newton's method on the whole residual.

With a = v = 0 Eq. (26) asks for F(q) + Φ_qᵀλ = Q and Φ(q) = 0. The matrix is that of the
integrator, [M + w K, Φ_qᵀ; Φ_q, 0]; M/w keeps steps short while w is small, and w grows as steps
shrink, so that in the end they are Newton's.
"""

from __future__ import annotations

import numpy as np

from flexband.mechanics.kernels.equations import residual, sense, tangent, to_right_side
from flexband.mechanics.kernels.factorization import factorize, solve
from flexband.mechanics.kernels.lanes import (
    any_true,
    filled,
    inlined,
    less,
    load,
    magnitude,
    maximum,
    store,
    where,
)

ITERATIONS = 200
TOLERANCE = 1e-10  # of the last step, relative to the size of the mechanism
LONGEST = 0.1  # a step is cut to this, relative to the size
GROWTH, MOST = 10.0, 1e3  # of w from step to step, and in all

NOT_SETTLED = 6.0


@inlined
def settle(structure, values, work, outputs, failure):
    """Move from the state in `work.z` to an equilibrium under the loads of `values`.

    `outputs`, shape (rows, WIDTH), gets the sensors' rows; `failure` is brought up to date.
    """
    z, r, matrix, pivots = work.z, work.r, work.matrix, work.inverse_pivots
    now = np.int64(0)
    for i in range(1, structure.coordinates + 1):
        store(z, structure.velocity + i, filled(0.0))
        store(z, structure.acceleration + i, filled(0.0))
    moving = where(load(failure, 0), filled(0.0), filled(1.0))
    least, w = load(values.rigidity, 0), load(values.rigidity, 0)
    for _ in range(ITERATIONS):
        residual(structure, values, now, z, r, work.blocks)
        tangent(structure, values, now, z, w, 0.0, matrix, work.blocks)
        factorize(structure.pattern, matrix, pivots, work.row)
        to_right_side(structure, r, w)
        solve(structure.pattern, matrix, pivots, r)
        largest = filled(0.0)
        for i in range(1, structure.coordinates + 1):
            largest = maximum(largest, magnitude(w * load(r, i)) * load(values.inverse_scale, i))
        part = where(less(largest, filled(LONGEST)), filled(1.0), LONGEST / largest)
        for i in range(1, structure.pattern.unknowns + 1):
            step = part * load(r, i)
            if i <= structure.coordinates:
                step = w * step
            store(z, i, where(moving, load(z, i) + step, load(z, i)))
        grown = less(w, 0.99 * MOST * least)
        short = less(largest, filled(LONGEST))
        done = where(grown, filled(0.0), less(largest, filled(TOLERANCE)))
        moving = where(done, filled(0.0), moving)
        w = where(short, where(grown, GROWTH * w, w), w)
        if not any_true(moving):
            break
    sense(structure, values, now, z, outputs)
    store(failure, 0, where(moving, filled(NOT_SETTLED), load(failure, 0)))
