"""Fast rotation, spectral radii near 1, small steps, drives, and redundant joints."""

import re
import warnings

import numpy as np
import pytest

import flexband as fb

SPEED_LOSSES = {0.5: 1.5e-2, 0.7: 4.2e-3, 0.9: 4e-4, 0.95: 9e-5, 0.98: 1.4e-5, 1.0: 1e-12}


def disc(rate):
    body = fb.RigidBody(mass=1.0, inertia=1.0, rate=rate)
    return fb.Mechanism(bodies={"disc": body}, sensors={"w": fb.AngularVelocity("disc")})


def speed_kept(rate, steps, radius):
    integrator = fb.GeneralizedAlpha(spectral_radius=radius)
    motion = fb.simulate(disc(rate), duration=float(steps), step=1.0, integrator=integrator)
    return float(motion[0, -1]) / rate


@pytest.mark.parametrize(("radius", "speed_loss"), SPEED_LOSSES.items())
def test_a_free_disc_keeps_its_speed(radius, speed_loss):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fb.errors.FlexbandWarning)
        assert abs(speed_kept(0.1, 10_000, radius) - 1) < speed_loss
        assert 0.1 < speed_kept(2.0, 1000, radius) < 1 + 1e-9


def test_a_step_that_slows_a_mass_on_a_rod_down_is_warned_of():
    mass = fb.PointMass(mass=1.0, position=(1.0, 0.0), velocity=(0.0, 0.5))
    model = fb.Mechanism(
        bodies={"mass": mass},
        joints={"rod": fb.Distance("mass", (0.0, 0.0), 1.0)},
        sensors={"x": fb.Position("mass")},
    )
    with pytest.warns(fb.errors.FlexbandWarning, match="'rod' turns by about .* rad per step"):
        fb.simulate(model, duration=2000.0, step=1.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fb.simulate(model, duration=10.0, step=0.1)


def test_a_step_that_slows_a_body_down_is_warned_of():
    with pytest.warns(fb.errors.FlexbandWarning, match="'disc' turns by about .* rad per step"):
        speed_kept(0.5, 1000, 0.7)


def bar(drive=None, **start):
    joints = {"A": fb.Revolute("bar.start", (0.0, 0.0))}
    joints |= {"motor": fb.PrescribedRotation("bar", drive)} if drive else {}
    body = fb.RigidBody.bar(length=1.0, height=0.02, width=0.02, density=2500.0, **start)  # 1 kg
    return fb.Mechanism(
        bodies={"bar": body}, joints=joints, loads={} if drive else {"g": fb.Gravity()},
        sensors={
            "F": fb.Reaction("A"), "w": fb.AngularVelocity("bar"), "angle": fb.Angle("bar"),
            "T": fb.KineticEnergy(), "V": fb.PotentialEnergy(),
        },
    )  # fmt: skip


INERTIA = 1 / 3 + 0.02**2 / 12


def force_x(angle, rate, second):
    return 0.5 * (-np.sin(angle) * second - np.cos(angle) * rate**2)


def test_a_bar_swings_for_a_minute_without_damping():
    integrator = fb.GeneralizedAlpha(spectral_radius=1.0)
    motion = fb.simulate(bar(), duration=60.0, step=1e-3, integrator=integrator)
    o = dict(zip(motion.output.values, motion.values, strict=True))
    energy = o["T"] + o["V"]
    assert np.abs(energy - energy[0]).max() < 1e-4
    exact = force_x(o["angle"], o["w"], -9.81 * 0.5 * np.cos(o["angle"]) / INERTIA)
    np.testing.assert_allclose(np.abs(o["F_X"]), np.abs(exact), atol=1e-6)


@pytest.mark.parametrize("step", [1e-5, 1e-6, 1e-7])
def test_reactions_are_free_of_rounding_at_tiny_steps(step):
    o = fb.simulate(bar(rate=3.0), duration=100 * step, step=step).sel(output=["F_X", "w", "angle"])
    force, rate, angle = o.values
    exact = force_x(angle, rate, -9.81 * 0.5 * np.cos(angle) / INERTIA)
    np.testing.assert_allclose(np.abs(force), np.abs(exact), rtol=1e-9)


@pytest.mark.parametrize("step", [1e-2, 1e-3, 1e-6])
def test_a_driven_bar_has_the_rates_of_its_drive(step):
    motion = fb.simulate(bar(lambda t: np.sin(3 * t)), duration=100 * step, step=step)
    o = dict(zip(motion.output.values, motion.values, strict=True))
    t = motion.time.values
    angle = np.sin(3 * t)
    rate = 3 * np.cos(3 * t)
    second = -9 * np.sin(3 * t)
    np.testing.assert_allclose(o["w"], rate, atol=1e-6)
    np.testing.assert_allclose(np.abs(o["F_X"]), np.abs(force_x(angle, rate, second)), atol=2e-5)


def test_a_drive_may_have_a_kink():
    with pytest.warns(fb.errors.ResolutionWarning, match="rate jumps at t = 0.5 s"):
        motion = fb.simulate(bar(lambda t: 2 * max(0.0, t - 0.5)), duration=1.0, step=1e-2)
    rates = motion.sel(output="w").values
    np.testing.assert_allclose(rates[:50], 0.0, atol=1e-9)
    np.testing.assert_allclose(rates[51:], 2.0, atol=1e-9)


def test_a_stiff_cable_bears_a_sudden_force():
    """Steps far longer than the axial periods: EA 1e6, EI 1 and 16 elements."""
    cable = fb.Cable(
        length=1.0, mass_per_length=0.1, axial_stiffness=1e6, bending_stiffness=1.0, elements=16
    )
    model = fb.Mechanism(
        bodies={"cable": cable}, joints={"clamp": fb.Weld("cable.start", (0.0, 0.0))},
        loads={"P": fb.Force("cable.end", x=3.0)}, sensors={"F": fb.Reaction("clamp")},
    )  # fmt: skip
    integrator = fb.GeneralizedAlpha(spectral_radius=0.95)
    force = fb.simulate(model, duration=1.0, step=2e-3, integrator=integrator).sel(output="F_X")
    assert np.abs(force).max() < 12.0
    assert float(force[-100:].mean()) == pytest.approx(-3.0, abs=0.1)


@pytest.mark.parametrize("excess_length", [0.0, 1e-13, 1e-11])
def test_a_plate_on_three_cranks_shares_its_weight(excess_length):
    """Statically indeterminate; the least multipliers are bounded by weight and inertia."""
    c = np.cos(0.3)
    s = np.sin(0.3)
    names = []
    points = {"0": (-0.4, 0.0), "1": (0.0, 0.0), "2": (0.4, 0.0)}
    at = (0.4 + 0.2 * c, 0.2 * s)
    plate = fb.RigidBody(mass=1.0, inertia=0.05, points=points, position=at, velocity=(-s, c))
    bodies = {"plate": plate}
    joints = {}
    sensors = {"a": fb.Acceleration("plate")}
    for k in range(3):
        bodies[f"c{k}"] = fb.RigidBody.bar(
            length=0.2 + (excess_length if k == 2 else 0.0), height=0.02, width=0.01,
            density=1000.0, start=(0.4 * k, 0.0), angle=0.3, rate=5.0,
        )  # fmt: skip
        joints |= {f"A{k}": fb.Revolute(f"c{k}.start", (0.4 * k, 0.0))}
        joints |= {f"B{k}": fb.Revolute(f"plate.{k}", f"c{k}.end")}
        names += [f"B{k}"]
        sensors[f"B{k}"] = fb.Reaction(f"B{k}")
    model = fb.Mechanism(bodies=bodies, joints=joints, loads={"g": fb.Gravity()}, sensors=sensors)
    # Reactions are bounded, and together they carry weight and inertia.
    motion = fb.simulate(model, duration=2.0, step=1e-3)
    assert "joint 'B2'" in motion.attrs["not_unique"]
    forces = motion.sel(output=[f"{n}_{axis}" for n in names for axis in "XY"])
    assert np.abs(forces).max() < 30.0
    vertical_force = sum(motion.sel(output=f"{n}_Y") for n in names)
    np.testing.assert_allclose(
        np.abs(vertical_force), np.abs(motion.sel(output="a_Y") + 9.81), atol=1e-4
    )


@pytest.mark.filterwarnings("ignore:.*numerical damping takes")
@pytest.mark.parametrize("radius", [0.0, 0.5, 0.7, 1.0])
def test_a_lag_that_adds_up_over_swings_is_warned_of(radius):
    """A disc on a clock spring that is wound by four turns, √(k/J) = 5 rad/s."""
    disc = fb.RigidBody(mass=1.0, inertia=0.02)
    model = fb.Mechanism(
        bodies={"disc": disc},
        joints={"pin": fb.Revolute("disc", (0.0, 0.0))},
        loads={"k": fb.TorsionSpring("disc", stiffness=0.5, rest_angle=-8 * np.pi)},  # to ground
        sensors={"angle": fb.Angle("disc")},
    )
    step = 1e-3 if radius > 0 else 5e-4
    integrator = fb.GeneralizedAlpha(spectral_radius=radius)
    with pytest.warns(
        fb.errors.ResolutionWarning, match=r"swings by about ± 25\.[12] rad"
    ) as records:
        motion = fb.simulate(model, duration=10.0, step=step, integrator=integrator)
    text = next(str(w.message) for w in records if "swings" in str(w.message))
    error = motion[0] / (8 * np.pi) + 1 - np.cos(5 * motion.time)
    lag = float(re.findall(r"lags by about (\S+) rad", text)[0])
    assert lag == pytest.approx(float(np.abs(error).max()), rel=0.05)
    step_ratio = float(re.findall(r"that is (\S+) times shorter", text)[0])
    finer_motion = fb.simulate(
        model, duration=10.0, step=0.1, substeps=int(0.1 * step_ratio / step) + 1,
        integrator=integrator,
    )  # fmt: skip
    error = finer_motion[0] / (8 * np.pi) + 1 - np.cos(5 * finer_motion.time)
    assert float(np.abs(error).max()) == pytest.approx(0.01, rel=0.1)
