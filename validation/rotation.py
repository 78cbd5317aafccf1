"""Fast rotation and long motions without damping."""

from __future__ import annotations

import numpy as np
from checks import Check

import flexband as fb


def disc() -> list[Check]:
    """Turn a free disc by 10 000 steps of 0.1 rad: its speed is constant."""
    model = fb.Mechanism(
        bodies={"disc": fb.RigidBody(mass=1.0, inertia=1.0, rate=0.1)},
        sensors={"w": fb.AngularVelocity("disc")},
    )
    checks = []
    for radius, tolerance in ((0.7, 5e-3), (0.98, 2e-5), (1.0, 1e-11)):
        integrator = fb.GeneralizedAlpha(spectral_radius=radius)
        motion = fb.simulate(model, duration=1e4, step=1.0, integrator=integrator)
        speed = float(motion.sel(output="w")[-1]) / 0.1
        checks.append(Check(f"free disc, ρ∞ = {radius:g}, speed kept", 1.0, speed, tolerance))
    return checks


def bar_pendulum() -> list[Check]:
    """Swing a bar of 1 m and 1 kg for a minute at 1 ms and ρ∞ = 1, from the horizontal."""
    body = fb.RigidBody.bar(length=1.0, height=0.02, width=0.02, density=2500.0)
    model = fb.Mechanism(
        bodies={"bar": body},
        joints={"A": fb.Revolute("bar.start", (0.0, 0.0))},
        loads={"gravity": fb.Gravity()},
        sensors={"T": fb.KineticEnergy(), "V": fb.PotentialEnergy()},
    )
    integrator = fb.GeneralizedAlpha(spectral_radius=1.0)
    energy = fb.simulate(model, duration=60.0, step=1e-3, integrator=integrator).sum("output")
    change = float(np.abs(energy - energy[0]).max())
    return [Check("bar pendulum, ρ∞ = 1, change of energy in 60 s [J]", 0.0, change, 1e-4)]


def redundant_plate() -> list[Check]:
    """Swing a plate of 1 kg on three equal parallel cranks: the least reactions, and their sum."""
    bar = {"length": 0.3, "height": 0.01, "width": 0.01, "density": 1000.0}
    bodies = {
        "plate": fb.RigidBody.block(
            length=1.0, height=0.1, width=0.01, density=1000.0, position=(0.662, -0.252),
            points={str(k): (0.5 * k - 0.5, 0.0) for k in range(3)},
        )
    }  # fmt: skip
    joints, sensors = {}, {"plate": fb.Acceleration("plate")}
    for k in range(3):
        bodies[f"crank{k}"] = fb.RigidBody.bar(**bar, start=(0.5 * k, 0.0), angle=-1.0)
        joints[f"A{k}"] = fb.Revolute(f"crank{k}.start", (0.5 * k, 0.0))
        joints[f"B{k}"] = fb.Revolute(f"plate.{k}", f"crank{k}.end")
        sensors[f"B{k}"] = fb.Reaction(f"B{k}")
    model = fb.Mechanism(
        bodies=bodies, joints=joints, loads={"gravity": fb.Gravity()}, sensors=sensors
    )
    motion = fb.simulate(model, duration=2.0, step=1e-3)
    forces = motion.sel(output=[f"B{k}_{axis}" for k in range(3) for axis in "XY"]).values
    total_force = motion.sel(output=["plate_X", "plate_Y"]).values + np.array([[0.0], [9.81]])
    difference = float(np.abs(forces.reshape(3, 2, -1).sum(axis=0) - total_force).max())
    largest = float(np.abs(forces).max())
    return [
        Check("plate on three cranks, sum of reactions − m (a − g) [N]", 0.0, difference, 1e-7),
        Check("plate on three cranks, largest reaction, below 2 m g [N]", 0.0, largest, 2 * 9.81),
    ]


PROBLEMS = [disc, bar_pendulum, redundant_plate]
