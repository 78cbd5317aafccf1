"""Small motions of loaded and of rotating cantilevers, built from the public interface only."""

from __future__ import annotations

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

    def found(load: np.ndarray):
        model = fb.Mechanism(
            bodies={"column": _cable()},
            joints={"clamp": fb.Weld("column.start", (0.0, 0.0))},
            loads={"P": fb.Force("column.end", x=-load, following=True)},
        )
        return fb.modes(model, 2)

    modes = found(np.array(list(exact)))
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
        first = int(np.argmax(found(loads)["unstable"].any("mode").values))
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
    found = 2 * np.pi * fb.modes(model, 1, about=fb.SteadyRotation(rate))["frequency"][:, 0]
    return [
        Check(
            f"rotating cantilever, η at Ω = {omega:g}",
            eta,
            float(np.sqrt(omega_in_plane**2 + omega**2)),
            5e-4 * eta,
        )
        for (omega, eta), omega_in_plane in zip(exact.items(), found.values, strict=True)
    ]


PROBLEMS = [beck, rotating_cantilever]
