"""Extremes and integrals over all steps, against exact motions."""

import re

import numpy as np
import pytest

import flexband as fb
from flexband.sensors import Integral, Largest, Smallest
from tests.mechanics.engine.test_free_steps import STIFFNESS, G, bounces, integrator_of

W = 10.0


def oscillator(**sensors):
    """x = 1 + 0.1 sin 10 t."""
    return fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0, position=(1.0, 0.0), velocity=(1.0, 0.0))},
        joints={"guide": fb.Slot("m", (0.0, 0.0))},
        loads={"k": fb.Spring("m", (-1.0, 0.0), stiffness=W**2, rest_length=2.0)},
        sensors={"x": fb.Position("m"), **sensors},
    )


@pytest.mark.parametrize("options", [{"substeps": 40}, {"integrator": integrator_of(1e-9)}])
def test_extremes_and_integrals_of_a_vibration_between_the_times_of_the_result(options):
    place = fb.Position("m")
    model = oscillator(
        most=Largest(place), least=Smallest(place), late=Largest(place, (0.35, 0.4)),
        sum=Integral(place), part=Integral(fb.Velocity("m"), (0.05, 0.25)),
    )  # fmt: skip
    motion = fb.simulate(model, duration=0.8, step=0.2, **options)

    def values(name):
        return motion.sel(output=name).values

    np.testing.assert_allclose(values("most_X"), [1.0, 1.1, 1.1, 1.1, 1.1], atol=1e-4)
    np.testing.assert_allclose(values("least_X"), [1.0, 1.0, 0.924, 0.9, 0.9], atol=1e-3)
    assert np.isnan(values("late_X")[:2]).all()
    expected = 1 + 0.1 * np.sin(W * 0.35)
    np.testing.assert_allclose(values("late_X")[2:], expected, atol=2e-3)
    t = motion["time"].values
    np.testing.assert_allclose(values("sum_X"), t + 0.01 * (1 - np.cos(W * t)), atol=5e-5)
    displacement = 0.1 * (np.sin(W * np.clip(t, 0.05, 0.25)) - np.sin(W * 0.05))
    np.testing.assert_allclose(values("part_X"), displacement, atol=1e-4)
    assert str(motion.sel(output="sum_X")["unit"].values) == "m s"


def test_the_largest_penetration_and_the_impulse_of_an_impact_within_a_step():
    """A contact of a millisecond between times of the result that are 0.1 s apart."""
    model = fb.Mechanism(
        bodies={"ball": fb.PointMass(mass=1.0, position=(0.0, 0.1))},
        loads={"floor": fb.ForceLaw(["ball"], bounces, (STIFFNESS,), events=["floor"])},
        sensors={"low": Smallest(fb.Position("ball")),
                 "most": Largest(fb.Acceleration("ball")),
                 "turn": Integral(fb.Acceleration("ball"))},
    )  # fmt: skip
    integrator = integrator_of(1e-9, spectral_radius=0.9)
    motion = fb.simulate(model, duration=0.2, step=0.2, integrator=integrator)
    speed = np.sqrt(0.2 * G)
    w = np.sqrt(STIFFNESS)
    depth = G / w**2 + np.hypot(G / w**2, speed / w)
    lowest, largest, turn = motion.sel(output=["low_Y", "most_Y", "turn_Y"]).values[:, -1]
    assert lowest == pytest.approx(-depth, rel=1e-3)
    assert largest == pytest.approx(w**2 * depth - G, rel=1e-3)
    contact = 2 * (np.pi - np.arctan(speed * w / G)) / w
    final_speed = speed - G * (0.2 - speed / G - contact)
    assert turn == pytest.approx(final_speed, rel=1e-3)


@pytest.mark.parametrize(
    ("sensor", "options", "message"),
    [
        (Largest(fb.Position("m")), {}, "Largest sensor must be one of the state itself; got Lar"),
        ("x", {}, "Largest sensor must be a Sensor"),
        (fb.Position("m"), {"window": (0.2, 0.1)}, "must be two increasing times from 0 on"),
        (fb.Position("m"), {"window": (-0.2, 0.1)}, "must be two increasing times from 0 on"),
        (fb.Position("m"), {"window": 0.3}, "Largest window [s] must be 2 numbers"),
    ],
)
def test_bad_extremes_are_refused_by_name(sensor, options, message):
    with pytest.raises(fb.errors.InputError, match=re.escape(message)):
        Largest(sensor, **options)
