"""Pins, guides and followers with clearance against published and exact results."""

import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import flexband as fb
from flexband import contact

EXAMPLES = Path(__file__).parents[3] / "examples"


def integrator_of(tolerance, **options):
    return fb.GeneralizedAlpha(step_tolerance=tolerance, **options)


SPEED = 2 * np.pi * 5000 / 60


def worn_pin(clearance, law=None):
    """The slider–crank of Flores with clearance at the slider's pin, 5000 rpm, no gravity."""
    r = 0.05
    length = 0.12
    rate = -0.05 * SPEED / 0.12
    law = law or contact.LankaraniNikravesh(stiffness=6.61e10, restitution=0.9)
    rod = fb.RigidBody(
        mass=0.21, inertia=2.5e-5, position=(r + length / 2, 0.0), rate=rate,
        velocity=(0.0, r * SPEED / 2),
        points={"crank": (-length / 2, 0.0), "pin": (length / 2, 0.0)},
    )  # fmt: skip
    slider = fb.PointMass(mass=0.14, position=(r + length, 0.0))
    crank = fb.RigidBody(mass=1.0, inertia=1e-3, points={"end": (r, 0.0)}, rate=SPEED)
    acceleration = fb.sensors.Smallest(fb.Acceleration("slider"))
    late_acceleration = fb.sensors.Smallest(fb.Acceleration("slider"), window=(0.012, 1.0))
    return fb.Mechanism(
        bodies={"crank": crank, "rod": rod, "slider": slider},
        joints={
            "O": fb.Revolute("crank", (0.0, 0.0)),
            "A": fb.Revolute("rod.crank", "crank.end"),
            "motor": fb.PrescribedRotation("crank", lambda t: SPEED * np.asarray(t)),
            "guide": fb.Slot("slider", (0.0, 0.0)),
            "pin": fb.Revolute("rod.pin", "slider", clearance=clearance, law=law),
        },
        sensors={"c": contact.Contacts("pin"), "a": acceleration, "later": late_acceleration},
    )


def test_the_pin_of_flores_has_its_impacts():
    """The first two impacts within 0.1 %, the largest acceleration of the first within 1 %.

    The third is within 0.12 %: before it the pin is pressed into its hole, where the contact of
    Flores is damped by more than its restitution tells.
    """
    clearances = np.array([0.5e-3, 0.2e-3, 0.1e-3])
    literature = [[0.2273, 0.6254, 0.7349], [0.1436, 0.4360, 0.7713], [0.1015, 0.3328, 0.572]]
    motion = fb.simulate(
        worn_pin(clearances), duration=1e-3, step=1e-4, integrator=integrator_of(1e-8)
    ).isel(time=-1)
    instants = 1e3 * motion.sel(output=["c_t1", "c_t2", "c_t3"]).values
    np.testing.assert_allclose(instants[:, :2], np.array(literature)[:, :2], rtol=1e-3)
    np.testing.assert_allclose(instants[:, 2], np.array(literature)[:, 2], rtol=1.2e-3)
    first = fb.simulate(
        worn_pin(clearances), duration=4e-4, step=1e-5, integrator=integrator_of(1e-8)
    )
    for n, time in enumerate((4e-4, 3e-4, 2e-4)):
        largest = -first[n].sel(output="a_X").sel(time=time, method="nearest")
        assert float(largest) == pytest.approx((327_400, 201_600, 143_150)[n], rel=1e-2)


@pytest.mark.filterwarnings("ignore::flexband.errors.ResolutionWarning")
def test_a_small_clearance_has_its_impacts_at_the_start_of_three_turns():
    """Then the pin stays at its hole, and vibrates there with little damping."""
    coarse, fine = (
        fb.simulate(
            worn_pin(1e-4), duration=0.036, step=1.2e-3, integrator=integrator_of(tolerance)
        )
        for tolerance in (1e-7, 1e-9)
    )
    for motion in (coarse, fine):
        number = motion.sel(output="c_number").values
        assert 10 <= number[-1] <= 14
        assert number[2] == number[-1]
    accelerations = [-float(motion.sel(output="later_X")[-1]) for motion in (coarse, fine)]
    assert accelerations[0] == pytest.approx(accelerations[1], rel=6e-2)


def test_half_the_tolerance_changes_the_first_impacts_by_less_than_its_share():
    clearances = np.linspace(1e-4, 5e-4, 8)
    first, second = (
        fb.simulate(
            worn_pin(clearances), duration=6e-4, step=1e-4, integrator=integrator_of(tolerance)
        )
        .isel(time=-1)
        .sel(output=["c_t1", "c_t2"])
        for tolerance in (1e-7, 5e-8)
    )
    np.testing.assert_allclose(first, second, rtol=2e-4)


def slider(clearance, tolerance=1e-8):
    """Return where the slider is, after the first impact of all."""
    motion = fb.simulate(
        replace(worn_pin(clearance), sensors={"x": fb.Position("slider")}),
        duration=4e-4, step=1e-4, integrator=integrator_of(tolerance),
    )  # fmt: skip
    return motion.sel(output="x_X").values[..., -1]


def test_a_sample_with_clearance_does_not_depend_on_its_neighbours():
    clearances = np.linspace(1e-4, 3e-4, 11)
    batch = slider(clearances)
    order = np.random.default_rng(0).permutation(11)
    np.testing.assert_array_equal(slider(clearances[order]), batch[order])
    for k in (0, 10):
        assert slider(clearances[k]) == batch[k]
        np.testing.assert_array_equal(slider(np.full(8, clearances[k])), np.full(8, batch[k]))


def test_the_noise_of_a_clearance_is_within_the_tolerance():
    """A change of 1e-9 of it changes steps, and the result by less than its error."""
    places = slider(2e-4 * (1 + 1e-9 * np.arange(8)), 1e-7)
    error = abs(places[0] - slider(2e-4, 1e-9))
    assert 0 < np.ptp(places) < 0.1 * error
    assert error < 1e-6 * 0.17


def test_a_pin_rests_at_the_bottom_of_its_hole():
    """The depth is (mg/K)^(2/3); the mode along the contact has K_t = 1.5 K √δ, and across it the
    pin is a pendulum in the hole."""  # fmt: skip
    m = 2.0
    K = 1e9
    c = 1e-2
    depth = (m * 9.81 / K) ** (2 / 3)
    model = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=m, position=(0.0, -0.5 * c))},
        joints={"pin": fb.Revolute(
            "m", (0.0, 0.0), clearance=c,
            law=contact.KeepsRestitution(stiffness=K, restitution=0.5))},
        loads={"g": fb.Gravity()},
        sensors={"x": fb.Position("m"), "gap": contact.Gap("pin"),
                 "F": contact.ContactForce("pin"), "R": fb.Reaction("pin")},
    )  # fmt: skip
    rest = fb.equilibrium(model)
    assert float(rest.sel(output="gap")) == pytest.approx(-depth, rel=1e-9)
    assert float(rest.sel(output="F")) == pytest.approx(m * 9.81, rel=1e-9)
    assert float(rest.sel(output="R_Y")) == pytest.approx(m * 9.81, rel=1e-9)
    frequencies = fb.modes(model, count=2)["frequency"].values
    exact = np.sqrt([9.81 / (c + depth), 1.5 * K * np.sqrt(depth) / m]) / (2 * np.pi)
    np.testing.assert_allclose(frequencies, exact, rtol=1e-3)


def test_a_follower_lifts_off_at_the_speed_of_its_spring():
    """ω² = (F₀ + 2ke)/(me): the force at the top is F₀ + 2ke − meω²."""
    train = runpy.run_path(str(EXAMPLES / "valve_train.py"))
    exact = train["LIFT_OFF"]
    law = contact.KeepsRestitution(stiffness=1e9, exponent=1.0)
    model = train["valve_train"](exact * np.array([0.9985, 1.0015]), law)
    turn = 2 * np.pi / exact
    motion = fb.simulate(model, duration=turn, step=turn / 20, integrator=integrator_of(1e-9))
    number = motion.isel(time=-1).sel(output="landings_number").values
    assert number[0] == 0
    assert number[1] > 0
