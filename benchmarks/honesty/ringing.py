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


def turns(r: Random, own: Sequence[str], most: float = 4.0) -> Formula:
    """Draw by how many radians the phase varies at the end, as a function of the variables."""
    size = most * 10 ** r.uniform(-1.3, 0.0)
    first, bent = linear(r, own, size), quadratic(r, own, 0.05 * size)
    return lambda *y: first(*y) + bent(*y)


def oscillation(r: Random, own: Sequence[str], count: float, most: float = 4.0) -> Formula:
    """Draw a decaying oscillation of so many periods."""
    turn, start = turns(r, own, most), r.uniform(0, TAU)
    size, decay = linear(r, own, r.choice([0.0, 0.05, 0.2])), r.uniform(0.0, 3.0)
    damping = linear(r, own, r.choice([0.0, 0.1, 0.3]))
    amplitude = r.uniform(0.3, 1.0)

    def value(*y):
        own = y[:-1]
        tau = y[-1]
        envelope = amplitude * (1 + size(*own)) * np.exp(-decay * (1 + damping(*own)) * tau)
        return envelope * np.cos((TAU * count + turn(*own)) * tau + start)

    return value


def samples(count: float) -> int:
    """Return the number of times for so many periods of the fastest oscillation."""
    return int(PER_PERIOD * count) + 1


def resolving(own: Sequence[str]) -> dict:
    """Return options of the rules that resolve a phase of some radians."""
    n = sum(kind != "interval" for kind in own)
    return {"points": {0: 1, 1: 97, 2: 45}[n], "nodes": 33 if n < 2 and len(own) - n < 2 else 21}


def ring(r: Random) -> Problem:
    """Draw a single mode on a slow base."""
    own = kinds(r)
    most = 4.0 if len(own) < 3 else 1.8

    def one() -> Formula:
        f, s, a = oscillation(r, own, count, most), shape(r), linear(r, own, 0.1)
        size = r.choice([0.0, 0.3, 1.0])
        return lambda *y: f(*y) + size * s(y[-1]) * (1 + a(*y[:-1]))

    count = periods(r)
    outputs = [of_all(own, one(), **resolving(own)) for _ in range(r.integers(1, 3))]
    return Problem(own, outputs, samples(count))


def modes(r: Random) -> Problem:
    """Draw two or three modes, each with inputs of its own or all with the same."""
    number = int(r.integers(2, 4))
    count = periods(r)
    counts = count / np.array([1.0, r.uniform(1.4, 4.0), r.uniform(4.0, 6.0)])[:number]
    if r.random() < 0.5:
        own = ("normal", "interval") if r.random() < 0.7 else ("uniform", "interval")
        parts = [oscillation(r, own, k) for k in counts]
        size = 0.5 ** np.arange(number)

        def together(*y):
            return sum(a * f(*y) for a, f in zip(size, parts, strict=True))

        return Problem(own, [of_all(own, together, **resolving(own))], samples(count))
    pairs = [("normal", "interval"), ("normal",), ("interval",), ("uniform",)]
    chosen = []
    terms = []
    for k in counts:
        own = pairs[r.integers(len(pairs))]
        on = tuple(range(len(chosen), len(chosen) + len(own)))
        terms.append(Term(oscillation(r, own, k), on, **resolving(own)))
        chosen += own
    return Problem(chosen, [terms], samples(count))


def veering(r: Random) -> Problem:
    """Draw two coupled oscillators whose frequencies approach each other for some inputs."""
    own = kinds(r, most_normal=1)
    count, coupling = periods(r), r.uniform(0.01, 0.08)
    apart, common = linear(r, own, r.uniform(0.01, 0.05)), linear(r, own, 0.02)
    offset = r.uniform(-0.04, 0.04)
    decay = r.uniform(0.0, 2.0)

    def value(*y):
        own = y[:-1]
        tau = y[-1]
        half = 0.5 * (apart(*own) + offset)
        split = np.sqrt(half**2 + coupling**2)
        turn = TAU * count * tau * (1 + 0.3 * common(*own))
        share = 0.5 * (1 + half / split)
        both = share * np.cos(turn * (1 + split)) + (1 - share) * np.cos(turn * (1 - split))
        return np.exp(-decay * tau) * both

    return Problem(own, [of_all(own, value, **resolving(own))], samples(1.1 * count))


def resonance(r: Random) -> Problem:
    """Draw an oscillator that is switched on close to its resonance."""
    own = kinds(r, most_normal=1)
    count, zeta = periods(r), r.uniform(0.02, 0.1)
    shift = linear(r, own, r.uniform(0.01, 0.06))
    ratio, more = r.uniform(0.85, 1.15), linear(r, own, 0.1)

    def value(*y):
        own = y[:-1]
        tau = y[-1]
        q = ratio * (1 + shift(*own))  # frequency of the excitation over the natural one
        real = 1 - q * q
        imaginary = 2 * zeta * q
        size = (real - 1j * imaginary) / (real**2 + imaginary**2)
        drive = TAU * count * tau
        natural = drive / q * np.sqrt(1 - zeta**2)
        steady = (size * np.exp(1j * drive)).real
        rate = (size * 1j * q).real + zeta * size.real
        free = size.real * np.cos(natural) + rate / np.sqrt(1 - zeta**2) * np.sin(natural)
        return (1 + more(*own)) * zeta * (steady - np.exp(-zeta * drive / q) * free)

    return Problem(own, [of_all(own, value, **resolving(own))], samples(1.2 * count))


def beats(r: Random) -> Problem:
    """Draw two close frequencies on a base that decays."""
    own = ("normal", "interval") if r.random() < 0.6 else ("interval", "normal", "interval")
    count = periods(r)
    close, s, rate = count * r.uniform(1.05, 1.3), r.uniform(0.3, 2.0), r.uniform(1.0, 5.0)
    most = 4.0 if len(own) < 3 else 1.8
    one, other = (oscillation(r, own, k, most) for k in (count, close))
    a, b = linear(r, own, 0.2), linear(r, own, 0.1)

    def value(*y):
        base = s * (1 + a(*y[:-1])) * np.exp(-rate * (1 + b(*y[:-1])) * y[-1])
        return base + one(*y) + other(*y)

    return Problem(own, [of_all(own, value, **resolving(own))], samples(close))
