"""Newton's third law: two free bodies that meet keep their linear and angular momentum."""

import numpy as np
import pytest

import flexband as fb
from flexband import contact

LAWS = {
    "keeps": contact.KeepsRestitution,
    "hunt": contact.HuntCrossley,
    "lankarani": contact.LankaraniNikravesh,
    "flores": contact.Flores,
}
MASSES = np.array([1.0, 2.5])
INERTIAS = np.array([0.02, 0.07])


def bodies(position, approach_velocity):
    """Two bodies that turn and approach each other, off their centres."""
    start = [
        ((0.0, 0.0), (0.3, 0.1), 4.0),
        (position, (approach_velocity[0] + 0.3, approach_velocity[1] + 0.1), -7.0),
    ]
    return {
        name: fb.RigidBody(
            mass=m, inertia=J, position=place, velocity=velocity, rate=rate, points=points
        )
        for name, m, J, (place, velocity, rate), points in zip(
            "ab", MASSES, INERTIAS, start, [{"p": (0.02, 0.03)}, {"p": (-0.01, 0.02)}], strict=True
        )
    }


def line(law, friction):
    shape = contact.CircleOnLine(radius=0.1, normal=(0.0, 1.0))
    touch = contact.Contact("b.p", "a.p", shape, law, friction=friction)
    return bodies((0.05, 0.12), (0.4, -1.0)), {}, {"touch": touch}


def circles(law, friction):
    shape = contact.CircleOnCircle(radii=(0.1, 0.05))
    touch = contact.Contact("b.p", "a.p", shape, law, friction=friction)
    return bodies((0.14, 0.13), (-1.0, -0.9)), {}, {"touch": touch}


def hole(law, friction):
    shape = contact.CircleInCircle(radii=(0.02, 0.05))
    touch = contact.Contact("b.p", "a.p", shape, law, friction=friction)
    return bodies((0.03, 0.01), (0.8, 0.4)), {}, {"touch": touch}


def stop(law, friction):
    touch = contact.Stop("b.p", "a.p", law, lower=-0.02, axis=(1.0, 0.2), friction=friction)
    return bodies((0.05, 0.0), (-1.0, 0.3)), {}, {"touch": touch}


def pin(law, friction):
    options = {} if friction is None else {"friction": friction}
    joint = fb.Revolute("b.p", "a.p", clearance=0.002, law=law, radius=0.01, **options)
    return bodies((0.03, 0.01), (0.8, 0.4)), {"pin": joint}, {}


def guide(law, friction):
    del friction
    joint = fb.Prismatic("b.p", "a.p", clearance=0.01, law=law, length=0.1, height=0.04)
    return bodies((0.03, 0.01), (0.8, 0.4)), {"guide": joint}, {}


def angular_stop(law, friction):
    del friction
    touch = contact.AngularStop("b", "a", law, lower=-0.05, upper=0.5)
    return bodies((0.3, 0.1), (0.2, 0.4)), {}, {"touch": touch}


@pytest.mark.parametrize("friction", [None, 0.4])
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("builder", [line, circles, hole, stop, pin, guide, angular_stop])
def test_two_free_bodies_keep_their_momentum(builder, law, friction):
    contact_law = LAWS[law](stiffness=1e6, restitution=0.6, exponent=1.5)
    parts, joints, loads = builder(contact_law, friction)
    name = "touch" if loads else next(iter(joints))
    angular = builder is angular_stop
    sensors = {
        **{f"r {b}": fb.Position(b) for b in "ab"},
        **{f"v {b}": fb.Velocity(b) for b in "ab"},
        **{f"w {b}": fb.AngularVelocity(b) for b in "ab"},
        "hits": contact.Contacts(name, first=0, angular=angular),
    }
    model = fb.Mechanism(bodies=parts, joints=joints, loads=loads, sensors=sensors)
    integrator = fb.GeneralizedAlpha(step_tolerance=1e-9, spectral_radius=1.0)
    motion = fb.simulate(model, duration=0.08, step=0.004, integrator=integrator)
    assert float(motion.sel(output="hits_number")[-1]) >= 1
    linear = np.zeros((2, motion.sizes["time"]))
    spin = np.zeros(motion.sizes["time"])
    for b, m, J in zip("ab", MASSES, INERTIAS, strict=True):
        x, y = (motion.sel(output=f"r {b}_{axis}").values for axis in "XY")
        u, v = (motion.sel(output=f"v {b}_{axis}").values for axis in "XY")
        linear += m * np.array([u, v])
        spin += J * motion.sel(output=f"w {b}").values + m * (x * v - y * u)
    scale = (MASSES * 1.5).sum()
    np.testing.assert_allclose(linear - linear[:, :1], 0.0, atol=1e-9 * scale)
    np.testing.assert_allclose(spin - spin[0], 0.0, atol=1e-9 * scale)
