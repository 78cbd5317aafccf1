"""Published beams and flexible mechanisms, built from the public interface only."""

from __future__ import annotations

import warnings

import numpy as np
import xarray as xr
from checks import Check, differences

import flexband as fb


def cantilever(beam: fb.Beam | fb.Cable, loads, *, axis: bool = False) -> np.ndarray:
    """Return position and angle of the tip of a clamped beam along X in equilibrium under loads."""
    model = fb.Mechanism(
        bodies={"beam": beam},
        joints={"clamp": fb.Weld("beam.start", (0.0, 0.0), axis=axis)},
        loads=loads,
        sensors={"tip": fb.Position("beam.end"), "angle": fb.Angle("beam.end")},
    )
    return fb.equilibrium(model, steps=4).values


def elastica() -> list[Check]:
    """Inextensible cantilever with a normal tip force P L²/EI = a; a strip with L/h = 500."""
    length, area, second, modulus = 1.0, 2e-5, 2e-5 * 0.002**2 / 12, 2e11
    exact = {
        1: (0.0564332363, 0.3017207738, 0.4613519497),
        2: (0.1606417208, 0.4934574804, 0.7817498316),
        5: (0.3876283607, 0.7137915236, 1.2153681176),
        10: (0.5549955978, 0.8106090249, 1.4302855388),
    }
    strip = fb.Cable(
        length=length, elements=16, mass_per_length=7800 * area,
        axial_stiffness=modulus * area, bending_stiffness=modulus * second,
    )  # fmt: skip
    checks = []
    for a, reference in exact.items():
        force = fb.Force("beam.end", y=a * modulus * second / length**2)
        x, y, angle = cantilever(strip, {"P": force})
        deflections = (length - x, y, angle)
        for name, value, r in zip(("u/L", "w/L", "tip angle"), deflections, reference, strict=True):
            checks.append(Check(f"elastica, a = {a}: {name}", r, float(value), 1e-5))
    return checks


def thin_cantilever() -> list[Check]:
    """Reissner beam with shear and the tip force F = 3EI/L²."""
    length, side, modulus = 2.0, 0.1, 2.07e11
    force = 3 * modulus * side**4 / 12 / length**2
    checks = []
    for elements, relative in ((8, 5e-5), (32, 1e-6)):
        beam = fb.Beam(
            length=length, height=side, width=side, youngs_modulus=modulus, poissons_ratio=0.3,
            density=7850.0, elements=elements,
        )  # fmt: skip
        x, y, _ = cantilever(beam, {"F": fb.Force("beam.end", y=-force)})
        name = f"thin cantilever, {elements} elements, tip displacement [m]"
        size = np.hypot(0.5094647177, 1.2088228296)
        for axis, displacement, r in (("X", x - length, -0.5094647177), ("Y", y, -1.2088228296)):
            checks.append(Check(f"{name} {axis}", r, float(displacement), relative * size))
    return checks


def thick_cantilever() -> list[Check]:
    """Results of Nachbagauer (2011) for the same elements, plain and selective."""
    nu = 0.3
    factor = 10 * (1 + nu) / (12 + 11 * nu)
    rules = {
        "plain": (fb.sections.FullIntegration(), (5.5545e-4, 7.2287e-4, 7.3386e-4, 7.3468e-4)),
        "selective": (
            fb.sections.SelectiveIntegration(shear_factor=factor),
            (6.1256e-4, 7.9674e-4, 8.0888e-4, 8.0979e-4),
        ),
    }
    checks = []
    for name, (rule, exact) in rules.items():
        for elements, reference in zip((1, 4, 16, 64), exact, strict=True):
            beam = fb.Beam(
                length=2.0, height=0.5, width=0.1, youngs_modulus=2.07e11, poissons_ratio=nu,
                density=7850.0, elements=elements, integration=rule,
            )  # fmt: skip
            _, y, _ = cantilever(beam, {"F": fb.Force("beam.end", y=-62_500.0)}, axis=True)
            checks.append(
                Check(
                    f"thick cantilever, {name}, {elements} elements, tip [m]",
                    reference, float(-y), 5e-4 * reference,
                )
            )  # fmt: skip
    return checks


def pendulum(
    name: str, beam: fb.Beam | fb.Cable, exact: dict, tolerance: float, duration: float
) -> list[Check]:
    """Return checks of the tip of a hinged beam released horizontally under gravity."""
    model = fb.Mechanism(
        bodies={"beam": beam},
        joints={"hinge": fb.Revolute("beam.start", (0.0, 0.0))},
        loads={"gravity": fb.Gravity()},
        sensors={"tip": fb.Position("beam.end")},
    )
    motion = fb.simulate(model, duration=duration, step=1e-3)
    return [
        c
        for t, r in exact.items()
        for c in differences(
            f"{name}, tip({t:g} s) [m]", motion.sel(time=t, method="nearest").values, r, tolerance
        )
    ]


def soft_pendulum() -> list[Check]:
    """Compare beam and cable elements with a published soft pendulum."""
    exact = {0.25: (0.32400, -0.37488), 0.5: (-0.42067, -0.26203), 0.75: (-0.41177, 0.06961)}
    beam = fb.Beam(
        length=0.5, height=0.002, width=0.01, density=1000.0, youngs_modulus=1e8,
        poissons_ratio=0.3, elements=32,
    )  # fmt: skip
    area = 0.002 * 0.01
    cable = fb.Cable(
        length=0.5, elements=16, mass_per_length=1000.0 * area, axial_stiffness=1e8 * area,
        bending_stiffness=1e8 * area * 0.002**2 / 12,
    )  # fmt: skip
    return [
        *pendulum("soft pendulum, beam", beam, exact, 3e-4, 0.75),
        *pendulum("soft pendulum, cable", cable, exact, 3e-4, 0.75),
    ]


def stiff_pendulum() -> list[Check]:
    """Compare with a published stiff pendulum, 0.05 m square, without rotary inertia."""
    exact = {0.5: (-0.09020, -0.99593), 1.0: (-0.99997, -0.00813)}
    area, modulus = 0.05**2, 2.1e10
    cable = fb.Cable(
        length=1.0, elements=8, mass_per_length=10.0, axial_stiffness=modulus * area,
        bending_stiffness=modulus * area * 0.05**2 / 12,
    )  # fmt: skip
    return pendulum("stiff pendulum, cable", cable, exact, 5e-4, 1.0)


CRANK, ROD, SPEED = 0.15, 0.3, 150.0
"""Lengths [m] and speed [rad/s] of Simeon's slider–crank."""

START = {
    "length": ROD, "start": (CRANK, 0.0), "velocity": (0.0, CRANK * SPEED),
    "rate": -CRANK * SPEED / ROD,
}  # fmt: skip
"""The rod's, straight and with the velocities of a rigid one."""


def simeon(rod: fb.Beam | fb.Cable, step: float) -> xr.DataArray:
    """Return the motion of the crank's end on a circle, an elastic rod, and a point mass."""
    model = fb.Mechanism(
        bodies={"rod": rod, "slider": fb.PointMass(mass=0.075552, position=(CRANK + ROD, 0.0))},
        joints={
            "crank": fb.PrescribedPath(
                "rod.start",
                lambda t: CRANK * np.cos(SPEED * t),
                lambda t: CRANK * np.sin(SPEED * t),
            ),
            "pin": fb.Revolute("rod.end", "slider"),
            "guide": fb.Slot("slider", (0.0, 0.0)),
        },
        sensors={"deflection": fb.Deflection("rod"), "slider": fb.Position("slider")},
    )
    integrator = fb.GeneralizedAlpha(spectral_radius=0.9)
    return fb.simulate(model, duration=0.1, step=step, integrator=integrator)


def flexible_slider_crank() -> list[Check]:
    """Simeon's slider–crank with an elastic rod."""
    rod = fb.Beam(
        height=0.008, width=0.008, density=7870.0, youngs_modulus=2e11, poissons_ratio=0.3,
        elements=16, **START,
    )  # fmt: skip
    motion = simeon(rod, 2e-5)
    deflection = motion.sel(output="deflection").values
    times = motion.time.values
    peak = float(np.abs(deflection).max())
    name = "flexible slider–crank, deflection of the middle"
    checks = [Check(f"{name}, largest [m]", 1.858e-3, peak, 0.02 * 1.858e-3)]
    for t, r in ((0.01, 6.98e-4), (0.05, 9.75e-4), (0.08, -1.646e-3)):
        deflection_at_t = float(deflection[np.argmin(np.abs(times - t))])
        checks.append(Check(f"{name}, t = {t:g} s [m]", r, deflection_at_t, 0.02 * abs(r)))
    return checks


def slider_crank_of_the_test_set() -> list[Check]:
    """Compare with the same mechanism in the test set for initial value problem solvers."""
    area = 0.008**2
    rod = fb.Cable(
        mass_per_length=7870.0 * area, axial_stiffness=2e11 * area,
        bending_stiffness=2e11 * area * 0.008**2 / 12, elements=8, **START,
    )  # fmt: skip
    slider = simeon(rod, 1e-5).sel(output="slider_X")[-1]
    angle = np.arctan2(-CRANK * np.sin(0.1 * SPEED), slider - CRANK * np.cos(0.1 * SPEED))
    name = "slider–crank of the IVP test set"
    return [
        Check(f"{name}, slider at 0.1 s [m]", 0.1697373328, float(slider), 1e-6),
        Check(f"{name}, angle of the rod at 0.1 s [rad]", -0.3311734988, float(angle), 1e-6),
    ]


def simulate_strained(model: fb.Mechanism, duration: float, step: float) -> xr.DataArray:
    """Return a motion of members that are strained by more than 10 %, as their problems demand."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fb.errors.StrainWarning)
        return fb.simulate(model, duration=duration, step=step)


def flying_spaghetti() -> list[Check]:
    """Simo, Vu-Quoc (1986): a free beam of EA = kGA = 1e4, ρA = 1, ρI = 10, thrown and spun."""
    exact = {
        500: {5: (4.2994, 0.6402, 11.8238, 7.2220), 10: (21.0650, 7.9515, 14.9573, 0.0313)},
        100: {5: (5.7315, 6.7442, 10.4829, 5.7530), 10: (15.6657, 1.6030, 16.1057, 7.3238)},
    }

    def load(peak: float):
        return lambda t: peak * np.interp(t, [0.0, 2.5, 5.0], [0.0, 1.0, 0.0])

    checks = []
    for stiffness, ends in exact.items():
        beam = fb.Beam(
            length=10.0, start=(6.0, 0.0), angle=np.arctan2(8.0, -6.0), elements=16,
            section=fb.sections.GeneralSection(1.0, stiffness / 1e4), density=1.0,
            youngs_modulus=1e4, poissons_ratio=0.0, shear_factor=2.0, rotary_inertia=10.0,
        )  # fmt: skip
        model = fb.Mechanism(
            bodies={"beam": beam},
            loads={
                "force": fb.Force("beam.start", x=load(8.0)),
                "moment": fb.Moment("beam.start", load(-80.0)),
            },
            sensors={"lower": fb.Position("beam.start"), "upper": fb.Position("beam.end")},
        )
        motion = simulate_strained(model, 10.0, 2e-3)
        for t, reference in ends.items():
            values = motion.sel(time=t, method="nearest").values
            for end, place in (("lower", slice(2)), ("upper", slice(2, 4))):
                name = f"flying spaghetti, EI = {stiffness}, {end} end at {t} s [m]"
                checks += differences(name, values[place], reference[place], 3e-3)
    return checks


def escalona(elements: int) -> fb.Mechanism:
    """Return the pendulum of Escalona, Hussien and Shabana (1998), released horizontally."""
    beam = fb.Beam(
        length=1.2, section=fb.sections.GeneralSection(1.8e-3, 1.215e-8), density=5540.0,
        youngs_modulus=0.7e6, poissons_ratio=0.3, shear_factor=0.85, elements=elements,
    )  # fmt: skip
    return fb.Mechanism(
        bodies={"beam": beam},
        joints={"hinge": fb.Revolute("beam.start", (0.0, 0.0))},
        loads={"gravity": fb.Gravity()},
        sensors={"tip": fb.Position("beam.end")},
    )


def escalonas_pendulum() -> list[Check]:
    """Compare with Reissner's beam of 200 quadratic elements, integrated by DOP853."""
    exact = {
        0.2: (1.179927, -0.196202),
        0.4: (0.852847, -0.785515),
        0.5: (0.395905, -1.216413),
        0.6: (-0.334759, -1.250512),
        0.8: (-0.877217, -0.821654),
    }
    motion = simulate_strained(escalona(64), 0.8, 2e-4)
    return [
        c
        for t, r in exact.items()
        for c in differences(
            f"Escalona's pendulum, tip({t:g} s) [m]",
            motion.sel(time=t, method="nearest").values,
            r,
            1e-4 if t < 0.7 else 5e-4,
        )
    ]


PROBLEMS = [
    elastica,
    thin_cantilever,
    thick_cantilever,
    soft_pendulum,
    stiff_pendulum,
    flexible_slider_crank,
    slider_crank_of_the_test_set,
    flying_spaghetti,
    escalonas_pendulum,
]
