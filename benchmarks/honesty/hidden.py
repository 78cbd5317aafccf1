"""Families whose responses do in a small part of their inputs what nothing elsewhere foretells."""

from __future__ import annotations

import numpy as np

from benchmarks.honesty.draws import KINKED, Random, linear, of_all, shape, times
from benchmarks.honesty.problems import Problem
from benchmarks.honesty.references import Formula, Term


def stops(r: Random) -> Problem:
    """Draw linear responses with a stop, or a stiffening, beyond 1.5 to 3 standard deviations."""
    choices = [("normal",), ("normal", "interval"), ("normal", "interval", "interval")]
    variables = choices[r.integers(len(choices))]
    s = shape(r)
    a = linear(r, variables, 1.0)
    shift = linear(r, variables[1:], 0.2)
    threshold = r.uniform(1.5, 3.0)
    stiff = 10 ** r.uniform(0.3, 1.5)
    power = r.integers(1, 3)

    def value(*y):
        excess = np.maximum(0, y[0] - threshold - shift(*y[1:-1]))
        return s(y[-1]) * a(*y[:-1]) + stiff * excess**power

    return Problem(variables, [of_all(variables, value, smooth=False, points=KINKED)], times(r))


def bumps(r: Random) -> Problem:
    """Draw responses with a narrow bump, a step or a steep end along an interval."""
    choices = [
        ("interval",),
        ("interval", "interval"),
        ("interval", "normal"),
        ("interval", "uniform"),
    ]
    variables = choices[r.integers(len(choices))]
    s = shape(r)
    a = linear(r, variables, 0.5)
    high = 10 ** r.uniform(-0.5, 1)
    width = r.uniform(0.04, 0.2)
    centre = r.uniform(-0.9, 0.9)
    drift = r.uniform(-0.2, 0.2)
    forms: list[Formula] = [
        lambda x: np.exp(-(x**2)),
        lambda x: 0.5 + 0.5 * np.tanh(x),
        lambda x: np.exp(np.minimum(x + (centre - 1) / width, 0.0)),
    ]
    form = forms[r.integers(len(forms))]

    def value(*y):
        x = (y[0] - centre - drift * y[-1]) / width
        return s(y[-1]) * a(*y[:-1]) + high * form(x) * (1 + 0.2 * y[-2])

    return Problem(variables, [of_all(variables, value, smooth=False)], times(r))


def powers(r: Random) -> Problem:
    """Draw high powers of one input, and Chebyshev polynomials of high order."""
    kind = ("interval", "normal", "uniform")[r.integers(3)]
    variables = (kind, "interval") if kind != "interval" and r.random() < 0.5 else (kind,)
    order = int(r.integers(4, 8 if kind == "normal" else 13))
    s = shape(r)
    a = r.uniform(0.0, 1.0)
    wave = kind != "normal" and r.random() < 0.5

    def value(*y):
        power = np.cos(order * np.arccos(np.clip(y[0], -1, 1))) if wave else y[0] ** order
        size = 1.0 if kind != "normal" else 3.0**-order
        return s(y[-1]) * size * power + a * y[-1] * sum(y[:-1])

    nodes = 41 if len(variables) == 1 else 11
    return Problem(variables, [of_all(variables, value, points=KINKED, nodes=nodes)], times(r))


def poles(r: Random) -> Problem:
    """Draw ratios whose denominator nearly vanishes in a corner of intervals."""
    count = int(r.integers(1, 3))
    variables = (*["interval"] * count, ("normal", "uniform")[r.integers(2)])
    s = shape(r)
    gap = 10 ** r.uniform(-1.7, -0.3)
    c = r.uniform(0.3, 1.0, count)
    c = c / c.sum() * r.choice([-1, 1], count)

    def value(*y):
        denominator = 1 + gap + sum(a * v for a, v in zip(c, y[:count], strict=True))
        return s(y[-1]) * (1 + 0.1 * y[-2]) / denominator

    return Problem(variables, [of_all(variables, value, smooth=False)], times(r))


def corners(r: Random) -> Problem:
    """Draw sums of two or three intervals that saturate in one corner of them."""
    count = int(r.integers(2, 4))
    s = shape(r, 0.6)
    stiff = 10 ** r.uniform(0, 1.3)
    at = r.uniform(0.55, 0.85)
    c = r.uniform(0.3, 1.0, count)
    c = c / c.sum() * r.choice([-1, 1], count)

    def value(*y):
        total = sum(a * v for a, v in zip(c, y[:-1], strict=True))
        return s(y[-1]) * total - stiff * np.maximum(0, total - at * s(y[-1]))

    variables = ("interval",) * count
    terms = [Term(value, tuple(range(count)), smooth=False)]
    if r.random() < 0.5:
        variables = (*variables, "normal")
        size = r.uniform(0.05, 0.3)
        terms.append(Term(lambda x, tau: size * x * (1 + tau), (count,)))
    return Problem(variables, [terms], times(r))
