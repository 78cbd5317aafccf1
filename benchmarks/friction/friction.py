"""Mechanisms with friction, drawn at random.

Blocks on inclines and belts, chains with rough pins, sliders that cranks drive in rough guides,
discs that slide and roll on lines and circles, wheels with brakes, and rough stops. Until ten
events, of contacts that close and of friction that sticks, slides or turns, the motion is compared
with the `Reference` as in benchmarks/numerics/contacts.py: places, instants of contacts that close,
and whether friction sticks at the times of the result; the instants of sticking and sliding show in
the places. Grazing are events that a change of a thousandth would undo.

    python -m benchmarks.friction.friction --seed 1 --samples 40
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from xarray import DataArray

from benchmarks.friction.draws import (
    Brake,
    Coulomb,
    Draw,
    Drive,
    Link,
    RoughTouch,
    mechanism,
)
from benchmarks.friction.reference import JammedError, Motion, Reference
from benchmarks.numerics.contact_draws import (
    EVENTS,
    GRAVITY,
    GROUND,
    Part,
    Place,
    TooLongError,
    Touch,
)
from benchmarks.numerics.contacts import (
    PLACE,
    TIMES,
    allowed_error,
    bars,
    chain,
    closing_error,
    count_comparable,
    last_time,
    law,
    place_error,
    random_velocity,
    simulate_and_compare,
    tabulate,
)

MECHANISMS = 40
STILL = 1e-8
"""Sliding speed [m/s] below which friction sticks."""


def draw_friction(rng: np.random.Generator, low: float = 0.1, high: float = 0.5) -> Coulomb:
    """Return a law: constant, with a static coefficient, or with parts of Stribeck and viscous."""
    kinetic = float(rng.uniform(low, high))
    static = kinetic * float(rng.choice([1.0, rng.uniform(1.05, 1.6)]))
    stribeck = float(rng.choice([0.0, rng.uniform(0.05, 0.5)])) if static > kinetic else 0.0
    return Coulomb(kinetic, static, stribeck, float(rng.choice([0.0, rng.uniform(0.1, 2.0)])))


def rate_drive(rate: float, begin: float = 0.0) -> Drive:
    """Return begin + rate t."""
    return lambda t: (begin + rate * t, rate, 0.0)


def wave_drive(amplitude: float, rate: float) -> Drive:
    """Return amplitude · sin(rate t)."""
    return lambda t: (
        amplitude * math.sin(rate * t), amplitude * rate * math.cos(rate * t),
        -amplitude * rate**2 * math.sin(rate * t),
    )  # fmt: skip


def ground(x: float = 0.0, y: float = 0.0) -> Place:
    """Return a point of the ground."""
    return Place(GROUND, x, y)


def block(rng: np.random.Generator, x: float, y: float) -> Part:
    """Return a block at rest, which joints may move."""
    m = float(rng.uniform(0.5, 2.0))
    return Part(m, m * float(rng.uniform(1e-3, 5e-3)), (x, y, 0.0), (0.0, 0.0, 0.0))


def blocks(rng: np.random.Generator) -> Draw:
    """Return one or two blocks on an incline or on a belt, each pulled by a spring."""
    slope, (a, b) = float(rng.uniform(-0.4, 0.4)), rng.uniform(-0.05, 0.05, 2)
    axis = math.cos(slope), math.sin(slope)
    if rng.random() < 0.5:
        drive = rate_drive(float(rng.choice([-1, 1]) * rng.uniform(0.05, 0.5)))
    else:
        drive = wave_drive(float(rng.uniform(0.02, 0.1)), float(rng.uniform(5, 20)))
    parts = [block(rng, 0.0, 0.0), block(rng, 0.3, 0.2)]
    belt = [
        Link("guide", Place(0, 0.0, 0.0), ground(), axis),
        Link("travel", Place(0, 0.0, 0.0), ground(), axis, drive=drive),
    ]
    on_belt = rng.random() < 0.5
    length = float(rng.uniform(0.05, 0.2))
    base = Place(0, 0.3, 0.2) if on_belt else ground(0.3, 0.2)
    links = [*belt, Link("guide", Place(1, 0.0, 0.0), base, axis, draw_friction(rng), length)]
    pull_point = Place(1, float(a), float(b))
    holder = ground(-0.3, 0.1) if on_belt else Place(0, 0.0, 0.0)
    stiffness = float(10 ** rng.uniform(1.5, 3.0))
    rest = float(rng.uniform(0.3, 0.6))
    springs = [(pull_point, holder, stiffness, rest)]
    if rng.random() < 0.5:
        parts.append(block(rng, 0.3, 0.3))
        links.append(
            Link(
                "guide",
                Place(2, 0.0, 0.0),
                Place(1, 0.0, 0.1),
                axis,
                draw_friction(rng),
                2 * length,
            )
        )
        springs.append((Place(2, 0.01, 0.0), ground(0.8, 0.3), stiffness / 2, 0.45))
    return Draw("blocks", parts, links, springs=springs)


def rough_chain(rng: np.random.Generator) -> Draw:
    """Return a pendulum of some bars with rough pins, whose end is on a spring."""
    lengths, angles = bars(rng)
    parts, pins, end = chain(rng, lengths, angles)
    links = [
        Link(
            "pin",
            first,
            second,
            friction=draw_friction(rng, 0.2, 0.9),
            length=float(rng.uniform(0.02, 0.08)),
        )
        for _, first, second in pins
    ]
    spring = (end, ground(0.4, -0.4), float(10 ** rng.uniform(1, 2.5)), 0.2)
    return Draw("rough chains", parts, links, springs=[spring])


def crank_and_slider(rng: np.random.Generator) -> Draw:
    """Return a slider in a rough guide or slot, which a crank pulls by a spring."""
    r = float(rng.uniform(0.05, 0.15))
    length = float(rng.uniform(0.05, 0.2))
    crank = Part(1.0, 1e-2, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    slider = block(rng, 0.5, 0.0)
    kind = str(rng.choice(["guide", "slot"]))
    links = [
        Link("pin", Place(0, 0.0, 0.0), ground()),
        Link("motor", Place(0, 0.0, 0.0), ground(), drive=rate_drive(float(rng.uniform(5, 30)))),
        Link(kind, Place(1, 0.0, 0.0), ground(0.5, 0.0), (1.0, 0.0), draw_friction(rng), length),
    ]
    high = float(rng.uniform(-0.03, 0.03)) if kind == "guide" else 0.0
    stiffness = float(10 ** rng.uniform(2, 3))
    spring = (Place(1, 0.0, high), Place(0, r, 0.0), stiffness, 0.5 - r)
    return Draw("cranks and sliders", [crank, slider], links, springs=[spring])


def slider_crank(rng: np.random.Generator) -> Draw:
    """Return a slider–crank with a rough guide, one rough pin, and a spring at its slider."""
    r = float(rng.uniform(0.1, 0.2))
    angle = float(rng.uniform(0.3, 2.8))
    reach = r * float(rng.uniform(2, 4))
    tilt = -math.asin(r * math.sin(angle) / reach)
    parts, pins, end = chain(rng, [r, reach], [angle, tilt])
    x = r * math.cos(angle) + reach * math.cos(tilt)
    parts.append(block(rng, x, 0.0))
    pins.append(("pin", Place(2, 0.0, 0.0), end))
    links = [Link("pin", first, second) for _, first, second in pins]
    has_motor = rng.random() < 0.5
    if has_motor:  # nothing can stick, all reactions change sign with the motion
        links[1] = links[1]._replace(
            friction=draw_friction(rng), length=float(rng.uniform(0.01, 0.03))
        )
        drive = rate_drive(float(rng.uniform(10, 40)), angle)
        links.append(Link("motor", Place(0, 0.0, 0.0), ground(), drive=drive))
    friction = draw_friction(rng, 0.05, 0.3)
    length = float(rng.uniform(0.05, 0.15))
    links.append(Link("guide", Place(2, 0.0, 0.0), ground(), (1.0, 0.0), friction, length))
    spring = (Place(2, 0.0, 0.0), ground(x + 0.5, 0.0), float(10 ** rng.uniform(1, 2.5)), 0.5)
    kind = "driven slider–cranks" if has_motor else "slider–cranks"
    return Draw(kind, parts, links, springs=[spring])


def disc(rng: np.random.Generator, x: float, y: float, radius: float) -> Part:
    """Return a disc or a ring that moves."""
    m = float(rng.uniform(0.5, 2.0))
    share = float(rng.uniform(0.4, 1.0))
    return Part(m, share * m * radius**2, (x, y, 0.0), random_velocity(rng))


def soft_law(rng: np.random.Generator) -> tuple[float, float, float]:
    """Return K, e and n of a contact in which a body can lie."""
    return float(10 ** rng.uniform(3.5, 5.5)), 1.0, 1.0


def rolling_disc(rng: np.random.Generator) -> Draw:
    """Return a disc that slides and rolls on a slope, a hump or in a hollow."""
    radius = float(rng.uniform(0.03, 0.1))
    where = str(rng.choice(["line", "circles", "hole"]))
    K, e, n = soft_law(rng)
    angle = math.pi / 2 + float(rng.uniform(-0.3, 0.3))
    normal = np.array([math.cos(angle), math.sin(angle)])
    part = disc(rng, 0.0, 0.0, radius)
    depth = part.mass * GRAVITY * math.sin(angle) / K
    tangent_velocity = np.array([normal[1], -normal[0]]) * float(rng.normal())
    part = replace(
        part,
        velocity=(float(tangent_velocity[0]), float(tangent_velocity[1]), 4 * part.velocity[2]),
    )
    if where == "line":
        numbers = (radius, angle)
        second = -(radius - depth) * normal
    elif where == "circles":
        numbers = radius, float(rng.uniform(0.2, 0.5))
        second = -(sum(numbers) - depth) * normal
    else:
        numbers = radius, radius + float(rng.uniform(0.1, 0.4))
        second = (numbers[1] - numbers[0] + depth) * normal
    touch = Touch(where, Place(0, 0.0, 0.0), ground(*map(float, second)), numbers, (K, e, n))
    return Draw("rolling discs", [part], touches=[RoughTouch(touch, draw_friction(rng), True)])


def falling_discs(rng: np.random.Generator) -> Draw:
    """Return two discs that fall on a slope and meet each other."""
    radii = rng.uniform(0.03, 0.08, 2)
    parts = [disc(rng, 0.25 * k, float(rng.uniform(0.15, 0.25)), float(radii[k])) for k in (0, 1)]
    angle = math.pi / 2 + float(rng.uniform(-0.2, 0.2))
    touches = []
    for k, radius in enumerate(radii):
        numbers = float(radius), angle
        touch = Touch("line", Place(k, 0.0, 0.0), ground(), numbers, law(rng))
        touches.append(RoughTouch(touch, draw_friction(rng)))
    centres = Place(0, 0.0, 0.0), Place(1, 0.0, 0.0)
    touch = Touch("circles", *centres, (float(radii[0]), float(radii[1])), law(rng))
    touches.append(RoughTouch(touch, draw_friction(rng)))
    spring = (*centres, float(rng.uniform(20, 200)), 0.1)
    return Draw("falling discs", parts, touches=touches, springs=[spring])


def rough_stops(rng: np.random.Generator) -> Draw:
    """Return a pendulum of one or two bars whose end moves between two rough stops."""
    lengths, angles = bars(rng)
    parts, pins, end = chain(rng, lengths[:2], angles[:2])
    x = float(lengths[:2] @ np.cos(angles[:2]))
    width = rng.uniform(0.05, 0.2, 2)
    limits = x - float(width[0]), x + float(width[1])
    touch = Touch("stop", end, ground(), limits, law(rng))
    links = [Link("pin", first, second) for _, first, second in pins]
    return Draw("rough stops", parts, links, [RoughTouch(touch, draw_friction(rng))])


def brakes(rng: np.random.Generator) -> Draw:
    """Return one or two wheels on a shaft, with a brake of each, springs at their rims."""
    count = int(rng.integers(1, 3))
    parts = []
    links = []
    springs = []
    brake_list = []
    for k in range(count):
        radius = float(rng.uniform(0.1, 0.3))
        m = float(rng.uniform(0.5, 2.0))
        turns = float(rng.uniform(-10, 10))
        parts.append(Part(m, m * radius**2 / 2, (0.0, 0.0, 0.0), (0.0, 0.0, turns)))
        pin = Link("pin", Place(k, 0.0, 0.0), ground())
        if k == 0 and count == 2:
            pin = pin._replace(friction=draw_friction(rng), length=float(rng.uniform(0.01, 0.05)))
        links.append(pin)
        springs.append(
            (Place(k, radius, 0.0), ground(0.5, 0.2), float(10 ** rng.uniform(1, 2.5)), 0.2)
        )
        base = float(rng.uniform(5, 50))
        swing = float(rng.uniform(0, 0.9))
        rate = float(rng.uniform(5, 40))

        def force(t, base=base, swing=swing, rate=rate):
            return base * (1.0 + swing * math.sin(rate * t))

        other = Place(0, 0.0, 0.0) if k else ground()
        if k or count == 1:
            brake_list.append(
                Brake(
                    Place(k, 0.0, 0.0),
                    other,
                    draw_friction(rng),
                    float(rng.uniform(0.05, 0.2)),
                    force,
                )
            )
    return Draw("brakes", parts, links, springs=springs, brakes=brake_list)


FAMILIES: list[Callable[[np.random.Generator], Draw]] = [
    blocks, rough_chain, crank_and_slider, slider_crank, rolling_disc, falling_discs, rough_stops,
    brakes,
]  # fmt: skip


def draw_mechanism(seed: int) -> Draw:
    """Return the mechanism of a seed."""
    return FAMILIES[seed % len(FAMILIES)](np.random.default_rng(seed))


def judge_mechanism(seed: int, tolerance: float) -> tuple[str, str, str, float]:
    """Return the family, what became of a mechanism, why, and the CPU time of the engine [s]."""
    draw = draw_mechanism(seed)
    reference = Reference(draw)
    duration = 0.5 if draw.touches else 1.0
    try:
        coarse = reference.motion(np.array([0.0, duration]), rtol=1e-9).counted_events
        duration = duration if len(coarse) <= EVENTS else coarse[EVENTS].time
        exact = reference.motion(np.linspace(0.0, duration, TIMES))
    except (TooLongError, JammedError) as error:
        return draw.kind, "no reference", type(error).__name__, 0.0
    count, stop_reason = count_comparable(exact.counted_events, coarse)

    def compare(motion: DataArray) -> tuple[bool, str]:
        inside = motion["time"].values <= last_time(
            motion, exact.counted_events, count, bool(stop_reason)
        )
        place_difference = place_error(motion, exact.places, inside, draw.size)
        instant_error = instants(motion, exact, count)
        other_modes = modes(motion, exact, inside)
        text = (
            f"{count} events, instants {instant_error:.1e} of what is allowed, "
            f"places {place_difference:.1e}, {other_modes} other modes {stop_reason}"
        )
        return instant_error < 1.0 and place_difference < PLACE and not other_modes, text

    model = mechanism(draw, reference.velocities().reshape(-1, 3))
    return draw.kind, *simulate_and_compare(model, duration, tolerance, compare)


def instants(motion: DataArray, exact: Motion, count: int) -> float:
    """Return the largest error of an instant at which a contact closes, over what is allowed."""
    events = exact.counted_events
    largest_error = 0.0
    for name in {event.name for event in events[:count] if event.what == "closes"}:
        closings = [
            (k, e.time)
            for k, e in enumerate(events[:count])
            if (e.name, e.what) == (name, "closes")
        ]
        largest_error = max(largest_error, closing_error(motion, name, closings, events))
    return largest_error


def modes(motion: DataArray, exact: Motion, inside: np.ndarray) -> int:
    """Return how often something sticks that should slide, or the other way round.

    That is counted at the times of the result that are not next to an event.
    """
    difference_count = 0
    events = exact.counted_events
    for k, event in enumerate(events):
        inside = inside & (np.abs(exact.times - event.time) > allowed_error(events, k))
    for k, name in enumerate(exact.names):
        if exact.names.count(name) > 1:  # a stop with two sides
            continue
        speed = np.abs(motion.sel(output=f"friction {name}_speed").values)
        slow_sliding = (exact.modes[:, k] != 0) & (np.abs(exact.speed[:, k]) < 10 * STILL)
        valid_mask = inside & ~np.isnan(exact.modes[:, k]) & ~slow_sliding
        difference_count += int(((exact.modes[:, k] == 0) != (speed < STILL))[valid_mask].sum())
    return difference_count


if __name__ == "__main__":
    tabulate("friction", __doc__, judge_mechanism, MECHANISMS)
