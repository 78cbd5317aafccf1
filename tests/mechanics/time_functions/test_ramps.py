"""Ramps rise smoothly, and their integrals are exact."""

import numpy as np
import pytest
from scipy.integrate import quad

import flexband as fb

TO = np.array([2.0, -3.0])
DURATION = np.array([0.5, 0.8])
ramp = fb.ramp(TO, DURATION)


def test_ends():
    assert np.array_equal(ramp(-1.0), [0, 0])
    assert np.array_equal(ramp(0.0), [0, 0])
    assert np.array_equal(ramp(0.8), TO)
    assert np.allclose(ramp(DURATION / 2), TO / 2, atol=1e-15)


def test_integral():
    for t in (-0.1, 0.0, 0.3, 0.5, 0.7, 2.0):
        exact = [quad(lambda s, k=k: ramp(s)[k], 0, t, points=[0.5, 0.8])[0] for k in (0, 1)]
        assert ramp.integral(t) == pytest.approx(exact, abs=1e-12)
    assert ramp.integral(2.0) == pytest.approx(TO * (2.0 - DURATION / 2), abs=1e-15)


@pytest.mark.parametrize(("function", "order"), [(ramp, 2), (ramp.integral, 3)])
def test_derivatives_are_continuous_up_to_an_order(function, order):
    """A derivative that jumps leaves a difference of its order that falls with that power alone."""
    for end in (0.0, 0.5):
        h = 0.01 / 2.0 ** np.arange(3)
        times = end + h[:, None] * (np.arange(order + 2) - (order + 1) / 2)
        differences = np.diff(function(times[..., None])[..., 0], order + 1, axis=1)[:, 0]
        falls = np.log2(np.abs(differences[:-1] / differences[1:]))
        assert np.all(falls > order + 0.8)


def test_a_run_sees_no_kink_and_every_sample_has_its_speed():
    crank = fb.Mechanism(
        bodies={"crank": fb.RigidBody(mass=1.0, inertia=2.0)},
        joints={
            "pin": fb.Revolute("crank", (0.0, 0.0)),
            "motor": fb.PrescribedRotation("crank", ramp.integral),
        },
        sensors={"rate": fb.AngularVelocity("crank"), "moment": fb.ReactionMoment("motor")},
    )
    motion = fb.simulate(crank, duration=1.0, step=0.01)
    t = motion.time.values[:, None]
    assert "impulses" not in motion.attrs
    assert np.allclose(motion.sel(output="rate").values.T, ramp(t), atol=1e-5)
    s = np.clip(t / DURATION, 0, 1)
    torque = 2.0 * TO * 30 * s**2 * (1 - s) ** 2 / DURATION  # J ω̇
    assert np.allclose(motion.sel(output="moment").values.T, torque, atol=5e-3)


@pytest.mark.parametrize("changes", [{"duration": 0.0}, {"duration": -1.0}, {"to": np.nan}])
def test_refusals(changes):
    with pytest.raises(fb.errors.InputError, match=f"ramp {next(iter(changes))}"):
        fb.ramp(**{"to": 1.0, "duration": 1.0} | changes)


def test_a_ramp_is_a_load():
    """A mass under a force that rises to F within d moves with F (t − d/2)/m at last."""
    force = fb.ramp(np.array([0.5, 2.0]), 0.5)
    mass = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=2.0)},
        loads={"f": fb.Force("m", force, 0.0)},
        sensors={"v": fb.Velocity("m")},
    )
    motion = fb.simulate(mass, duration=1.0, step=0.01)
    np.testing.assert_allclose(motion.sel(output="v_X")[:, -1], force.to * 0.75 / 2.0, rtol=1e-4)
