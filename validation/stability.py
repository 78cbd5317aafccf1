"""Small motions of loaded and of rotating cantilevers, built from the public interface only."""

from __future__ import annotations

import warnings

import numpy as np
from checks import Check

import flexband as fb


def _cable(**start) -> fb.Cable:
    """Return a thin cantilever of length, mass and bending stiffness 1."""
    return fb.Cable(
        length=1.0, mass_per_length=1.0, axial_stiffness=1e8, bending_stiffness=1.0, elements=16,
        **start,
    )  # fmt: skip


def beck() -> list[Check]:
    """Beck's column: an end force of P EI/L² that follows the tangent."""
    exact = {3.0: (3.913096, 21.09872), 10.0: (5.175762, 18.58679)}

    def modes_at(load: np.ndarray):
        model = fb.Mechanism(
            bodies={"column": _cable()},
            joints={"clamp": fb.Weld("column.start", (0.0, 0.0))},
            loads={"P": fb.Force("column.end", x=-load, following=True)},
        )
        return fb.modes(model, 2)

    modes = modes_at(np.array(list(exact)))
    checks = [
        Check(
            f"Beck's column, P = {load:g}, ω{mode + 1} √(ρA L⁴/EI)",
            reference,
            2 * np.pi * float(modes["frequency"][k, mode]),
            1e-4 * reference,
        )
        for k, (load, references) in enumerate(exact.items())
        for mode, reference in enumerate(references)
    ]
    low, high = 18.0, 22.0
    while high - low > 1e-4:
        loads = np.linspace(low, high, 9)
        first = int(np.argmax(modes_at(loads)["unstable"].any("mode").values))
        low, high = loads[first - 1], loads[first]
    return [*checks, Check("Beck's column, flutter load P L²/EI", 20.051, (low + high) / 2, 2e-3)]


def rotating_cantilever() -> list[Check]:
    """Wright et al. (1982), no hub: η out of the plane, √(η² − Ω²) in the plane of rotation."""
    exact = {2.0: 4.1373, 4.0: 5.5850, 12.0: 13.1702}
    rate = np.array(list(exact))
    model = fb.Mechanism(
        bodies={"hub": fb.RigidBody(mass=1.0, inertia=1.0), "blade": _cable()},
        joints={
            "pin": fb.Revolute("hub", (0.0, 0.0)),
            "drive": fb.PrescribedRotation("hub", lambda t: rate * t),
            "root": fb.Weld("blade.start", "hub"),
        },
    )
    frequencies = 2 * np.pi * fb.modes(model, 1, about=fb.SteadyRotation(rate))["frequency"][:, 0]
    return [
        Check(
            f"rotating cantilever, η at Ω = {omega:g}",
            eta,
            float(np.sqrt(omega_in_plane**2 + omega**2)),
            5e-4 * eta,
        )
        for (omega, eta), omega_in_plane in zip(exact.items(), frequencies.values, strict=True)
    ]


def check_forces(bodies: dict, joints: dict, point: str, start: tuple, exact: dict) -> list[Check]:
    """Return checks of the forces that hold a point at travels downwards, travel -> force."""
    checks = []
    for travel, force in exact.items():
        lift = fb.PrescribedTravel(point, start, lambda t, travel=travel: -travel, (0.0, 1.0))
        model = fb.Mechanism(
            bodies=bodies, joints=joints | {"lift": lift}, sensors={"F": fb.Reaction("lift")}
        )
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="assembly turned")  # to meet the travel
            value = -float(fb.equilibrium(model).sel(output="F_Y"))
        checks.append(Check(f"force at a travel of {travel:g}", force, value, 2e-4 * force))
    return checks


def lee() -> list[Check]:
    """Lee's frame past its limit point, by prescribed travel; 8 elements a member."""
    section = {
        "section": fb.sections.GeneralSection(6.0, 2.0), "density": 1.0, "youngs_modulus": 720.0,
        "poissons_ratio": 0.3,
    }  # fmt: skip
    members = {
        "column": fb.Beam(length=120.0, angle=np.pi / 2, elements=8, **section),
        "near": fb.Beam(length=24.0, start=(0.0, 120.0), elements=2, **section),
        "far": fb.Beam(length=96.0, start=(24.0, 120.0), elements=6, **section),
    }
    joints = {
        "foot": fb.Revolute("column.start", (0.0, 0.0)),
        "corner": fb.Weld("near.start", "column.end", -np.pi / 2),
        "load": fb.Weld("far.start", "near.end"),
        "end": fb.Revolute("far.end", (120.0, 120.0)),
    }
    exact = {10: 0.9626, 20: 1.3447, 30: 1.5940, 40: 1.7794, 50: 1.8523}
    checks = check_forces(members, joints, "near.end", (24.0, 120.0), exact)
    return [c._replace(name=f"Lee's frame, {c.name}") for c in checks]


def williams() -> list[Check]:
    """Williams' toggle past its limit point, by prescribed travel; 8 elements a member."""
    span, rise = 12.943, 0.386
    angle = np.arctan2(rise, span)
    member = {
        "length": np.hypot(span, rise), "elements": 8, "mass_per_length": 1.0,
        "axial_stiffness": 1.885e6, "bending_stiffness": 9.27e3,
    }  # fmt: skip
    members = {
        "left": fb.Cable(angle=angle, **member),
        "right": fb.Cable(angle=-angle, start=(span, rise), **member),
    }
    joints = {
        "left": fb.Weld("left.start", (0.0, 0.0), angle),
        "right": fb.Weld("right.end", (2 * span, 0.0), -angle),
        "top": fb.Weld("right.start", "left.end", -2 * angle),
    }
    exact = {0.1: 25.201, 0.24: 33.841, 0.4: 31.282, 0.6: 53.282}
    checks = check_forces(members, joints, "left.end", (span, rise), exact)
    return [c._replace(name=f"Williams' toggle, {c.name}") for c in checks]


PROBLEMS = [beck, rotating_cantilever, lee, williams]
