"""Forces of contacts that stay closed in slow motions, between the times of the result and at them.

A beam of random size with a mass at its end rests on a loose pin, rough or smooth, which a drive
lowers slowly. At the start it is in equilibrium. All four normal laws, tolerances of 1e-6, 1e-7 and
1e-8 and steps of the result of 0.1, 1 and 10 ms are tried, or one setting at random. The reference
are forces at a thousand times with a tolerance of 1e-10, which sensors of extremes have no part in.
The largest and smallest forces at all steps may differ from theirs by 1e-3 of the largest force at
a tolerance of 1e-6 and by 1e-4 at 1e-8, and the energy that damping takes is not negative.

    python -m benchmarks.numerics.quasi_static --seed 1 --samples 30
"""

from __future__ import annotations

import itertools
import sys
import warnings
from functools import cache
from typing import NamedTuple

import numpy as np

import flexband as fb
from benchmarks.harness import options, report
from flexband import contact

LAWS = (
    contact.KeepsRestitution, contact.HuntCrossley, contact.Flores, contact.LankaraniNikravesh,
)  # fmt: skip
TOLERANCES = {1e-6: 1e-3, 1e-7: 1e-3, 1e-8: 1e-4}
"""Of steps -> allowed error of forces, in parts of the largest."""

STEPS = (1e-4, 1e-3, 1e-2)
DURATION = 0.1
PLACES = 1000
NUMBERS = {"stiffness": 1e9, "restitution": 0.5}


class Lever(NamedTuple):
    """A beam on a pin; lengths in m."""

    angle: float
    half: float  # distance of the pin from the foot, half the length
    height: float
    mass: float  # at the end [kg]
    elements: int
    clearance: float
    travel: float  # of the pin in half a second

    def mechanism(self, law: contact.NormalLaw, friction: float | None) -> fb.Mechanism:
        """Return the mechanism."""
        x = self.half * np.cos(self.angle)
        y = self.half * np.sin(self.angle)
        way = fb.ramp(to=-self.travel, duration=0.5).integral
        return fb.Mechanism(
            bodies={
                "arm": fb.Beam(
                    length=2.0 * self.half, height=self.height, width=0.012, density=2700.0,
                    youngs_modulus=70e9, poissons_ratio=0.33, retardation_time=5e-4,
                    elements=self.elements, angle=self.angle,
                ),
                "load": fb.PointMass(mass=self.mass, position=(2.0 * x, 2.0 * y)),
                "slide": fb.RigidBody(mass=2.0, inertia=0.01, position=(x, y)),
            },
            joints={
                "foot": fb.Slot("arm.start", (0.0, 0.0)),
                "load": fb.Revolute("arm.end", "load"),
                "pin": fb.Revolute(
                    "slide", "arm.0.5", clearance=self.clearance, law=law, radius=0.01,
                    friction=friction,
                ),
                "guide": fb.Slot("slide", (x, 0.0), axis=(0.0, 1.0)),
                "turn": fb.PrescribedRotation("slide", lambda t: 0.0 * t),
                "drive": fb.PrescribedTravel(
                    "slide", (0.0, 0.0), lambda t: y - way(t), axis=(0.0, 1.0)
                ),
            },
            loads={"g": fb.Gravity()},
            sensors={
                "F": contact.ContactForce("pin"),
                "R": fb.Reaction("drive"),
                "pin": contact.Contacts("pin", first=0),
                "large": fb.sensors.Largest(fb.Reaction("drive")),
                "small": fb.sensors.Smallest(fb.Reaction("drive")),
            },
        )  # fmt: skip


FIRST = Lever(0.35, 0.3, 0.04, 30.0, 4, 5e-5, 0.07)


def draw_lever(rng: np.random.Generator) -> Lever:
    """Return a lever of random size."""
    half = float(rng.uniform(0.15, 0.5))
    return Lever(
        angle=float(rng.uniform(0.1, 0.6)),
        half=half,
        height=half * float(rng.uniform(0.08, 0.2)),
        mass=float(rng.uniform(5.0, 50.0)),
        elements=int(rng.integers(2, 6)),
        clearance=float(10 ** rng.uniform(-5.0, -3.7)),
        travel=half * float(rng.uniform(0.05, 0.25)),
    )


@cache
def references(lever: Lever, kind: type, friction: float | None) -> tuple[float, float, float]:
    """Return the largest force of the pin, and the largest and smallest of the drive."""
    motion = fb.simulate(
        lever.mechanism(kind(**NUMBERS), friction), duration=DURATION, step=DURATION / PLACES,
        start="static", integrator=fb.GeneralizedAlpha(step_tolerance=1e-10),
    )  # fmt: skip
    pin, drive = (motion.sel(output=name).values for name in ("F", "R_Y"))
    return float(pin.max()), float(drive.max()), float(drive.min())


def judge_setting(
    lever: Lever, kind: type, friction: float | None, tolerance: float, step: float
) -> tuple[float, str]:
    """Return the largest error of a force over what is allowed, and the errors."""
    exact = references(lever, kind, friction)
    end = fb.simulate(
        lever.mechanism(kind(**NUMBERS), friction), duration=DURATION, step=step, start="static",
        integrator=fb.GeneralizedAlpha(step_tolerance=tolerance),
    ).isel(time=-1)  # fmt: skip
    forces = [float(end.sel(output=name)) for name in ("pin_force", "large_Y", "small_Y")]
    largest = max(map(abs, exact))
    errors = [abs(a - b) / largest for a, b in zip(forces, exact, strict=True)]
    energy_loss = float(end.sel(output="pin_energy"))
    text = f"forces {', '.join(f'{error:.1e}' for error in errors)}, loss {energy_loss:.1e} J"
    return np.inf if energy_loss < 0.0 else max(errors) / TOLERANCES[tolerance], text


def main() -> None:
    """Judge all settings of the first lever, or one of each of as many random levers."""
    arguments = options(
        __doc__, 30, seed=(0, "first of the seeds; 0 for all settings of one lever")
    )
    rows: dict[str, list[float]] = {}
    warnings.simplefilter("ignore")
    settings = list(itertools.product(LAWS, (None, 0.1), TOLERANCES, STEPS))
    cases = [(FIRST, setting) for setting in settings]
    if arguments.seed:
        cases = []
        for seed in range(arguments.seed, arguments.seed + arguments.samples):
            rng = np.random.default_rng(seed)
            cases.append((draw_lever(rng), settings[rng.integers(len(settings))]))
    for lever, (kind, friction, tolerance, step) in cases:
        worst, text = judge_setting(lever, kind, friction, tolerance, step)
        rows.setdefault(kind.__name__, []).append(worst)
        if worst > 1.0:
            setting = f"µ {friction}, tolerance {tolerance:g}, step {step:g} s"
            print(lever, kind.__name__, setting, text, file=sys.stderr, flush=True)
    header = ["law", "settings", "right", "largest error over what is allowed"]
    lines = [
        [name, str(len(errors)), str(sum(e <= 1.0 for e in errors)), f"{max(errors):.2g}"]
        for name, errors in rows.items()
    ]
    report(arguments.output, "quasi_static", header, lines, rows)


if __name__ == "__main__":
    main()
