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
    found = []
    for radius, lost in ((0.7, 5e-3), (0.98, 2e-5), (1.0, 1e-11)):
        integrator = fb.GeneralizedAlpha(spectral_radius=radius)
        motion = fb.simulate(model, duration=1e4, step=1.0, integrator=integrator)
        speed = float(motion.sel(output="w")[-1]) / 0.1
        found.append(Check(f"free disc, ρ∞ = {radius:g}, speed kept", 1.0, speed, lost))
    return found


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


PROBLEMS = [disc, bar_pendulum]
