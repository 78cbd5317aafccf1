"""Contact: the slider–crank whose guide has play."""

from __future__ import annotations

import math
from dataclasses import replace

from checks import Check

import flexband as fb


def slider_crank(guide: fb.Prismatic) -> fb.Mechanism:
    """Return the mechanism of Flores, Leine and Glocker (2010) without friction and drive."""
    crank = fb.RigidBody(
        mass=0.038, inertia=7.4e-5, position=(0.0765, 0.0), rate=150.0,
        velocity=(0.0, 150.0 * 0.0765), points={"O": (-0.0765, 0.0), "A": (0.0765, 0.0)},
    )  # fmt: skip
    rod = fb.RigidBody(
        mass=0.038, inertia=5.9e-4, position=(0.306, 0.0), rate=-75.0,
        velocity=(0.0, 0.5 * 150.0 * 0.153), points={"A": (-0.153, 0.0), "B": (0.153, 0.0)},
    )  # fmt: skip
    slider = fb.RigidBody(mass=0.076, inertia=2.7e-6, position=(0.459, 0.0))
    return fb.Mechanism(
        bodies={"crank": crank, "rod": rod, "slider": slider},
        joints={
            "O": fb.Revolute("crank.O", (0.0, 0.0)),
            "A": fb.Revolute("rod.A", "crank.A"),
            "B": fb.Revolute("slider", "rod.B"),
            "guide": guide,
        },
        loads={"gravity": fb.Gravity()},
        sensors={"turn": fb.Angle("crank"), "T": fb.KineticEnergy(), "V": fb.PotentialEnergy()},
    )


def play_of_a_guide() -> list[Check]:
    """Let the crank go at 150 rad/s, without play and with 1 mm on each side."""
    tight_guide = fb.Prismatic("slider", (0.0, 0.0))

    def loose_guide(stiffness: float, restitution: float = 0.4) -> fb.Prismatic:
        law = fb.contact.KeepsRestitution(stiffness=stiffness, restitution=restitution)
        return replace(tight_guide, clearance=1e-3, length=0.1, height=0.05, law=law)

    adaptive_steps = fb.GeneralizedAlpha(step_tolerance=1e-8)
    checks = []
    for name, guide, integrator, turns, error in (
        ("no play", tight_guide, fb.GeneralizedAlpha(), (1.17109, 2.30756), 1e-5),
        ("play, rigid impacts", loose_guide(1e11), adaptive_steps, (1.16691, 2.28616), 2e-3),
        ("play, 1e9 N/m^1.5", loose_guide(1e9), adaptive_steps, (1.167295, 2.290760), 2e-5),
    ):
        motion = fb.simulate(
            slider_crank(guide), duration=0.1598, step=2e-5 if guide is tight_guide else 2e-4,
            integrator=integrator,
        )  # fmt: skip
        for time, turn in zip((0.0798, 0.1598), turns, strict=True):
            value = float(motion.sel(output="turn", time=time)) / (2 * math.pi)
            name_at = f"guide with {name}, turns of the crank at {time} s"
            checks.append(Check(name_at, turn, value, error * turn))
    elastic = slider_crank(loose_guide(1e9, restitution=1.0))
    motion = fb.simulate(
        elastic, duration=0.01, step=2e-4, integrator=fb.GeneralizedAlpha(step_tolerance=1e-7)
    )
    energy = motion.sel(output=["T", "V"]).sum("output").values
    energy_ratio = float(energy[-1] / energy[0])
    return [*checks, Check("guide with play, e = 1, energy kept in 10 ms", 1.0, energy_ratio, 2e-4)]


PROBLEMS = [play_of_a_guide]
