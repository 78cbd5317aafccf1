"""Random functions of time with their derivatives and their kinks and jumps, for the benchmarks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

Values = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class RandomFunction:
    """A function of time, its first two derivatives, and where one of the three jumps [s].

    The impulses that kinks of a prescribed motion take are left out of the derivatives.
    """

    f: Values
    rate: Values
    acceleration: Values
    breakpoints: tuple[float, ...] = ()

    def __add__(self, other: RandomFunction) -> RandomFunction:
        return RandomFunction(
            lambda t: self.f(t) + other.f(t),
            lambda t: self.rate(t) + other.rate(t),
            lambda t: self.acceleration(t) + other.acceleration(t),
            self.breakpoints + other.breakpoints,
        )

    def __rmul__(self, factor: float) -> RandomFunction:
        return RandomFunction(
            lambda t: factor * self.f(t),
            lambda t: factor * self.rate(t),
            lambda t: factor * self.acceleration(t),
            self.breakpoints,
        )

    def after(self, start: float) -> RandomFunction:
        """Return f(t − start) from the start on, and zero before it."""

        def later(part: Values) -> Values:
            return lambda t: np.where(t >= start, part(np.maximum(t - start, 0.0)), 0.0)

        ends = (start, *(start + b for b in self.breakpoints))
        return RandomFunction(later(self.f), later(self.rate), later(self.acceleration), ends)


def total(terms: list[RandomFunction]) -> RandomFunction:
    """Return the sum of some functions."""
    result = terms[0]
    for other in terms[1:]:
        result += other
    return result


def sine(omega: float, phase: float) -> RandomFunction:
    """Return sin(ωt + φ)."""
    return RandomFunction(
        lambda t: np.sin(omega * t + phase),
        lambda t: omega * np.cos(omega * t + phase),
        lambda t: -(omega**2) * np.sin(omega * t + phase),
    )


def polynomial(coefficients: np.ndarray, duration: float) -> RandomFunction:
    """Return a sum of Chebyshev polynomials over the duration."""
    series = np.polynomial.Chebyshev(coefficients, [0.0, duration])
    return RandomFunction(series, series.deriv(), series.deriv(2))


def power(order: int) -> RandomFunction:
    """Return tⁿ."""
    p = np.polynomial.Polynomial([0.0] * order + [1.0])
    return RandomFunction(p, p.deriv(), p.deriv(2))


def exponential(time_constant: float) -> RandomFunction:
    """Return exp(−t/τ)."""

    def derivative(order: int) -> Values:
        return lambda t: np.exp(-np.maximum(t, 0) / time_constant) / (-time_constant) ** order

    return RandomFunction(derivative(0), derivative(1), derivative(2))


def rise(kind: str, width: float) -> RandomFunction:
    """Return how a function rises from 0 to 1 within a width."""
    q = {
        "ramp": np.polynomial.Polynomial([0, 1]),
        "smoothstep": np.polynomial.Polynomial([0, 0, 3, -2]),
        "quintic": np.polynomial.Polynomial([0, 0, 0, 10, -15, 6]),
    }
    if kind == "cycloid":
        turn = 2 * np.pi
        parts = (
            lambda s: s - np.sin(turn * s) / turn,
            lambda s: 1 - np.cos(turn * s),
            lambda s: turn * np.sin(turn * s),
        )
    else:
        parts = q[kind], q[kind].deriv(), q[kind].deriv(2)
    return RandomFunction(
        lambda t: parts[0](np.clip(t / width, 0, 1)),
        lambda t: np.where((t >= 0) & (t < width), parts[1](np.clip(t / width, 0, 1)), 0) / width,
        lambda t: (
            np.where((t >= 0) & (t < width), parts[2](np.clip(t / width, 0, 1)), 0) / width**2
        ),
        () if kind in ("quintic", "cycloid") else (0.0, width),
    )


def pulse(kind: str, width: float) -> RandomFunction:
    """Return a pulse of height 1 that starts at 0."""
    shapes = {
        "rectangle": np.ones_like,
        "half sine": lambda s: np.sin(np.pi * s),
        "triangle": lambda s: 1 - abs(2 * s - 1),
    }

    def f(t: np.ndarray) -> np.ndarray:
        return np.where((t >= 0) & (t < width), shapes[kind](np.clip(t / width, 0.0, 1.0)), 0.0)

    inner = (width / 2,) * (kind == "triangle")
    return RandomFunction(f, np.zeros_like, np.zeros_like, (0.0, *inner, width))


def wave(kind: str, period: float, shift: float, duration: float) -> RandomFunction:
    """Return a square, a sawtooth, a triangle or a rectified sine."""
    shapes = {
        "square": (lambda s: np.where(s < 0.5, 1.0, -1.0), (0.0, 0.5)),
        "sawtooth": (lambda s: s, (0.0,)),
        "triangle": (lambda s: 1 - 4 * abs(s - 0.5), (0.0, 0.5)),
        "rectified": (lambda s: np.sin(np.pi * s), (0.0,)),
    }
    shape, places = shapes[kind]
    number = np.arange(-1, int(duration / period) + 2)[:, None]
    at = (period * (number + np.array(places)) - shift).ravel()
    zero = np.zeros_like
    return RandomFunction(
        lambda t: shape((t + shift) / period % 1.0), zero, zero, tuple(at.tolist())
    )


def smooth(rng: np.random.Generator, h: float, duration: float) -> RandomFunction:
    """Return a sum of sines and a polynomial that steps of h resolve to 3e-4."""
    slowest = 2 * np.pi / duration
    omega = np.exp(rng.uniform(np.log(slowest / 4), np.log(0.05 / h), rng.integers(1, 4)))
    parts = [rng.uniform(0.1, 1) * sine(w, rng.uniform(0, 6)) for w in omega]
    return total([*parts, polynomial(rng.normal(size=rng.integers(1, 6)), duration)])


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Return a number whose logarithm is uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def load(family: str, rng: np.random.Generator, h: float, steps: int) -> RandomFunction:
    """Return a load of a family for so many steps of h."""
    duration = h * steps
    base = smooth(rng, h, duration)
    if family == "smooth":
        return base
    if family not in ("jumps", "kinks"):
        base = rng.choice([0.0, 1.0]) * base
    return base + rng.choice([-1.0, 1.0]) * FEATURES[family](rng, h, steps)


def _sines(rng: np.random.Generator, h: float, steps: int) -> RandomFunction:
    omega = 2 * np.pi / (h * np.array([log_uniform(rng, 3, 60) for _ in range(3)]))
    return total([rng.uniform(0.1, 1) * sine(w, rng.uniform(0, 6)) for w in omega])


def _vibration(rng: np.random.Generator, h: float, steps: int) -> RandomFunction:
    omega = 2 * np.pi / (h * log_uniform(rng, 0.3, 2.9))
    return log_uniform(rng, 0.1, 10) * sine(omega, rng.uniform(0, 6))


def _pulses(rng: np.random.Generator, h: float, steps: int) -> RandomFunction:
    pulses = []
    for kind in rng.choice(["rectangle", "half sine", "triangle"], rng.integers(1, 4)):
        width = log_uniform(rng, 0.021, min(20, steps / 8)) * h
        shape = pulse(kind, width).after(rng.uniform(0, 0.9) * h * steps)
        pulses.append(log_uniform(rng, 1, 100) * shape)
    return total(pulses)


def _wave(rng: np.random.Generator, h: float, steps: int) -> RandomFunction:
    kind = rng.choice(["square", "sawtooth", "triangle", "rectified"])
    period = log_uniform(rng, 0.4, steps / 2) * h
    return wave(kind, period, rng.uniform(0, period), h * steps)


def _table(rng: np.random.Generator, h: float, steps: int) -> RandomFunction:
    count = rng.integers(3, max(4, steps // 4))
    times = np.sort(np.r_[0.0, rng.uniform(0, h * steps, count), h * steps])
    values = rng.normal(size=len(times)).cumsum()
    ends = tuple(times[1:-1].tolist())
    return RandomFunction(lambda t: np.interp(t, times, values), np.zeros_like, np.zeros_like, ends)


def _start(rng: np.random.Generator, h: float, steps: int) -> float:
    return rng.uniform(0.05, 0.9) * h * steps


def _width(rng: np.random.Generator, h: float, steps: int) -> float:
    return log_uniform(rng, 0.1, min(100, steps / 4)) * h


FEATURES: dict[str, Callable[[np.random.Generator, float, int], RandomFunction]] = {
    "sines": _sines,
    "vibrations": _vibration,
    "rises": lambda rng, *run: rise(
        rng.choice(["smoothstep", "cycloid", "quintic"]), _width(rng, *run)
    ).after(_start(rng, *run)),
    "exponentials": lambda rng, h, steps: exponential(log_uniform(rng, 0.3, steps) * h).after(
        rng.choice([0.0, _start(rng, h, steps)])
    ),
    "jumps": lambda rng, *run: (log_uniform(rng, 2e-3, 3) * power(0)).after(_start(rng, *run)),
    "kinks": lambda rng, h, steps: (log_uniform(rng, 1e-2, 10) / (h * steps) * power(1)).after(
        _start(rng, h, steps)
    ),
    "pulses": _pulses,
    "ramps": lambda rng, *run: rise("ramp", _width(rng, *run)).after(_start(rng, *run)),
    "waves": _wave,
    "switched": lambda rng, h, steps: sine(
        2 * np.pi / (h * log_uniform(rng, 100, steps)), rng.uniform(0, 6)
    ).after(_start(rng, h, steps)),
    "tables": _table,
}
LOADS = ("smooth", *FEATURES)


def drive(family: str, rng: np.random.Generator, h: float, steps: int) -> RandomFunction:
    """Return a prescribed motion of a family for so many steps of h."""
    duration = h * steps
    at = rng.uniform(0.05, 0.5) * duration
    width = rng.uniform(0.05, 0.4) * duration
    speed = log_uniform(rng, 1, 50)
    base = rng.choice([0.0, speed]) * power(1)
    if family == "smooth":
        return base + smooth(rng, h, duration)
    if family == "cycloids":
        return base + (speed * width * rise(rng.choice(["cycloid", "quintic"]), width)).after(at)
    if family == "smoothsteps":
        return base + (speed * width * rise("smoothstep", width)).after(at)
    if family == "trapezoids":
        up = log_uniform(rng, 1, steps / 4) * h
        down = log_uniform(rng, 1, steps / 4) * h
        ends = np.cumsum([at, up, width, down])
        slopes = np.array([1 / up, -1 / up, -1 / down, 1 / down]) * speed / 2
        return total([(s * power(2)).after(end) for s, end in zip(slopes, ends, strict=True)])
    if family == "speed jumps":
        first = base + smooth(rng, h, duration)
        return first + (speed * log_uniform(rng, 1e-2, 1) * power(1)).after(at)
    tau = log_uniform(rng, 10, steps) * h  # run-up of a motor
    return (speed * (power(1) + tau * (exponential(tau) + (-1.0) * power(0)))).after(at)


DRIVES = ("smooth", "cycloids", "smoothsteps", "trapezoids", "speed jumps", "run-ups")
