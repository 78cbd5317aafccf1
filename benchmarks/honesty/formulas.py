"""Smooth families: rational, saturating, aliased, products, pulses.

A family is a function of a random generator that returns a `Problem`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.honesty.draws import Random, kinds, linear, of_all, quadratic, shape, times
from benchmarks.honesty.problems import Problem
from benchmarks.honesty.references import Formula, Term


def smooth(r: Random) -> Problem:
    """Draw exponentials, decays, slow waves and polynomials."""
    variables = kinds(r)

    def draw_formula() -> Formula:
        a = linear(r, variables, 0.4)
        b = quadratic(r, variables, 0.3)
        s = shape(r)
        rate = r.uniform(0.5, 3.0)
        forms: list[Formula] = [
            lambda *y: s(y[-1]) * np.exp(a(*y[:-1])),
            lambda *y: (1 + b(*y[:-1])) * np.exp(-rate * (1 + 0.5 * a(*y[:-1])) * y[-1]),
            lambda *y: np.cos(2 * a(*y[:-1]) + rate * y[-1]),
            lambda *y: s(y[-1]) * a(*y[:-1]) + y[-1] * b(*y[:-1]),
            lambda *y: np.sin(a(*y[:-1]) * (1 + 3 * y[-1])) + b(*y[:-1]) * s(y[-1]),
        ]
        return forms[r.integers(len(forms))]

    return Problem(
        variables, [of_all(variables, draw_formula()) for _ in range(r.integers(1, 3))], times(r)
    )


def rational(r: Random) -> Problem:
    """Draw quotients, some of them close to a pole."""
    variables = kinds(r)
    small = np.array([0.06 if kind == "normal" else 0.7 / len(variables) for kind in variables])
    small *= r.uniform(0.3, 1.0, len(variables)) * r.choice([-1, 1], len(variables))
    a = linear(r, variables, 1.0)
    b = linear(r, variables, 0.5)
    s = shape(r)
    sharp = r.uniform(0.5, 3.0)
    centre = r.uniform(-1.0, 1.0)

    def pole(*y):
        return 1 / (1 + sum(c * v for c, v in zip(small, y, strict=True)))

    forms: list[Formula] = [
        lambda *y: s(y[-1]) * pole(*y[:-1]),
        lambda *y: (1 + b(*y[:-1]) * y[-1]) * pole(*y[:-1]),
        lambda *y: s(y[-1]) / (1 + sharp * (a(*y[:-1]) - centre) ** 2),
        lambda *y: 1 / (1 + sharp * (b(*y[:-1]) - centre + y[-1]) ** 2),
        lambda *y: b(*y[:-1]) * s(y[-1]) / (1 + a(*y[:-1]) ** 2),
    ]
    formula = forms[r.integers(len(forms))]
    return Problem(
        variables, [of_all(variables, formula, nodes=61 if len(variables) < 3 else 25)], times(r)
    )


def saturations(r: Random) -> Problem:
    """Draw tanh, logistic functions, arctan and cubic stiffness, some of them steep."""
    variables = kinds(r)
    a = linear(r, variables, 1.0)
    b = linear(r, variables, 0.3)
    s = shape(r)
    few_random = sum(kind != "interval" for kind in variables) < 2
    steep = 10 ** r.uniform(-0.3, 0.7 if few_random else 0.2)
    centre = r.uniform(-0.7, 0.7)
    drift = r.uniform(0, 1.5)
    wide = min(steep, 2.5)

    def at(*y):
        return a(*y[:-1]) - centre - drift * y[-1]

    forms: list[Formula] = [
        lambda *y: np.tanh(steep * at(*y)) + b(*y[:-1]) * s(y[-1]),
        lambda *y: s(y[-1]) / (1 + np.exp(-2 * steep * at(*y))),
        lambda *y: np.arctan(wide * at(*y)) + 0.5 * b(*y[:-1]),
        lambda *y: at(*y) / np.sqrt(1 + (wide * at(*y)) ** 2) * s(y[-1]),
    ]
    options = (
        {"points": 201, "nodes": 81 if len(variables) < 3 else 31} if few_random else {"points": 45}
    )
    return Problem(
        variables, [of_all(variables, forms[r.integers(len(forms))], **options)], times(r)
    )


def _waves(r: Random, interval: bool) -> Callable[[np.ndarray], np.ndarray]:
    """Draw a function of one variable that low orders take for another."""
    k = int(r.integers(2, 8))
    turns = np.pi * r.choice([0.5, 1, 2])
    unit = np.polynomial.Chebyshev.basis(k) if interval else None
    hermite = np.polynomial.HermiteE.basis(min(k, 5))
    c = r.uniform(0.2, 1.0)
    if unit is None:
        forms = [
            lambda x: x**3,
            lambda x: hermite(x) / 8,
            lambda x: x**3 - 3 * c * x,
            lambda x: np.sin(turns * x),
            lambda x: np.exp(-x * x),
        ]
    else:
        forms = [
            lambda e: e**3,
            unit,
            lambda e: e**3 - c * e,
            lambda e: np.sin(turns * e),
            lambda e: 1 - np.cos(turns * e),
            lambda e: e**k,
        ]
    return forms[r.integers(len(forms))]


def alias(r: Random) -> Problem:
    """Draw functions that a few points take for others: x³ + e, sin over a period, (1−a²)(1−b²)."""
    choices = [("interval", "normal"), ("interval", "interval"), ("interval", "interval", "normal")]
    variables = choices[r.integers(len(choices))]
    s = shape(r)
    u = shape(r)
    f = [_waves(r, kind == "interval") for kind in variables]
    c = r.uniform(0.1, 1.0)
    if r.random() < 0.5:  # a sum
        terms = [Term(lambda y, tau: s(tau) * f[0](y), (0,))]
        terms += [Term(lambda y, tau, k=k: c * u(tau) * f[k](y), (k,)) for k in range(1, len(f))]
    else:

        def product(*y):
            values = [g(v) for g, v in zip(f, y, strict=False)]
            return s(y[-1]) * np.prod(np.broadcast_arrays(*values), axis=0) + c * y[0] * y[-1]

        terms = of_all(variables, product)
    if r.random() < 0.25:
        variables = ("interval", "interval", "normal")
        terms = [
            Term(lambda a, b, tau: s(tau) * (1 - a * a) * (1 - b * b), (0, 1)),
            Term(lambda x, tau: 0.3 * c * x * u(tau), (2,)),
        ]
    return Problem(variables, [terms], times(r))


def products(r: Random) -> Problem:
    """Draw products of two to four variables, with or without terms of their own."""
    pool = ["normal", "interval", "interval", "normal", "uniform", "interval"]
    variables = [pool[k] for k in r.permutation(len(pool))[: r.integers(2, 5)]]
    linear_part = linear(r, variables, float(r.choice([0.0, 0.0, 0.3, 1.0])))
    s = shape(r)
    u = shape(r)
    factor_count = max(2, len(variables) - int(r.integers(0, 2)))

    def value(*y):
        product = 1.0
        for v in y[:factor_count]:
            product = product * v
        return s(y[-1]) * product + u(y[-1]) * linear_part(*y[:-1])

    return Problem(variables, [of_all(variables, value, points=25, nodes=4)], times(r))


def pulses(r: Random) -> Problem:
    """Draw pulses and steps whose time of arrival depends on the inputs."""
    variables = ("normal", "interval") if r.random() < 0.7 else ("uniform", "interval")
    a = linear(r, variables, r.uniform(0.02, 0.12))
    b = linear(r, variables, 0.2)
    width = r.uniform(0.04, 0.2)
    middle = r.uniform(0.35, 0.65)

    def delay(*y):
        return (y[-1] - middle - a(*y[:-1])) / width

    forms: list[Formula] = [
        lambda *y: np.exp(-(delay(*y) ** 2)) * (1 + b(*y[:-1])),
        lambda *y: 0.5 * (1 + np.tanh(delay(*y))),
        lambda *y: 0.5 * (1 + np.tanh(delay(*y))) * (1 + b(*y[:-1])) + 0.3 * b(*y[:-1]),
    ]
    formula = forms[r.integers(len(forms))]
    return Problem(variables, [of_all(variables, formula, points=241, nodes=81)], times(r))


def scalars(r: Random) -> Problem:
    """Draw powers, exponentials and gains of engineering, at one time: no mean over time helps."""
    variables = ("normal", "interval") if r.random() < 0.7 else ("normal", "interval", "interval")
    p = r.uniform(-3, 3, 2)
    q = r.uniform(-4, 4)
    c = r.uniform(-1, 1)
    half = r.uniform(0.02, 0.3, 2)
    cv = r.uniform(0.03, 0.25)
    ratio = r.uniform(0.5, 0.85)
    damping = r.uniform(0.1, 0.3)

    def scatter(x: np.ndarray, size: float) -> np.ndarray:
        return np.exp(size * x - size**2 / 2)

    def dimensions(*y: np.ndarray) -> np.ndarray:
        return np.prod([(1 + h * e) ** k for h, k, e in zip(half, p, y, strict=False)], axis=0)

    def gain(x: np.ndarray, e: np.ndarray) -> np.ndarray:
        square = ratio**2 / scatter(x, cv / 3)
        return 1 / np.sqrt((1 - square) ** 2 + (damping * (1 + half[0] * e)) ** 2 * square)

    forms: list[Formula] = [
        lambda x, e, *y: dimensions(e, *y[:-1]) * scatter(x, cv) ** q + c * e + 0 * y[-1],
        lambda x, e, *y: np.exp(p[0] * half[0] * e + q * cv * x) + np.sin((1 + cv * x) * e) * c,
        lambda x, e, *y: gain(x, e) * dimensions(*y[:-1]),
    ]
    formula = forms[r.integers(len(forms))]
    return Problem(variables, [of_all(variables, formula, nodes=25)], 1)
