"""Contacts that stay closed: at rest, preloaded, set down, dropped, and pressed by slow drives."""

import numpy as np
import pytest

import flexband as fb
from flexband import contact

LAWS = (
    contact.KeepsRestitution,
    contact.HuntCrossley,
    contact.LankaraniNikravesh,
    contact.Flores,
)
WEIGHT = 98.1
FORCE = 40.0
FREQUENCY = 5.0


def damping_ratio(e):
    return -np.log(e) / np.hypot(np.pi, np.log(e))


def foot(law, height):
    """A machine of 10 kg on a foot that it presses in by 0.981 mm, shaken from 3 s on."""

    def shaking_force(t):
        return np.where(t > 3.0, FORCE * np.sin(2 * np.pi * FREQUENCY * t), 0.0)

    stop = contact.Stop(
        "m", (0.0, 0.0), law, lower=0.0, axis=(0.0, 1.0), closed_at_start=height <= 0.0
    )
    return fb.Mechanism(
        bodies={"m": fb.PointMass(mass=10.0, position=(0.0, height))},
        joints={"guide": fb.Slot("m", (0.0, 0.0), (0.0, 1.0))},
        loads={
            "g": fb.Force("m", 0.0, -WEIGHT),
            "foot": stop,
            "F": fb.Force("m", 0.0, shaking_force),
        },
        sensors={"y": fb.Position("m")},
    )


def amplitude(motion, frequency, last):
    """The Fourier component of the only output in the last seconds of a motion."""
    t = motion["time"].values
    y = motion.values[..., -1, :]
    inside = t > t[-1] - last + 1e-9
    turns = np.exp(-2j * np.pi * frequency * t[inside])
    return 2 * np.abs((y[..., inside] * turns).mean(axis=-1))


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize(
    "height", [-WEIGHT / 1e5, 1e-4, 0.1], ids=["at rest", "set down", "dropped"]
)
def test_a_foot_is_the_spring_that_it_is(law, height):
    """The amplitude is that of a linear vibration with ζ, whatever was before."""
    e = np.array([0.3, 0.5, 0.7] if height > 0.01 else [0.3, 0.5, 0.7, 0.9])
    model = foot(law(stiffness=1e5, restitution=e, exponent=1.0), height)
    motion = fb.simulate(model, duration=6.0, step=0.005).sel(output=["y_Y"])
    r = 2 * np.pi * FREQUENCY / np.sqrt(1e5 / 10.0)
    exact = FORCE / 1e5 / np.hypot(1 - r**2, 2 * damping_ratio(e) * r)
    tolerance = 1e-2 if height > 0.01 else 2e-3  # a fast impact damps less until it is forgotten
    np.testing.assert_allclose(amplitude(motion, FREQUENCY, 2.0), exact, rtol=tolerance)
    np.testing.assert_allclose(exact, 0.444e-3, rtol=0.04)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_modes_have_the_frequency_and_the_damping_of_a_closed_contact(law, exponent):
    """And a simulation that starts a little beside the rest has them too."""
    e = np.array([0.3, 0.5, 0.9])
    K = 1e5 if exponent == 1.0 else 3e6
    model = foot(
        law(stiffness=K, restitution=e, exponent=exponent), -((WEIGHT / K) ** (1 / exponent))
    )
    modes = fb.modes(model, 1)
    depth = (WEIGHT / K) ** (1 / exponent)
    omega = np.sqrt(exponent * K * depth ** (exponent - 1) / 10.0)
    np.testing.assert_allclose(modes["frequency"][:, 0], omega / (2 * np.pi), rtol=1e-5)
    np.testing.assert_allclose(modes["damping_ratio"][:, 0], damping_ratio(e), rtol=1e-5)
    beside = foot(law(stiffness=K, restitution=e, exponent=exponent), -1.01 * depth)
    motion = fb.simulate(beside, duration=0.25, step=2.5e-4).sel(output="y_Y")
    s = -damping_ratio(e) * omega + 1j * omega * np.sqrt(1 - damping_ratio(e) ** 2)
    t = motion["time"].values
    wave = np.exp(s[:, None] * t)
    exact = -0.01 * depth * (wave.real - (s.real / s.imag)[:, None] * wave.imag) - depth
    np.testing.assert_allclose(motion, exact, rtol=0, atol=3e-4 * depth)


@pytest.mark.parametrize("kind", ["stop", "contact"])
@pytest.mark.parametrize("e", [0.1, 0.5])
def test_a_bolt_takes_its_share_of_the_force(kind, e):
    """A joint of 1e8 N/m that 2000 N preload is pulled by ± 500 N: k/(k + K) of it, 83.3 N."""
    law = contact.KeepsRestitution(stiffness=1e8, restitution=e, exponent=1.0)
    points = ("flange", (0.0, 0.0))
    options = {"closed_at_start": True}
    joint = (
        contact.Stop(*points, law, lower=0.0, axis=(0.0, 1.0), **options)
        if kind == "stop"
        else contact.Contact(*points, contact.CircleOnLine(), law, **options)
    )
    bolt = fb.Spring("flange", (0.0, -0.1), stiffness=2e7, rest_length=0.1 - 2e-5 - 1e-4)
    model = fb.Mechanism(
        bodies={"flange": fb.PointMass(mass=1.0, position=(0.0, -2e-5))},
        joints={"guide": fb.Slot("flange", (0.0, 0.0), (0.0, 1.0))},
        loads={
            "bolt": bolt,
            "joint": joint,
            "F": fb.Force("flange", 0.0, lambda t: 500.0 * np.sin(100 * np.pi * t)),
        },
        sensors={"y": fb.Position("flange")},
    )
    motion = fb.simulate(model, duration=0.2, step=2e-4, start="static").sel(output=["y_Y"])
    share = 2e7 * amplitude(motion, 50.0, 0.1)
    np.testing.assert_allclose(share, 83.4, rtol=5e-3)


def test_an_angular_stop_at_rest_is_a_spring():
    """A bar that 20 N m press against its stop, moved by ± 5 N m at 10 Hz."""
    e = np.array([0.3, 0.6, 0.9])
    law = contact.HuntCrossley(stiffness=5e4, restitution=e, exponent=1.0)
    model = fb.Mechanism(
        bodies={"bar": fb.RigidBody(mass=1.0, inertia=0.5, angle=0.2 + 20.0 / 5e4)},
        joints={"axle": fb.Revolute("bar", (0.0, 0.0))},
        loads={
            "M": fb.Moment("bar", lambda t: 20.0 + 5.0 * np.sin(20 * np.pi * t)),
            "stop": contact.AngularStop("bar", (0.0, 0.0), law, upper=0.2, closed_at_start=True),
        },
        sensors={"angle": fb.Angle("bar")},
    )
    motion = fb.simulate(model, duration=1.0, step=1e-3)
    r = 20 * np.pi / np.sqrt(5e4 / 0.5)
    exact = 5.0 / 5e4 / np.hypot(1 - r**2, 2 * damping_ratio(e) * r)
    np.testing.assert_allclose(amplitude(motion, 10.0, 0.5), exact, rtol=3e-3)


def test_a_pin_that_rests_in_its_hole_is_a_spring():
    """A slider of 2 kg hangs on a pin with clearance; its hole moves by ± 10 µm at 20 Hz."""
    law = contact.KeepsRestitution(stiffness=1e9, restitution=np.array([0.3, 0.5, 0.9]))
    weight = 2.0 * 9.81
    depth = (weight / 1e9) ** (2 / 3)
    model = fb.Mechanism(
        bodies={
            "m": fb.PointMass(mass=2.0, position=(0.0, -1e-4 - depth)),
            "hole": fb.RigidBody(mass=1.0, inertia=1.0),
        },
        joints={
            "guide": fb.Slot("m", (0.0, 0.0), (0.0, 1.0)),
            "still": fb.PrescribedRotation("hole", lambda t: 0.0 * t),
            "drive": fb.PrescribedPath(
                "hole", lambda t: 0.0 * t, lambda t: 1e-5 * np.sin(40 * np.pi * t) ** 3
            ),
            "pin": fb.Revolute("m", "hole", clearance=1e-4, law=law),
        },
        loads={"g": fb.Gravity()},
        sensors={"F": contact.ContactForce("pin")},
    )
    motion = fb.simulate(model, duration=0.1, step=1e-3, start="static")
    t = motion["time"].values
    s = np.sin(40 * np.pi * t)
    c = np.cos(40 * np.pi * t)
    w = 40 * np.pi
    force = weight + 2.0 * 1e-5 * w**2 * (6 * s * c**2 - 3 * s**3)  # m (g + acceleration)
    np.testing.assert_allclose(motion.sel(output="F"), np.tile(force, (3, 1)), atol=0.01 * weight)


@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_a_slow_drive_presses_a_contact_with_its_stiffness(exponent):
    """A press at 2 mm/s on a mass at a foot: the force is that of the depth, not of the speed."""
    law = contact.KeepsRestitution(stiffness=1e7, restitution=0.5, exponent=exponent)
    model = fb.Mechanism(
        bodies={
            "ram": fb.PointMass(mass=1.0, position=(0.0, 0.1)),
            "m": fb.PointMass(mass=5.0, position=(0.0, 1e-5)),
        },
        joints={
            "guide": fb.Slot("m", (0.0, 0.0), (0.0, 1.0)),
            "rail": fb.Slot("ram", (0.0, 0.0), (0.0, 1.0)),
            "press": fb.PrescribedTravel("ram", (0.0, 0.1), lambda t: -2e-3 * t, (0.0, 1.0)),
        },
        loads={
            "spring": fb.Spring("ram", "m", 1e6, 0.1 - 1e-5, damping=100.0),
            "foot": contact.Stop("m", (0.0, 0.0), law, lower=0.0, axis=(0.0, 1.0)),
        },
        sensors={"y": fb.Position("m"), "F": contact.ContactForce("foot")},
    )
    motion = fb.simulate(model, duration=0.5, step=0.01).isel(time=slice(15, None))
    depth = -motion.sel(output="y_Y").values
    force = 1e7 * depth**exponent
    np.testing.assert_allclose(motion.sel(output="F"), force, rtol=0, atol=5e-3 * force.max())


@pytest.mark.parametrize("exponent", [1.0, 1.5])
@pytest.mark.parametrize("e", [0.3, 0.6, 0.9])
def test_restitution_does_not_depend_on_the_depth(exponent, e):
    """Depths from 1e-3 to 1e-9 of the size, which the travel to the stop sets."""
    size = 1.0
    mass = 1.0
    speed = 0.1
    depths = 10.0 ** -np.arange(3.0, 10.0)
    K = 0.5 * (exponent + 1) * mass * speed**2 / depths ** (exponent + 1)
    law = contact.KeepsRestitution(stiffness=K, restitution=e, exponent=exponent)
    model = fb.Mechanism(
        bodies={
            "m": fb.PointMass(mass=mass, velocity=(speed, 0.0)),
            "far": fb.PointMass(mass=1.0, position=(size, 0.0)),
        },
        joints={
            "guide": fb.Slot("m", (0.0, 0.0)),
            "pin": fb.Revolute("far", (size, 0.0)),
        },
        loads={"stop": contact.Stop("m", (0.0, 0.0), law, upper=1e-3)},
        sensors={"v": fb.Velocity("m")},
    )
    ends = fb.simulate(model, duration=0.05, step=0.01).sel(output="v_X").values[:, -1]
    np.testing.assert_allclose(ends, -e * speed, rtol=0, atol=1e-3 * speed)


@pytest.mark.parametrize("step", [1e-3, 0.5, 5.0])
def test_an_impact_of_microseconds_runs_with_any_output_step(step):
    law = contact.KeepsRestitution(stiffness=1e12, restitution=0.6, exponent=1.0)
    model = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0, velocity=(0.1, 0.0))},
        joints={"guide": fb.Slot("m", (0.0, 0.0))},
        loads={"stop": contact.Stop("m", (0.0, 0.0), law, upper=0.03)},
        sensors={"v": fb.Velocity("m")},
    )
    motion = fb.simulate(model, duration=max(5.0, step), step=step)
    assert float(motion.sel(output="v_X")[-1]) == pytest.approx(-0.06, rel=2e-3)
