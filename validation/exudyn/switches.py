"""Contact, friction, joints that switch, and forces that are chosen step by step."""

from __future__ import annotations

import numpy as np
from members import cable
from pendulums import GRAVITY, bar
from rebuilt import at_end, register_script

import flexband as fb


@register_script(
    "TestModels/pendulumFriction.py",
    "y of the centre after 1 s [m]",
    exudyn=-0.16685757,
    tolerance=1e-6,
    value=1.0,
)
def pendulum_with_friction(force):
    mass, length, width = 2.5, 0.8, 0.025
    body = fb.RigidBody(
        mass=mass,
        inertia=mass * (length**2 + width**2) / 12,
        position=(length / 2, 0.0),
        points={"pin": (-length / 2, 0.0)},
    )
    brake = fb.contact.Brake("b", (0.0, 0.0), fb.contact.Coulomb(kinetic=1.0), length, force)
    model = fb.Mechanism(
        bodies={"b": body},
        joints={"pin": fb.Revolute("b.pin", (0.0, 0.0))},
        loads=GRAVITY | {"brake": brake},
        sensors={"r": fb.Position("b")},
    )
    return at_end(model, 1.0, 0.01, integrator=fb.GeneralizedAlpha(step_tolerance=1e-9))[..., 1]


@register_script(
    "Examples/switchingConstraintsPendulum.py",
    "y of the rod after 2 s [m]",
    exudyn=1.69804383,
    tolerance=1e-5,
    value=4.0,
)
def pendulum_that_is_released(rate):
    """Let a rod lose a point after 0.1 s, and its pin after 0.3 s."""
    rod = bar(1.0, 12.0, position=(-0.5, 0.0), rate=rate, velocity=(0.0, rate / 2))
    point = fb.PointMass(mass=2.0, position=(-0.5, 0.0), velocity=(0.0, rate / 2))
    pin, hold = fb.Revolute("rod.a", (-1.0, 0.0)), fb.Revolute("point", "rod")
    model = fb.Mechanism(
        bodies={"rod": rod, "point": point},
        joints={
            "pin": fb.contact.Switched(pin, lambda t: t < 0.3),
            "hold": fb.contact.Switched(hold, lambda t: t < 0.1),
        },
        sensors={"rod": fb.Position("rod")},
    )
    return at_end(model, 2.0, 1e-3)[..., 1]


@register_script(
    "Examples/testGymCartpoleEnv.py",
    "angle of the pole after ten decisions [rad]",
    exudyn=-0.01985288,
    tolerance=1e-7,
    value=10.0,
)
def cart_and_pole(force):
    """Decide every 20 ms where the cart is pushed, in a simulation of its own."""
    pole = fb.RigidBody(
        mass=0.1,
        inertia=1e-6,
        points={"foot": (0.0, -0.5)},
        angle=0.05,
        position=(-0.5 * np.sin(0.05), 0.5 * np.cos(0.05)),
    )
    motion = "assembled"
    for right in (0, 0, 1, 0, 1, 1, 0, 1, 0, 0):
        model = fb.Mechanism(
            bodies={"cart": fb.RigidBody(mass=1.0, inertia=0.1), "pole": pole},
            joints={"rail": fb.Slot("cart", (0.0, 0.0)), "pin": fb.Revolute("pole.foot", "cart")},
            loads={
                "gravity": fb.Gravity(y=-9.8),
                "push": fb.Force("cart", force if right else -force),
            },
            sensors={"angle": fb.Angle("pole")},
        )
        motion = fb.simulate(model, duration=0.02, step=2e-4, start=motion, keep_state=True)
    return motion.values[..., 0, -1]


@register_script(
    "TestModels/ANCFcontactCircleTest.py",
    "travel of the end along y at rest [m]",
    exudyn=-0.46727,
    tolerance=1e-3,
    value=0.5,
)
def cable_on_two_rolls(depth):
    """Let nodes meet the rolls, with a fine mesh where they do."""
    law = fb.contact.KeepsRestitution(stiffness=1e3, exponent=1.0)
    bodies, joints, loads = {}, {}, {}
    rolls = {1: ((0.5, -0.15), 0.1), 3: ((1.5, -depth), 0.2)}
    start, before = 0.0, (0.0, 0.0)
    for part, (end, elements) in enumerate(((0.45, 6), (0.65, 16), (1.4, 12), (1.7, 24), (2.0, 5))):
        bodies[f"{part}"] = cable(
            end - start, 0.001, 0.001, 2.07e11, 7800.0, elements, start=(start, 0.0)
        )
        joints[f"{part}"] = fb.Weld(f"{part}.start", before)
        loads[f"{part}"] = fb.DistributedLoad(f"{part}", y=-80 * 7800.0 * 1e-6)
        if part in rolls:
            center, radius = rolls[part]
            shape = fb.contact.CircleOnCircle(radii=(0.0, radius))
            loads |= {
                f"{part} {k}": fb.contact.Contact(f"{part}.node {k}", center, shape, law)
                for k in range(1, elements)
            }
        start, before = end, f"{part}.end"
    model = fb.Mechanism(
        bodies=bodies, joints=joints, loads=loads, sensors={"r": fb.Position(before)}
    )
    return fb.equilibrium(model, steps=5).sel(output="r_Y").values
