"""Starts at rest and on periodic motions, against closed forms."""

import numpy as np
import pytest

import flexband as fb
from flexband.errors import AssemblyError, InputError

MASS = 2.0
STIFFNESS = 800.0
DAMPING = 4.0
PERIOD = 0.5
FREQUENCY = 2 * np.pi / PERIOD


def oscillator(force=10.0, damping=DAMPING, wave=np.cos):
    """Return a mass on a spring under a harmonic force."""
    pull = fb.Spring("m", (0.0, 0.0), stiffness=STIFFNESS, damping=damping, rest_length=1.0)
    push = fb.Force("m", x=lambda t: force * wave(FREQUENCY * t))
    return fb.Mechanism(
        bodies={"m": fb.PointMass(mass=MASS, position=(1.0, 0.0))},
        joints={"rail": fb.Slot("m", (0.0, 0.0))},
        loads={"spring": pull, "force": push},
        sensors={"x": fb.Position("m"), "v": fb.Velocity("m")},
    )


def steady(motion, force):
    """Return the largest distance from the steady state, in parts of its amplitude."""
    amplitude = force / (STIFFNESS - MASS * FREQUENCY**2 + 1j * DAMPING * FREQUENCY)
    exact = np.real(amplitude[:, None] * np.exp(1j * FREQUENCY * motion.time.values))
    error = motion.sel(output="x_X").values - 1.0 - exact
    return float((np.abs(error).max(axis=1) / np.abs(amplitude)).max())


@pytest.mark.parametrize("integrator", [None, fb.GeneralizedAlpha(step_tolerance=1e-8)])
def test_an_oscillator_starts_on_its_steady_state(integrator):
    force = np.array([10.0, 5.0])
    errors = []
    for step in (2e-3, 1e-3):
        response = fb.dynamic_response(
            oscillator, duration=PERIOD, step=step, start="periodic", period=PERIOD,
            integrator=integrator,
        )  # fmt: skip
        motion = response(force=force)
        assert np.allclose(motion[..., 0], motion[..., -1], rtol=0, atol=1e-9)
        errors.append(steady(motion, force))
    assert errors[1] < 2e-5
    if integrator is None:
        assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)  # second order, as the steps


def test_undamped_motions_are_refused_with_their_spectral_radius():
    rho = np.exp(-0.05 * PERIOD / (2 * MASS))
    for damping, radius_text in ((0.0, "1,"), (0.05, f"{rho:.4g},")):
        with pytest.raises(
            AssemblyError, match=f"spectral radius of the motion .* is {radius_text}"
        ):
            fb.simulate(
                oscillator(damping=damping), duration=PERIOD, step=1e-3, start="periodic",
                period=PERIOD,
            )  # fmt: skip


def test_a_drive_that_does_not_repeat_itself_is_refused_by_name():
    def fading(phase):
        return np.cos(phase) * np.exp(-0.01 * phase)

    for period, wave in ((PERIOD, fading), (0.4, np.cos)):
        with pytest.raises(InputError, match=r"period of 0\.\d s; the function 'osc.*' does not"):
            fb.simulate(
                oscillator(wave=wave), duration=PERIOD, step=1e-3, start="periodic", period=period
            )


def driven_loop():
    """Return a crank with a damped flexible coupler and a rocker."""
    bar = {"height": 0.012, "width": 0.008, "density": 7800.0}
    coupler = fb.Beam(
        length=0.29, height=0.006, width=0.006, density=1140.0, youngs_modulus=3e9,
        poissons_ratio=0.39, retardation_time=2e-4, start=(0.05, 0.0), angle=0.222, elements=3,
    )  # fmt: skip
    return fb.Mechanism(
        bodies={
            "crank": fb.RigidBody.bar(length=0.05, **bar),
            "coupler": coupler,
            "rocker": fb.RigidBody.bar(length=0.09, start=(0.3, -0.02), angle=1.1965, **bar),
        },
        joints={
            "A": fb.Revolute("crank.start", (0.0, 0.0)),
            "B": fb.Revolute("coupler.start", "crank.end"),
            "C": fb.Revolute("coupler.end", "rocker.end"),
            "D": fb.Revolute("rocker.start", (0.3, -0.02)),
            "motor": fb.PrescribedRotation("crank", lambda t: 4 * np.pi * t),
        },
        loads={"gravity": fb.Gravity()},
        sensors={"rocker": fb.Angle("rocker"), "middle": fb.Deflection("coupler")},
    )


def test_a_mechanism_starts_where_its_vibrations_have_decayed():
    step = {"step": 1e-3, "duration": PERIOD}
    steady = fb.simulate(driven_loop(), start="periodic", period=PERIOD, **step)
    long = fb.simulate(driven_loop(), step=1e-3, duration=4 * PERIOD)
    last = long.values[:, -steady.sizes["time"] :]
    assert np.abs(steady[:, 0] - steady[:, -1]).max() < 1e-9
    assert np.abs(long.values[:, :501] - last).max() > 1e-4  # rings from the start
    assert np.abs(steady.values - last).max() < 1e-6


def hanging_beam(youngs_modulus=7e9):
    return fb.Mechanism(
        bodies={
            "b": fb.Beam(
                length=1.0, height=0.01, width=0.03, density=2700.0, poissons_ratio=0.3,
                youngs_modulus=youngs_modulus, elements=4,
            )
        },
        joints={"wall": fb.Weld("b.start", (0.0, 0.0))},
        loads={"gravity": fb.Gravity()},
        sensors={"tip": fb.Position("b.end"), "speed": fb.Velocity("b.end")},
    )  # fmt: skip


def test_a_beam_under_gravity_stays_where_it_is():
    response = fb.dynamic_response(hanging_beam, duration=0.2, step=1e-3, start="static")
    moduli = np.array([2e9, 7e9, 7e10])
    motion = response(youngs_modulus=moduli)
    rest = fb.equilibrium(hanging_beam(moduli))
    assert np.abs(motion.values - rest.values[..., None]).max() < 1e-9
    assert np.abs(rest.sel(output="tip_Y")).min() > 1e-3


def test_springs_and_given_velocities_keep_their_meaning():
    """A spring is relaxed as it was given, and the mass leaves its rest with its velocity."""
    body = fb.PointMass(mass=MASS, position=(0.0, 1.0), velocity=(0.0, 0.3))
    mass = fb.Mechanism(
        bodies={"m": body},
        joints={"rail": fb.Slot("m", (0.0, 0.0), axis=(0.0, 1.0))},
        loads={"gravity": fb.Gravity(), "spring": fb.Spring("m", (0.0, 0.0), STIFFNESS)},
        sensors={"y": fb.Position("m")},
    )
    motion = fb.simulate(mass, duration=0.1, step=1e-4, start="static").sel(output="y_Y")
    omega = np.sqrt(STIFFNESS / MASS)
    exact = 1.0 - MASS * 9.81 / STIFFNESS + 0.3 / omega * np.sin(omega * motion.time)
    assert np.abs(motion - exact).max() < 1e-6


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"start": "still"}, r"start must be .*'assembled', 'static' or 'periodic'"),
        ({"start": "periodic"}, r"requires a period \[s\]"),
        ({"period": 0.5}, r"is required by a period; got start='assembled' and period=0\.5"),
        ({"start": "periodic", "period": 0.0}, r"period \[s\] must be positive"),
        ({"start": "periodic", "period": 0.1005}, "whole multiple of step; got 0.1005"),
    ],
)
def test_refusals(options, message):
    with pytest.raises(InputError, match=message):
        fb.dynamic_response(oscillator, duration=0.1, step=1e-3, **options)
    with pytest.raises(InputError, match=message):
        fb.simulate(oscillator(), duration=0.1, step=1e-3, **options)


def test_an_unstable_rest_is_refused():
    pole = fb.Mechanism(
        bodies={"pole": fb.PointMass(mass=1.0, position=(0.0, 1.0))},
        joints={"rail": fb.Slot("pole", (0.0, 1.0))},
        loads={"spring": fb.Spring("pole", (0.0, 0.0), stiffness=10.0, rest_length=2.0)},
        sensors={"x": fb.Position("pole")},
    )
    with pytest.raises(AssemblyError, match="equilibrium to start from is not stable"):
        fb.simulate(pole, duration=0.1, step=1e-3, start="static")


def test_the_identity_of_a_response_includes_its_start():
    response = fb.dynamic_response(oscillator, duration=0.5, step=1e-3)
    static = fb.dynamic_response(oscillator, duration=0.5, step=1e-3, start="static")
    assert response.identity != static.identity
    assert len(response.identity) == 7  # as before there were other starts
