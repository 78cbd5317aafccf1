"""Static equilibrium of one block of samples, on lanes: Newton's method on the whole residual.

With a = v = 0, Eq. (26) becomes F(q) + Φ_qᵀλ = Q and Φ(q) = 0. The matrix is that of the
integrator, [M + w K, Φ_qᵀ; Φ_q, 0]. M/w keeps the steps short while w is small; w grows as the
steps shrink, so that the last steps are Newton's.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexband.mechanics.engine.initial_conditions import ASSEMBLY
from flexband.mechanics.kernels.equations import residual, sense, tangent, to_right_side, watch
from flexband.mechanics.kernels.factorization import backward, factorize
from flexband.mechanics.kernels.failure_codes import FAILURE
from flexband.mechanics.kernels.lanes import (
    any_true,
    compiled,
    less,
    load,
    magnitude,
    maximum,
    splat,
    store,
    where,
)
from flexband.mechanics.kernels.running_extremes import begin_extremes


class StaticOptions(NamedTuple):
    """How a rest is found. Lengths are relative to the size of the mechanism."""

    iterations: int = 200
    """Of Newton's method, at most."""
    tolerance: float = 1e-10
    """Of the last step."""
    max_step: float = 0.1
    """Longer steps are shortened."""
    growth: float = 10.0
    """Of the weight w from one step to the next."""
    total_growth: float = 1e3
    """Of w over all steps."""


STATIC = StaticOptions()


@compiled
def settle(structure, values, work, outputs, failure, stop):
    """Move from the state in `work.z` to an equilibrium under the loads of `values`.

    Fills `outputs`, shape (`STATIC.iterations` + 1, rows, WIDTH), with the sensors' rows at the
    start and after every iteration that is made, and updates `failure`.
    """
    state = structure.state
    z = work.z
    r = work.r
    matrix = work.matrix
    now = np.int64(0)
    # Begin at rest.
    for i in range(1, state.coordinates + 1):
        store(z, state.velocity + i, splat(0.0))
        store(z, state.acceleration + i, splat(0.0))
    moving = where(load(failure, 0), splat(0.0), splat(1.0))
    first_weight = load(values.rigidity, 0)
    w = load(values.rigidity, 0)
    begin_extremes(structure.extremes, state, z)
    all_lanes = splat(1.0)
    for n in range(STATIC.iterations + 1):
        watch(structure, values, now, work, splat(max(n - 1.0, 0.0)), splat(1.0 * n), all_lanes)
        sense(structure, values, now, z, outputs[n], work.blocks)
        if n == STATIC.iterations or any_true(load(stop, 0)) or not any_true(moving):
            break
        # Solve for a step, and limit its length.
        residual(structure, values, now, z, r, work.blocks)
        tangent(structure, values, now, z, w, 0.0, matrix, work.blocks)
        to_right_side(structure, r, w)
        factorize(structure.pattern, matrix, splat(ASSEMBLY.min_pivot), r)
        backward(structure.pattern, matrix, (r,))
        largest = splat(0.0)
        for i in range(1, state.coordinates + 1):
            largest = maximum(largest, magnitude(w * load(r, i)) * load(values.inverse_scale, i))
        part = where(less(largest, splat(STATIC.max_step)), splat(1.0), STATIC.max_step / largest)
        for i in range(1, state.angle):
            step = part * load(r, i)
            if i <= state.coordinates:
                step = w * step
            store(z, i, where(moving, load(z, i) + step, load(z, i)))
        # Let the weight of the stiffness grow while steps are short.
        grown = less(w, 0.99 * STATIC.total_growth * first_weight)
        short = less(largest, splat(STATIC.max_step))
        done = where(grown, splat(0.0), less(largest, splat(STATIC.tolerance)))
        moving = where(done, splat(0.0), moving)
        w = where(short, where(grown, STATIC.growth * w, w), w)
    store(failure, 0, where(moving, splat(FAILURE.not_settled), load(failure, 0)))
