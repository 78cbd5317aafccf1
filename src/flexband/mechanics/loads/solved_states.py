"""First-order states of a force law: Newton's method for one sample.

A state y_k with the rate ẏ_k(y) solves y_k = b_k + τ_k ẏ_k, which is a step of a method for stiff
equations, or ẏ_k = 0 where τ_k is `laws.states.MARK.solved`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from llvmlite import ir
from numba import types

from flexband.compilation.functions import compiled, instruction


class Outcomes(NamedTuple):
    """What a law did: it raised an error, it ran, or no states agreed with their rates."""

    raised: int = 0
    ran: int = 1
    unsolved: int = 2


OUTCOME = Outcomes()


class StateSolver(NamedTuple):
    """How states are solved for. Sizes of states are relative to y, b and a part of τ ẏ.

    Attributes
    ----------
    iterations, halvings
        The most of Newton's method, and of each of its corrections.
    difference
        Displacement of the differences that derivatives of the rates are taken from.
    rate_part
        Part of τ ẏ that counts as the size of a state near zero. A stiff state changes by less.
    tolerance
        Of the last correction.
    stalled
        Correction that is small enough where rounding lets none be smaller.
    """

    iterations: int = 50
    halvings: int = 12
    difference: float = 1e-7
    rate_part: float = 1e-4
    tolerance: float = 1e-12
    stalled: float = 1e-8


SOLVER = StateSolver()


@instruction
def call_law(typingctx, address, t, x, v, y, p, force, rate, mode, gap):
    """Call the C function of a law with its time and arrays; return whether it raised no error."""
    arrays = x, v, y, p, force, rate, mode, gap

    def code(context, builder, sig, args):
        data = [
            context.make_array(kind)(context, builder, argument).data
            for kind, argument in zip(arrays, args[2:], strict=True)
        ]
        numbers = [args[1].type, *(pointer.type for pointer in data)]
        function = ir.FunctionType(ir.IntType(64), numbers).as_pointer()
        return builder.call(builder.inttoptr(args[0], function), [args[1], *data])

    return types.int64(types.int64, types.float64, *arrays), code


@instruction
def call_report(typingctx, address, lanes, lane, outcome):
    """Call the C function at `address` that notes why a law failed in a lane."""

    def code(context, builder, sig, args):
        number = ir.IntType(64)
        data = context.make_array(sig.args[1])(context, builder, args[1]).data
        function = ir.FunctionType(ir.VoidType(), [number] * 3).as_pointer()
        numbers = [builder.ptrtoint(data, number), *args[2:]]
        builder.call(builder.inttoptr(args[0], function), numbers)
        return context.get_dummy_value()

    return types.void(types.int64, lanes, types.int64, types.int64), code


@compiled
def evaluate(law, t, x, v, y, p, force, rate, mode, gap, b, tau, rest):
    """Call the law, and fill what its states miss; return whether it raised no error."""
    for k in range(force.size):
        force.flat[k] = 0.0
    for k in range(len(y)):
        rate[k] = 0.0
    ran = call_law(law, t, x, v, y, p, force, rate, mode, gap) != 0
    for k in range(len(y)):
        rest[k] = rate[k] if tau[k] < 0.0 else y[k] - b[k] - tau[k] * rate[k]
    return ran


@compiled
def differentiate(law, t, x, v, y, p, force, rate, mode, gap, b, tau, rest, other, size, J):
    """Fill J with the derivatives of `rest` by the states, of these sizes."""
    ran = True
    for k in range(len(y)):
        size[k] = max(abs(y[k]), abs(b[k]), SOLVER.rate_part * abs(tau[k] * rate[k]))
    for k in range(len(y)):
        before = y[k]
        y[k] = before + (SOLVER.difference * size[k] if size[k] > 0.0 else SOLVER.difference)
        width = y[k] - before
        ran = evaluate(law, t, x, v, y, p, force, rate, mode, gap, b, tau, other) and ran
        for i in range(len(y)):
            J[i, k] = (other[i] - rest[i]) / width
        y[k] = before
    return ran


@compiled
def solve(  # noqa: PLR0911, PLR0912
    law, t, x, v, y, p, force, rate, mode, gap, b, tau
):
    """Solve for the states of a law, and fill its forces and rates; return the outcome."""
    states = len(y)
    rest, move, before = np.empty(states), np.empty(states), np.empty(states)
    size, weight, other = np.empty(states), np.empty(states), np.empty(states)
    J, last = np.empty((states, states)), np.inf
    if not evaluate(law, t, x, v, y, p, force, rate, mode, gap, b, tau, rest):
        return OUTCOME.raised
    for _ in range(SOLVER.iterations):
        rests = False
        for k in range(states):
            rests = rests or rest[k] != 0.0
        if not rests:
            return OUTCOME.ran
        if not differentiate(
            law, t, x, v, y, p, force, rate, mode, gap, b, tau, rest, other, size, J
        ):
            return OUTCOME.raised
        for i in range(states):
            weight[i] = 1e-300
            for k in range(states):
                weight[i] = max(abs(J[i, k]) * size[k], weight[i])
            before[i], move[i] = y[i], -rest[i]
        excess = largest(rest, weight)
        eliminate(J, move)
        part = 1.0
        for _ in range(SOLVER.halvings):
            for k in range(states):
                y[k] = before[k] + part * move[k]
            if not evaluate(law, t, x, v, y, p, force, rate, mode, gap, b, tau, rest):
                return OUTCOME.raised
            remaining = largest(rest, weight)
            if remaining < excess or remaining < SOLVER.tolerance:
                break
            part = 0.5 * part
        for k in range(states):
            size[k] = max(abs(y[k]), size[k], 1e-300)
        change = largest(move, size)
        if not np.isfinite(change):
            return OUTCOME.unsolved
        if change < SOLVER.tolerance or (change < SOLVER.stalled and change > 0.5 * last):
            return OUTCOME.ran
        last = change
    return OUTCOME.unsolved


@compiled
def largest(values, sizes):
    """Return the largest of the absolute values over their sizes; NaN if one is NaN."""
    top = 0.0
    for k in range(len(values)):
        ratio = abs(values[k]) / sizes[k]
        if ratio > top or np.isnan(ratio):
            top = ratio
    return top


@compiled
def eliminate(matrix, x):
    """Replace x by the solution of matrix @ solution = x, by elimination with exchanged rows."""
    n = len(x)
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        for j in range(n):
            matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
        x[k], x[pivot] = x[pivot], x[k]
        for i in range(k + 1, n):
            factor = matrix[i, k] / matrix[k, k]
            for j in range(k, n):
                matrix[i, j] -= factor * matrix[k, j]
            x[i] -= factor * x[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            x[k] -= matrix[k, j] * x[j]
        x[k] /= matrix[k, k]
