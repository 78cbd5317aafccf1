"""Families that oscillate: modes, veering, resonance, beats.

Phases are linear or quadratic functions of the inputs; at the end they vary by up to some radians.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.honesty.draws import Random, kinds, linear, of_all, quadratic, shape
from benchmarks.honesty.problems import Problem
from benchmarks.honesty.references import Formula, Term

TAU = 2 * np.pi
PER_PERIOD = 12
"""Times per period of the fastest oscillation."""


def periods(r: Random) -> float:
    """Draw the number of periods."""
    return r.uniform(4.0, 14.0)


def turns(r: Random, variables: Sequence[str], max_phase: float = 4.0) -> Formula:
    """Draw by how many radians the phase varies at the end, as a function of the variables."""
    size = max_phase * 10 ** r.uniform(-1.3, 0.0)
    first = linear(r, variables, size)
    curvature = quadratic(r, variables, 0.05 * size)
    return lambda *y: first(*y) + curvature(*y)


def oscillation(
    r: Random, variables: Sequence[str], count: float, max_phase: float = 4.0
) -> Formula:
    """Draw a decaying oscillation of so many periods."""
    turn = turns(r, variables, max_phase)
    start = r.uniform(0, TAU)
    size = linear(r, variables, r.choice([0.0, 0.05, 0.2]))
    decay = r.uniform(0.0, 3.0)
    damping = linear(r, variables, r.choice([0.0, 0.1, 0.3]))
    amplitude = r.uniform(0.3, 1.0)

    def value(*y):
        inputs = y[:-1]
        tau = y[-1]
        envelope = amplitude * (1 + size(*inputs)) * np.exp(-decay * (1 + damping(*inputs)) * tau)
        return envelope * np.cos((TAU * count + turn(*inputs)) * tau + start)

    return value


def samples(count: float) -> int:
    """Return the number of times for so many periods of the fastest oscillation."""
    return int(PER_PERIOD * count) + 1


def resolution_options(variables: Sequence[str]) -> dict:
    """Return options of the rules that resolve a phase of some radians."""
    n = sum(kind != "interval" for kind in variables)
    return {
        "points": {0: 1, 1: 97, 2: 45}[n],
        "nodes": 33 if n < 2 and len(variables) - n < 2 else 21,
    }


def ring(r: Random) -> Problem:
    """Draw a single mode on a slow base."""
    variables = kinds(r)
    max_phase = 4.0 if len(variables) < 3 else 1.8

    def draw_formula() -> Formula:
        f = oscillation(r, variables, count, max_phase)
        s = shape(r)
        a = linear(r, variables, 0.1)
        size = r.choice([0.0, 0.3, 1.0])
        return lambda *y: f(*y) + size * s(y[-1]) * (1 + a(*y[:-1]))

    count = periods(r)
    outputs = [
        of_all(variables, draw_formula(), **resolution_options(variables))
        for _ in range(r.integers(1, 3))
    ]
    return Problem(variables, outputs, samples(count))


def modes(r: Random) -> Problem:
    """Draw two or three modes, each with inputs of its own or all with the same."""
    number = int(r.integers(2, 4))
    count = periods(r)
    counts = count / np.array([1.0, r.uniform(1.4, 4.0), r.uniform(4.0, 6.0)])[:number]
    if r.random() < 0.5:
        variables = ("normal", "interval") if r.random() < 0.7 else ("uniform", "interval")
        parts = [oscillation(r, variables, k) for k in counts]
        size = 0.5 ** np.arange(number)

        def sum_of_modes(*y):
            return sum(a * f(*y) for a, f in zip(size, parts, strict=True))

        return Problem(
            variables,
            [of_all(variables, sum_of_modes, **resolution_options(variables))],
            samples(count),
        )
    pairs = [("normal", "interval"), ("normal",), ("interval",), ("uniform",)]
    all_variables = []
    terms = []
    for k in counts:
        variables = pairs[r.integers(len(pairs))]
        on = tuple(range(len(all_variables), len(all_variables) + len(variables)))
        terms.append(Term(oscillation(r, variables, k), on, **resolution_options(variables)))
        all_variables += variables
    return Problem(all_variables, [terms], samples(count))


def veering(r: Random) -> Problem:
    """Draw two coupled oscillators whose frequencies approach each other for some inputs."""
    variables = kinds(r, most_normal=1)
    count = periods(r)
    coupling = r.uniform(0.01, 0.08)
    detuning = linear(r, variables, r.uniform(0.01, 0.05))
    common = linear(r, variables, 0.02)
    offset = r.uniform(-0.04, 0.04)
    decay = r.uniform(0.0, 2.0)

    def value(*y):
        inputs = y[:-1]
        tau = y[-1]
        half = 0.5 * (detuning(*inputs) + offset)
        split = np.sqrt(half**2 + coupling**2)
        turn = TAU * count * tau * (1 + 0.3 * common(*inputs))
        share = 0.5 * (1 + half / split)
        superposition = share * np.cos(turn * (1 + split)) + (1 - share) * np.cos(
            turn * (1 - split)
        )
        return np.exp(-decay * tau) * superposition

    return Problem(
        variables, [of_all(variables, value, **resolution_options(variables))], samples(1.1 * count)
    )


def resonance(r: Random) -> Problem:
    """Draw an oscillator that is switched on close to its resonance."""
    variables = kinds(r, most_normal=1)
    count = periods(r)
    zeta = r.uniform(0.02, 0.1)
    shift = linear(r, variables, r.uniform(0.01, 0.06))
    ratio = r.uniform(0.85, 1.15)
    gain = linear(r, variables, 0.1)

    def value(*y):
        inputs = y[:-1]
        tau = y[-1]
        q = ratio * (1 + shift(*inputs))  # frequency of the excitation over the natural one
        real = 1 - q * q
        imaginary = 2 * zeta * q
        size = (real - 1j * imaginary) / (real**2 + imaginary**2)
        drive = TAU * count * tau
        natural = drive / q * np.sqrt(1 - zeta**2)
        steady = (size * np.exp(1j * drive)).real
        rate = (size * 1j * q).real + zeta * size.real
        transient = size.real * np.cos(natural) + rate / np.sqrt(1 - zeta**2) * np.sin(natural)
        return (1 + gain(*inputs)) * zeta * (steady - np.exp(-zeta * drive / q) * transient)

    return Problem(
        variables, [of_all(variables, value, **resolution_options(variables))], samples(1.2 * count)
    )


def beats(r: Random) -> Problem:
    """Draw two close frequencies on a base that decays."""
    variables = ("normal", "interval") if r.random() < 0.6 else ("interval", "normal", "interval")
    count = periods(r)
    close_count = count * r.uniform(1.05, 1.3)
    s = r.uniform(0.3, 2.0)
    rate = r.uniform(1.0, 5.0)
    max_phase = 4.0 if len(variables) < 3 else 1.8
    first, second = (oscillation(r, variables, k, max_phase) for k in (count, close_count))
    a = linear(r, variables, 0.2)
    b = linear(r, variables, 0.1)

    def value(*y):
        base = s * (1 + a(*y[:-1])) * np.exp(-rate * (1 + b(*y[:-1])) * y[-1])
        return base + first(*y) + second(*y)

    return Problem(
        variables, [of_all(variables, value, **resolution_options(variables))], samples(close_count)
    )
