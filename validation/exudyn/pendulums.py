"""Points and rigid bodies in chains."""

from __future__ import annotations

import numpy as np
from rebuilt import at_end, register_script

import flexband as fb

GRAVITY = {"gravity": fb.Gravity()}


def position(model, duration, step, output):
    motion = fb.simulate(model, duration=duration, step=step)
    return motion.sel(output=output).values[..., -1]


@register_script(
    "TestModels/MiniExamples/ObjectMassPoint2D.py",
    "x after 1 s [m]",
    exudyn=2.0,
    tolerance=1e-10,
    value=0.5,
)
def free_point(speed):
    model = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0, position=(1.5, 1.0), velocity=(speed, 0.0))},
        sensors={"x": fb.Position("m")},
    )
    return position(model, 1.0, 0.1, "x_X")


@register_script(
    "Examples/myFirstExample.py", "x after 1 s [m]", exudyn=5e-5, tolerance=1e-12, value=0.001
)
def pushed_point(force):
    model = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=10.0)},
        loads={"F": fb.Force("m", force)},
        sensors={"x": fb.Position("m")},
    )
    return position(model, 1.0, 0.01, "x_X")


@register_script(
    "TestModels/MiniExamples/ObjectRigidBody2D.py",
    "x and the rotation after 1 s, added",
    exudyn=4.35619449,
    tolerance=5e-8,
    value=0.75 * np.pi,
)
def free_body(rate):
    body = fb.RigidBody(
        mass=1.0, inertia=2.0, position=(1.5, 1.0), angle=np.pi / 4, velocity=(0.5, 0.0), rate=rate
    )
    sensors = {"x": fb.Position("b"), "turn": fb.Angle("b")}
    motion = fb.simulate(fb.Mechanism(bodies={"b": body}, sensors=sensors), duration=1.0, step=1e-4)
    x, turn = (motion.sel(output=name).values[..., -1] for name in ("x_X", "turn"))
    return x + turn - np.pi / 4


def point_pendulum(length, mass, start):
    return fb.Mechanism(
        bodies={"m": fb.PointMass(mass=mass, position=start)},
        joints={"rod": fb.Distance("m", (0.0, 0.0), length)},
        loads=GRAVITY,
        sensors={"r": fb.Position("m")},
    )


@register_script(
    "TestModels/MiniExamples/ObjectConnectorDistance.py",
    "x after 1 s [m]",
    exudyn=-0.98629175,
    tolerance=1e-7,
    value=1.0,
)
def pendulum_from_the_side(length):
    return position(point_pendulum(length, 50.0, (length, 0.0)), 1.0, 1e-4, "r_X")


@register_script(
    "Examples/pendulum2Dconstraint.py",
    "y after 2 s [m]",
    exudyn=-0.06803906,
    tolerance=1e-6,
    value=0.8,
)
def short_pendulum(length):
    return position(point_pendulum(length, 2.5, (length, 0.0)), 2.0, 1e-4, "r_Y")


@register_script(
    "Examples/pendulumIftommBenchmark.py",
    "x after 2 s [m]",
    exudyn=-0.7935662,
    tolerance=1e-6,
    value=1.0,
)
def pendulum_from_the_left(length):
    return position(point_pendulum(length, 1.0, (-length, 0.0)), 2.0, 1e-4, "r_X")


def bar(length, mass, inertia=None, **start):
    """Return a bar between the points a and b; its inertia is that of a thin one if not given."""
    return fb.RigidBody(
        mass=mass,
        inertia=mass * length**2 / 12 if inertia is None else inertia,
        points={"a": (-length / 2, 0.0), "b": (length / 2, 0.0)},
        **start,
    )


def crank_pins(frame=(0.0, 0.0), slider="slider"):
    """Return the pins of a slider–crank whose bars are a crank and a rod."""
    pins = {"A": ("crank.a", frame), "B": ("rod.a", "crank.b"), "C": (slider, "rod.b")}
    return {name: fb.Revolute(*points) for name, points in pins.items()}


def chain(links, length):
    """Return unit bodies, of unit inertia, that hang side by side from (−½, 0)."""
    bodies = {
        f"{k}": bar(length, 1.0, 1.0, position=((k + 0.5) * length - 0.5, 0.0))
        for k in range(links)
    }
    joints = {"0": fb.Revolute("0.a", (-0.5, 0.0))}
    joints |= {f"{k}": fb.Revolute(f"{k}.a", f"{k - 1}.b") for k in range(1, links)}
    return bodies, joints


def hanging_chain(links, length, duration):
    """Return the angle of the lowest body of a chain at the end [rad]."""
    bodies, joints = chain(links, length)
    sensors = {"angle": fb.Angle(f"{links - 1}")}
    model = fb.Mechanism(bodies=bodies, joints=joints, loads=GRAVITY, sensors=sensors)
    return at_end(model, duration, 1e-4)


@register_script(
    "Examples/doublePendulum2D.py",
    "angle of the lower body after 2 s [rad]",
    exudyn=-4.86837483,
    tolerance=2e-6,
    value=1.0,
)
def double_pendulum(length):
    return hanging_chain(2, length, 2.0)


@register_script(
    "Examples/simple4linkPendulumBing.py",
    "angle of the lowest body after 1 s [rad]",
    exudyn=-0.66473225,
    tolerance=1e-6,
    value=1.0,
)
def pendulum_of_four(length):
    return hanging_chain(4, length, 1.0)


@register_script(
    "Examples/rigidPendulum.py",
    "angle after 1 s [rad]",
    exudyn=-3.15004032,
    tolerance=1e-6,
    value=2.0,
)
def rigid_pendulum(rate):
    """Start with the rate that the pin leaves: the script's body turns about its centre."""
    rate = rate / 4
    model = fb.Mechanism(
        bodies={"b": bar(1.0, 12.0, position=(-0.5, 1.0), rate=rate, velocity=(0.0, rate / 2))},
        joints={"pin": fb.Revolute("b.a", (-1.0, 1.0))},
        loads=GRAVITY,
        sensors={"angle": fb.Angle("b")},
    )
    return at_end(model, 1.0, 1e-4)


@register_script(
    "TestModels/compareFullModifiedNewton.py",
    "angle after 2 s [rad]",
    exudyn=-3.10390193,
    tolerance=1e-6,
    value=12 * 9.81,
)
def pendulum_under_a_tip_force(weight):
    model = fb.Mechanism(
        bodies={"b": bar(1.0, 12.0, position=(0.5, 0.0))},
        joints={"pin": fb.Revolute("b.a", (0.0, 0.0))},
        loads={"weight": fb.Force("b.b", y=-weight)},
        sensors={"angle": fb.Angle("b")},
    )
    return at_end(model, 2.0, 1e-4)


@register_script(
    "TestModels/coordinateVectorConstraint.py",
    "x + y of the upper point after 1 s [m]",
    exudyn=-1.08251704,
    tolerance=1e-6,
    value=0.8,
)
def two_points_on_rods(length):
    model = fb.Mechanism(
        bodies={
            "a": fb.PointMass(mass=2.5, position=(length, 0.0)),
            "b": fb.PointMass(mass=2.5, position=(2 * length, 0.0)),
        },
        joints={"a": fb.Distance("a", (0.0, 0.0), length), "b": fb.Distance("b", "a", length)},
        loads=GRAVITY,
        sensors={"r": fb.Position("a")},
    )
    return fb.simulate(model, duration=1.0, step=5e-5).values[..., -1].sum(-1)
