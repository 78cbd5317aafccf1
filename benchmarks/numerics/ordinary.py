"""Ordinary mechanisms, drawn at random, that studies must take: none is refused.

Four-bars, slider–cranks, quick returns, pendulums, gears, stiff springs and elastic cranks, each
with every sensor on every part, and with single sensors, whose outputs may be nothing but rounding.
Samples are those of the smallest expansions; what is told of a mechanism is why it was refused.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

import flexband as fb
from benchmarks.harness import options, report
from benchmarks.honesty.mechanisms import STEEL, four_bar, pendulum, quick_return, slider_crank

MECHANISMS = 100
ALONE = 4
"""Sensors of each mechanism that are studied alone."""

DURATION = 0.2
STEPS = 2e-3, 1e-3, 2e-4
"""From which the step is drawn [s]."""


def gears(first, second, mass, speed):
    """Return two wheels; the first one is driven at constant speed."""
    return fb.Mechanism(
        bodies={
            "pinion": fb.RigidBody(mass=mass, inertia=mass * first**2 / 2),
            "wheel": fb.RigidBody(
                mass=2 * mass, inertia=mass * second**2, position=(first + second, 0.0)
            ),
        },
        joints={
            "A": fb.Revolute("pinion", (0.0, 0.0)),
            "B": fb.Revolute("wheel", (first + second, 0.0)),
            "mesh": fb.Gear("pinion", "wheel", first, second),
            "motor": fb.PrescribedRotation("pinion", lambda t: speed * t),
        },
    )


def spring(mass, stiffness, friction, load):
    """Return a mass on a guide, on a stiff spring."""
    return fb.Mechanism(
        bodies={"mass": fb.RigidBody(mass=mass, inertia=0.01, position=(0.5, 0.0))},
        joints={"guide": fb.Prismatic("mass", (0.0, 0.0))},
        loads={
            "spring": fb.Spring("mass", (0.0, 0.0), stiffness, damping=friction),
            "force": fb.Force("mass", x=lambda t: load * np.sin(20 * t)),
        },
    )


def elastic_crank(crank, youngs_modulus, load, speed):
    """Return an elastic arm with a point mass at its end, on a motor at constant speed."""
    arm = fb.Beam(
        length=crank, elements=2, youngs_modulus=youngs_modulus, poissons_ratio=0.3, **STEEL
    )
    return fb.Mechanism(
        bodies={
            "hub": fb.RigidBody(mass=0.5, inertia=1e-3, rate=speed),
            "arm": arm,
            "tip": fb.PointMass(mass=load, position=(crank, 0.0)),
        },
        joints={
            "A": fb.Revolute("hub", (0.0, 0.0)),
            "W": fb.Weld("arm.start", "hub"),
            "T": fb.Revolute("tip", "arm.end"),
            "motor": fb.PrescribedRotation("hub", lambda t: speed * t),
        },
    )


KINDS = {
    slider_crank: {
        "crank": 0.2, "rod": 0.5, "stiffness": 300.0, "friction": 2.0, "load": 5.0, "speed": 14.0
    },
    quick_return: {"crank": 0.1, "pivot": 0.25, "friction": 5.0, "load": 3.0, "speed": 8.0},
    four_bar: {
        "crank": 0.08, "coupler": 0.3, "rocker": 0.2, "ground": 0.32, "stiffness": 5.0,
        "friction": 0.1, "speed": 10.0,
    },
    pendulum: {"upper": 0.4, "lower": 0.3, "weight": 0.5, "friction": 0.05, "angle": 0.7},
    gears: {"first": 0.05, "second": 0.12, "mass": 1.5, "speed": 30.0},
    spring: {"mass": 2.0, "stiffness": 1e7, "friction": 20.0, "load": 100.0},
    elastic_crank: {"crank": 0.3, "youngs_modulus": 2.1e11, "load": 0.3, "speed": 20.0},
}  # fmt: skip
"""Builders, and what their arguments are about."""


def sensors(mechanism: fb.Mechanism) -> dict[str, Any]:
    """Return every sensor that a mechanism may have, at the points that bodies name."""
    sensor_map: dict[str, Any] = {
        "E_k": fb.KineticEnergy(), "E_e": fb.ElasticEnergy(), "E_p": fb.PotentialEnergy()
    }  # fmt: skip
    for name, body in mechanism.bodies.items():
        ends = [f"{name}.{end}" for end in ("start", "end") if end in getattr(body, "points", {})]
        of_member = isinstance(body, fb.Beam)
        places = [f"{name}.start", f"{name}.middle", f"{name}.end"] if of_member else [name, *ends]
        kinds = [fb.Position, fb.Velocity, fb.Acceleration]
        kinds += [fb.Angle, fb.AngularVelocity] * (not isinstance(body, fb.PointMass))
        sensor_map |= {
            f"{kind.__name__} {place}": kind(place) for kind in kinds for place in places
        }
        if of_member:
            members = fb.SectionForces, fb.Strain, fb.Stress, fb.Deflection
            sensor_map |= {f"{kind.__name__} {name}": kind(name) for kind in members}
    for name in mechanism.joints:
        kinds = fb.Reaction, fb.ReactionMoment, fb.Work
        sensor_map |= {f"{kind.__name__} {name}": kind(name) for kind in kinds}
    for name, load in mechanism.loads.items():
        springs = {fb.Spring: fb.SpringForce, fb.TorsionSpring: fb.SpringMoment}
        sensor_map |= {
            f"{kind.__name__} {name}": kind(name) for kind in [springs.get(type(load))] if kind
        }
        sensor_map[f"Work {name}"] = fb.Work(name)
    return {
        name: sensor for name, sensor in sensor_map.items() if _accepts(mechanism, name, sensor)
    }


def _accepts(mechanism: fb.Mechanism, name: str, sensor: Any) -> bool:
    """Return whether a mechanism may have a sensor."""
    try:
        fb.simulate(with_sensors(mechanism, {name: sensor}), duration=1e-3, step=1e-3)
    except fb.errors.InputError:
        return False
    return True


def with_sensors(mechanism: fb.Mechanism, selection: Mapping[str, Any]) -> fb.Mechanism:
    """Return a mechanism with other sensors."""
    parts = {"bodies": mechanism.bodies, "joints": mechanism.joints, "loads": mechanism.loads}
    return fb.Mechanism(**parts, sensors=dict(selection))


def refusals(seed: int) -> Iterator[str]:
    """Draw a mechanism, and yield why it is refused with all sensors, and with some of them."""
    rng = np.random.default_rng([seed, 33])
    builder, about = list(KINDS.items())[seed % len(KINDS)]
    nominal = {name: value * rng.uniform(0.9, 1.1) for name, value in about.items()}
    step = float(rng.choice(STEPS))
    uncertain_names = rng.choice(list(nominal), size=2, replace=False).tolist()
    half = float(rng.choice([1e-3, 0.02]))
    inputs = {
        uncertain_names[0]: fb.Interval.around(nominal[uncertain_names[0]], percent=100 * half),
        uncertain_names[1]: fb.Normal(nominal[uncertain_names[1]], cv=half),
    }
    all_sensors = sensors(builder(**nominal))
    groups = [
        all_sensors,
        *({k: all_sensors[k]} for k in rng.choice(list(all_sensors), size=ALONE, replace=False)),
    ]
    for selection in groups:

        def build(selection: Mapping[str, Any] = selection, **values: Any) -> fb.Mechanism:
            return with_sensors(builder(**nominal | values), selection)

        response = fb.dynamic_response(build, duration=DURATION, step=step, threads=1)
        try:
            fb.propagate(response, inputs, fb.PCCI(1, 1))
        except fb.errors.InputError as error:
            sensor_name = "all sensors" if selection is all_sensors else next(iter(selection))
            yield f"{builder.__name__}:{seed} with {sensor_name}, {step:g} s: {error}"


def main() -> None:
    arguments = options(__doc__, MECHANISMS, seed=(0, "first seed"))
    rows = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for seed in range(arguments.seed, arguments.seed + arguments.samples):
            for text in refusals(seed):
                rows.append([text])
                print(text, flush=True)
    notes = [
        f"{arguments.samples} mechanisms, seeds from {arguments.seed} on; refused: {len(rows)}"
    ]
    report(arguments.output, "ordinary", ["refused"], rows, {"refused": rows}, notes)


if __name__ == "__main__":
    main()
