"""Families with kinks: |x|, dead zones, gaps that close, dry friction, impact."""

from __future__ import annotations

import numpy as np

from benchmarks.honesty.draws import KINKED, Random, linear, of_all, shape, times
from benchmarks.honesty.problems import Problem
from benchmarks.honesty.references import Formula, Term
from benchmarks.honesty.ringing import TAU, oscillation, periods, samples, turns


def kinks(r: Random) -> Problem:
    """Draw |x − c|, max(0, x − c) and dead zones in sums of inputs."""
    choices = [("normal",), ("interval",), ("normal", "interval"), ("uniform", "interval")]
    variables = choices[r.integers(len(choices))]
    a = linear(r, variables, 1.0)
    b = linear(r, variables, 0.3)
    s = shape(r)
    centre = r.uniform(-0.8, 0.8)
    drift = r.choice([0.0, 1.0]) * r.uniform(-1, 1)
    gap = r.uniform(0.1, 0.6)

    def at(*y):
        return a(*y[:-1]) - centre - drift * y[-1]

    forms: list[Formula] = [
        lambda *y: s(y[-1]) * np.abs(at(*y)),
        lambda *y: s(y[-1]) * np.maximum(0, at(*y)) + b(*y[:-1]),
        lambda *y: np.sign(at(*y)) * np.maximum(0, np.abs(at(*y)) - gap) * s(y[-1]),
        lambda *y: np.minimum(s(y[-1]), 1 + at(*y)),
    ]
    formula = forms[r.integers(len(forms))]
    return Problem(variables, [of_all(variables, formula, smooth=False, points=KINKED)], times(r))


def contact(r: Random) -> Problem:
    """Draw gaps that close only in a corner of the inputs, for example at the worst stack."""
    s = shape(r, 0.6)
    c = r.uniform(0.2, 1.0)
    stiff = 10 ** r.uniform(0.3, 1.5)
    gap = r.uniform(0.2, 0.9)
    if r.random() < 0.5:
        variables = ("interval", "normal") if r.random() < 0.6 else ("interval",)
        spread = r.uniform(0.1, 0.4)

        def stack(*y):
            total = y[0] + spread * sum(y[1:-1])
            return c * total + stiff * np.maximum(0, -total - gap * s(y[-1]))

        return Problem(variables, [of_all(variables, stack, smooth=False, points=KINKED)], times(r))
    part = r.uniform(0.2, 0.8)

    def corner(a, b, tau):
        overlap = np.maximum(0, a - gap) * np.maximum(0, b - part)
        return c * (a - b) * tau + stiff * s(tau) * overlap

    terms = [Term(corner, (0, 1), smooth=False), Term(lambda x, tau: 0.3 * c * x, (2,))]
    return Problem(("interval", "interval", "normal"), [terms], times(r))


def friction(r: Random) -> Problem:
    """Draw amplitudes that fall linearly to zero, as with dry friction, and then rest."""
    choices = [("normal", "interval"), ("interval",), ("uniform", "interval"), ("normal",)]
    variables = choices[r.integers(len(choices))]
    count = periods(r)
    end = r.uniform(0.5, 1.5)
    a = linear(r, variables, 0.1)
    turn = turns(r, variables, 2.0)

    def value(*y):
        amplitude = np.maximum(0, 1 - y[-1] / end / (1 + a(*y[:-1])))
        return amplitude * np.cos((TAU * count + turn(*y[:-1])) * y[-1])

    options = {"smooth": False, "points": KINKED if len(variables) == 1 else 301}
    return Problem(variables, [of_all(variables, value, **options)], samples(count))


def impact(r: Random) -> Problem:
    """Draw forces of contacts: an oscillation that hits a stop, or bounces back from it."""
    choices = [("normal", "interval"), ("interval",), ("uniform", "interval"), ("normal",)]
    variables = choices[r.integers(len(choices))]
    count = r.uniform(2.0, 6.0)
    f = oscillation(r, variables, count, 2.0)
    gap = r.uniform(0.1, 0.6)
    shift = linear(r, variables, 0.1)
    stiff = r.uniform(1.0, 5.0)
    forms: list[Formula] = [
        lambda *y: stiff * np.maximum(0, f(*y) - gap - shift(*y[:-1])),
        lambda *y: f(*y) - stiff * np.maximum(0, f(*y) - gap - shift(*y[:-1])),
        lambda *y: np.abs(f(*y) - 0.2 * gap),
    ]
    options = {"smooth": False, "points": KINKED if len(variables) == 1 else 601}
    formula = forms[r.integers(len(forms))]
    return Problem(variables, [of_all(variables, formula, **options)], samples(count))
