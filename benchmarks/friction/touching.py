"""Bodies that are placed in touch, exactly or within 1e-9 of their size, drawn at random.

Wheels on a floor, boxes on two corners, discs in a corner and pins at the rim of their holes, rough
and smooth, with output steps from 1 ms to 0.1 s. Each must start, and travel as far as the same
body that falls from 1e-6 of the size above. The places are averages from halfway to the end, or to
where a contact closes again after the rebounds of that fall: what vibrates on its contacts does so
otherwise after a fall. They may differ by 1e-3 of the travel and ten times the height of the fall.

    python -m benchmarks.friction.touching --seed 1 --samples 300
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

import flexband as fb
from benchmarks.harness import options, report
from flexband import contact

MECHANISMS = 300
TRAVEL = 1e-3
"""Allowed difference, relative to the travel."""
FALL = 1e-6
"""Height of the fall, relative to the size."""
DURATION = 0.2
POINTS = 400
"""Times at which motions are compared."""


class TouchingBody(NamedTuple):
    """A body that may be placed at a height above what it touches."""

    kind: str
    size: float  # [m]
    restitution: float
    contacts: tuple[str, ...]
    at: Callable[[float], fb.Mechanism]


def draw_law(rng: np.random.Generator) -> tuple[contact.KeepsRestitution, float | None]:
    """Return the normal law and the coefficient of friction of a body."""
    law = contact.KeepsRestitution(
        stiffness=10 ** rng.uniform(5.0, 9.0),
        restitution=rng.uniform(0.2, 0.95),
        exponent=rng.choice([1.0, 1.5]),
    )
    return law, rng.choice([None, rng.uniform(0.05, 0.9)])


def wheel(rng: np.random.Generator) -> TouchingBody:
    """Return a wheel of 1 kg that gravity and a moment roll along a floor."""
    (law, mu), radius, g = draw_law(rng), 10 ** rng.uniform(-2.0, 0.0), rng.normal()
    moment = 0.1 * rng.normal() * radius

    def at(height: float) -> fb.Mechanism:
        touching = contact.Contact(
            "b", (0.0, 0.0), contact.CircleOnLine(radius=radius), law, friction=mu
        )
        return mechanism(
            (0.0, radius + height), 0.4 * radius**2, {"floor": touching}, fb.Gravity(x=g), moment
        )

    return TouchingBody("wheel", radius, law.restitution, ("floor",), at)


def box(rng: np.random.Generator) -> TouchingBody:
    """Return a box of 1 kg on two corners, with a load along the floor."""
    (law, mu), width, g = draw_law(rng), 10 ** rng.uniform(-1.5, 0.0), rng.normal()
    tall = width * rng.uniform(0.2, 1.0)
    corners = {"left": (-0.5 * width, -0.5 * tall), "right": (0.5 * width, -0.5 * tall)}

    def at(height: float) -> fb.Mechanism:
        touching = {
            name: contact.Contact(f"b.{name}", (0.0, 0.0), contact.CircleOnLine(), law, friction=mu)
            for name in corners
        }
        inertia = (width**2 + tall**2) / 12.0
        return mechanism(
            (0.0, 0.5 * tall + height), inertia, touching, fb.Gravity(x=g), points=corners
        )

    return TouchingBody("box", width, law.restitution, ("left", "right"), at)


def disc(rng: np.random.Generator) -> TouchingBody:
    """Return a disc of 1 kg in the corner of a floor and a wall."""
    (law, mu), radius = draw_law(rng), 10 ** rng.uniform(-2.0, 0.0)

    def at(height: float) -> fb.Mechanism:
        floor = contact.CircleOnLine(radius=radius)
        wall = contact.CircleOnLine(radius=radius, normal=(1.0, 0.0))
        touching = {
            name: contact.Contact("b", (0.0, 0.0), side, law, friction=mu)
            for name, side in (("floor", floor), ("wall", wall))
        }
        place = radius + height
        return mechanism((place, place), 0.5 * radius**2, touching, fb.Gravity(x=-1.0), 0.1)

    return TouchingBody("disc", radius, law.restitution, ("floor", "wall"), at)


def pin(rng: np.random.Generator) -> TouchingBody:
    """Return a body of 1 kg on a pin that rests at the rim of its hole."""
    (law, mu), clearance = draw_law(rng), 10 ** rng.uniform(-4.0, -2.5)
    radius = {} if mu is None else {"radius": 0.02, "friction": mu}

    def at(height: float) -> fb.Mechanism:
        hole = fb.Revolute("b", (0.0, 0.0), clearance=clearance, law=law, **radius)
        return mechanism((0.0, height - clearance), 0.01, {}, fb.Gravity(), 0.05, {"pin": hole})

    return TouchingBody("pin", 0.3, law.restitution, ("pin",), at)


FAMILIES = (wheel, box, disc, pin)


def mechanism(
    position: tuple[float, float],
    inertia: float,
    contacts: dict[str, contact.Contact],
    gravity: fb.Gravity,
    moment: float = 0.0,
    joints: dict[str, fb.Revolute] | None = None,
    points: dict[str, tuple[float, float]] | None = None,
) -> fb.Mechanism:
    """Return a body of 1 kg with its contacts, a sensor of each, and those of its motion."""
    body = fb.RigidBody(mass=1.0, inertia=inertia, position=position, points=points or {})
    parts = [*contacts, *(joints or {})]
    return fb.Mechanism(
        bodies={"b": body},
        joints=joints or {},
        loads={"gravity": gravity, "moment": fb.Moment("b", moment), **contacts},
        sensors={
            "p": fb.Position("b"),
            "a": fb.Angle("b"),
            **{name: contact.Contacts(name, first=0) for name in parts},
        },
    )


def judge_body(seed: int) -> tuple[str, str, str]:
    """Return the family of a body, what became of it, and by how much it differs."""
    rng = np.random.default_rng(seed)
    body = FAMILIES[seed % len(FAMILIES)](rng)
    gap = rng.choice([0.0, 1e-12, -1e-12, 9e-10, -9e-10]) * body.size
    step = rng.choice([1e-3, 1e-2, 0.1])
    # Simulate the body in touch, then its fall.
    try:
        fb.simulate(body.at(gap), duration=DURATION, step=step)
        touching = fb.simulate(body.at(gap), duration=DURATION, step=DURATION / POINTS)
    except fb.errors.RunError as error:
        return body.kind, "refused", str(error)
    falling = fb.simulate(body.at(FALL * body.size), duration=DURATION, step=DURATION / POINTS)
    # Leave out the times after contacts close again.
    times = touching["time"].values
    fall = np.sqrt(2.0 * FALL * body.size / 1.0)
    rebounds = fall * (1.0 + 2.0 * body.restitution / (1.0 - body.restitution))
    number = np.zeros(len(times))
    for motion in (touching, falling):
        closings = [motion.sel(output=f"{name}_number").values for name in body.contacts]
        later = sum(c - c[np.searchsorted(times, min(rebounds, times[-1]))] for c in closings)
        number = np.maximum(number, later)
    time_mask = number < 1.0
    time_mask &= times >= 0.5 * times[time_mask][-1]
    # Compare mean places.
    start, touching_mean, falling_mean = (
        m.sel(output=["p_X", "p_Y"]).values[:, rows].mean(axis=1)
        for m, rows in ((touching, [0]), (touching, time_mask), (falling, time_mask))
    )
    travel = np.abs(touching_mean - start).max()
    difference = np.abs(touching_mean - falling_mean).max()
    tolerance = TRAVEL * travel + 10.0 * FALL * body.size
    text = f"off by {difference:.1e} m of {travel:.1e} m, {time_mask.mean():.0%} of the time"
    return body.kind, "right" if difference <= tolerance else "different", text


def main() -> None:
    """Judge bodies of successive seeds and report how many of each family are right."""
    arguments = options(__doc__, MECHANISMS, seed=(1, "first of the seeds"))
    counts: dict[str, Counter] = {}
    for seed in range(arguments.seed, arguments.seed + arguments.samples):
        kind, outcome, why = judge_body(seed)
        counts.setdefault(kind, Counter())[outcome] += 1
        if outcome != "right":
            print(seed, kind, outcome, why, file=sys.stderr, flush=True)
    columns = ["right", "different", "refused"]
    rows = [[kind, *(str(of_kind[c]) for c in columns)] for kind, of_kind in counts.items()]
    report(arguments.output, "touching", ["body", *columns], rows,
           {kind: dict(of_kind) for kind, of_kind in counts.items()})  # fmt: skip


if __name__ == "__main__":
    main()
