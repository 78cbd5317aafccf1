"""Mechanisms and numerics drawn at random, for the judgement of estimated errors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import flexband as fb
from benchmarks.honesty.studies import KINDS


@dataclass(frozen=True)
class Run:
    """A mechanism, and how it is simulated."""

    mechanism: fb.Mechanism
    duration: float
    step: float


def cantilever(rng: np.random.Generator) -> Run:
    """Return a beam whose end is loaded suddenly or within a while."""
    length = rng.uniform(0.2, 1.0)
    slenderness = rng.uniform(8, 80)
    height = length / slenderness
    modulus = 10 ** rng.uniform(8, 11)
    density = 2000.0
    area = 0.02 * height
    second = 0.02 * height**3 / 12
    period = 2 * np.pi / 3.516 * length**2 * np.sqrt(density * area / (modulus * second))
    force = rng.uniform(0.1, 1.5) * modulus * second / length**2
    rise = rng.uniform(0, 1) * period
    beam = fb.Beam(
        length=length, height=height, width=0.02, density=density, youngs_modulus=modulus,
        poissons_ratio=0.3, elements=int(rng.integers(2, 7)),
        retardation_time=rng.choice([0.0, 0.01 * period]),
        integration=rng.choice(np.array([None, fb.sections.SelectiveIntegration()], dtype=object)),
    )  # fmt: skip
    mechanism = fb.Mechanism(
        bodies={"beam": beam},
        joints={"clamp": fb.Weld("beam.start", (0.0, 0.0))},
        loads={"load": fb.Force("beam.end", y=lambda t: -force * np.minimum(t / rise, 1.0))},
        sensors={
            "tip": fb.Position("beam.end"),
            "root": fb.Reaction("clamp"),
            "bend": fb.SectionForces("beam", "middle"),
        },
    )
    return _run(mechanism, rng.uniform(1, 5) * period, int(rng.integers(100, 400)))


def swinging_member(rng: np.random.Generator) -> Run:
    """Return a soft beam or a cable that falls from the horizontal, with a weight at its end."""
    length = rng.uniform(0.4, 1.0)
    height = rng.uniform(2e-3, 8e-3)
    modulus = 10 ** rng.uniform(7, 9)
    density = 1200.0
    elements = int(rng.integers(3, 13))
    area = 0.02 * height
    second = 0.02 * height**3 / 12
    if rng.random() < 0.5:
        member = fb.Cable(
            length=length, mass_per_length=density * area, elements=elements,
            axial_stiffness=modulus * area, bending_stiffness=modulus * second,
        )  # fmt: skip
    else:
        member = fb.Beam(
            length=length, height=height, width=0.02, density=density, youngs_modulus=modulus,
            poissons_ratio=0.4, elements=elements,
        )  # fmt: skip
    mechanism = fb.Mechanism(
        bodies={
            "member": member,
            "weight": fb.PointMass(mass=rng.uniform(0, 0.5) + 1e-3, position=(length, 0.0)),
        },
        joints={
            "hinge": fb.Revolute("member.start", (0.0, 0.0)),
            "end": fb.Revolute("weight", "member.end"),
        },
        loads={"gravity": fb.Gravity()},
        sensors={
            "end": fb.Position("member.end"),
            "F": fb.Reaction("hinge"),
            "U": fb.ElasticEnergy(),
        },
    )
    return _run(mechanism, rng.uniform(0.3, 0.8), int(rng.integers(150, 600)))


def chain(rng: np.random.Generator) -> Run:
    """Return rigid bars with torsion springs between them that are let go."""
    bodies = {}
    joints = {}
    loads = {"gravity": fb.Gravity()}
    end = (0.0, 0.0)
    for k in range(int(rng.integers(2, 5))):
        length = rng.uniform(0.1, 0.4)
        angle = rng.uniform(-1, 1)
        bodies[f"{k}"] = fb.RigidBody.bar(
            length=length, height=0.02, width=0.02, density=3000.0, start=end, angle=angle
        )
        previous_end = f"{k - 1}.end" if k else end
        joints[f"j{k}"] = fb.Revolute(f"{k}.start", previous_end)
        loads[f"s{k}"] = fb.TorsionSpring(
            f"{k}", previous_end, 10 ** rng.uniform(0, 2), damping=1e-3
        )
        end = (end[0] + length * np.cos(angle), end[1] + length * np.sin(angle))
    sensors = {
        "end": fb.Position(f"{k}.end"),
        "turn": fb.Angle(f"{k}"),
        "F": fb.Reaction("j0"),
    }
    return _run(
        fb.Mechanism(bodies=bodies, joints=joints, loads=loads, sensors=sensors),
        rng.uniform(0.3, 1.0),
        int(rng.integers(100, 600)),
    )


def _run(mechanism: fb.Mechanism, duration: float, steps: int) -> Run:
    """Return a run of so many steps, whose length has few digits."""
    step = float(f"{duration / steps:.3g}")
    return Run(mechanism, float(f"{steps * step:.12g}"), step)


def linkage(name: str) -> Callable[[np.random.Generator], Run]:
    """Return a function that draws one of the mechanisms of the honesty benchmark."""
    kind = KINDS[name]

    def draw(rng: np.random.Generator) -> Run:
        values = {
            key: value * (1 + spread * rng.uniform(-1, 1))
            for key, (value, spread) in kind.parameters.items()
        }
        steps = round(rng.uniform(*kind.duration) / kind.step * 10 ** rng.uniform(-0.3, 0.5))
        return _run(kind.builder(**values), rng.uniform(*kind.duration), steps)

    return draw


DRAWN = {"cantilever": cantilever, "swinging member": swinging_member, "chain": chain} | {
    name: linkage(name) for name in KINDS
}
