"""Linkages of rigid bodies."""

from __future__ import annotations

import numpy as np
from pendulums import GRAVITY, bar, crank_pins
from rebuilt import at_end, register_script

import flexband as fb


@register_script(
    "Examples/SliderCrank.py",
    "x of the slider after 2 s [m]",
    exudyn=0.501202253,
    tolerance=2e-6,
    value=10.0,
)
def slider_crank(torque):
    model = fb.Mechanism(
        bodies={
            "crank": bar(0.5, 2.0, position=(0.25, 0.0)),
            "rod": bar(1.0, 4.0, position=(1.0, 0.0)),
            "slider": fb.PointMass(mass=1.0, position=(1.5, 0.0)),
        },
        joints=crank_pins() | {"guide": fb.Slot("slider", (0.0, 0.0))},
        loads={"torque": fb.Moment("crank", torque)},
        sensors={"x": fb.Position("slider")},
    )
    return at_end(model, 2.0, 5e-5)[..., 0]


@register_script(
    "TestModels/fourBarMechanismIftomm.py",
    "x of the first bar's centre after 4 s [m]",
    exudyn=0.05880804,
    tolerance=1e-6,
    value=1.0,
)
def ladder(speed):
    starts = [(0.0, 0.5), (0.5, 1.0), (1.0, 0.5), (1.5, 1.0), (2.0, 0.5)]
    bodies = {}
    for k, start in enumerate(starts):
        motion = (
            {"angle": np.pi / 2, "rate": -speed, "velocity": (speed / 2, 0.0)}
            if k % 2 == 0
            else {"velocity": (speed, 0.0)}
        )
        bodies[f"{k}"] = bar(1.0, 1.0, position=start, **motion)
    pins = [
        ("0.a", (0.0, 0.0)),
        ("2.a", (1.0, 0.0)),
        ("4.a", (2.0, 0.0)),
        ("1.a", "0.b"),
        ("3.a", "1.b"),
        ("3.a", "2.b"),
        ("3.b", "4.b"),
    ]
    joints = {f"{k}": fb.Revolute(*pin) for k, pin in enumerate(pins)}
    model = fb.Mechanism(
        bodies=bodies, joints=joints, loads=GRAVITY, sensors={"r": fb.Position("0")}
    )
    return at_end(model, 4.0, 1e-4)[..., 0]


def crank_with_two_sliders(stiffness):
    start = 0.6 * np.cos(np.pi / 6)
    crank, rod = (
        bar(length, mass, mass / 12 * length**2 * 1e-10, angle=angle)
        for mass, length, angle in ((0.36, 0.3, np.pi / 2), (0.15, 0.6, -np.pi / 6))
    )
    return fb.Mechanism(
        bodies={
            "crank": crank,
            "rod": rod,
            "3": fb.PointMass(mass=0.1, position=(start, 0.0)),
            "4": fb.PointMass(mass=0.7, position=(start + 0.2, 0.0)),
        },
        joints=crank_pins(slider="3") | {k: fb.Slot(k, (0.0, 0.0)) for k in "34"},
        loads={"torque": fb.Moment("crank", 1.0), "spring": fb.Spring("4", "3", stiffness, 0.2)},
        sensors={"x": fb.Position("4")},
    )


@register_script(
    "Examples/slidercrankWithMassSpring.py",
    "x of the second slider after 1 s [m]",
    exudyn=0.9419289,
    tolerance=1e-5,
    value=1000.0,
)
def slider_crank_with_a_spring(stiffness):
    return at_end(crank_with_two_sliders(stiffness), 1.0, 2e-5)[..., 0]
