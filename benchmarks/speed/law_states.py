"""The cost of a step of a force law with states, over a step of its mechanism without the law.

LuGre's friction (Canudas de Wit et al., IEEE Trans. Automat. Contr. 40 (1995) 419) holds a mass
that is pulled, and a cylinder with two pressures lifts an arm of 120 kg.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial

import numpy as np

import flexband as fb
from benchmarks.friction.bristles import bristles
from benchmarks.harness import alternate, medians, options, report

STEPS = 5000
STEP = 2e-4


def cylinder(t, x, v, s, p, force, rate):
    """Push two points apart by the pressures s, which a valve controls."""
    area = p[0]
    bulk = p[1]
    flow = p[2]
    supply = p[3]
    opening = 2.0 * (p[4] + 0.05 * np.sin(np.pi * t) - x[2, 0])
    for side in range(2):
        drop = supply - s[side] if opening >= 0.0 else s[side]
        through = opening * flow * np.sign(drop) * np.sqrt(abs(drop))
        rate[side] = bulk * (through - (1.0 - 2.0 * side) * area * v[2, 0])
        opening = -opening
    force[2, 0] = area * (s[0] - s[1]) - 2e5 * v[2, 0]


def pulled_mass(pull: np.ndarray, *, law: bool) -> fb.Mechanism:
    """Return LuGre's mass, with or without its friction, pulled by a force [N]."""
    parameters = [1e5, np.sqrt(1e5), 1.0, 1.5, 1e-3]
    floor = fb.ForceLaw(["mass"], bristles, parameters=parameters, states={"z": 0.0})
    return fb.Mechanism(
        bodies={"mass": fb.PointMass(mass=1.0)},
        joints={"rail": fb.Slot("mass", (0.0, 0.0))},
        loads={"pull": fb.Force("mass", x=pull)} | ({"floor": floor} if law else {}),
        sensors={"mass": fb.Position("mass")},
    )


def lifted_arm(area: np.ndarray, *, law: bool) -> fb.Mechanism:
    """Return an arm, lifted by a cylinder of these areas, or falling."""
    oil = fb.ForceLaw(
        ["arm.eye", (0.0, -0.25)],
        cylinder,
        parameters=[area, 1e11, 2e-5, 2e7, 0.25 * 2**0.5],
        between=[(0, 1)],
        states={"a": 2e6, "b": 2e6},
    )
    points = {"pin": (-0.5, 0.0), "eye": (-0.25, 0.0)}
    arm = fb.RigidBody(mass=120.0, inertia=10.0, position=(0.5, 0.0), points=points)
    return fb.Mechanism(
        bodies={"arm": arm},
        joints={"pin": fb.Revolute("arm.pin", (0.0, 0.0))},
        loads={"gravity": fb.Gravity(y=-0.01 * area)} | ({"oil": oil} if law else {}),
        sensors={"arm": fb.Angle("arm")},
    )


CASES: dict[str, tuple[Callable[..., fb.Mechanism], float]] = {
    "LuGre's mass": (pulled_mass, 2.0),
    "cylinder with two pressures": (lifted_arm, 0.01),
}


def microseconds(name: str, samples: int, law: bool) -> float:
    """Return the time of a step of one sample [µs]."""
    make, middle = CASES[name]
    model = make(middle * np.linspace(0.99, 1.01, samples), law=law)
    begin = time.perf_counter()
    fb.simulate(model, duration=STEPS * STEP, step=STEP, threads=1)
    return 1e6 * (time.perf_counter() - begin) / (STEPS * samples)


def main() -> None:
    arguments = options(__doc__, 64)
    cases = {
        f"{name}, {samples} samples, {'with' if law else 'without'}": partial(
            microseconds, name, samples, law
        )
        for name in CASES
        for samples in (1, arguments.samples)
        for law in (True, False)
    }
    for case in cases.values():
        case()  # compile
    measurements = alternate(cases, arguments.repeats)
    middle = medians(measurements)
    rows = []
    for name in CASES:
        for samples in (1, arguments.samples):
            case = f"{name}, {samples} samples"
            cost = middle[f"{case}, with"]
            bare = middle[f"{case}, without"]
            rows.append([case, f"{cost:.3g}", f"{bare:.3g}", f"{cost / bare:.2f}"])
    header = ["case", "with the law [µs]", "without [µs]", "ratio"]
    report(arguments.output, "law_states", header, rows, measurements)


if __name__ == "__main__":
    main()
