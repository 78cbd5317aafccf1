"""Mechanisms that several tests use, and dense views of what the engine computes on lanes."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm
from scipy.optimize import root_scalar

import flexband as fb
from flexband.mechanics.assembly.packing import pack
from flexband.mechanics.assembly.structure import WorkSpace
from flexband.mechanics.assembly.system import assemble
from flexband.mechanics.engine.batch import begin, run
from flexband.mechanics.engine.entries import MARCH
from flexband.mechanics.kernels.equations import residual, tangent
from flexband.mechanics.kernels.factorization import factorize, solve, to_dense
from flexband.mechanics.kernels.lane_arrays import WIDTH
from flexband.mechanics.kernels.lanes import cached, splat
from flexband.mechanics.kernels.records import Record
from flexband.mechanics.kernels.springs import RELAXED

ROD = {"length": 1.0, "height": 0.05, "width": 0.02, "density": 1000.0}  # 1 kg
SQUARE_ROD = {"height": 0.02, "width": 0.02, "density": 2000.0}  # 0.8 kg/m
FINE = fb.GeneralizedAlpha(spectral_radius=0.8, tolerance=1e-12)
STEEL = {"density": 7800.0, "youngs_modulus": 2.1e11, "poissons_ratio": 0.3}
THIN = {"mass_per_length": 0.2, "axial_stiffness": 4e6, "bending_stiffness": 3.0}


def slider_crank(
    crank_length=0.2,
    spring_stiffness=1000.0,
    youngs_modulus=69e9,
    poissons_ratio=0.34,
    elements=3,
    integration=None,
    angle=lambda t: 4 * np.pi * t,
    rest_length=None,
):
    """The slider-crank of the paper's section 5.3."""
    crank = fb.RigidBody.bar(length=crank_length, height=0.01, width=0.01, density=7800.0)
    link = fb.Beam(
        length=0.45,
        height=0.01,
        width=0.01,
        density=2700.0,
        youngs_modulus=youngs_modulus,
        poissons_ratio=poissons_ratio,
        elements=elements,
        integration=integration or fb.sections.FullIntegration(),
        start=(crank_length, 0.0),
    )
    return _with_slider(crank, link, crank_length, spring_stiffness, angle, rest_length=rest_length)


def rigid_slider_crank(crank_length=0.2, link_length=0.45, angle=lambda t: 4 * np.pi * t):
    """The same with a rigid link."""
    crank = fb.RigidBody.bar(length=crank_length, height=0.01, width=0.01, density=7800.0)
    link = fb.RigidBody.bar(
        length=link_length, height=0.01, width=0.01, density=2700.0, start=(crank_length, 0.0)
    )
    return _with_slider(crank, link, crank_length, 1000.0, angle, link_length)


def _with_slider(crank, link, crank_length, stiffness, angle, link_length=0.45, rest_length=None):
    slider = fb.RigidBody.block(
        length=0.08,
        height=0.08,
        width=0.2,
        density=7800.0,
        position=(crank_length + link_length, 0.0),
    )
    return fb.Mechanism(
        bodies={"crank": crank, "link": link, "slider": slider},
        joints={
            "A": fb.Revolute("crank.start", (0.0, 0.0)),
            "B": fb.Revolute("link.start", "crank.end"),
            "C": fb.Revolute("slider", "link.end"),
            "guide": fb.Prismatic("slider", (0.0, 0.0)),
            "motor": fb.PrescribedRotation("crank", angle),
        },
        loads={"spring": fb.Spring("slider", (2.0, 0.0), stiffness, rest_length)},
        sensors={
            "F": fb.Reaction("A"),
            "slider": fb.Position("slider"),
            "pin": fb.Position("crank.end"),
        },
    )


def pendulum(angle=0.0):
    """A uniform bar of 1 m under gravity, hinged at the origin."""
    bar = fb.RigidBody.bar(length=1.0, height=0.02, width=0.03, density=1500.0, angle=angle)
    return fb.Mechanism(
        bodies={"bar": bar},
        joints={"hinge": fb.Revolute("bar.start", (0.0, 0.0))},
        loads={"gravity": fb.Gravity()},
        sensors={"tip": fb.Position("bar.end"), "F": fb.Reaction("hinge")},
    )


def between_rods(slope):
    """A mass of 2 kg between two rods that rise towards it at this slope, under gravity."""
    x = np.cos(slope)
    y = np.sin(slope)
    return fb.Mechanism(
        bodies={"m": fb.PointMass(mass=2.0, position=(0.0, 0.0))},
        joints={
            "left": fb.Distance("m", (-x, -y), 1.0),
            "right": fb.Distance("m", (1.5 * x, -1.5 * y), 1.5),
        },
        loads={"gravity": fb.Gravity()},
        sensors={"R": fb.Reaction("left"), "m": fb.Position("m")},
    )


def beam(elements=3, integration=None, **changes):
    """A free beam and nothing else."""
    values = {
        "length": 1.3,
        "height": 0.2,
        "width": 0.1,
        "density": 2700.0,
        "youngs_modulus": 70e9,
        "poissons_ratio": 0.3,
        "elements": elements,
        "integration": integration or fb.sections.FullIntegration(),
    }
    return fb.Beam(**(values | changes))


def motion_of(duration=0.5, step=5e-4, **parts):
    """The motion of a mechanism of these parts, integrated with `FINE`."""
    return fb.simulate(fb.Mechanism(**parts), duration=duration, step=step, integrator=FINE)


def wheel(mass=1.0, inertia=0.5, **start):
    """A body with its centre in its axis and a point on its rim."""
    return fb.RigidBody(mass=mass, inertia=inertia, points={"rim": (0.1, 0.0)}, **start)


def gears(radii, inertias, **joints):
    """Bodies and joints of two gears on fixed axes."""
    r1, r2 = radii
    first = wheel(inertia=inertias[0], angle=0.3)
    second = wheel(inertia=inertias[1], position=(r1 + r2, 0.0), angle=-0.5)
    return {"1": first, "2": second}, {
        "A": fb.Revolute("1", (0.0, 0.0)),
        "B": fb.Revolute("2", (r1 + r2, 0.0)),
        "mesh": fb.Gear("1", "2", r1, r2),
        **joints,
    }


def spring_and_moment(t, x, v, p, force):
    """A spring between two points, and a moment on the second by its angle."""
    for axis in range(2):
        pull = p[0] * (x[0, axis] - x[1, axis])
        force[0, axis] = -pull
        force[1, axis] = pull
    force[1, 2] = -p[1] * x[1, 2]


def block(**changes):
    """A cube of 1 kg."""
    return fb.RigidBody.block(
        **({"length": 0.1, "height": 0.1, "width": 0.1, "density": 1000.0} | changes)
    )


def two_blocks(joints=None, **parts):
    """A mechanism of two cubes "a" and "b" with these joints, loads or sensors."""
    return fb.Mechanism(bodies={"a": block(), "b": block()}, joints=joints or {}, **parts)


def pendulum_driven(angle, **parts):
    """A cube whose angle is prescribed, pinned at its centre."""
    return fb.Mechanism(
        bodies={"a": block()},
        joints={"pin": fb.Revolute("a", (0, 0)), "motor": fb.PrescribedRotation("a", angle)},
        **({"sensors": {"angle": fb.Angle("a")}} | parts),
    )


def parallelogram(cranks, lean=0.3):
    """Cranks of 1 m at x = 0, 1, …, all pinned to one coupler; a third one is redundant."""
    direction = np.pi / 2 - lean
    x = np.cos(direction)
    y = np.sin(direction)
    bodies = {
        f"crank{k}": fb.RigidBody.bar(length=1.0, start=(k, 0.0), angle=direction, **SQUARE_ROD)
        for k in range(cranks)
    }
    joints = {f"ground{k}": fb.Revolute(f"crank{k}.start", (k, 0.0)) for k in range(cranks)}
    bodies["coupler"] = fb.RigidBody(
        mass=0.8, inertia=0.1, position=(x, y), points={f"{k}": (k, 0.0) for k in range(cranks)}
    )
    for k in range(cranks):
        joints[f"top{k}"] = fb.Revolute(f"crank{k}.end", f"coupler.{k}")
    return fb.Mechanism(
        bodies=bodies,
        joints=joints,
        loads={"gravity": fb.Gravity()},
        sensors={
            "coupler": fb.Position("coupler"),
            **{f"F{k}": fb.Reaction(f"ground{k}") for k in range(cranks)},
        },
    )


def clamped_member(member, loads):
    """A member "m" clamped at its start, with sensors of its end."""
    return fb.Mechanism(
        bodies={"m": member},
        joints={"clamp": fb.Weld("m.start", (0.0, 0.0))},
        loads=loads,
        sensors={"tip": fb.Position("m.end"), "angle": fb.Angle("m.end")},
    )


def tip_compliance(member, direction=(0.0, 1.0), force=1.0):
    """Displacement of the tip along a small force there, over the force."""
    load = {"P": fb.Force("m.end", *(force * d for d in direction))}
    rest, loaded_tip = (
        fb.equilibrium(clamped_member(member, loads))[..., :2] for loads in ({}, load)
    )
    return (loaded_tip - rest).values @ np.array(direction) / force


@dataclass
class Dense:
    """Residual and tangent of one sample as NumPy arrays, unknowns [q, λ]."""

    mechanism: fb.Mechanism

    def __post_init__(self):
        self.system = assemble(self.mechanism)
        self.structure = self.system.structure
        self.values = pack(self.system, np.array([0.0, 1e-3]))(0)
        rest = self.values.springs.rest
        rest[rest == RELAXED] = 0.7
        self.work = WorkSpace.from_structure(self.structure)
        self.records = Record(self.structure), Record(self.values), Record(self.work)
        self.start = self.values.start[1:, 0].copy()

    def _fill(self, unknowns, acceleration=None):
        z = self.work.z
        z[:] = 0.0
        z[0] = 1.0
        z[1 : 1 + len(unknowns)] = np.asarray(unknowns)[:, None]
        if acceleration is not None:
            row = self.structure.state.acceleration
            z[row + 1 : row + 1 + len(acceleration)] = np.asarray(acceleration)[:, None]

    def residual(self, unknowns, acceleration=None):
        self._fill(unknowns, acceleration)
        residual_of(*self.records)
        return self.work.r[1 : 1 + self.structure.pattern.unknowns, 3].copy()

    def tangent(self, unknowns, weight=1.0):
        """Return the dense matrix, read back through the sparse slots."""
        self.residual(unknowns)  # which updates the angles, moments and springs in z
        self._tangent(weight)
        return to_dense(self.structure.pattern, self.work.matrix)[3]

    def _tangent(self, weight):
        tangent_of(*self.records, float(weight))

    def solved(self, unknowns, right):
        """Return the solution of the tangent system by the sparse factorization."""
        self.residual(unknowns)
        self._tangent(1.0)
        factorize_of(self.records[0], self.records[2])
        self.work.r[1 : 1 + len(right)] = np.asarray(right)[:, None]
        solve_of(self.records[0], self.records[2])
        return self.work.r[1 : 1 + len(right), 5].copy()

    def mass(self):
        """Return the mass matrix."""
        n = self.structure.state.coordinates
        zero = np.zeros(self.structure.pattern.unknowns)
        rest = self.residual(zero, np.zeros(n))[:n]
        return np.stack([self.residual(zero, e)[:n] - rest for e in np.eye(n)], axis=1)


@cached
def residual_of(structure, values, work):
    residual(structure, values, 0, work.z, work.r, work.blocks)


@cached
def tangent_of(structure, values, work, weight):
    tangent(structure, values, 0, work.z, splat(weight), 0.0, work.matrix, work.blocks)


@cached
def factorize_of(structure, work):
    factorize(structure.pattern, work.matrix, splat(1e-12), work.s)


@cached
def solve_of(structure, work):
    solve(structure.pattern, structure.pattern.below, work.matrix, (work.r,))


def states(mechanism, steps, step, integrator=None):
    """Return q, v and λ at the end, each of shape (rows,)."""
    integrator = integrator or fb.GeneralizedAlpha()
    system = assemble(mechanism)
    times = np.arange(max(steps, 1) + 1) * step
    structure = system.structure
    outputs = np.zeros((steps + 1, system.sensor_row_count, WIDTH))
    values = pack(system, times)(0)
    work, failure = begin(system, values)
    run(
        MARCH, system, values, work, outputs, failure,
        integrator.coefficients(step), integrator.tolerance,
    )  # fmt: skip
    assert not failure[0].any()
    n = structure.state.coordinates
    v = structure.state.velocity
    z = work.z[:, 0]
    return z[1 : n + 1], z[v + 1 : v + n + 1], z[n + 1 : structure.pattern.unknowns + 1]


def hardening_spring(speed):
    """A mass on a line that a spring stops so hard that fast ones diverge with steps of 0.02 s."""
    return fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0, position=(1.0, 0.0), velocity=(speed, 0.0))},
        joints={"line": fb.Slot("m", (0.0, 0.0))},
        loads={"s": fb.Spring("m", (-1.0, 0.0), 10.0, 2.0, cubic=1e7)},
        sensors={"m": fb.Position("m")},
    )


def timoshenko(omega, length, EI, kGA, mass, rotary):
    """Transfer matrix of w, φ, M/EI and S/EI along Timoshenko's beam at an angular frequency.

    `mass` and `rotary` are the mass [kg/m] and the rotary inertia [kg m] per length.
    """
    A = np.zeros((4, 4))
    A[0, 1] = 1
    A[0, 3] = EI / kGA
    A[1, 2] = 1
    A[2, 3] = -1
    A[2, 1] = -rotary * omega**2 / EI
    A[3, 0] = -mass * omega**2 / EI
    return expm(A * length)


def roots(function, frequencies):
    """The frequencies [Hz] between the given ones at which a function of ω vanishes."""
    omega = 2 * np.pi * frequencies
    signs = np.sign([function(rate) for rate in omega])
    changes = np.flatnonzero(signs[:-1] != signs[1:])
    return [root_scalar(function, bracket=omega[k : k + 2]).root / (2 * np.pi) for k in changes]
