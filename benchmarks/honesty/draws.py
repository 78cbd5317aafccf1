"""What the families draw: kinds of variables, slow shapes, linear and quadratic functions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.honesty.references import Formula, Term

Random = np.random.Generator

KINDS = [
    ("normal",),
    ("interval",),
    ("normal", "interval"),
    ("normal", "interval"),
    ("uniform", "interval"),
    ("normal", "normal", "interval"),
    ("normal", "interval", "interval"),
    ("interval", "interval"),
]
"""Kinds of variables that families draw from."""

KINKED = 1001
"""Points of the rules for a kink in a random variable."""


def kinds(r: Random, most_normal: int = 2) -> tuple[str, ...]:
    """Draw the kinds of variables."""
    candidates = [group for group in KINDS if group.count("normal") <= most_normal]
    return candidates[r.integers(len(candidates))]


def times(r: Random) -> int:
    """Draw the number of times."""
    return int(r.integers(40, 100))


def shape(r: Random, minimum: float = 0.3) -> Formula:
    """Draw a slow function of τ whose size is of order one."""
    a = r.uniform(minimum, 1.0)
    b = r.uniform(0.0, 1.0)
    turn = r.uniform(0.0, 6.3)
    turns = r.uniform(1.0, 7.0)
    return lambda tau: a + b * np.sin(turns * tau + turn) ** 2


def linear(r: Random, variables: Sequence[str], size: float) -> Formula:
    """Draw a linear function of some variables; its coefficients are of the given size."""
    c = size * r.uniform(0.3, 1.0, len(variables)) * r.choice([-1, 1], len(variables))
    return lambda *y: sum(a * v for a, v in zip(c, y, strict=True))


def quadratic(r: Random, variables: Sequence[str], size: float) -> Formula:
    """Draw a quadratic function of some variables with all products."""
    first = linear(r, variables, size)
    C = 0.5 * size * r.uniform(-1, 1, (len(variables), len(variables)))

    def value(*y):
        return first(*y) + sum(C[a, b] * y[a] * y[b] for a in range(len(y)) for b in range(a + 1))

    return value


def of_all(variables: Sequence[str], formula: Formula, **options) -> list[Term]:
    """Return one term of all variables."""
    return [Term(formula, tuple(range(len(variables))), **options)]
