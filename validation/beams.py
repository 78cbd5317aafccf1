"""Cantilevers of the default beam, coarse meshes included, built from the public interface only."""

from __future__ import annotations

import numpy as np
from checks import Check, differences
from flexible import cantilever

import flexband as fb

MODULUS, RATIO, DENSITY = 2.1e11, 0.3, 7800.0


def _beam(slenderness: float, elements: int = 4) -> tuple[fb.Beam, float]:
    """Return a beam of 1 m with this L/h, and its bending stiffness [N m²]."""
    height, width = 1.0 / slenderness, 0.01
    beam = fb.Beam(
        length=1.0, height=height, width=width, density=DENSITY, youngs_modulus=MODULUS,
        poissons_ratio=RATIO, elements=elements,
    )  # fmt: skip
    return beam, MODULUS * width * height**3 / 12


def slender_cantilever() -> list[Check]:
    """Four elements under a tip force P L²/EI = 1, against the inextensible elastica."""
    checks = []
    for slenderness in (100.0, 500.0):
        beam, bending = _beam(slenderness)
        x, y, angle = cantilever(beam, {"P": fb.Force("beam.end", y=bending)})
        deflections, exact = (1 - x, y, angle), (0.0564332363, 0.3017207738, 0.4613519497)
        checks += [
            Check(f"four elements, L/h = {slenderness:g}, a = 1: {name}", reference, value, 1e-4)
            for name, value, reference in zip(
                ("u/L", "w/L", "tip angle"), deflections, exact, strict=True
            )
        ]
    return checks


def princeton() -> list[Check]:
    """Dowell and Traybar (1975): the beam loaded in each of its planes, four elements."""
    high, low = 12.3777e-3, 3.2024e-3
    exact = {
        ("stiff", 8.896): 0.0107142,
        ("stiff", 13.345): 0.0160642,
        ("soft", 8.896): 0.146246,
        ("soft", 13.345): 0.200678,
    }
    checks = []
    for (plane, force), reference in exact.items():
        height, width = (high, low) if plane == "stiff" else (low, high)
        beam = fb.Beam(
            length=0.508, height=height, width=width, density=2700.0, youngs_modulus=71.7e9,
            poissons_ratio=0.31, elements=4,
        )  # fmt: skip
        _, y, _ = cantilever(beam, {"P": fb.Force("beam.end", y=force)})
        name = f"Princeton beam, {plane} plane, {force:g} N, tip [m]"
        checks.append(Check(name, reference, float(y), 3e-4 * reference))
    return checks


def roll_up() -> list[Check]:
    """Close a cantilever to a circle by an end moment of 2πEI/L."""
    beam, bending = _beam(100.0, elements=16)
    cable = fb.Cable(
        length=1.0, mass_per_length=1.0, axial_stiffness=1e6 * bending,
        bending_stiffness=bending, elements=16,
    )  # fmt: skip
    checks = []
    for name, member in (("beam", beam), ("cable", cable)):
        model = fb.Mechanism(
            bodies={"beam": member},
            joints={"clamp": fb.Weld("beam.start", (0.0, 0.0))},
            loads={"M": fb.Moment("beam.end", 2 * np.pi * bending)},
            sensors={"tip": fb.Position("beam.end"), "U": fb.ElasticEnergy()},
        )
        x, y, energy = fb.equilibrium(model, steps=20).values
        checks += differences(f"roll-up, {name}, tip [m]", np.array([x, y]), (0.0, 0.0), 1e-6)
        reference = 2 * np.pi**2
        scaled_energy = float(energy / bending)
        checks.append(
            Check(f"roll-up, {name}, energy L/EI", reference, scaled_energy, 1e-6 * reference)
        )
    return checks


def frequencies() -> list[Check]:
    """Clamped–free beam of four elements, L/h = 500, against a thin beam: (βL)²."""
    beam, bending = _beam(500.0)
    model = fb.Mechanism(bodies={"beam": beam}, joints={"clamp": fb.Weld("beam.start", (0.0, 0.0))})
    eigenvalues = fb.modes(model, 3, about="start")["frequency"].values * 2 * np.pi
    eigenvalues /= np.sqrt(bending / (DENSITY * 0.01 / 500.0))
    roots, relative = (1.875104, 4.694091, 7.854757), (2e-4, 1.5e-3, 1.2e-2)
    return [
        Check(f"clamped–free, four elements, (β{k} L)²", r**2, float(w), part * r**2)
        for k, (w, r, part) in enumerate(zip(eigenvalues, roots, relative, strict=True), start=1)
    ]


PROBLEMS = [slender_cantilever, princeton, roll_up, frequencies]
