"""Mechanisms with stops and with pins and guides that have clearance, drawn at random.

Chains with stops and angular stops, worn pins, sliders in guides with play, driven slider–cranks
and discs that meet each other and walls, all without friction. Until ten contacts have closed,
their instants and the motion are compared with the `Reference` of contact_draws.py. Instants may be
off by 1e-5 s or a thousandth of the time between them, places by 1e-6 of the mechanism. From a
grazing contact on, a thousandth as fast as the fastest, and from where the reference itself is
sensitive on, nothing is compared. What is wrong is simulated again with a hundredth of the
tolerance, since impacts amplify errors.

    python -m benchmarks.numerics.contacts --seed 1 --samples 60
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Callable

import numpy as np
from xarray import DataArray

import flexband as fb
from benchmarks.harness import options, report
from benchmarks.numerics.contact_draws import (
    EVENTS,
    GROUND,
    Draw,
    Event,
    Part,
    Place,
    Reference,
    TooLongError,
    Touch,
    mechanism,
)

MECHANISMS = 60
LONGEST = 0.5
TIMES = 41
GRAZING = 1e-3
INSTANT = 1e-5
SHARE = 1e-3
PLACE = 1e-6
SENSITIVE = 0.1
"""Difference of two integrations of the reference, as a share of what is allowed, that tells
nothing about the engine."""


def law(rng: np.random.Generator) -> tuple[float, float, float]:
    """Return K, e and n of a contact."""
    n = float(rng.choice([1.0, 1.5]))
    K = 10.0 ** rng.uniform(7, 10) if n == 1.5 else 10.0 ** rng.uniform(5, 7.5)
    return K, float(rng.choice([1.0, rng.uniform(0.3, 0.95)])), n


def random_velocity(rng: np.random.Generator) -> tuple[float, float, float]:
    """Return a velocity."""
    return float(rng.normal()), float(rng.normal()), float(5 * rng.normal())


def chain(rng: np.random.Generator, lengths, angles) -> tuple[list[Part], list[tuple], Place]:
    """Return bars one after the other from a pin at the origin, their joints and the end."""
    parts, joints, last, (x, y) = [], [], Place(GROUND, 0.0, 0.0), (0.0, 0.0)
    for k, (length, angle) in enumerate(zip(lengths, angles, strict=True)):
        c = np.cos(angle)
        s = np.sin(angle)
        m = rng.uniform(0.5, 2.0)
        place = x + length / 2 * c, y + length / 2 * s, float(angle)
        parts.append(Part(m, m * length**2 / 12, place, random_velocity(rng)))
        joints.append(("pin", Place(k, -length / 2, 0.0), last))
        last = Place(k, length / 2, 0.0)
        x = x + length * c
        y = y + length * s
    return parts, joints, last


def bars(rng: np.random.Generator, min_count: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Return lengths and angles of a few bars."""
    count = int(rng.integers(min_count, 4))
    return rng.uniform(0.2, 0.6, count), rng.uniform(-np.pi, np.pi, count)


def stopped_chain(rng: np.random.Generator) -> Draw:
    """Return a pendulum whose end moves between two stops."""
    lengths, angles = bars(rng)
    parts, joints, end = chain(rng, lengths, angles)
    x = float(lengths @ np.cos(angles))
    width = rng.uniform(0.05, 0.3, 2)
    limits = x - float(width[0]), x + float(width[1])
    stop = Touch("stop", end, Place(GROUND, 0.0, 0.0), limits, law(rng))
    return Draw("stops", parts, joints, [stop])


def turned_chain(rng: np.random.Generator) -> Draw:
    """Return a pendulum with angular stops between two of its bars."""
    lengths, angles = bars(rng, 2)
    parts, joints, _ = chain(rng, lengths, angles)
    relative_angle = float(angles[1] - angles[0])
    limits = (
        relative_angle - float(rng.uniform(0.1, 0.6)),
        relative_angle + float(rng.uniform(0.1, 0.6)),
    )
    K, e, n = law(rng)
    stop = Touch("turn", Place(1, 0.0, 0.0), Place(0, 0.0, 0.0), limits, (1e-3 * K, e, n))
    return Draw("angular stops", parts, joints, [stop])


def worn_chain(rng: np.random.Generator) -> Draw:
    """Return a pendulum one of whose pins has clearance."""
    parts, joints, _ = chain(rng, *bars(rng, 2))
    pin_index = int(rng.integers(len(joints)))
    _, pin, hole = joints.pop(pin_index)
    touch = Touch("pin", pin, hole, (float(10 ** rng.uniform(-4, -2.3)),), law(rng))
    return Draw("worn pins", parts, joints, [touch])


def slider_crank(rng: np.random.Generator) -> Draw:
    """Return a slider–crank with a guide that has play, or with a worn pin and a motor."""
    r = rng.uniform(0.1, 0.2)
    angle = rng.uniform(0.3, 2.8)
    length = r * rng.uniform(2, 4)
    tilt = -np.arcsin(r * np.sin(angle) / length)
    parts, joints, end = chain(rng, [r, length], [angle, tilt])
    x = float(r * np.cos(angle) + length * np.cos(tilt))
    m = rng.uniform(0.3, 2.0)
    long = rng.uniform(0.05, 0.15)
    high = rng.uniform(0.02, 0.08)
    parts.append(Part(m, m * (long**2 + high**2) / 12, (x, 0.0, 0.0), (0.0, 0.0, 0.0)))
    ground = Place(GROUND, 0.0, 0.0)
    slider = Place(2, 0.0, 0.0)
    play = float(10 ** rng.uniform(-3.7, -2.3))
    if rng.random() < 0.5:
        joints.append(("pin", slider, end))
        touch = Touch("guide", slider, ground, (play, float(long), float(high)), law(rng))
        return Draw("guides with play", parts, joints, [touch])
    joints.append(("slot", slider, ground, (1.0, 0.0)))
    joints.append(("motor", Place(0, 0.0, 0.0), ground, float(rng.uniform(10, 60))))
    touch = Touch("pin", end, slider, (play,), law(rng))
    return Draw("driven worn pins", parts, joints, [touch])


def discs(rng: np.random.Generator) -> Draw:
    """Return two discs above a floor and between walls; one hangs on a spring."""
    radii = rng.uniform(0.03, 0.08, 2)
    parts = []
    touches = []
    for k, radius in enumerate(radii):
        m = rng.uniform(0.5, 2.0)
        place = 0.3 * k - 0.15, float(rng.uniform(0.1, 0.3)), 0.0
        parts.append(Part(m, m * radius**2 / 2, place, random_velocity(rng)))
        for angle, wall in (
            (np.pi / 2, (0.0, 0.0)), (0.0, (-0.4, 0.0)), (np.pi, (0.4, 0.0)),
        ):  # fmt: skip
            numbers = float(radius), float(angle)
            touches.append(
                Touch("line", Place(k, 0.0, 0.0), Place(GROUND, *wall), numbers, law(rng))
            )
    centres = Place(0, 0.0, 0.0), Place(1, 0.0, 0.0)
    touches.append(Touch("circles", *centres, (float(radii[0]), float(radii[1])), law(rng)))
    spring = (Place(1, 0.0, 0.0), Place(GROUND, 0.0, 0.6), float(rng.uniform(20, 200)), 0.3)
    return Draw("discs and walls", parts, [], touches, [spring])


FAMILIES: list[Callable[[np.random.Generator], Draw]] = [
    stopped_chain, turned_chain, worn_chain, slider_crank, slider_crank, discs,
]  # fmt: skip


def draw_mechanism(seed: int) -> Draw:
    """Return the mechanism of a seed."""
    return FAMILIES[seed % len(FAMILIES)](np.random.default_rng(seed))


def count_comparable(fine: list, coarse: list) -> tuple[int, str]:
    """Return how many events can be compared, and why no more of them."""
    for k, event in enumerate(fine[:EVENTS]):
        if event.share < GRAZING:
            return k, "grazing"
        if k >= len(coarse) or abs(coarse[k].time - event.time) > SENSITIVE * allowed_error(
            fine, k
        ):
            return k, "sensitive"
    return min(len(fine), EVENTS), ""


def allowed_error(events: list, k: int) -> float:
    """Return by how much the instant of an event may be off [s]."""
    previous_time = events[k - 1].time if k else 0.0
    return max(INSTANT, SHARE * (events[k].time - previous_time))


def judge_mechanism(seed: int, tolerance: float) -> tuple[str, str, str, float]:
    """Return the family, what became of a mechanism, why, and the CPU time of the engine [s]."""
    draw = draw_mechanism(seed)
    reference = Reference(draw)
    try:
        _, coarse = reference.motion(np.array([0.0, LONGEST]), rtol=1e-9)
        duration = LONGEST if len(coarse) <= EVENTS else coarse[EVENTS].time
        times = np.linspace(0.0, duration, TIMES)
        places, events = reference.motion(times)
    except TooLongError:
        return draw.kind, "no reference", "", 0.0
    count, stop_reason = count_comparable(events, coarse)

    def compare(motion: DataArray) -> tuple[bool, str]:
        instant_error, place_difference = errors(
            draw, motion, places, events, count, bool(stop_reason)
        )
        text = (
            f"{count} contacts, instants {instant_error:.1e} of what is allowed, "
            f"places {place_difference:.1e}"
        )
        return instant_error < 1.0 and place_difference < PLACE, f"{text} {stop_reason}"

    model = mechanism(draw, reference.velocities().reshape(-1, 3))
    return draw.kind, *simulate_and_compare(model, duration, tolerance, compare)


def simulate_and_compare(
    model: fb.Mechanism,
    duration: float,
    tolerance: float,
    compare: Callable[[DataArray], tuple[bool, str]],
) -> tuple[str, str, float]:
    """Return what becomes of a mechanism, why, and the CPU time of the engine [s].

    One that is wrong is simulated again with a hundredth of the tolerance. `compare` says whether
    a motion is right, and why.
    """
    outcome = "wrong"
    text = ""
    cpu_time = 0.0
    for part in (1.0, 0.01):
        start_time = time.process_time()
        try:
            motion = fb.simulate(
                model, duration=duration, step=duration / (TIMES - 1),
                integrator=fb.GeneralizedAlpha(
                    step_tolerance=part * tolerance, spectral_radius=1.0
                ),
            )  # fmt: skip
        except fb.errors.RunError as error:
            return "failed", f"{type(error).__name__}: {error}", 0.0
        cpu_time = time.process_time() - start_time
        right, text = compare(motion)
        if right:
            outcome = "right" if part == 1.0 else "right at a hundredth"
            break
    return outcome, text, cpu_time


def errors(
    draw: Draw,
    motion: DataArray,
    places: np.ndarray,
    events: list[Event],
    count: int,
    early_end: bool,
) -> tuple[float, float]:
    """Return the largest error of an instant, over what is allowed, and of a place.

    Places are compared until the last of the contacts that count, or to the end if all do.
    """
    largest_error = 0.0
    for touch in range(len(draw.touches)):
        exact = [(k, e.time) for k, e in enumerate(events[:count]) if e.touch == touch]
        largest_error = max(largest_error, closing_error(motion, f"T{touch}", exact, events))
    until = last_time(motion, events, count, early_end)
    inside = motion["time"].values <= until
    return largest_error, place_error(motion, places, inside, draw.size)


def last_time(motion: DataArray, events: list, count: int, early_end: bool) -> float:
    """Return the instant of the last event that counts, or the end if all of them do."""
    if len(events) <= count and not early_end:
        return float(motion["time"].values[-1])
    return events[count - 1].time if count else 0.0


def closing_error(
    motion: DataArray, name: str, exact: list[tuple[int, float]], events: list
) -> float:
    """Return the largest error of instants at which a contact closes, over what is allowed.

    `exact` are the instants, each with its number among all events.
    """
    largest_error = 0.0
    for n, (k, instant) in enumerate(exact):
        engine_instant = float(motion.sel(output=f"{name}_t{n + 1}").values[-1])
        largest_error = max(
            largest_error,
            1e9
            if np.isnan(engine_instant)
            else abs(engine_instant - instant) / allowed_error(events, k),
        )
    return largest_error


def place_error(motion: DataArray, places: np.ndarray, inside: np.ndarray, size: float) -> float:
    """Return the largest error of x and y, over the size, and of φ [rad] at some times."""
    largest_error = 0.0
    for k in range(places.shape[1] // 3):
        names = f"place b{k}_X", f"place b{k}_Y", f"angle b{k}"
        for i, name in enumerate(names):
            values = motion.sel(output=name).values[inside]
            difference = np.abs(values - places[inside, 3 * k + i]).max(initial=0.0)
            largest_error = max(largest_error, float(difference) / (1.0 if i == 2 else size))
    return largest_error


def tabulate(
    name: str,
    description: str | None,
    judge: Callable[..., tuple[str, str, str, float]],
    count: int,
) -> None:
    """Judge mechanisms of successive seeds and report how many of each family are right."""
    arguments = options(
        description, count, seed=(1, "first of the seeds"), tolerance=(1e-10, "of the steps")
    )
    counts: dict[str, Counter] = {}
    for seed in range(arguments.seed, arguments.seed + arguments.samples):
        kind, outcome, why, cpu_time = judge(seed, arguments.tolerance)
        of_kind = counts.setdefault(kind, Counter())
        of_kind[outcome] += 1
        for stop_reason in ("grazing", "sensitive"):
            of_kind[stop_reason] += why.endswith(stop_reason)
        print(seed, kind, outcome, why, f"{cpu_time:.2f} s", file=sys.stderr, flush=True)
    columns = [
        "right",
        "right at a hundredth",
        "wrong",
        "failed",
        "no reference",
        "grazing",
        "sensitive",
    ]
    rows = [[kind, *(str(of_kind[c]) for c in columns)] for kind, of_kind in counts.items()]
    measurements = {kind: dict(of_kind) for kind, of_kind in counts.items()}
    report(arguments.output, name, ["mechanism", *columns], rows, measurements)


if __name__ == "__main__":
    tabulate("contacts", __doc__, judge_mechanism, MECHANISMS)
