"""Functions of time that do something between the steps."""

import warnings

import numpy as np
import pytest

import flexband as fb

IMPULSE = 500 * 2e-4  # N s


def pushed(force, mass=1.0):
    return fb.Mechanism(
        bodies={"p": fb.PointMass(mass=mass)},
        joints={"s": fb.Slot("p", (0.0, 0.0))},
        loads={"f": fb.Force("p", x=force)},
        sensors={"v": fb.Velocity("p"), "x": fb.Position("p")},
    )


def turned(angle):
    return fb.Mechanism(
        bodies={"d": fb.RigidBody(mass=1.0, inertia=0.02)},
        joints={"h": fb.Revolute("d", (0.0, 0.0)), "m": fb.PrescribedRotation("d", angle)},
        sensors={"M": fb.ReactionMoment("m")},
    )


def pulse(start):
    """Return sin 20t N and a pulse of 0.2 ms."""
    return lambda t: np.sin(20 * t) + 500.0 * ((t > start) & (t < start + 2e-4))


@pytest.mark.filterwarnings("ignore:output 'v_X' vibrates")
@pytest.mark.parametrize(("h", "error"), [(5e-3, 9e-4), (2.5e-3, 2e-4), (1.25e-3, 5e-5)])
def test_the_impulse_of_a_short_pulse_is_counted(h, error):
    """The rest is the error of the trapezoidal rule for sin 20t."""
    motion = fb.simulate(pushed(pulse(0.1003)), duration=0.2, step=h)
    speed = (1 - np.cos(4)) / 20 + IMPULSE
    assert float(motion.sel(output="v_X")[-1]) == pytest.approx(speed, abs=error * IMPULSE)


def test_a_function_of_one_time_is_looked_at_too():
    def force(t):
        return 500.0 if 0.1003 < t < 0.1005 else 0.0

    motion = fb.simulate(pushed(force), duration=0.2, step=1.25e-3)
    assert float(motion.sel(output="v_X")[-1]) == pytest.approx(IMPULSE, rel=1e-9)
    assert float(motion.sel(output="x_X")[-1]) == pytest.approx(IMPULSE * 0.0996, rel=1e-9)


def test_a_sample_with_its_own_pulse_does_not_depend_on_the_others():
    starts = np.linspace(0.05, 0.15, 11) + 3e-4

    def motion(chosen):
        return fb.simulate(pushed(pulse(chosen)), duration=0.2, step=1.25e-3).sel(output="v_X")

    together = motion(starts).values
    assert together[:, -1] == pytest.approx((1 - np.cos(4)) / 20 + IMPULSE, abs=1e-4 * IMPULSE)
    assert np.array_equal(together[4:6], motion(starts[4:6]))
    assert np.array_equal(together[::-1], motion(starts[::-1]))


@pytest.mark.parametrize("h", [2.5e-3, 1.25e-3, 6.25e-4])
def test_a_force_above_what_the_step_resolves_is_averaged_and_named(h):
    """At 1.25 and 0.625 ms all values of 800 Hz are zeros."""
    omega = 2 * np.pi * 800
    with pytest.warns(fb.ResolutionWarning, match="has about 800 Hz, which steps"):
        motion = fb.simulate(pushed(lambda t: 50 * np.sin(omega * t), 0.1), duration=0.2, step=h)
    assert float(motion.sel(output="x_X")[-1]) == pytest.approx(500 * 0.2 / omega, rel=0.02)


@pytest.mark.parametrize("h", [5e-3, 1.25e-3])
def test_the_motion_under_a_sudden_force_is_exact(h):
    motion = fb.simulate(pushed(lambda t: 1.0 * (t > 0.1003)), duration=0.2, step=h)
    assert float(motion.sel(output="x_X")[-1]) == pytest.approx(0.0997**2 / 2, rel=1e-9)


@pytest.mark.parametrize("at", [0.3, 0.3005])
def test_a_drive_whose_speed_jumps_is_named(at):
    mechanism = turned(lambda t: 3 * np.maximum(0.0, t - at))
    with pytest.warns(fb.ResolutionWarning, match=f"joint 'm' .* rate jumps at t = {at} s"):
        fb.simulate(mechanism, duration=0.6, step=1e-3)


@pytest.mark.parametrize(
    "angle",
    [
        lambda t: 4 * np.pi * t,
        lambda t: 0.2 * np.sin(100 * t),
        lambda t: 0.5 * np.maximum(0.0, t - 0.2) ** 2,
    ],
)
@pytest.mark.filterwarnings("error")
def test_drives_with_a_continuous_speed_are_not_warned_of(angle):
    fb.simulate(turned(angle), duration=0.5, step=1e-3)
