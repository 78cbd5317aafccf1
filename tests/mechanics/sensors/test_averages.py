"""Averages over fixed and moving windows, against exact means of sines and parabolas."""

import re
from dataclasses import replace

import numpy as np
import pytest

import flexband as fb
from tests.mechanics.engine.test_free_steps import integrator_of
from tests.mechanics.sensors.test_extremes import W, oscillator

PLACE = fb.Position("m")
Average = fb.sensors.Average


def exact(first, last):
    """Return the mean of 1 + 0.1 sin 10 t."""
    return 1 - 0.01 * (np.cos(W * last) - np.cos(W * first)) / (last - first)


@pytest.mark.parametrize(
    ("options", "atol"), [({"substeps": 40}, 5e-5), ({"integrator": integrator_of(1e-9)}, 3e-6)]
)
def test_the_means_of_a_vibration_between_the_times_of_the_result(options, atol):
    model = oscillator(
        moving=Average(PLACE, 0.3), fixed=Average(PLACE, (0.17, 0.53)), whole=Average(PLACE, 1.2)
    )
    motion = fb.simulate(model, duration=1.2, step=0.1, **options)
    t = motion["time"].values[1:]

    def values(name):
        return motion.sel(output=name).values

    assert values("moving_X")[0] == values("x_X")[0] == 1.0
    np.testing.assert_allclose(values("moving_X")[1:], exact(np.maximum(t - 0.3, 0), t), atol=atol)
    np.testing.assert_allclose(values("whole_X")[1:], exact(0.0, t), atol=atol)
    np.testing.assert_allclose(values("fixed_X"), exact(0.17, 0.53), atol=atol)
    assert str(motion.sel(output="moving_X")["unit"].values) == "m"


def test_the_mean_converges_with_order_two():
    errors = []
    for substeps in (4, 8, 16):
        model = oscillator(mean=Average(PLACE, 0.2))
        motion = fb.simulate(model, duration=1.0, step=0.1, substeps=substeps)
        errors.append(abs(motion.sel(output="mean_X").values[-1] - exact(0.8, 1.0)))
    assert 3.5 < errors[0] / errors[1] < 4.6
    assert 3.5 < errors[1] / errors[2] < 4.6


@pytest.mark.parametrize("masses", [1.0, np.array([1.0, 2.0, 4.0])])
def test_the_mean_of_a_force_that_jumps_within_a_step(masses):
    """A force of 2 N from 0.033 s on: mean accelerations are changes of speed."""
    pulse = fb.Force("m", x=lambda t: np.where(t < 0.033, 0.0, 2.0))
    model = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=masses, position=(0.0, 0.0))},
        loads={"pulse": pulse},
        sensors={
            "a": Average(fb.Acceleration("m"), 0.02),
            "b": Average(fb.Acceleration("m"), (0.03, 0.06)),
        },
    )
    motion = fb.simulate(model, duration=0.1, step=0.01)
    t = motion["time"].values[1:]
    speed = np.maximum(t - 0.033, 0.0)
    before = np.maximum(np.maximum(t - 0.02, 0.0) - 0.033, 0.0)
    mean = (speed - before) / np.minimum(t, 0.02)
    forces = 2.0 / np.atleast_1d(masses)
    means = np.atleast_2d(motion.sel(output="a_X").values)
    np.testing.assert_allclose(means[:, 1:], forces[:, None] * mean, atol=2e-4)
    window_means = np.atleast_2d(motion.sel(output="b_X").values)
    np.testing.assert_allclose(window_means, np.tile(forces[:, None] * 0.9, 11), atol=2e-4)


def test_the_mean_of_a_reaction_is_that_of_a_turning_force():
    """A bar that turns at ω: its pin bears m g, and m ω² l/2 along the bar."""
    speed = 20.0
    mass = 3.0
    length = 0.4
    model = fb.Mechanism(
        bodies={
            "bar": fb.RigidBody(
                mass=mass,
                inertia=0.04,
                position=(length / 2, 0.0),
                points={"O": (-length / 2, 0.0)},
            )
        },
        joints={
            "pin": fb.Revolute("bar.O", (0.0, 0.0)),
            "drive": fb.PrescribedRotation("bar", lambda t: speed * t),
        },
        loads={"gravity": fb.Gravity()},
        sensors={
            "F": Average(fb.Reaction("pin"), 0.06),
            "whole": Average(fb.Reaction("pin"), (0.05, 0.2)),
            "most": fb.sensors.Largest(fb.Reaction("pin")),
        },
    )
    motion = fb.simulate(model, duration=0.3, step=0.01, substeps=50)
    t = motion["time"].values[1:]
    first = np.maximum(t - 0.06, 0.0)
    size = mass * speed**2 * length / 2

    def mean(first, last):
        angles = speed * first, speed * last
        turn = angles[1] - angles[0]
        along_x = -size * (np.sin(angles[1]) - np.sin(angles[0])) / turn
        return along_x, mass * 9.81 + size * (np.cos(angles[1]) - np.cos(angles[0])) / turn

    for name, expected in (("F", mean(first, t)), ("whole", mean(0.05, 0.2))):
        for axis, values in zip("XY", expected, strict=True):
            means = motion.sel(output=f"{name}_{axis}").values[1:]
            np.testing.assert_allclose(means, np.broadcast_to(values, t.shape), atol=1e-4 * size)
    largest = motion.sel(output="most_Y").values[-1]
    assert largest == pytest.approx(mass * 9.81 + size, rel=1e-4)
    in_body = {"F": Average(fb.Reaction("pin", axes="body"), 0.1)}
    with pytest.raises(fb.errors.InputError, match="an Average cannot follow this Reaction"):
        replace(model, sensors=in_body)


def test_the_band_of_an_averaged_output_is_that_of_the_average():
    def moving_mass(speed):
        mechanism = fb.Mechanism(
            bodies={"m": fb.PointMass(mass=1.0, velocity=(speed, 0.0))},
            sensors={
                "mean": Average(fb.Position("m"), (0.1, 0.3)),
                "last": Average(fb.Position("m"), 0.1),
            },
        )
        return mechanism

    response = fb.dynamic_response(moving_mass, duration=0.4, step=0.05)
    bands = fb.propagate(response, {"speed": fb.Interval(1.0, 3.0)}, fb.PCCI(0, 2))
    np.testing.assert_allclose(
        bands["mean"].sel(output="mean_X"), [[0.2] * 9, [0.6] * 9], rtol=1e-9
    )
    np.testing.assert_allclose(
        bands["mean"].sel(output="last_X").values[1, 2:],
        3 * (np.arange(2, 9) * 0.05 - 0.05),
        rtol=1e-9,
    )


@pytest.mark.parametrize(
    ("window", "message"),
    [
        (0.0, "Average window [s] must be above 0; got 0"),
        (-0.1, "Average window [s] must be above 0; got -0.1"),
        ((0.2, 0.1), "must be two increasing times from 0 on"),
        ((0.2, 0.1, 0.3), "Average window [s] must be 2 numbers"),
        (np.nan, "Average window [s]"),
        ("x", "Average window [s]"),
        (None, "Average window [s]"),
    ],
)
def test_bad_windows_are_refused_by_name(window, message):
    with pytest.raises(fb.errors.InputError, match=re.escape(message)):
        Average(PLACE, window)


@pytest.mark.parametrize(
    ("sensor", "message"),
    [
        (Average(PLACE, 0.15), "sensor 'a': a moving window of an Average must be a whole number"),
        (Average(PLACE, 0.05), "must be a whole number of steps of the result, 0.1 s; got 0.05 s"),
        (Average(PLACE, (0.1, 1.5)), "must be within the run from 0 to 1 s; got 0.1 to 1.5 s"),
    ],
)
def test_windows_that_the_result_does_not_show_are_refused(sensor, message):
    with pytest.raises(fb.errors.InputError, match=re.escape(message)):
        fb.simulate(oscillator(a=sensor), duration=1.0, step=0.1, substeps=4)


def test_averages_are_refused_where_they_make_no_sense():
    with pytest.raises(
        fb.errors.InputError, match="Average sensor must be one of the state itself"
    ):
        Average(Average(PLACE, 0.1), 0.1)
