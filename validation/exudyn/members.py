"""Cables and beams."""

from __future__ import annotations

import numpy as np
from pendulums import GRAVITY
from rebuilt import at_end, register_script

import flexband as fb

STEEL = {"length": 2.0, "youngs_modulus": 2.07e11}


def cable(length, height, width, youngs_modulus, density, elements, softer=1.0, **start):
    """Return a cable with a rectangular section; its axial stiffness may be softer than EA."""
    area = height * width
    return fb.Cable(
        length=length,
        elements=elements,
        mass_per_length=density * area,
        axial_stiffness=youngs_modulus * area / softer,
        bending_stiffness=youngs_modulus * area * height**2 / 12,
        **start,
    )


def solve_clamped(member, loads, output, *, steps=10, point="end"):
    """Return an output at the end of a clamped member at rest under loads."""
    model = fb.Mechanism(
        bodies={"beam": member},
        joints={"clamp": fb.Weld("beam.start", (0.0, 0.0), angle=member.angle)},
        loads=loads,
        sensors={"r": fb.Position(f"beam.{point}")},
    )
    return fb.equilibrium(model, steps=steps).sel(output=output).values


@register_script(
    "TestModels/MiniExamples/ObjectANCFCable2D.py",
    "travel of the end along x at rest [m]",
    exudyn=-0.501305847,
    tolerance=2e-6,
    value=2500.0 / 3,
)
def heavy_cable(bending_stiffness):
    member = fb.Cable(
        length=2.0,
        mass_per_length=78.0,
        axial_stiffness=1e6,
        bending_stiffness=bending_stiffness,
        elements=16,
    )
    return solve_clamped(member, GRAVITY, "r_X") - 2.0


@register_script(
    "Examples/ANCFcantileverTest.py",
    "travel of the end along y at rest [m]",
    exudyn=-1.20723985,
    tolerance=5e-6,
    value=3 * 2.07e11 * 1e-4 / 12 / 4,
)
def loaded_cantilever(force):
    member = cable(**STEEL, height=0.1, width=0.1, density=7800.0, elements=16)
    return solve_clamped(member, {"F": fb.Force("beam.end", y=-force)}, "r_Y")


@register_script(
    "Examples/ANCFtestHalfcircle.py",
    "y of the middle at rest [m]",
    exudyn=0.63662017,
    tolerance=1e-6,
    value=2.07e11 * 1e-8 / 12 * np.pi,
)
def cable_bent_to_a_circle(moment):
    member = cable(**STEEL, height=0.01, width=0.01, density=7800.0, elements=32)
    return solve_clamped(member, {"M": fb.Moment("beam.end", moment)}, "r_Y", point="node 16")


@register_script(
    "TestModels/geometricallyExactBeam2Dtest.py",
    "travel of the end along y at rest [m]",
    exudyn=-2.20944107,
    tolerance=1e-4,
    value=6.25e7,
)
def thick_cantilever(force):
    beam = fb.Beam(
        length=2.0,
        height=0.5,
        width=0.1,
        density=7850.0,
        youngs_modulus=2.07e11,
        poissons_ratio=0.3,
        elements=16,
        angle=np.pi / 4,
    )
    loads = {
        "F": fb.Force("beam.end", force * 0.5**0.5, -force * 0.5**0.5),
        "M": fb.Moment("beam.end", -5e8),
    }
    return solve_clamped(beam, loads, "r_Y", steps=20) - 2.0 * 0.5**0.5


@register_script(
    "TestModels/LShapeGeomExactBeam2D.py",
    "travel of the end along y at rest [m]",
    exudyn=-0.91405596,
    tolerance=2e-5,
    value=1e6,
)
def angle_of_beams(force):
    section = {
        "height": 0.05,
        "width": 0.1,
        "density": 7800.0,
        "youngs_modulus": 2.1e11,
        "poissons_ratio": 0.3,
        "length": 1.0,
        "elements": 8,
    }
    model = fb.Mechanism(
        bodies={
            "foot": fb.Beam(**section),
            "post": fb.Beam(**section, start=(1.0, 0.0), angle=np.pi / 2),
        },
        joints={
            "clamp": fb.Weld("foot.start", (0.0, 0.0)),
            "corner": fb.Weld("post.start", "foot.end", angle=np.pi / 2),
        },
        loads={"F": fb.Force("post.end", x=force)},
        sensors={"r": fb.Position("post.end")},
    )
    return fb.equilibrium(model, steps=10).sel(output="r_Y").values - 1.0


@register_script(
    "Examples/flexiblePendulumANCF.py",
    "x of the end after 0.5 s [m]",
    exudyn=-0.0902007,
    tolerance=1e-5,
    value=9.81,
)
def stiff_cable_pendulum(gravity):
    member = cable(1.0, 0.05, 0.05, 2.1e10, 4000.0, elements=8)
    model = fb.Mechanism(
        bodies={"cable": member},
        joints={"pin": fb.Revolute("cable.start", (0.0, 0.0))},
        loads={"gravity": fb.Gravity(y=-gravity)},
        sensors={"r": fb.Position("cable.end")},
    )
    return at_end(model, 0.5, 2e-4)[..., 0]


@register_script(
    "TestModels/ANCFCableBeamDampingTest.py",
    "y of the end after 0.1 s [m]",
    exudyn=-0.0955618,
    tolerance=2e-4,
    value=5.0,
)
def suddenly_loaded_cantilever(force):
    member = fb.Cable(
        length=0.5,
        mass_per_length=2.0,
        axial_stiffness=1e8 * np.pi * 0.01**2,
        bending_stiffness=1e8 * np.pi * 0.01**4 / 4,
        elements=16,
    )
    model = fb.Mechanism(
        bodies={"cable": member},
        joints={"clamp": fb.Weld("cable.start", (0.0, 0.0), axis=True)},
        loads={"F": fb.Force("cable.end", y=-force)},
        sensors={"r": fb.Position("cable.end")},
    )
    return at_end(model, 0.1, 1e-4)[..., 1]


@register_script(
    "TestModels/ANCFoutputTest.py",
    "x of the end after 0.5 s [m]",
    exudyn=-0.03583189,
    tolerance=1e-6,
    value=2.5,
)
def cable_on_a_pin_below_its_axis(bending_stiffness):
    """Pin the cable beside its axis by a body without mass."""
    member = fb.Cable(
        length=1.0,
        mass_per_length=10.0,
        axial_stiffness=1e5,
        bending_stiffness=bending_stiffness,
        elements=32,
        start=(0.0, 0.05),
        bending_retardation_time=0.1,
    )
    foot = fb.RigidBody(mass=0.0, inertia=0.0, points={"pin": (0.0, -0.05)}, position=(0.0, 0.05))
    model = fb.Mechanism(
        bodies={"cable": member, "foot": foot},
        joints={
            "weld": fb.Weld("cable.start", "foot"),
            "pin": fb.Revolute("foot.pin", (0.0, 0.0)),
        },
        loads=GRAVITY,
        sensors={"r": fb.Position("cable.end")},
    )
    return at_end(model, 0.5, 1e-4)[..., 0]


@register_script(
    "Examples/pendulumGeomExactBeam2D.py",
    "x of the end after 0.4 s [m]",
    exudyn=-0.22334937,
    tolerance=1.5e-4,
    value=9.81,
)
def soft_beam_pendulum(gravity):
    beam = fb.Beam(
        length=0.5,
        height=0.002,
        width=0.01,
        density=1000.0,
        youngs_modulus=1e8,
        poissons_ratio=0.3,
        elements=16,
    )
    model = fb.Mechanism(
        bodies={"beam": beam},
        joints={"pin": fb.Revolute("beam.start", (0.0, 0.0))},
        loads={"gravity": fb.Gravity(y=-gravity)},
        sensors={"r": fb.Position("beam.end")},
    )
    return at_end(model, 0.4, 2e-4)[..., 0]


@register_script(
    "Examples/ANCFcantileverTestDyn.py",
    "y of the end 0.1 s after the jolt [m]",
    exudyn=-0.90185,
    tolerance=1e-3,
    value=0.1,
)
def jolted_cantilever(amplitude):
    """Move the clamp with a jolt; a beam that starts with its drive would move with it."""
    member, motion = cable(**STEEL, height=0.1, width=0.1, density=7800.0, elements=16), "assembled"
    for duration, size in ((0.01, 0.0 * amplitude), (0.1, amplitude)):
        drive = fb.PrescribedPath(
            "clamp", lambda t: 0.0 * t, lambda t, a=size: a * np.sin(2 * np.pi * 20 * (t - 0.01))
        )
        model = fb.Mechanism(
            bodies={"clamp": fb.RigidBody(mass=1.0, inertia=1.0), "beam": member},
            joints={
                "drive": drive,
                "hold": fb.PrescribedRotation("clamp", lambda t: 0.0 * t),
                "weld": fb.Weld("beam.start", "clamp"),
            },
            sensors={"r": fb.Position("beam.end")},
        )
        motion = fb.simulate(model, duration=duration, step=2e-5, start=motion, keep_state=True)
    return motion.sel(output="r_Y").values[..., -1]


@register_script(
    "Examples/ANCFtests2.py",
    "x of the end after 1 s [m]",
    exudyn=0.01988596,
    tolerance=1e-5,
    value=np.pi,
)
def cable_bent_in_a_second(turn):
    member = cable(**STEEL, height=0.1, width=0.1, density=78000.0, elements=8)
    stiffness = 2.07e11 * 1e-4 / 12
    model = fb.Mechanism(
        bodies={"beam": member},
        joints={"clamp": fb.Weld("beam.start", (0.0, 0.0))},
        loads={"M": fb.Moment("beam.end", lambda t: turn * stiffness * t)},
        sensors={"r": fb.Position("beam.end")},
    )
    return at_end(model, 1.0, 1e-4)[..., 0]


@register_script(
    "Examples/ANCFrotatingCable2D.py",
    "y of the end after 2.5 s [m]",
    exudyn=-0.34748052,
    tolerance=1e-4,
    value=np.pi,
)
def swung_cable(amplitude):
    member = cable(2.0, 0.01, 0.01, 2e11, 7800.0, elements=16, bending_retardation_time=0.02)
    model = fb.Mechanism(
        bodies={"hub": fb.RigidBody(mass=1e-3, inertia=1e-6), "cable": member},
        joints={
            "pin": fb.Revolute("hub", (0.0, 0.0)),
            "clamp": fb.Weld("cable.start", "hub"),
            "drive": fb.PrescribedRotation(
                "hub", lambda t: (t > 2) * amplitude * np.sin(np.pi * t)
            ),
        },
        loads=GRAVITY,
        sensors={"r": fb.Position("cable.end")},
    )
    return at_end(model, 2.5, 1e-4)[..., 1]


@register_script(
    "Examples/finiteSegmentMethod.py",
    "y of the end after 0.5 s [m]",
    exudyn=-1.39837446,
    tolerance=2e-5,
    value=1.0,
)
def cable_of_rigid_segments(bending_stiffness):
    count, length = 64, 2.0 / 64
    points = {"a": (-length / 2, 0.0), "b": (length / 2, 0.0)}
    bodies = {
        f"{k}": fb.RigidBody(
            mass=length, inertia=0.0, points=points, position=((k + 0.5) * length, 0.0)
        )
        for k in range(count)
    }
    joints = {"0": fb.Revolute("0.a", (0.0, 0.0))}
    joints |= {f"{k}": fb.Revolute(f"{k}.a", f"{k - 1}.b") for k in range(1, count)}
    springs = {
        f"{k}": fb.TorsionSpring(f"{k}", f"{k - 1}", bending_stiffness / length)
        for k in range(1, count)
    }
    sensors = {"r": fb.Position(f"{count - 1}.b")}
    model = fb.Mechanism(bodies=bodies, joints=joints, loads=GRAVITY | springs, sensors=sensors)
    return at_end(model, 0.5, 1e-3)[..., 1]


def free_cable(height):
    return fb.Mechanism(
        bodies={
            "cable": cable(
                **STEEL, height=height, width=0.01, density=7800.0, elements=16, softer=10.0
            )
        }
    )


@register_script(
    "TestModels/computeODE2EigenvaluesTest.py",
    "lowest circular frequency, free [1/s]",
    exudyn=83.17966446,
    tolerance=1e-3,
    value=0.01,
)
def free_cable_modes(height):
    return 2 * np.pi * fb.modes(free_cable(height), 4)["frequency"].values[..., 3]
