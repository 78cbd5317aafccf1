"""Families of oscillations whose phases bend: frequencies that are not linear in random inputs.

The moments are integrals over one random variable each: phases are sums of functions of one
variable, and amplitudes products of such functions. So they are exact at every time, where an
expansion that is right in all its values may still be integrated by too coarse a rule.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from scipy.special import ellipj, ellipk, ndtr, ndtri
from scipy.stats import norm, weibull_min

import flexband as fb
from benchmarks.honesty.draws import Random
from benchmarks.honesty.problems import Bands, Case
from benchmarks.honesty.references import InterpolatedMoments, bands, chebyshev_nodes, rule

TAU = 2 * np.pi
POINTS = 1201
"""Points of the rule for each random variable."""

NODES = 41
"""Nodes in the interval input, between which moments are interpolated."""

Function = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Variable:
    """A random input: its distribution, and its value at values of a standard normal variable."""

    distribution: fb.Input
    of_normal: Function


@dataclass(frozen=True)
class Swing:
    """An oscillation of random variables, whose frequency is scaled by 1 + `detuning` · e.

    Attributes
    ----------
    turns : part of the frequency that each variable adds, as a function of its values.
    sizes : factor of the amplitude that each variable is, as a function of its values.
    """

    variables: Sequence[Variable]
    turns: Sequence[Function]
    sizes: Sequence[Function]
    periods: float
    start: float
    detuning: float
    times: int

    def values(self, x: Sequence[np.ndarray], e: np.ndarray) -> np.ndarray:
        """Return the oscillation at values (runs,) of the inputs, shape (runs, times)."""
        frequency = 1 + sum(turn(v) for turn, v in zip(self.turns, x, strict=True))
        size = np.prod([size(v) for size, v in zip(self.sizes, x, strict=True)], axis=0)
        tau = np.linspace(0.0, 1.0, self.times)
        angle = TAU * self.periods * (frequency * (1 + self.detuning * e))[:, None] * tau
        return size[:, None] * np.cos(angle + self.start)

    def moments(self, e: np.ndarray, points: int) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and variance at e (nodes,), each of shape (nodes, times)."""
        tau = np.linspace(0.0, 1.0, self.times)
        clock = TAU * self.periods * np.outer(1 + self.detuning * e, tau)
        first = np.exp(1j * (clock + self.start))
        second = np.exp(2j * clock)
        square = 1.0
        second *= np.exp(2j * self.start)
        z, weights = rule("normal", points)
        for variable, turn, size in zip(self.variables, self.turns, self.sizes, strict=True):
            x = variable.of_normal(z)
            amplitude = size(x) * np.ones_like(x)
            wave = np.exp(1j * clock[..., None] * turn(x))
            first = first * (wave @ (weights * amplitude))
            second = second * ((wave * wave) @ (weights * amplitude**2))
            square *= weights @ amplitude**2
        mean = first.real
        return mean, 0.5 * square + 0.5 * second.real - mean**2


@dataclass(frozen=True)
class Anharmonic:
    """A nonlinear oscillator released from rest at a random amplitude.

    `motion` returns its position at an amplitude and times 2π n τ of its small oscillations.
    """

    amplitude: Variable
    motion: Callable[[np.ndarray, np.ndarray], np.ndarray]
    periods: float
    detuning: float
    times: int

    def values(self, x: Sequence[np.ndarray], e: np.ndarray) -> np.ndarray:
        """Return the positions at values (runs,) of the inputs, shape (runs, times)."""
        tau = np.linspace(0.0, 1.0, self.times)
        clock = TAU * self.periods * np.outer(1 + self.detuning * e, tau)
        return self.motion(x[0][:, None], clock)

    def moments(self, e: np.ndarray, points: int) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and variance at e (nodes,), each of shape (nodes, times)."""
        tau = np.linspace(0.0, 1.0, self.times)
        # A truncated normal variable is integrated over its probability, folded at both ends
        y, weights = rule("uniform", min(points // 3, 400))
        weights = weights * (1 - y**2) ** 3
        weights /= weights.sum()
        cumulative = (35 * y - 35 * y**3 + 21 * y**5 - 5 * y**7) / 16
        x = self.amplitude.of_normal(ndtri(np.clip(0.5 * (1 + cumulative), 0.0, 1.0)))
        moment_pairs = []
        for node in e:
            clock = TAU * self.periods * (1 + self.detuning * node) * tau
            F = self.motion(x[:, None], clock)
            mean = weights @ F
            moment_pairs.append((mean, weights @ (F - mean) ** 2))
        mean, variance = map(np.stack, zip(*moment_pairs, strict=True))
        return mean, variance


def pendulum(a: np.ndarray, clock: np.ndarray) -> np.ndarray:
    """Return the angle of a pendulum released at the angle a, below π."""
    k = np.sin(a / 2)
    m = k**2
    return 2 * np.arcsin(k * ellipj(clock + ellipk(m), m)[0])


def duffing(cubic_stiffness: float) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """Return the motion of ẍ + x + b x³ = 0; of negative b for a² |b| below 1."""

    def motion(a: np.ndarray, clock: np.ndarray) -> np.ndarray:
        b = cubic_stiffness * a**2
        if cubic_stiffness > 0:
            return a * ellipj(np.sqrt(1 + b) * clock, 0.5 * b / (1 + b))[1]
        m = -0.5 * b / (1 + 0.5 * b)
        return a * ellipj(np.sqrt(1 + 0.5 * b) * clock + ellipk(m), m)[0]

    return motion


def normal_input(r: Random) -> Variable:
    """Draw a normal input."""
    mean = r.choice([0.0, 10 ** r.uniform(-1, 2)])
    std = 10 ** r.uniform(-1, 1)
    return Variable(fb.Normal(mean, std), lambda z: mean + std * z)


def positive_input(r: Random) -> Variable:
    """Draw a log-normal input or one with Weibull's distribution, of mean 1."""
    cv = r.uniform(0.05, 0.5)
    if r.random() < 0.5:
        s = np.sqrt(np.log1p(cv**2))
        return Variable(fb.LogNormal(1.0, cv=cv), lambda z: np.exp(s * z - s * s / 2))
    distribution = fb.Weibull(mean=1.0, cv=cv)
    law = weibull_min(distribution.shape, scale=distribution.scale)

    def of_normal(z: np.ndarray) -> np.ndarray:
        return np.where(z > 0, law.isf(norm.sf(z)), law.ppf(norm.cdf(z)))

    return Variable(distribution, of_normal)


def truncated_input(r: Random, limit: float) -> Variable:
    """Draw a normal amplitude that is cut on both sides, below `limit`."""
    mean = limit * r.uniform(0.25, 0.7)
    std = mean * r.uniform(0.05, 0.3)
    lower = max(mean - 3 * std, 0.05 * mean)
    upper = min(mean + 3 * std, 0.97 * limit)
    ends = ndtr(np.array([lower - mean, upper - mean]) / std)

    def of_normal(z: np.ndarray) -> np.ndarray:
        return mean + std * ndtri(ends[0] + (ends[1] - ends[0]) * ndtr(z))

    return Variable(fb.TruncatedNormal(mean, std, lower, upper), of_normal)


def bent_phases(name: str, seed: int, r: Random) -> Case:
    """Draw frequencies that are functions of one to three random inputs, which are not linear."""
    count = r.uniform(5.0, 60.0)
    number = int(r.integers(1, 4))
    max_rate = 10 ** r.uniform(-0.3, 1.0) / (TAU * count * np.sqrt(number))  # rad at the end
    variables = []
    turns = []
    sizes = []
    for _ in range(number):
        variable = normal_input(r) if r.random() < 0.5 else positive_input(r)
        z = np.linspace(-2.0, 2.0, 81)
        x = variable.of_normal(z)
        middle = x.mean()
        spread = x.std()
        form = _forms(r)[r.integers(4)]
        deviation = np.std(form((x - middle) / spread))
        part = r.choice([-1.0, 1.0]) * max_rate * r.uniform(0.3, 1.0) / deviation
        variables.append(variable)
        turns.append(lambda v, f=form, a=part, m=middle, s=spread: a * f((v - m) / s))
        slope = r.choice([0.0, 0.0, 0.1, 0.3])
        sizes.append(lambda v, b=slope, m=middle, s=spread: 1 + b * (v - m) / s)
    parameters = variables, turns, sizes, count, r.uniform(0, TAU), _detuning(r, count)
    return _case(name, seed, Swing(*parameters, _times(count)), variables, r)


def swinging_pendulum(name: str, seed: int, r: Random) -> Case:
    """Draw pendulums of random amplitude, below the upright position."""
    count = r.uniform(5.0, 60.0)
    amplitude = truncated_input(r, np.pi)
    parameters = amplitude, pendulum, count, _detuning(r, count), _times(count)
    return _case(name, seed, Anharmonic(*parameters), [amplitude], r)


def duffing_oscillator(name: str, seed: int, r: Random) -> Case:
    """Draw Duffing's oscillators of random amplitude, of stiffening and of softening springs."""
    count = r.uniform(5.0, 60.0)
    b = r.choice([-1.0, 1.0]) * 10 ** r.uniform(-2, 0)
    amplitude = truncated_input(r, 0.9 if b < 0 else 1.5)
    parameters = amplitude, duffing(float(b)), count, _detuning(r, count), _times(count)
    return _case(name, seed, Anharmonic(*parameters), [amplitude], r)


def _forms(r: Random) -> list[Function]:
    """Draw functions of a variable in standard deviations from its mean."""
    first = r.choice([0.0, 0.5, 1.0])
    bend = r.uniform(0.02, 0.2)
    steep = r.uniform(0.2, 0.8)
    return [
        lambda y: first * y + y**2,
        lambda y: first * y + 0.3 * y**3,
        lambda y: 1 / (1 + bend * y**2),
        lambda y: np.tanh(steep * y),
    ]


def _detuning(r: Random, count: float) -> float:
    """Draw how far the interval input changes the frequency: by up to some radians at the end."""
    return 3 * 10 ** r.uniform(-1.5, 0.0) / (TAU * count)


def _times(count: float) -> int:
    return int(count * (12 if count < 20 else 8)) + 1


def _case(
    name: str, seed: int, oscillation: Swing | Anharmonic, variables: Sequence[Variable], r: Random
) -> Case:
    """Return the case of an oscillation with an interval input that scales its frequency."""
    duration = 10 ** r.uniform(-2, 1)
    scale = 10 ** r.uniform(-1, 3)
    labels = {"output": ["q0"], "time": duration * np.linspace(0.0, 1.0, oscillation.times)}
    inputs = {f"x{k}": variable.distribution for k, variable in enumerate(variables)}

    def response(**values: np.ndarray) -> xr.DataArray:
        F = oscillation.values([values[f"x{k}"] for k in range(len(variables))], values["e"])
        return xr.DataArray(scale * F[:, None], dims=("sample", "output", "time"), coords=labels)

    def reference(refine: int = 1) -> Bands:
        nodes = chebyshev_nodes(refine * (NODES - 1) + 1)
        part = InterpolatedMoments(*oscillation.moments(nodes, refine * POINTS))
        mean, bar = bands([part], oscillation.times, refine)
        return scale * mean[:, None], scale * bar[:, None]

    return Case(name, seed, response, inputs | {"e": fb.Interval(-1.0, 1.0)}, reference)
