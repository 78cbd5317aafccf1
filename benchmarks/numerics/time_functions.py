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
    Drawn,
    between,
    drive,
    load,
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
    one_time = rng.random() < 0.25
    steps = int(between(rng, 100, MAX_STEPS_OF_ONE_TIME if one_time else MAX_STEPS))
    h = between(rng, 1e-4, 1e-2)
    samples = int(rng.choice([1, 1, 3]))
    make = load if kind == "load" else drive
    drawn = [make(family, rng, h, steps) for _ in range(samples)]
    if kind == "drive":
        drawn = [function + float(-function.f(np.zeros(1))[0]) * power(0) for function in drawn]
    f = functions(drawn, one_time)
    times = h * np.arange(steps + 1)
    omega = rng.choice([0.0, rng.uniform(1, 6) / times[-1]])
    exact = response if kind == "load" else travel
    references = [exact(function, omega, times) for function in drawn]
    inertia = 20 * max(np.abs(reference[0]).max() for reference, _ in references)
    mechanism = moved(f, omega, inertia) if kind == "load" else driven(f)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        motion = fb.simulate(mechanism, duration=steps * h, step=h).values
    motion = motion.reshape(samples, -1, steps + 1)
    motion = motion[:, ::2] if motion.shape[1] == 4 else motion  # x of x and y
    motion = motion * inertia if kind == "load" and omega else motion
    error = allowed = 0.0
    for result, (reference, linear) in zip(motion, references, strict=True):
        scale = np.maximum(np.ptp(reference, axis=1), 1e-12)
        most = np.abs(linear - reference).max(axis=1) / scale
        within = RIGHT + np.where(most < RESOLVED, 2 * most, 0.0)
        off = np.abs(result - reference).max(axis=1) / scale
        k = np.argmax(off / within)
        if off[k] / within[k] >= error / max(allowed, RIGHT):
            error = off[k]
            allowed = within[k]
    warned = tuple(text for w in caught if UNRESOLVED in (text := str(w.message)))
    outcome = OUTCOMES[
        (0 if error <= allowed else 3) + (1 if error <= allowed else -1) * bool(warned)
    ]
    needless = 0
    if not any(function.breakpoints for function in drawn):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            schedule, *_ = tabulate([f], {1: "m"} if kind == "drive" else {}, samples, times)
        needless = int((schedule.sides > 0).sum())
    return Trial(f"{kind}: {family}", outcome, error, allowed, needless, warned, seed)


def functions(drawn: list[Drawn], one_time: bool):
    """Return functions as one that has a column for each, of one time or of many."""

    def f(t):
        moments = np.broadcast_to(t, (*np.shape(t)[:-1], len(drawn)))
        columns = [function.f(moments[..., k]) for k, function in enumerate(drawn)]
        return np.stack(columns, axis=-1) if len(drawn) > 1 or np.ndim(t) else columns[0]

    def of_one_time(t):
        values = f(float(t))
        return values if len(drawn) > 1 else float(values)

    return of_one_time if one_time else f


def moved(f, omega: float, inertia: float) -> fb.Mechanism:
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


def driven(f) -> fb.Mechanism:
    """Return a mass whose travel is prescribed."""
    return fb.Mechanism(
        bodies={"p": fb.PointMass(mass=MASS)},
        joints={
            "s": fb.Slot("p", (0.0, 0.0)),
            "m": fb.PrescribedTravel("p", (0.0, 0.0), f),
        },
        sensors={"v": fb.Velocity("p"), "F": fb.Reaction("m")},
    )


def response(load: Drawn, omega: float, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return displacement and velocity, shape (2, times), under a load and its linear pieces.

    The pieces are those between the times and the breakpoints.
    """
    inside = [b for b in load.breakpoints if times[0] < b < times[-1]]
    edges = np.unique(np.r_[times, inside])
    gauss, weights = np.polynomial.legendre.leggauss(POINTS)
    parts = (np.arange(CELLS)[:, None] + (gauss + 1) / 2).ravel() / CELLS
    width = np.diff(edges)[:, None]
    at = edges[:-1, None] + width * parts
    dt = width * np.tile(weights, CELLS) / (2 * CELLS)
    near = 1e-9 * width[:, 0]
    ends = load.f(np.stack([edges[:-1] + near, edges[1:] - near]))
    linear = ends[0][:, None] + (ends[1] - ends[0])[:, None] * parts
    exact, in_pieces = (_integrated(f, at, dt, omega, edges, times) for f in (load.f(at), linear))
    return exact, in_pieces


def _integrated(f, at, dt, omega: float, edges: np.ndarray, times: np.ndarray) -> np.ndarray:
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


def travel(drive: Drawn, _: float, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
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
            drawn = [trial(kind, name, arguments.seed + k) for k in range(arguments.samples)]
            counts = Counter(each.outcome for each in drawn)
            divided = sum(each.needless > 0 for each in drawn)
            most = max((each.error for each in drawn if not each.warned), default=0.0)
            numbers = [*(str(counts[o]) for o in OUTCOMES), f"{100 * most:.2g}", str(divided)]
            rows.append([drawn[0].family, *numbers])
            trials += [each._asdict() for each in drawn]
    header = ["function", *OUTCOMES, "largest error in silence [%]", "smooth, but divided"]
    report(arguments.output, "time_functions", header, rows, {"trials": trials})


if __name__ == "__main__":
    main()
