"""Natural frequencies and mode shapes against closed forms."""

import numpy as np
import pytest
from scipy.optimize import brentq

import flexband as fb

STRIP = {"height": 0.02, "width": 0.02, "density": 2700.0, "youngs_modulus": 70e9}


def test_cantilever_frequencies_are_euler_bernoullis():
    """Clamped–free: cos β cosh β = −1; rotary inertia and shear lower them by parts of (h/L)²."""
    length = np.array([1.0, 1.2])
    model = fb.Mechanism(
        bodies={"b": fb.Beam(length=length, poissons_ratio=0.3, elements=48, **STRIP)},
        joints={"clamp": fb.Weld("b.start", (0.0, 0.0))},
        sensors={"tip": fb.Position("b.end"), "middle": fb.Position("b.middle")},
    )
    found = fb.modes(model, 3, about="start")
    beta = [
        brentq(lambda b: np.cos(b) * np.cosh(b) + 1, *r) for r in ((1.5, 2.5), (4, 5.5), (7, 8.5))
    ]
    for k, b in enumerate(beta):
        exact = b**2 / (2 * np.pi) * np.sqrt(70e9 * 0.02**2 / 12 / 2700) / length**2
        loss = 0.5 * b**2 * 0.02**2 / 12 / length**2 * (1 + 3.12)  # Timoshenko, about
        np.testing.assert_allclose(found["frequency"][:, k], exact * (1 - loss), rtol=2.5e-3)
    shape = found["shape"].sel(mode=0)
    ratio = float(shape.sel(output="middle_Y")[0] / shape.sel(output="tip_Y")[0])
    assert ratio == pytest.approx(0.33952, rel=2e-3)  # of the exact first mode
    modal_mass = 2700 * 0.02**2 * 1.0 / 4  # of a cantilever whose tip moves by one
    assert abs(float(shape.sel(output="tip_Y")[0])) == pytest.approx(modal_mass**-0.5, rel=2e-3)


def test_pendulum_and_inverted_pendulum():
    def model(angle):
        return fb.Mechanism(
            bodies={"m": fb.PointMass(mass=2.0, position=(np.cos(angle), np.sin(angle)))},
            joints={"rod": fb.Distance("m", (0.0, 0.0), 1.0)},
            loads={"gravity": fb.Gravity()},
            sensors={"m": fb.Position("m")},
        )

    exact = np.sqrt(9.81) / (2 * np.pi)
    down = fb.modes(model(-np.pi / 2), 5)
    np.testing.assert_allclose(down["frequency"], [exact], rtol=1e-9)
    np.testing.assert_allclose(np.abs(down["shape"][0]), [2.0**-0.5, 0.0], atol=1e-9)
    up = fb.modes(model(np.pi / 2), 5, about="start")
    np.testing.assert_allclose(up["frequency"], [-exact], rtol=1e-9)


def test_free_beam_has_three_free_motions():
    body = fb.Beam(length=1.0, poissons_ratio=0.0, elements=32, **STRIP)
    model = fb.Mechanism(bodies={"b": body}, sensors={"b": fb.Position("b.start")})
    frequency = fb.modes(model, 4, about="start")["frequency"].values
    beta = brentq(lambda b: np.cos(b) * np.cosh(b) - 1, 4, 5.5)
    exact = beta**2 / (2 * np.pi) * np.sqrt(70e9 * 0.02**2 / 12 / 2700)
    assert np.abs(frequency[:3]).max() < 1e-3 * frequency[3]
    assert frequency[3] == pytest.approx(exact, rel=5e-3)


def test_bad_requests_are_refused():
    model = fb.Mechanism(bodies={"m": fb.PointMass(mass=1.0)})
    with pytest.raises(fb.InputError, match="count must be 1 or more; got 0"):
        fb.modes(model, 0)
    with pytest.raises(fb.InputError, match="about must be 'start' or 'equilibrium'; got 'rest'"):
        fb.modes(model, 1, about="rest")  # type: ignore[arg-type]
