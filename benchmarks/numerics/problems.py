"""Mechanisms whose numerics are varied, and their converged motions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import xarray as xr

import flexband as fb

STEEL = {"height": 0.012, "width": 0.01, "density": 7800.0}  # m, m, kg/m³


@dataclass(frozen=True)
class Choice:
    """The numerics of a run.

    Attributes
    ----------
    element : "Beam", "Cable", "selective" or "full" integration, a Beam "stiff in shear", or
        "rigid".
    step : [s].
    radius : spectral radius ρ∞.
    damping : retardation time [s].
    """

    element: str
    elements: int
    step: float
    radius: float = 0.7
    damping: float = 0.0


@dataclass(frozen=True)
class Problem:
    """A mechanism, the choices that are compared, and the numerics that converge.

    Attributes
    ----------
    build : function of element, number of elements and retardation time that returns the mechanism.
    outputs : those that are compared.
    times : number of equal parts of the duration at whose ends motions are compared.
    frequency : of the vibration that rings [Hz], or 0.
    fine, other : numerics of the reference, and numerics with another element that check it.
    """

    name: str
    build: Callable[[str, int, float], fb.Mechanism]
    outputs: Sequence[str]
    duration: float
    times: int
    frequency: float
    choices: Sequence[Choice]
    fine: Choice
    other: Choice


def member(
    element: str, elements: int, damping: float, *, E, nu, density, height, width, **properties
):
    """Return a flexible member of a rectangular section."""
    area = height * width
    second = width * height**3 / 12
    properties |= {"elements": elements, "retardation_time": damping}
    if element == "Cable":
        stiffness = {"axial_stiffness": E * area, "bending_stiffness": E * second}
        return fb.Cable(mass_per_length=density * area, **stiffness, **properties)
    properties |= {"density": density, "youngs_modulus": E, "poissons_ratio": nu}
    if element == "stiff in shear":
        properties |= {"shear_factor": 1e3, "rotary_inertia": 1e-3 * density * second}
    rules = {"full": fb.sections.FullIntegration(), "selective": fb.sections.SelectiveIntegration()}
    return fb.Beam(height=height, width=width, integration=rules.get(element), **properties)


def slider_crank(element: str, elements: int, damping: float) -> fb.Mechanism:
    """Return the mechanism of examples/slider_crank.py."""
    crank = 0.2
    link = 0.45
    return fb.Mechanism(
        bodies={
            "crank": fb.RigidBody.bar(length=crank, height=0.01, width=0.01, density=7800.0),
            "link": member(
                element, elements, damping, E=69e9, nu=0.34, density=2700.0, height=0.01,
                width=0.01, length=link, start=(crank, 0.0),
            ),
            "slider": fb.RigidBody.block(
                length=0.08, height=0.08, width=0.2, density=7800.0, position=(crank + link, 0.0)
            ),
        },
        joints={
            "A": fb.Revolute("crank.start", (0.0, 0.0)),
            "B": fb.Revolute("link.start", "crank.end"),
            "C": fb.Revolute("slider", "link.end"),
            "guide": fb.Prismatic("slider", (0.0, 0.0), axis=(1.0, 0.0)),
            "motor": fb.PrescribedRotation("crank", lambda t: 4 * np.pi * t),
        },
        loads={"spring": fb.Spring("slider", (2.0, 0.0), 1000.0)},
        sensors={"F": fb.Reaction("A")},
    )  # fmt: skip


def pendulum(element: str, elements: int, damping: float) -> fb.Mechanism:
    """Return the soft pendulum of the README."""
    beam = member(
        element, elements, damping, E=1e8, nu=0.3, density=1000.0, height=0.002, width=0.01,
        length=0.5,
    )  # fmt: skip
    return fb.Mechanism(
        bodies={"beam": beam},
        joints={"hinge": fb.Revolute("beam.start", (0.0, 0.0))},
        loads={"gravity": fb.Gravity()},
        sensors={"tip": fb.Position("beam.end"), "F": fb.Reaction("hinge")},
    )


def four_bar(element: str, elements: int, damping: float) -> fb.Mechanism:
    """Return the mechanism of examples/four_bar.py."""

    def angle(t):
        return np.pi / 3 + 6 * np.pi * t

    return fb.Mechanism(
        bodies={
            "crank": fb.RigidBody.bar(length=0.08, angle=angle(0.0), **STEEL),
            "coupler": member(
                element, elements, damping, E=2.8e9, nu=0.39, density=1140.0, height=0.006,
                width=0.01, length=0.30, start=(0.04, 0.07), angle=0.4,
            ),
            "rocker": fb.RigidBody.bar(length=0.2, start=(0.32, 0.0), angle=1.6, **STEEL),
        },
        joints={
            "A": fb.Revolute("crank.start", (0.0, 0.0)),
            "B": fb.Revolute("coupler.start", "crank.end"),
            "C": fb.Revolute("coupler.end", "rocker.end"),
            "D": fb.Revolute("rocker.start", (0.32, 0.0)),
            "motor": fb.PrescribedRotation("crank", angle),
        },
        sensors={"rocker": fb.Angle("rocker"), "bend": fb.Deflection("coupler")},
    )  # fmt: skip


def engine(element: str, elements: int, damping: float) -> fb.Mechanism:
    """Return a rigid slider–crank that a flywheel keeps turning at about 3000 rpm."""
    crank = 0.05
    rod = 0.15
    rate = 100 * np.pi
    return fb.Mechanism(
        bodies={
            "crank": fb.RigidBody.disc(
                radius=0.12, width=0.03, density=7800.0, rate=rate, points={"pin": (crank, 0.0)}
            ),
            "rod": fb.RigidBody.bar(length=rod, start=(crank, 0.0), **STEEL),
            "piston": fb.PointMass(mass=0.5, position=(crank + rod, 0.0)),
        },
        joints={
            "A": fb.Revolute("crank", (0.0, 0.0)),
            "B": fb.Revolute("rod.start", "crank.pin"),
            "C": fb.Revolute("piston", "rod.end"),
            "guide": fb.Slot("piston", (0.0, 0.0)),
        },
        sensors={"F": fb.Reaction("A")},
    )


def rope(element: str, elements: int, damping: float) -> fb.Mechanism:
    """Return the falling cable of examples/cable_pendulum.py."""
    cable = member(
        element, elements, damping, E=4e6, nu=0.3, density=1100.0, height=0.0104, width=0.0109,
        length=1.2,
    )  # fmt: skip
    return fb.Mechanism(
        bodies={"cable": cable},
        joints={"hinge": fb.Revolute("cable.start", (0.0, 0.0))},
        loads={"gravity": fb.Gravity()},
        sensors={
            "end": fb.Position("cable.end"),
            "F": fb.Reaction("hinge"),
            "U": fb.ElasticEnergy(),
        },
    )


def sweep(base: Choice, **series: Sequence) -> list[Choice]:
    """Return the base and choices that differ from it by one value each."""
    return [base, *(replace(base, **{name: v}) for name, values in series.items() for v in values)]


MS = 1e-3
PAPER = Choice("full", 3, MS)
CRANK = Choice("Beam", 4, MS / 8, damping=1e-4)
SWING = Choice("Beam", 16, MS, damping=1e-3)
COUPLER = Choice("Beam", 4, MS / 4, damping=5e-4)
ROPE = Choice("Cable", 24, MS / 2)
PROBLEMS = [
    Problem(
        "slider–crank", slider_crank, ("F_X", "F_Y"), 0.6, 2400, 184.4,
        [
            PAPER,
            *sweep(Choice("Beam", 4, MS), step=[MS / k for k in (2, 4, 8, 16, 32)]),
            *sweep(Choice("Beam", 4, MS / 16), radius=(0.0, 0.9, 1.0))[1:],
            *(Choice("Beam", 4, MS / k, damping=1e-5) for k in (4, 8, 16)),
            *sweep(CRANK, elements=(1, 2, 8), element=("Cable", "selective", "full")),
        ],
        Choice("Beam", 8, MS / 32), Choice("Cable", 16, MS / 32),
    ),
    Problem(
        "pendulum", pendulum, ("tip_X", "F_Y"), 0.6, 600, 1.8,
        [
            *sweep(SWING, elements=(2, 4, 8, 32), step=(4 * MS, 2 * MS, MS / 2)),
            replace(SWING, element="Cable"),
            *(Choice(name, n, MS, damping=1e-3)
              for name in ("selective", "full") for n in (8, 32, 128)),
        ],
        Choice("Beam", 64, MS / 4, damping=1e-3), Choice("Cable", 64, MS / 4, damping=1e-3),
    ),
    Problem(
        "four-bar", four_bar, ("bend",), 0.35, 350, 47.4,
        [
            *sweep(COUPLER, step=[MS / k for k in (1, 2, 8)], elements=(1, 2, 8)),
            *sweep(COUPLER, radius=(0.0, 1.0), element=("selective", "full"))[1:],
        ],
        Choice("Beam", 16, MS / 16, damping=5e-4), Choice("selective", 64, MS / 16, damping=5e-4),
    ),
    Problem(
        "engine", engine, ("F_X", "F_Y"), 0.04, 2560, 50.0,
        [Choice("rigid", 0, MS / k, radius) for radius in (0.7, 1.0) for k in (1, 2, 4, 8)],
        Choice("rigid", 0, MS / 64), Choice("rigid", 0, MS / 64, 1.0),
    ),
    Problem(
        "cable", rope, ("end_X", "F_Y", "U"), 0.9, 900, 0.0,
        [
            *sweep(ROPE, elements=(6, 12, 48), step=(2 * MS, MS, MS / 4), radius=(0.0, 1.0)),
            replace(ROPE, element="Beam"),
        ],
        Choice("Cable", 64, MS / 4), Choice("stiff in shear", 64, MS / 4),
    ),
]  # fmt: skip


def motion(problem: Problem, choice: Choice) -> xr.DataArray:
    """Return the outputs that are compared, at the times of the comparison or at its own."""
    substeps = max(1, round(problem.duration / problem.times / choice.step))
    return fb.simulate(
        problem.build(choice.element, choice.elements, choice.damping),
        duration=problem.duration,
        step=choice.step * substeps,
        substeps=substeps,
        integrator=fb.GeneralizedAlpha(spectral_radius=choice.radius),
    ).sel(output=list(problem.outputs))


class Reference(NamedTuple):
    """A converged motion, and how far other converged numerics are off [parts of the variation]."""

    motion: xr.DataArray
    half_step_error: np.ndarray
    undamped_error: np.ndarray
    other: np.ndarray


def reference(problem: Problem, damping: float) -> Reference:
    """Return the motion extrapolated from the finest step and half of it, and its checks."""
    fine, other = (replace(choice, damping=damping) for choice in (problem.fine, problem.other))
    halves = [motion(problem, replace(fine, step=fine.step / k)) for k in (1, 2, 4)]
    extrapolations = [(4 * b - a) / 3 for a, b in pairwise(halves)]
    truth = extrapolations[1]
    return Reference(
        truth,
        relative_difference(extrapolations[0], truth),
        relative_difference(motion(problem, replace(fine, radius=1.0)), halves[0]),
        relative_difference(motion(problem, other), halves[0]),
    )


def relative_difference(motion: xr.DataArray, truth: xr.DataArray) -> np.ndarray:
    """Return the root mean square difference of each output, in parts of its own variation."""
    truth = truth.sel(time=motion.time, method="nearest")
    difference = motion.values - truth.values
    return np.sqrt((difference**2).mean(axis=-1)) / truth.values.std(axis=-1)


def peak_error(motion: xr.DataArray, truth: xr.DataArray) -> np.ndarray:
    """Return how far the largest size of each output is off, in parts of it."""
    peak, true = (np.abs(series.values).max(axis=-1) for series in (motion, truth))
    return peak / true - 1
