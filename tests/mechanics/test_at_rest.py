"""Frequencies and equilibria as responses, with their bands, against closed forms."""

import re

import numpy as np
import pytest
from scipy.optimize import brentq

import flexband as fb

STRIP = {"height": 0.02, "width": 0.02, "density": 2700.0, "youngs_modulus": 70e9}


def cantilever(length):
    return fb.Mechanism(
        bodies={"b": fb.Beam(length=length, poissons_ratio=0.3, elements=6, **STRIP)},
        joints={"clamp": fb.Weld("b.start", (0.0, 0.0))},
    )


def two_oscillators(first, coupling=None):
    """Two masses of 2 kg on springs, each along a line of its own."""
    loads = {
        "a": fb.Spring("a", (-1.0, 0.0), first, 1.0),
        "b": fb.Spring("b", (-1.0, 1.0), 95.0, 1.0),
    }
    if coupling is not None:
        loads["c"] = fb.Spring("a", "b", coupling, 1.0)
    return fb.Mechanism(
        bodies={"a": fb.PointMass(mass=2.0), "b": fb.PointMass(mass=2.0, position=(0.0, 1.0))},
        joints={"along": fb.Slot("a", (0.0, 0.0)), "other": fb.Slot("b", (0.0, 1.0))},
        loads=loads,
    )


def test_bands_of_a_cantilevers_frequencies():
    """f = β²/2π √(EI/ρA) / L², less a part of Timoshenko's."""
    inputs = {"length": fb.Interval(0.9, 1.1)}
    response = fb.modal_response(cantilever, 2, nominal={"length": 1.0}, about="start")
    bands = fb.propagate(response, inputs, fb.PCCI(1, 4))
    beta = [brentq(lambda b: np.cos(b) * np.cosh(b) + 1, *r) for r in ((1.5, 2.5), (4, 5.5))]
    length = np.array([1.1, 0.9])
    for k, b in enumerate(beta):
        exact = b**2 / (2 * np.pi) * np.sqrt(70e9 * 0.02**2 / 12 / 2700) / length**2
        loss = 0.5 * b**2 * 0.02**2 / 12 / length**2 * (1 + 3.12)
        np.testing.assert_allclose(bands["mean"][:, k], exact * (1 - loss), rtol=4e-3)
    assert bands["mean"].attrs["units"] == "Hz"
    assert bands["mean_at"].values[0, :, 0].tolist() == [1.1, 0.9]
    refined_response = response.refinements(length=np.ones(1))["elements"]
    unit_length = np.array([1.0])
    np.testing.assert_allclose(
        refined_response(length=unit_length), response(length=unit_length), rtol=2e-3
    )
    assert response.description(length=unit_length).discretization == {"elements of b": 6}


def test_modes_keep_their_numbers_where_frequencies_cross():
    response = fb.modal_response(two_oscillators, 2, nominal={"first": 100.0})
    first = np.array([60.0, 94.0, 95.0, 96.0, 140.0])
    frequencies = response(first=first)
    exact = np.sqrt(np.stack([np.full(5, 95.0), first], axis=1) / 2) / (2 * np.pi)
    np.testing.assert_allclose(frequencies, exact, rtol=1e-9)
    bands = fb.propagate(response, {"first": fb.Interval(60.0, 140.0)}, fb.PCCI(1, 5))
    np.testing.assert_allclose(bands["mean"].values, exact[[0, 4]], rtol=1e-4)


def test_a_mode_whose_shape_changes_is_followed_in_steps():
    """Strongly coupled, frequencies do not cross; the shapes turn by more than 45°."""
    nominal = {"first": 300.0, "coupling": 0.0}

    def exact(first, coupling):
        K = np.array([[first + coupling, -coupling], [-coupling, 95.0 + coupling]])
        return np.sqrt(np.linalg.eigvalsh(K) / 2) / (2 * np.pi)

    def coupled_masses(first, coupling):
        masses = fb.PointMass(mass=2.0), fb.PointMass(mass=2.0, position=(1.0, 0.0))
        return fb.Mechanism(
            bodies=dict(zip("ab", masses, strict=True)),
            joints={"along": fb.Slot("a", (0.0, 0.0)), "other": fb.Slot("b", (1.0, 0.0))},
            loads={
                "a": fb.Spring("a", (-1.0, 0.0), first, 1.0),
                "b": fb.Spring("b", (2.0, 0.0), 95.0, 1.0),
                "c": fb.Spring("a", "b", coupling, 1.0),
            },
        )

    response = fb.modal_response(coupled_masses, 2, nominal=nominal)
    frequencies = response(first=np.array([300.0, 110.0]), coupling=np.array([50.0, 400.0]))
    np.testing.assert_allclose(frequencies, [exact(300.0, 50.0), exact(110.0, 400.0)], rtol=1e-8)


def hanging_mass(stiffness, mass):
    return fb.Mechanism(
        bodies={"m": fb.PointMass(mass=mass, position=(0.0, -1.0))},
        loads={"s": fb.Spring("m", (0.0, 0.0), stiffness, 1.0), "g": fb.Gravity()},
        sensors={"m": fb.Position("m"), "force": fb.SpringForce("s")},
    )


def test_bands_of_an_equilibrium():
    inputs = {"stiffness": fb.Interval(80.0, 120.0), "mass": fb.Normal(1.5, 0.05)}
    bands = fb.propagate(fb.static_response(hanging_mass), inputs, fb.PCCI(1, 6))
    elongation = 9.81 * 1.5 / np.array([80.0, 120.0])
    np.testing.assert_allclose(bands["mean"].sel(output="m_Y"), -1 - elongation, rtol=1e-6)
    upper = -1 - 9.81 * 1.45 / 120
    np.testing.assert_allclose(bands["error_bar"].sel(output="m_Y")[1], upper, rtol=1e-6)
    np.testing.assert_allclose(bands["mean"].sel(output="force_F"), 9.81 * 1.5, rtol=1e-6)


def test_components_of_a_sensor_at_rest_are_judged_together():
    """That of a mass below its spring which is zero in theory is rounding, which has no terms."""
    inputs = {"stiffness": fb.Interval(80.0, 120.0), "mass": fb.Normal(1.5, 0.05)}
    response = fb.static_response(hanging_mass)
    values = {"stiffness": 100.0, "mass": 1.5}
    assert response.description(**values).quantities == ["m [m]", "m [m]", "force [N]", "force [m]"]
    assert response.description(**values).tensors == []
    bands = fb.propagate(response, inputs, fb.AdaptivePCCI())
    assert bands["trusted"].dims == ("output",)
    assert bands["trusted"].all()
    assert bands.attrs["expected_error"] < 0.01


def test_a_pendulum_against_a_spring():
    """A rod turned by φ: m g l sin φ = k (φ₀ − φ)."""

    def model(moment):
        rod = fb.RigidBody(mass=1.0, inertia=0.1, points={"o": (0.0, 0.5)}, angle=0.3)
        return fb.Mechanism(
            bodies={"r": rod},
            joints={"pin": fb.Revolute("r.o", (0.0, 0.0))},
            loads={"g": fb.Gravity(), "m": fb.Moment("r", moment)},
            sensors={"r": fb.Angle("r")},
        )

    inputs = {"moment": fb.Interval(0.5, 1.5)}
    bands = fb.propagate(fb.static_response(model), inputs, fb.PCCI(1, 6))
    exact = np.arcsin(np.array([0.5, 1.5]) / (9.81 * 0.5))
    np.testing.assert_allclose(bands["mean"][:, 0], exact, rtol=1e-5)


def test_what_is_not_stable_or_not_unique_is_refused():
    def inverted_pendulum(mass):
        return fb.Mechanism(
            bodies={"m": fb.PointMass(mass=mass, position=(0.0, 1.0))},
            joints={"rod": fb.Distance("m", (0.0, 0.0), 1.0), "along": fb.Slot("m", (0.0, 0.0))},
            sensors={"m": fb.Position("m")},
        )

    with pytest.raises((fb.errors.InputError, fb.errors.AssemblyError)):
        fb.static_response(inverted_pendulum)(mass=np.ones(1))
    equal_response = fb.modal_response(two_oscillators, 2, nominal={"first": 95.0})
    with pytest.raises(
        fb.errors.InputError, match="modes 1 and 2 are the same at the nominal values"
    ):
        equal_response(first=np.array([100.0]))
    excess_response = fb.modal_response(two_oscillators, 3, nominal={"first": 100.0})
    with pytest.raises(fb.errors.InputError, match="modes must be 2 or less"):
        excess_response(first=np.array([100.0]))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: fb.modal_response(1, 1, nominal={}), "builder must be a function"),
        (lambda: fb.modal_response(hanging_mass, 0, nominal={}), "modes must be 1 or more"),
        (lambda: fb.modal_response(hanging_mass, 1, nominal=3), "nominal must be a mapping"),
        (lambda: fb.modal_response(hanging_mass, 1, nominal={"mass": "x"}), "nominal mass must be"),
        (lambda: fb.modal_response(hanging_mass, 1, nominal={}, about="x"), "about must be"),
        (
            lambda: fb.modal_response(hanging_mass, 1, nominal={})(mass=1.0, stiffness=1.0),
            "nominal must name",
        ),
        (lambda: fb.static_response(hanging_mass, time=1e12), "time [s] must be at most"),
        (lambda: fb.static_response(lambda a: 3)(a=1.0), "must return a Mechanism; got 3"),
    ],
)
def test_refused(make, message):
    with pytest.raises(fb.errors.InputError, match=re.escape(message)):
        make()
