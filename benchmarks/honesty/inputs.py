"""Families named after their inputs: uniform, many, turned, intervals or random only, odd units.

They return the problem and the options of `honesty_problems.case`.
"""

from __future__ import annotations

import numpy as np

from benchmarks.honesty.draws import KINKED, Random, linear, of_all, shape, times
from benchmarks.honesty.formulas import alias, smooth
from benchmarks.honesty.problems import Problem
from benchmarks.honesty.references import Formula, Term
from benchmarks.honesty.ringing import oscillation, periods, resolution_options, ring, samples

ProblemWithOptions = tuple[Problem, dict]


def uniform(r: Random) -> Problem:
    """Draw functions, most of them linear, of uniform and interval inputs."""
    s = shape(r)
    u = shape(r)
    c = r.uniform(0.2, 2.0)
    number = int(r.integers(1, 4))
    if r.random() < 0.5:  # a sum
        kinds = ["uniform"] * number + ["interval"]
        terms = [Term(lambda y, tau, k=k: s(tau) * y / (1 + k), (k,)) for k in range(number)]
        terms.append(Term(lambda e, tau: c * u(tau) * e, (number,)))
        return Problem(kinds, [terms], times(r))
    forms: list[Formula] = [
        lambda y, e, tau: s(tau) * (1 + c * y) * (1 + 0.5 * e),
        lambda y, e, tau: s(tau) * y * e + 0.3 * y,
        lambda y, e, tau: s(tau) * y * y + u(tau) * c * e,
        lambda y, e, tau: np.exp(c * y) * s(tau) + e * u(tau),
        lambda y, e, tau: np.cos(c * y + tau + e),
    ]
    variables = ("uniform", "interval")
    return Problem(variables, [of_all(variables, forms[r.integers(len(forms))])], times(r))


def many_inputs(r: Random) -> ProblemWithOptions:
    """Draw responses to 5 to 30 inputs, of which few or all matter."""
    inputs = int(r.integers(5, 31))
    s = shape(r)
    u = shape(r)
    form = r.integers(5)
    if form == 0:  # the square of a sum
        variables = [("interval",), ("normal",), ("normal", "interval")][r.integers(3)]
        offset = r.uniform(-0.5, 1.5)
        c = r.uniform(0.2, 1.0)
        terms = of_all(variables, lambda *y: s(y[-1]) * (c * sum(y[:-1]) + offset) ** 2)
        return Problem(variables, [terms], times(r)), {"inputs": inputs}
    if form == 1:  # a sum of functions of one variable each
        kinds = list(r.choice(["normal", "interval", "interval", "uniform"], inputs))
        c = r.uniform(0.1, 1.0, inputs) * r.choice([0.3, 0.7, 1.0]) ** np.arange(inputs)
        forms = [np.sin, np.tanh, lambda y: y, lambda y: y + 0.3 * y * y]
        functions = [forms[k] for k in r.integers(len(forms), size=inputs)]
        terms = [
            Term(lambda y, tau, k=k: c[k] * functions[k](y) * (s(tau) if k % 2 else u(tau)), (k,))
            for k in range(inputs)
        ]
        return Problem(kinds, [terms], times(r)), {}
    variables = ("normal", "interval")
    if form == 2:
        count = periods(r)
        terms = of_all(
            variables, oscillation(r, variables, count, 2.0), **resolution_options(variables)
        )
        return Problem(variables, [terms], samples(count)), {"inputs": min(inputs, 16)}
    if form == 3:
        a = linear(r, variables, 0.6)
        c = r.uniform(0.5, 2.0)
        terms = of_all(
            variables, lambda *y: np.exp(c * a(*y[:-1])) * s(y[-1]) + u(y[-1]) * a(*y[:-1])
        )
        return Problem(variables, [terms], times(r)), {"inputs": inputs}
    gap = r.uniform(0.2, 0.8)
    stiff = r.uniform(2.0, 20.0)
    width = r.uniform(0.1, 0.4)

    def stack(x, e, tau):
        total = e + width * x
        return s(tau) * total + stiff * np.maximum(0, -total - gap)

    terms = of_all(variables, stack, smooth=False, points=KINKED)
    return Problem(variables, [terms], times(r)), {"inputs": inputs}


def sums_of_normals(r: Random) -> ProblemWithOptions:
    """Draw kinks in a sum of two to four normal inputs."""
    s = shape(r)
    centre = r.uniform(-0.5, 1.5)
    gap = r.uniform(0.1, 0.6)
    forms: list[Formula] = [
        lambda y, tau: s(tau) * np.maximum(0, y - centre),
        lambda y, tau: s(tau) * np.abs(y - centre) + 0.3 * y,
        lambda y, tau: np.minimum(s(tau), 1 + y - centre),
        lambda y, tau: np.sign(y) * np.maximum(0, np.abs(y) - gap) * s(tau),
    ]
    formula = forms[r.integers(len(forms))]
    terms = of_all(("normal",), formula, smooth=False, points=KINKED)
    return Problem(("normal",), [terms], times(r)), {"inputs": int(r.integers(2, 5))}


def intervals(r: Random) -> ProblemWithOptions:
    """Draw responses to interval inputs only."""
    return _single_kind(r, "interval")


def randoms(r: Random) -> ProblemWithOptions:
    """Draw responses to random inputs only."""
    return _single_kind(r, str(r.choice(["normal", "normal", "uniform"])))


def _single_kind(r: Random, kind: str) -> ProblemWithOptions:
    """Draw a response whose variables are all of one kind."""
    variables = (kind,) * int(r.integers(1, 3))
    form = r.integers(4)
    s = shape(r)
    a = linear(r, variables, 0.7)
    b = linear(r, variables, 0.3)
    options = {"inputs": len(variables) + int(r.integers(0, 4))}
    if form < 2:
        count = periods(r)
        f = oscillation(r, variables, count, 2.0)
        terms = of_all(
            variables,
            lambda *y: f(*y) + 0.5 * s(y[-1]) * b(*y[:-1]),
            **resolution_options(variables),
        )
        return Problem(variables, [terms], samples(count)), options
    forms: list[Formula] = [
        lambda *y: np.tanh(1.5 * a(*y[:-1]) - y[-1]) + b(*y[:-1]) * s(y[-1]),
        lambda *y: s(y[-1]) * np.exp(a(*y[:-1])) + y[-1] * y[0] * y[len(variables) - 1],
    ]
    terms = of_all(variables, forms[form - 2], points=161 if len(variables) == 1 else 73)
    return Problem(variables, [terms], times(r)), options


def units(r: Random) -> ProblemWithOptions:
    """Draw outputs of very different sizes, one that hardly varies and one that is constant."""
    problem = [ring, smooth, alias][r.integers(3)](r)
    level = 10 ** r.uniform(1, 4)
    c = r.uniform(0.1, 1.0)
    s = shape(r)
    others = [
        [Term(lambda y, tau: level + c * s(tau) * y, (0,))],  # hardly varies
        [Term(lambda y, tau: 0 * y + s(tau), (0,))],  # does not depend on the inputs
        [Term(lambda y, tau: np.maximum(0, tau - 0.5) * y, (0,))],  # varies later on
    ]
    extra_outputs = [others[k] for k in r.permutation(3)[: r.integers(1, 4)]]
    outputs = [*problem.outputs, *extra_outputs]
    sizes = 10 ** r.uniform(-9, 9, len(outputs))
    return Problem(problem.kinds, outputs, problem.times), {"units": sizes}
