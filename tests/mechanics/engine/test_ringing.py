"""Vibrations of too few steps per period: how much they lag, and that this is warned of."""

import re

import numpy as np
import pytest

import flexband as fb

OMEGA = 2 * np.pi


def mass_on_spring(start=1.5, force=None, natural=OMEGA):
    """A mass that vibrates about 1 m, at 1 Hz by default."""
    loads = {"k": fb.Spring("m", (0.0, 0.0), natural**2, 1.0)}
    if force is not None:
        loads["F"] = fb.Force("m", x=force)
    return fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0, position=(start, 0.0))},
        joints={"guide": fb.Slot("m", (0.0, 0.0))},
        loads=loads,
        sensors={"r": fb.Position("m"), "v": fb.Velocity("m")},
    )


def run(mechanism, periods, steps, radius=0.7):
    integrator = fb.GeneralizedAlpha(spectral_radius=radius)
    return fb.simulate(mechanism, duration=periods, step=1 / steps, integrator=integrator)


@pytest.mark.parametrize("radius", [0.0, 0.5, 0.7, 1.0])
def test_lag_and_damping_of_a_free_vibration(radius):
    """(ωh)²/12 (1 + 4.5 δ²) of the angle, and the damping ratio δ³ (ωh)³/2."""
    steps = 200
    delta = (1 - radius) / (1 + radius)
    x = OMEGA / 200
    motion = run(mass_on_spring(), 4, steps, radius)
    r, v = motion.sel(output=["r_X", "v_X"]).values
    z = (r - 1) - 1j * v / OMEGA
    lag = -np.angle(z[-1] / z[0]) / (OMEGA * 4)
    damping = -np.log(abs(z[-1] / z[0])) / (OMEGA * 4)
    assert lag == pytest.approx(x**2 / 12 * (1 + 4.5 * delta**2), rel=0.01)
    assert damping == pytest.approx(delta**3 * x**3 / 2, rel=0.02, abs=1e-9)


@pytest.mark.parametrize(("steps", "radius"), [(10, 0.7), (20, 1.0), (30, 0.0)])
def test_the_warning_tells_frequency_lag_and_error(steps, radius):
    with pytest.warns(fb.errors.FlexbandWarning, match="steps per period") as records:
        motion = run(mass_on_spring(), 20, steps, radius)
    message = str(records[0].message)
    numbers = [float(x) for x in re.findall(r"([\d.]+) (?:Hz|steps|rad)", message)]
    z = motion.sel(output="r_X").values - 1 - 1j * motion.sel(output="v_X").values / OMEGA
    lag = OMEGA * 20 - np.unwrap(np.angle(z))[-1]
    exact = 0.5 * np.cos(OMEGA * motion.time)
    deviation = motion.sel(output="r_X") - 1 - exact
    error = float(np.sqrt((deviation**2).mean()) / exact.std())
    assert numbers[:2] == pytest.approx([1.0, steps], rel=0.06)
    assert numbers[2] == pytest.approx(lag, rel=0.25)
    error_estimate = float(re.search(r"error of about (\d+)%", message)[1]) / 100
    assert error_estimate == pytest.approx(error, rel=0.25)
    advised_steps = numbers[3]
    finer_motion = run(mass_on_spring(), 20, int(advised_steps), radius).sel(output="r_X")
    deviation = finer_motion - 1 - 0.5 * np.cos(OMEGA * finer_motion.time)
    assert 0.005 < float(np.sqrt((deviation**2).mean())) / np.sqrt(0.125) < 0.015


def test_what_is_forced_or_resolved_or_at_rest_is_not_warned_of():
    """A force below the natural frequency moves the mass with an error of (ωh)²/12 at most."""
    mechanism = mass_on_spring(1.0, lambda t: 10.0 * np.sin(OMEGA * t) ** 3, 20 * OMEGA)
    run(mechanism, 20, 25)
    run(mass_on_spring(), 20, 300)
    run(mass_on_spring(1.0), 20, 10)


def test_rounding_errors_do_not_vibrate():
    """Gears at constant speed need no moment, and what is computed of it is rounding."""
    joints = {
        "A": fb.Revolute("pinion", (0.0, 0.0)),
        "B": fb.Revolute("wheel", (0.3, 0.0)),
        "mesh": fb.Gear("pinion", "wheel", 0.1, 0.2),
        "motor": fb.PrescribedRotation("pinion", lambda t: 10 * t),
    }
    gears = fb.Mechanism(
        bodies={
            "pinion": fb.RigidBody(mass=1.0, inertia=0.02, rate=10.0),
            "wheel": fb.RigidBody(mass=1.0, inertia=0.02, position=(0.3, 0.0), rate=-5.0),
        },
        joints=joints,
        sensors={"M": fb.ReactionMoment("motor"), "F": fb.Reaction("mesh")},
    )
    motion = fb.simulate(gears, duration=0.2, step=2e-4)
    assert np.abs(motion).max() < 1e-6
    assert "few_steps" not in motion.attrs
    wheel = fb.Mechanism(
        bodies={"wheel": fb.RigidBody(mass=1.0, inertia=0.02, rate=100.0)},
        joints={
            "pin": fb.Revolute("wheel", (0.0, 0.0)),
            "motor": fb.PrescribedRotation("wheel", lambda t: 100 * t),
        },
        sensors={"M": fb.ReactionMoment("motor")},
    )
    motion = fb.simulate(wheel, duration=0.2, step=1e-4)  # 2e-5 N m after the first step
    assert np.ptp(motion.values[:, 1:]) < 1e-6
    assert "few_steps" not in motion.attrs
