"""The cable element: derivatives, exact statics, frequencies, damping and arcs."""

import numpy as np
import pytest
from scipy.optimize import brentq

import flexband as fb
from tests.mechanics.models import THIN, Dense, clamped_member


def test_tangent_is_the_derivative_of_the_residual():
    cable = fb.Cable(length=0.7, elements=2, curvature=0.8, **(THIN | {"axial_stiffness": 50.0}))
    dense = Dense(fb.Mechanism(bodies={"c": cable}))
    q = dense.start + 0.1 * np.random.default_rng(0).standard_normal(len(dense.start))
    step = 1e-5
    exact = np.stack(
        [
            (dense.residual(q + step * e) - dense.residual(q - step * e)) / (2 * step)
            for e in np.eye(len(q))
        ],
        axis=1,
    )
    tangent = dense.tangent(q) - dense.tangent(q, 0.0)
    np.testing.assert_allclose(tangent, exact, atol=1e-7 * np.abs(exact).max())


def test_forces_are_the_derivative_of_the_energy():
    """Against the energy of the assumed strains by a fine rule, differentiated numerically."""
    cable = fb.Cable(length=0.7, elements=1, **(THIN | {"axial_stiffness": 50.0}))
    dense = Dense(fb.Mechanism(bodies={"c": cable}))
    q = dense.start + 0.02 * np.random.default_rng(1).standard_normal(8)
    x, weights = np.polynomial.legendre.leggauss(40)
    s = (x + 1) / 2

    # Slope and curvature of the Hermite cubics.
    def line(q, s):
        slope = np.stack(
            [6 * s**2 - 6 * s, 1 - 4 * s + 3 * s**2, 6 * s - 6 * s**2, 3 * s**2 - 2 * s]
        )
        curve = np.stack([12 * s - 6, 6 * s - 4, 6 - 12 * s, 6 * s - 2])
        nodes = q.reshape(4, 2) * np.array([[1.0], [0.7], [1.0], [0.7]])
        p = slope.T @ nodes / 0.7
        w = curve.T @ nodes / 0.49
        return p, (p[:, 0] * w[:, 1] - p[:, 1] * w[:, 0]) / (p**2).sum(axis=1)

    # Stretch is assumed quadratic along the element, the curvature linear.
    def energy(q):
        p, _ = line(q, np.array([0.0, 0.5, 1.0]))
        stretch = np.polynomial.Polynomial.fit([0, 0.5, 1], np.hypot(*p.T) - 1, 2)(s)
        at = 0.5 + np.array([-1, 1]) / np.sqrt(12)
        angle = np.arctan2(p[:, 1], p[:, 0])
        kappa = line(q, at)[1]
        bend = (angle[2] - angle[0]) / 0.7 + np.diff(kappa) * (s - 0.5) * np.sqrt(3)
        return 0.35 * weights @ (25.0 * stretch**2 + 1.5 * bend**2)

    step = 1e-6
    exact = [(energy(q + step * e) - energy(q - step * e)) / (2 * step) for e in np.eye(8)]
    np.testing.assert_allclose(dense.residual(q), exact, atol=2e-5)


@pytest.mark.parametrize("turns", [0.25, 1.0])
def test_an_end_moment_rolls_a_straight_cable_to_an_arc(turns):
    bend = 2 * np.pi * turns / 2.0
    cable = fb.Cable(length=2.0, elements=24, **THIN)
    tip = fb.equilibrium(clamped_member(cable, {"M": fb.Moment("m.end", 3.0 * bend)}), steps=8)
    exact = [np.sin(2 * bend) / bend, (1 - np.cos(2 * bend)) / bend]
    np.testing.assert_allclose(tip[:2], exact, atol=2e-3)
    assert np.cos(float(tip[2]) - 2 * bend) == pytest.approx(1.0, abs=1e-5)


def test_an_arc_is_free_of_stress_and_a_moment_unrolls_it():
    curvature = np.array([0.5, -1.2])
    cable = fb.Cable(length=2.0, elements=24, curvature=curvature, **THIN)
    rest = fb.equilibrium(clamped_member(cable, {}))
    exact = np.stack([np.sin(2 * curvature), 1 - np.cos(2 * curvature)]) / curvature
    np.testing.assert_allclose(rest[:, :2], exact.T, atol=1e-9)
    np.testing.assert_allclose(rest[:, 2], 2 * curvature, atol=1e-9)
    straight = fb.equilibrium(
        clamped_member(cable, {"M": fb.Moment("m.end", -3.0 * curvature)}), steps=4
    )
    np.testing.assert_allclose(straight[:, :2], [[2.0, 0.0]] * 2, atol=1e-3)


def test_a_very_thin_cantilever_does_not_lock():
    """L/h = 1000: the elastica to 1e-3 with 16 elements, where the shear-deformable beam is off."""
    length = 1.0
    height = 1e-3
    area = 1e-2 * height
    second = 1e-2 * height**3 / 12
    cable = fb.Cable(
        length=length, elements=16, mass_per_length=7800 * area,
        axial_stiffness=2e11 * area, bending_stiffness=2e11 * second,
    )  # fmt: skip
    force = {"P": fb.Force("m.end", y=10 * 2e11 * second)}
    x, y, angle = fb.equilibrium(clamped_member(cable, force), steps=8).values
    exact = (0.5549955978, 0.8106090249, 1.4302855388)
    np.testing.assert_allclose((1 - x, y, angle), exact, atol=1e-3)


def test_cantilever_frequencies():
    cable = fb.Cable(length=1.0, elements=16, **THIN)
    model = fb.Mechanism(bodies={"c": cable}, joints={"clamp": fb.Weld("c.start", (0.0, 0.0))})
    frequencies = fb.modes(model, 2, about="start")["frequency"]
    for k, bracket in enumerate(((1.5, 2.5), (4.0, 5.5))):
        b = brentq(lambda b: np.cos(b) * np.cosh(b) + 1, *bracket)
        assert float(frequencies[k]) == pytest.approx(
            b**2 / (2 * np.pi) * np.sqrt(3.0 / 0.2), rel=1e-4
        )


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"axial_stiffness": 0.0}, "Cable axial_stiffness .* must be positive"),
        ({"bending_stiffness": -1.0}, "Cable bending_stiffness"),
        ({"curvature": np.nan}, "Cable curvature"),
        ({"elements": 0}, "Cable elements must be 1 or more"),
    ],
)
def test_bad_numbers_are_refused(change, text):
    with pytest.raises(fb.errors.InputError, match=text):
        fb.Cable(**({"length": 1.0, "elements": 2} | THIN | change))


def test_a_damped_cable_decays_as_its_retardation_tells():
    """Bending of a clamped cable: decay ratio e^(−2πζ/√(1−ζ²)) a period with ζ = τω/2."""
    cable = fb.Cable(length=1.0, elements=8, **THIN)
    omega = 2 * np.pi * float(fb.modes(clamped_member(cable, {}), 1, about="start")["frequency"][0])
    ratio = 0.03
    damped_cable = fb.Cable(length=1.0, elements=8, retardation_time=2 * ratio / omega, **THIN)
    period = 2 * np.pi / omega
    mechanism = clamped_member(
        damped_cable, {"P": fb.Force("m.end", y=lambda t: 1e-4 * (t < period / 200))}
    )
    motion = fb.simulate(
        mechanism, duration=8 * period, step=period / 200,
        integrator=fb.GeneralizedAlpha(spectral_radius=0.9),
    ).sel(output="tip_Y").values  # fmt: skip
    swings = np.array([np.abs(motion[400 * k : 400 * (k + 1)]).max() for k in range(1, 4)])
    exact = np.exp(-2 * 2 * np.pi * ratio / np.sqrt(1 - ratio**2))
    np.testing.assert_allclose(swings[1:] / swings[:-1], exact, rtol=0.02)
