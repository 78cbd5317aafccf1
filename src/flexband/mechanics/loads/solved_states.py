"""First-order states of a force law: Newton's method for one sample, compiled with the law.

A state y_k with the rate ẏ_k(y) solves y_k = b_k + τ_k ẏ_k, which is a step of a method for stiff
equations, or ẏ_k = 0 where τ_k is `laws.states.MARK.solved`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from flexband.mechanics.loads.lines import called_by_code


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


def solver_of(law: Callable, states: int, solver: StateSolver = StateSolver()) -> Callable:
    """Return a function that solves for the states of a law and fills its forces and rates.

    It takes t, x, v, y, p, force, rate, mode, gap, b and τ, and returns whether there is a
    solution. `law` is compiled, and takes all of these but b and τ.
    """
    iterations, halvings, difference, rate_part, tolerance, stalled = solver

    @called_by_code
    def evaluated(t, x, v, y, p, force, rate, mode, gap, b, tau):
        law(t, x, v, y, p, force, rate, mode, gap)
        return True

    @called_by_code
    def evaluate(t, x, v, y, p, force, rate, mode, gap, b, tau, rest):
        for k in range(force.size):
            force.flat[k] = 0.0
        for k in range(states):
            rate[k] = 0.0
        law(t, x, v, y, p, force, rate, mode, gap)
        for k in range(states):
            rest[k] = rate[k] if tau[k] < 0.0 else y[k] - b[k] - tau[k] * rate[k]

    @called_by_code
    def differentiate(t, x, v, y, p, force, rate, mode, gap, b, tau, rest, size, J):
        """Fill J with the derivatives of `rest` by the states, of these sizes."""
        other = np.empty(states)
        for k in range(states):
            size[k] = max(abs(y[k]), abs(b[k]), rate_part * abs(tau[k] * rate[k]))
        for k in range(states):
            before = y[k]
            y[k] = before + (difference * size[k] if size[k] > 0.0 else difference)
            width = y[k] - before
            evaluate(t, x, v, y, p, force, rate, mode, gap, b, tau, other)
            for i in range(states):
                J[i, k] = (other[i] - rest[i]) / width
            y[k] = before

    @called_by_code
    def solved(t, x, v, y, p, force, rate, mode, gap, b, tau):
        rest, move, before, size, weight = np.empty((5, states))
        J, last = np.empty((states, states)), np.inf
        evaluate(t, x, v, y, p, force, rate, mode, gap, b, tau, rest)
        for _ in range(iterations):
            if not rest.any():
                return True
            differentiate(t, x, v, y, p, force, rate, mode, gap, b, tau, rest, size, J)
            for i in range(states):
                weight[i] = 1e-300
                for k in range(states):
                    weight[i] = max(abs(J[i, k]) * size[k], weight[i])
                before[i], move[i] = y[i], -rest[i]
            excess = largest(rest, weight)
            eliminate(J, move)
            part = 1.0
            for _ in range(halvings):
                for k in range(states):
                    y[k] = before[k] + part * move[k]
                evaluate(t, x, v, y, p, force, rate, mode, gap, b, tau, rest)
                remaining = largest(rest, weight)
                if remaining < excess or remaining < tolerance:
                    break
                part = 0.5 * part
            for k in range(states):
                size[k] = max(abs(y[k]), size[k], 1e-300)
            change = largest(move, size)
            if not np.isfinite(change):
                return False
            if change < tolerance or (change < stalled and change > 0.5 * last):
                return True
            last = change
        return False

    return solved if states else evaluated


@called_by_code
def largest(values, sizes):
    """Return the largest of the absolute values over their sizes; NaN if one is NaN."""
    top = 0.0
    for k in range(len(values)):
        ratio = abs(values[k]) / sizes[k]
        if ratio > top or np.isnan(ratio):
            top = ratio
    return top


@called_by_code
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
