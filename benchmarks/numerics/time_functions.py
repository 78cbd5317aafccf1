"""Motions under random functions of time, compared with exact solutions.

A force acts on a free mass, or a torque on a disc with a slow spring. A drive moves a mass along a
slot; its force is the mass times the acceleration. A response is right if its error is below 1e-3
of its range, or below twice that of a load that is linear between the times of the run and its
breakpoints, where that is below 4 %. Warnings count that say that steps do not resolve a function.
"""

from __future__ import annotations

import warnings
from collections import Counter
from typing import NamedTuple

import numpy as np

import flexband as fb
from benchmarks.harness import options, report
from benchmarks.numerics.time_functions_draws import (
    DRIVES,
    LOADS,
    RandomFunction,
    drive,
    load,
    log_uniform,
    power,
)
from flexband.mechanics.time_functions.tabulation import tabulate

RIGHT = 1e-3
RESOLVED = 0.04
MASS = 0.02
POINTS = 8
CELLS = 4
MAX_STEPS = 600
MAX_STEPS_OF_ONE_TIME = 200

UNRESOLVED = "do not resolve"
"""In warnings of functions of time."""

OUTCOMES = ("right", "right, warned", "wrong, warned", "wrong in silence")


class Trial(NamedTuple):
    """A drawn case and its outcome."""

    family: str
    outcome: str
    error: float
    allowed: float
    needless: int
    warned: tuple[str, ...]
    seed: int


def trial(kind: str, family: str, seed: int) -> Trial:
    """Return the outcome of a random function that is a "load" or a "drive"."""
    rng = np.random.default_rng([seed, *family.encode()])
    # Draw functions of time.
    one_time = rng.random() < 0.25
    steps = int(log_uniform(rng, 100, MAX_STEPS_OF_ONE_TIME if one_time else MAX_STEPS))
    h = log_uniform(rng, 1e-4, 1e-2)
    samples = int(rng.choice([1, 1, 3]))
    make = load if kind == "load" else drive
    random_functions = [make(family, rng, h, steps) for _ in range(samples)]
    if kind == "drive":
        random_functions = [
            function + float(-function.f(np.zeros(1))[0]) * power(0)
            for function in random_functions
        ]
    f = functions(random_functions, one_time)
    # Exact solutions.
    times = h * np.arange(steps + 1)
    omega = rng.choice([0.0, rng.uniform(1, 6) / times[-1]])
    exact = response if kind == "load" else travel
    references = [exact(function, omega, times) for function in random_functions]
    inertia = 20 * max(np.abs(reference[0]).max() for reference, _ in references)
    # Simulate, and keep the warnings.
    mechanism = forced_body(f, omega, inertia) if kind == "load" else driven_mass(f)
    with warnings.catch_warnings(record=True) as warning_list:
        warnings.simplefilter("always")
        motion = fb.simulate(mechanism, duration=steps * h, step=h).values
    motion = motion.reshape(samples, -1, steps + 1)
    motion = motion[:, ::2] if motion.shape[1] == 4 else motion  # x of x and y
    motion = motion * inertia if kind == "load" and omega else motion
    # Find the largest error over what is allowed.
    error = allowed_error = 0.0
    for result, (reference, linear) in zip(motion, references, strict=True):
        scale = np.maximum(np.ptp(reference, axis=1), 1e-12)
        linear_error = np.abs(linear - reference).max(axis=1) / scale
        tolerances = RIGHT + np.where(linear_error < RESOLVED, 2 * linear_error, 0.0)
        deviation = np.abs(result - reference).max(axis=1) / scale
        k = np.argmax(deviation / tolerances)
        if deviation[k] / tolerances[k] >= error / max(allowed_error, RIGHT):
            error = deviation[k]
            allowed_error = tolerances[k]
    messages = tuple(text for w in warning_list if UNRESOLVED in (text := str(w.message)))
    outcome = OUTCOMES[
        (0 if error <= allowed_error else 3)
        + (1 if error <= allowed_error else -1) * bool(messages)
    ]
    # Count divided steps of smooth functions.
    needless = 0
    if not any(function.breakpoints for function in random_functions):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            schedule, *_ = tabulate([f], {1: "m"} if kind == "drive" else {}, samples, times)
        needless = int((schedule.sides > 0).sum())
    return Trial(f"{kind}: {family}", outcome, error, allowed_error, needless, messages, seed)


def functions(parts: list[RandomFunction], one_time: bool):
    """Return functions as one that has a column for each, of one time or of many."""

    def f(t):
        moments = np.broadcast_to(t, (*np.shape(t)[:-1], len(parts)))
        columns = [function.f(moments[..., k]) for k, function in enumerate(parts)]
        return np.stack(columns, axis=-1) if len(parts) > 1 or np.ndim(t) else columns[0]

    def of_one_time(t):
        values = f(float(t))
        return values if len(parts) > 1 else float(values)

    return of_one_time if one_time else f


def forced_body(f, omega: float, inertia: float) -> fb.Mechanism:
    """Return a mass under a force, or a disc under a torque with a spring of this frequency."""
    if not omega:
        return fb.Mechanism(
            bodies={"p": fb.PointMass(mass=1.0)},
            joints={"s": fb.Slot("p", (0.0, 0.0))},
            loads={"f": fb.Force("p", x=f)},
            sensors={"x": fb.Position("p"), "v": fb.Velocity("p")},
        )
    return fb.Mechanism(
        bodies={"d": fb.RigidBody(mass=1.0, inertia=inertia)},
        joints={"h": fb.Revolute("d", (0.0, 0.0))},
        loads={
            "f": fb.Moment("d", f),
            "c": fb.TorsionSpring("d", (0.0, 0.0), stiffness=inertia * omega**2),
        },
        sensors={"angle": fb.Angle("d"), "speed": fb.AngularVelocity("d")},
    )


def driven_mass(f) -> fb.Mechanism:
    """Return a mass whose travel is prescribed."""
    return fb.Mechanism(
        bodies={"p": fb.PointMass(mass=MASS)},
        joints={
            "s": fb.Slot("p", (0.0, 0.0)),
            "m": fb.PrescribedTravel("p", (0.0, 0.0), f),
        },
        sensors={"v": fb.Velocity("p"), "F": fb.Reaction("m")},
    )


def response(
    load: RandomFunction, omega: float, times: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return displacement and velocity, shape (2, times), under a load and its linear pieces.

    The pieces are those between the times and the breakpoints.
    """
    inside = [b for b in load.breakpoints if times[0] < b < times[-1]]
    edges = np.unique(np.r_[times, inside])
    gauss, weights = np.polynomial.legendre.leggauss(POINTS)
    parts = (np.arange(CELLS)[:, None] + (gauss + 1) / 2).ravel() / CELLS
    width = np.diff(edges)[:, None]
    points = edges[:-1, None] + width * parts
    dt = width * np.tile(weights, CELLS) / (2 * CELLS)
    margin = 1e-9 * width[:, 0]
    ends = load.f(np.stack([edges[:-1] + margin, edges[1:] - margin]))
    linear = ends[0][:, None] + (ends[1] - ends[0])[:, None] * parts
    exact, in_pieces = (
        _integrate(f, points, dt, omega, edges, times) for f in (load.f(points), linear)
    )
    return exact, in_pieces


def _integrate(f, at, dt, omega: float, edges: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return displacement and velocity at the times, with the propagator of the free motion."""

    def sine(t):
        return np.sin(omega * t) / omega if omega else t

    total = [(dt * f * -sine(at)).sum(axis=1), (dt * f * np.cos(omega * at)).sum(axis=1)]
    x, v = np.concatenate([np.zeros((2, 1)), np.cumsum(total, axis=1)], axis=1)[
        :, np.searchsorted(edges, times)
    ]
    c = np.cos(omega * times)
    s = sine(times)
    return np.stack([c * x + s * v, -(omega**2) * s * x + c * v])


def travel(drive: RandomFunction, _: float, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return speed and force of a mass that is driven, twice: no load is integrated."""
    values = np.stack([drive.rate(times), MASS * drive.acceleration(times)])
    return values, values


def main() -> None:
    arguments = options(__doc__, 100, seed=(1, "first seed"), family=("", "of this name only"))
    names = [("load", name) for name in LOADS] + [("drive", name) for name in DRIVES]
    rows = []
    trials = []
    for kind, name in names:
        if arguments.family in f"{kind}: {name}":
            kind_trials = [trial(kind, name, arguments.seed + k) for k in range(arguments.samples)]
            counts = Counter(result.outcome for result in kind_trials)
            divided_count = sum(result.needless > 0 for result in kind_trials)
            largest_error = max(
                (result.error for result in kind_trials if not result.warned), default=0.0
            )
            numbers = [
                *(str(counts[o]) for o in OUTCOMES),
                f"{100 * largest_error:.2g}",
                str(divided_count),
            ]
            rows.append([kind_trials[0].family, *numbers])
            trials += [result._asdict() for result in kind_trials]
    header = ["function", *OUTCOMES, "largest error in silence [%]", "smooth, but divided"]
    report(arguments.output, "time_functions", header, rows, {"trials": trials})


if __name__ == "__main__":
    main()
