"""Forces and work of contacts with friction, against balances of momentum and energy."""

from functools import cache

import numpy as np
import pytest

import flexband as fb
from flexband.contact import CircleInCircle, CircleOnCircle, Contact, KeepsRestitution

G = 9.81
M = 2.0
J = 0.02
LAW = KeepsRestitution(stiffness=1e6, exponent=1.0)


def wheel_on(joint, wheel):
    """A wheel under gravity on a joint that it rubs on."""
    return fb.Mechanism(
        bodies={"wheel": wheel},
        joints={"part": joint},
        loads={"g": fb.Gravity()},
        sensors={
            "v": fb.Velocity("wheel"), "w": fb.AngularVelocity("wheel"), "T": fb.KineticEnergy(),
            "V": fb.PotentialEnergy(), "work": fb.Work("part"), "F": fb.Reaction("part"),
            "M": fb.ReactionMoment("part"), "J": fb.sensors.Integral(fb.Reaction("part")),
            "most": fb.sensors.Largest(fb.Reaction("part")),
        },
    )  # fmt: skip


def pin(friction=0.3):
    """A pin in a hole with clearance."""
    wheel = fb.RigidBody(mass=M, inertia=J, position=(0.03, -0.04), velocity=(0.4, 0.3), rate=3.0)
    joint = fb.Revolute("wheel", (0.0, 0.0), clearance=0.05, radius=0.1, law=LAW, friction=friction)
    return wheel_on(joint, wheel)


def slider(friction=0.3):
    """A slider that stands on two corners, beside its middle."""
    wheel = fb.RigidBody(
        mass=M, inertia=J, position=(0.0, -0.009), velocity=(1.5, 0.0), angle=0.002
    )
    joint = fb.Prismatic(
        "wheel", (0.0, 0.0), clearance=0.01, length=0.2, height=0.1, law=LAW, friction=friction
    )
    return wheel_on(joint, wheel)


def simulate(model, duration=0.2):
    integrator = fb.GeneralizedAlpha(step_tolerance=1e-10, spectral_radius=1.0)
    return fb.simulate(model, duration=duration, step=1e-4, integrator=integrator)


def outputs(motion):
    return {name: motion.sel(output=name).values for name in motion["output"].values}


@cache
def motion_of(make):
    return simulate(make())


@pytest.mark.parametrize("model", [pin, slider])
def test_the_reaction_of_a_joint_with_clearance_and_friction_changes_the_momentum(model):
    motion = motion_of(model)
    time = motion["time"].values
    values = outputs(motion)
    change = {"X": M * values["v_X"], "Y": M * (values["v_Y"] + G * time)}
    for axis, momentum in change.items():
        assert np.ptp(momentum) > 0.1
        impulse = values[f"J_{axis}"]
        np.testing.assert_allclose(impulse, momentum - momentum[0], rtol=0, atol=1e-5)
    mean = 0.5 * (values["M"][1:] + values["M"][:-1])  # friction jumps between two times
    angular_impulse = J * (values["w"] - values["w"][0])
    tolerance = 2e-3 * np.ptp(angular_impulse)
    np.testing.assert_allclose(
        np.cumsum(mean) * time[1], angular_impulse[1:], rtol=0, atol=tolerance
    )
    assert values["most_Y"][-1] >= values["F_Y"].max()


@pytest.mark.parametrize("model", [pin, slider])
def test_the_work_of_contacts_with_friction_is_what_the_energy_loses(model):
    motion = motion_of(model)
    values = outputs(motion)
    total = values["T"] + values["V"]
    assert total[-1] - total[0] < -0.02 * total.max()
    np.testing.assert_allclose(values["work"], total - total[0], rtol=0, atol=1e-6)


def test_a_pin_in_the_middle_of_its_hole_has_no_reaction():
    joint = fb.Revolute("wheel", (0.0, 0.0), clearance=0.05, radius=0.1, law=LAW, friction=0.3)
    motion = simulate(wheel_on(joint, fb.RigidBody(mass=M, inertia=J)), duration=1e-3)
    np.testing.assert_array_equal(motion.sel(output=["F_X", "F_Y", "M", "work"]), 0.0)


@pytest.mark.parametrize("inside", [False, True])
def test_the_work_of_friction_between_circles(inside):
    """A wheel that is thrown into a hole, or on top of a wheel that turns."""
    geometry = CircleInCircle(radii=(0.1, 0.3)) if inside else CircleOnCircle(radii=(0.1, 0.3))
    height = -0.19 if inside else 0.401
    model = fb.Mechanism(
        bodies={
            "wheel": fb.RigidBody(
                mass=M, inertia=J, position=(0.02, height), velocity=(1.0, 0.0), rate=5.0
            ),
            "other": fb.RigidBody(mass=5.0, inertia=0.2, rate=-2.0),
        },
        joints={"axle": fb.Revolute("other", (0.0, 0.0))},
        loads={"g": fb.Gravity(), "part": Contact("wheel", "other", geometry, LAW, friction=0.2)},
        sensors={"T": fb.KineticEnergy(), "V": fb.PotentialEnergy(), "work": fb.Work("part")},
    )
    motion = simulate(model)
    values = outputs(motion)
    total = values["T"] + values["V"]
    assert total[-1] - total[0] < -0.1
    np.testing.assert_allclose(values["work"], total - total[0], rtol=0, atol=1e-6)


def test_the_work_of_a_brake_and_of_a_rough_pin():
    wheel = fb.RigidBody(mass=M, inertia=J, rate=20.0, position=(0.05, 0.0), velocity=(0.0, 1.0),
                         points={"pin": (-0.05, 0.0)})  # fmt: skip
    model = fb.Mechanism(
        bodies={"wheel": wheel},
        joints={"pin": fb.Revolute("wheel.pin", (0.0, 0.0), friction=0.3, radius=0.02)},
        loads={"brake": fb.contact.Brake(
            "wheel", (0.0, 0.0), friction=0.3, radius=0.1, force=5.0)},
        sensors={"T": fb.KineticEnergy(), "pin": fb.Work("pin"), "brake": fb.Work("brake"),
                 "angle": fb.Angle("wheel")},
    )  # fmt: skip
    motion = simulate(model)
    values = outputs(motion)
    turn = values["angle"] - values["angle"][0]
    np.testing.assert_allclose(values["brake"], -0.15 * turn, rtol=1e-6)
    energy_change = values["T"] - values["T"][0]
    np.testing.assert_allclose(values["pin"] + values["brake"], energy_change, rtol=0, atol=1e-6)
    assert values["pin"][-1] < -0.1
