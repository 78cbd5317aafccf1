"""A force law for one sample: its first-order states, by Newton's method, and its derivatives.

A state y_k with the rate ẏ_k(y) solves y_k = b_k + τ_k ẏ_k, which is a step of a method for stiff
equations, or ẏ_k = 0 where τ_k is `laws.states.MARK.solved`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from llvmlite import ir
from numba import types

from flexband.compilation.functions import compiled, instruction
from flexband.mechanics.loads.lines import add_lines, pass_on


class Outcomes(NamedTuple):
    """What a law did: it raised an error, it ran, or no states agreed with their rates."""

    error: int = 0
    ran: int = 1
    unsolved: int = 2


OUTCOME = Outcomes()


class StateSolver(NamedTuple):
    """How states are solved for. Sizes of states are relative to y, b and a part of τ ẏ."""

    iterations: int = 50
    """Of Newton's method, at most."""
    halvings: int = 12
    """Of each of its corrections, at most."""
    difference: float = 1e-7
    """Displacement of the differences that derivatives are taken from."""
    rate_part: float = 1e-4
    """Of τ ẏ, the size of a state near zero; a stiff one changes by less."""
    tolerance: float = 1e-12
    """Of what the last correction leaves."""
    stalled: float = 1e-8
    """Of the last correction where rounding lets none be smaller."""
    regular: float = 0.1
    """Correction after which the next ones shrink as their ratio says."""
    reuse_ratio: float = 0.01
    """Ratio of two corrections below which derivatives serve once more."""


SOLVER = StateSolver()


class LawArrays(NamedTuple):
    """What a law reads and fills for one sample, rows of lines behind those of points."""

    x: np.ndarray
    v: np.ndarray
    y: np.ndarray
    p: np.ndarray
    force: np.ndarray
    rate: np.ndarray
    mode: np.ndarray
    gap: np.ndarray


class LawCall(NamedTuple):
    """The address of a law, its time, its points, its lines, and what its states solve."""

    law: int
    t: float
    points: int
    lines: np.ndarray
    b: np.ndarray
    tau: np.ndarray


class Scratch(NamedTuple):
    """Memory for the solution of a law with n states; matrices are row by row."""

    rest: np.ndarray
    other: np.ndarray
    move: np.ndarray
    before: np.ndarray
    size: np.ndarray
    weight: np.ndarray
    jacobian: np.ndarray  # derivatives of the rest, (n, n)
    factors: np.ndarray
    by_state: np.ndarray  # derivatives of the forces, (3 points, n)
    by_axis: np.ndarray  # derivatives of the rest, (n, 3 points)


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
def scratch_of(memory, states, axes):
    """Return the `Scratch` of a law in an array of `scratch_size` numbers."""
    n = states
    square = states * states
    rectangle = states * axes
    first = 6 * n
    return Scratch(
        memory[:n], memory[n : 2 * n], memory[2 * n : 3 * n], memory[3 * n : 4 * n],
        memory[4 * n : 5 * n], memory[5 * n : first], memory[first : first + square],
        memory[first + square : first + 2 * square],
        memory[first + 2 * square : first + 2 * square + rectangle],
        memory[first + 2 * square + rectangle :],
    )  # fmt: skip


@compiled
def scratch_size(states, axes):
    """Return how many numbers the `Scratch` of a law takes."""
    return 2 * states * (3 + states + axes)


@compiled
def evaluate(call, arrays, rest):
    """Call the law, and fill what its states miss; return whether it raised no error."""
    x, v, y, p, force, rate, mode, gap = arrays
    for k in range(force.size):
        force.flat[k] = 0.0
    for k in range(len(y)):
        rate[k] = 0.0
    for k in range(len(gap)):
        gap[k] = 0.0
    ran = call_law(call.law, call.t, x, v, y, p, force, rate, mode, gap) != 0
    for k in range(len(y)):
        tau = call.tau[k]
        rest[k] = rate[k] if tau < 0.0 else y[k] - call.b[k] - tau * rate[k]
    return ran


@compiled
def size_of(call, arrays, k):
    """Return the size of state k."""
    rate = SOLVER.rate_part * abs(call.tau[k] * arrays.rate[k])
    return max(abs(arrays.y[k]), abs(call.b[k]), rate)


@compiled
def differentiate(call, arrays, scratch):
    """Fill the derivatives of the rest by the states; return whether the law raised no error."""
    ran = True
    y = arrays.y
    J = scratch.jacobian
    for k in range(len(y)):
        scratch.size[k] = size_of(call, arrays, k)
    for k in range(len(y)):
        before = y[k]
        size = scratch.size[k]
        y[k] = before + (SOLVER.difference * size if size > 0.0 else SOLVER.difference)
        width = y[k] - before
        ran = evaluate(call, arrays, scratch.other) and ran
        for i in range(len(y)):
            J[i * len(y) + k] = (scratch.other[i] - scratch.rest[i]) / width
        y[k] = before
    return ran


@compiled
def solve(call, arrays, scratch):  # noqa: PLR0911, PLR0912
    """Solve for the states of a law, and fill its forces and rates; return the outcome.

    Derivatives serve for the next correction too where those before show that it will do.
    """
    y = arrays.y
    states = len(arrays.y)
    rest = scratch.rest
    move = scratch.move
    before = scratch.before
    size = scratch.size
    last = np.inf
    fresh = True
    if not evaluate(call, arrays, rest):
        return OUTCOME.error
    for _ in range(SOLVER.iterations):
        # Solved, if nothing is missing at all.
        rests = False
        for k in range(states):
            rests = rests or rest[k] != 0.0
        if not rests:
            return OUTCOME.ran
        # Differentiate anew, and weigh each equation by its terms.
        if fresh:
            if not differentiate(call, arrays, scratch):
                return OUTCOME.error
            for i in range(states):
                scratch.weight[i] = 1e-300
                for k in range(states):
                    part = abs(scratch.jacobian[i * states + k]) * size[k]
                    scratch.weight[i] = max(part, scratch.weight[i])
        # Newton's correction.
        for i in range(states):
            before[i] = y[i]
            move[i] = -rest[i]
        excess = largest(rest, scratch.weight)
        eliminate(scratch, move)
        # Halve it until the equations are better met.
        part = 1.0
        for _ in range(SOLVER.halvings):
            for k in range(states):
                y[k] = before[k] + part * move[k]
            if not evaluate(call, arrays, rest):
                return OUTCOME.error
            remaining = largest(rest, scratch.weight)
            if remaining < excess or remaining < SOLVER.tolerance:
                break
            part = 0.5 * part
        # Stop where what remains is rounding.
        for k in range(states):
            size[k] = max(abs(y[k]), size[k], 1e-300)
        change = largest(move, size)
        if not np.isfinite(change):
            return OUTCOME.unsolved
        regular = part == 1.0 and last < SOLVER.regular
        error = change * min(change / last, 1.0) if regular else change
        if error < SOLVER.tolerance or (change < SOLVER.stalled and change > 0.5 * last):
            return OUTCOME.ran
        # Keep the derivatives while corrections shrink fast.
        reference = last if last < np.inf else 1.0
        fresh = part < 1.0 or change > SOLVER.reuse_ratio * reference
        last = change
    return OUTCOME.unsolved


@compiled
def fill_stiffness(call, arrays, nudge, pace, stiffness, scratch):  # noqa: PLR0912
    """Fill −∂force/∂x in which the states, solved for, follow x; return whether all went well.

    `stiffness` is (3 points, 3 points), row by row. Derivatives are central differences of x by
    `nudge` and, at once, of v by `pace`; an axis whose nudge is 0 does not move.
    """
    x = arrays.x
    v = arrays.v
    y = arrays.y
    force = arrays.force
    axes = len(nudge)
    states = len(y)
    ran = True
    by_axis = scratch.by_axis
    by_state = scratch.by_state
    for k in range(states):
        scratch.size[k] = size_of(call, arrays, k)
    # Differences of the places, with all states as they are.
    for j in range(axes):
        place = x.flat[j]
        speed = v.flat[j]
        for i in range(axes):
            stiffness[i * axes + j] = 0.0
        for k in range(states):
            by_axis[k * axes + j] = 0.0
        if nudge[j] == 0.0:
            continue
        for sign in (1.0, -1.0):
            x.flat[j] = place + sign * nudge[j]
            v.flat[j] = speed + sign * pace[j]
            add_lines(call.lines, call.points, x, v)
            ran = evaluate(call, arrays, scratch.rest) and ran
            pass_on(call.lines, call.points, x, force)
            for i in range(axes):
                stiffness[i * axes + j] -= (0.5 * sign) * force.flat[i] / nudge[j]
            for k in range(states):
                by_axis[k * axes + j] += (0.5 * sign) * scratch.rest[k] / nudge[j]
        x.flat[j] = place
        v.flat[j] = speed
    # Differences of the states, with all places as they are.
    add_lines(call.lines, call.points, x, v)
    for k in range(states):
        for i in range(axes):
            by_state[i * states + k] = 0.0
        for i in range(states):
            scratch.jacobian[i * states + k] = 0.0
        before = y[k]
        size = scratch.size[k]
        width = SOLVER.difference * size if size > 0.0 else SOLVER.difference
        for sign in (1.0, -1.0):
            y[k] = before + sign * width
            ran = evaluate(call, arrays, scratch.rest) and ran
            pass_on(call.lines, call.points, x, force)
            for i in range(axes):
                by_state[i * states + k] += (0.5 * sign) * force.flat[i] / width
            for i in range(states):
                scratch.jacobian[i * states + k] += (0.5 * sign) * scratch.rest[i] / width
        y[k] = before
    # States follow the places such that they agree with their rates.
    for j in range(axes):
        if states > 0 and nudge[j] != 0.0:
            for k in range(states):
                scratch.move[k] = by_axis[k * axes + j]
            eliminate(scratch, scratch.move)
            for i in range(axes):
                for k in range(states):
                    stiffness[i * axes + j] += by_state[i * states + k] * scratch.move[k]
    return ran


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
def eliminate(scratch, x):
    """Replace x by the solution of jacobian @ solution = x, by elimination with exchanged rows."""
    n = len(x)
    matrix = scratch.factors
    for i in range(n):
        for j in range(n):
            matrix[i * n + j] = scratch.jacobian[i * n + j]
    # Eliminate downwards, with the largest pivot of each column.
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(matrix[i * n + k]) > abs(matrix[pivot * n + k]):
                pivot = i
        for j in range(n):
            matrix[k * n + j], matrix[pivot * n + j] = matrix[pivot * n + j], matrix[k * n + j]
        x[k], x[pivot] = x[pivot], x[k]
        for i in range(k + 1, n):
            factor = matrix[i * n + k] / matrix[k * n + k]
            for j in range(k, n):
                matrix[i * n + j] -= factor * matrix[k * n + j]
            x[i] -= factor * x[k]
    # Substitute back.
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            x[k] -= matrix[k * n + j] * x[j]
        x[k] /= matrix[k * n + k]
