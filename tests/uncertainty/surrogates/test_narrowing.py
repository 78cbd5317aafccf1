"""Surrogates of narrower inputs against studies of these inputs."""

import numpy as np
import pytest
import scipy.stats as ss

import flexband as fb

T = np.linspace(0, 1, 50)
INPUTS = {
    "a": fb.Normal(1.0, 0.1),
    "b": fb.Uniform(0.5, 1.5),
    "e": fb.Interval(1.0, 2.0),
    "f": fb.Interval(-1.0, 1.0),
}


def response(a, b, e, f):
    return a[:, None] * T + (b * e * a)[:, None] * np.sin(3 * T) + (f**2 + f)[:, None] * T**2


@pytest.fixture(scope="module")
def surrogate():
    return fb.expand(response, INPUTS, fb.AdaptivePCCI(1e-3))


@pytest.mark.parametrize(
    "changes",
    [
        {"e": fb.Interval(1.5, 1.7)},
        {"e": 1.25, "f": fb.Interval(0.2, 0.9)},
        {"a": fb.Normal(1.05, 0.05), "f": -0.5},
        {"b": fb.Uniform(0.8, 1.2)},
        {"b": fb.Normal(1.1, 0.06)},
        {"a": fb.Uniform(0.9, 1.2)},
        {"a": fb.Normal(1.0, 0.1), "b": 1.3},
        {"a": 1.0, "b": 1.0, "e": 1.5},
    ],
)
def test_a_polynomial_is_the_same_as_in_a_study_of_its_own(surrogate, changes):
    bands = surrogate.narrowed(**changes).bands()
    expected = fb.propagate(response, INPUTS | changes, fb.PCCI(4, 2))
    for name in ("mean", "error_bar"):
        np.testing.assert_allclose(bands[name], expected[name], rtol=1e-12, atol=1e-12)
    assert bands.attrs["expected_error"] < 1e-12
    assert bands.attrs["inputs"] == expected.attrs["inputs"]


def test_twice_narrowed_is_once_narrowed(surrogate):
    first = surrogate.narrowed(e=fb.Interval(1.2, 1.8), a=fb.Normal(1.0, 0.08))
    twice = first.narrowed(e=fb.Interval(1.5, 1.7), a=fb.Normal(1.02, 0.05))
    direct = surrogate.narrowed(e=fb.Interval(1.5, 1.7), a=fb.Normal(1.02, 0.05))
    np.testing.assert_allclose(twice.bands()["error_bar"], direct.bands()["error_bar"], rtol=1e-12)


def test_parameters_and_fields():
    def bent(modulus, field, force):
        return (force * modulus)[:, None] * field(T)

    field = fb.RandomField(2.0, 0.2, 0.5, domain=(0.0, 1.0), terms=3)
    inputs = {
        "modulus": fb.Normal(fb.Interval(4.8, 5.2), 0.3),
        "field": field,
        "force": fb.Interval(1.0, 2.0),
    }
    surrogate = fb.expand(bent, inputs, fb.PCCI(2, 2))
    narrower = fb.RandomField(2.0, 0.1, 0.5, terms=3)
    part = surrogate.narrowed(**{"modulus.mean": fb.Interval(4.9, 5.0)}, field=narrower)
    inputs["modulus"] = fb.Normal(fb.Interval(4.9, 5.0), 0.3)
    inputs["field"] = fb.RandomField(2.0, 0.1, 0.5, domain=(0.0, 1.0), terms=3)
    expected = fb.propagate(bent, inputs, fb.PCCI(2, 2))
    np.testing.assert_allclose(part.bands()["error_bar"], expected["error_bar"], rtol=1e-10)
    at = surrogate.narrowed(**{"modulus.mean": 5.0}).bands()
    inputs |= {"modulus": fb.Normal(5.0, 0.3), "field": field}
    expected = fb.propagate(bent, inputs, fb.PCCI(2, 2))
    np.testing.assert_allclose(at["error_bar"], expected["error_bar"], rtol=1e-10)
    with pytest.raises(fb.errors.InputError, match=r"narrowed by its parameters .* modulus\.mean"):
        surrogate.narrowed(modulus=fb.Normal(5.0, 0.1))
    with pytest.raises(fb.errors.InputError, match="can be narrowed in its std"):
        surrogate.narrowed(field=fb.RandomField(2.1, 0.1, 0.5, terms=3))


@pytest.mark.parametrize("middle", [1.9, 2.3])
def test_a_p_box_whose_polynomials_depend_on_its_parameters(middle):
    def power(x):
        return (1 + 0.1 * x)[:, None] ** 2 * T

    inputs = {"x": fb.Weibull(scale=1.0, shape=fb.Interval(1.8, 2.6))}
    surrogate = fb.expand(power, inputs, fb.PCCI(8, 6))
    part = fb.Interval(middle - 0.05, middle + 0.05)
    bar = surrogate.narrowed(**{"x.shape": part}).bands()["error_bar"]
    inputs["x"] = fb.Weibull(scale=1.0, shape=part)
    expected = fb.propagate(power, inputs, fb.PCCI(8, 6))["error_bar"]
    np.testing.assert_allclose(bar, expected, rtol=1e-4)


@pytest.mark.parametrize(
    ("x", "changes", "squares"),
    [
        (ss.gamma(4.0, scale=fb.Interval(0.5, 0.6)), {"x.scale": (0.52, 0.55)}, (5.408, 6.05)),
        (
            fb.Normal(fb.Interval(1.0, 2.0), fb.Interval(0.1, 0.2)),
            {"x.mean": (1.2, 1.5), "x.std": (0.12, 0.15)},
            (1.4544, 2.2725),
        ),
    ],
)
def test_parameters_are_narrowed_together(x, changes, squares):
    """E[x²] of a gamma distribution is a (a + 1) scale², of a normal one mean² + std²."""
    surrogate = fb.expand(lambda x: x[:, None] ** 2 * np.ones(2), {"x": x}, fb.PCCI(3, 3))
    parts = {name: fb.Interval(*ends) for name, ends in changes.items()}
    mean = surrogate.narrowed(**parts).bands()["mean"]
    np.testing.assert_allclose(mean[:, 0], squares, rtol=1e-12)


def test_options_are_narrowed_together():
    def by_kind(a, kind):
        return a[:, None] * np.where(kind == "two", 2.0, 1.0)[:, None] * T

    inputs = {"a": fb.Interval(1.0, 2.0), "kind": fb.Choice("one", "two")}
    surrogate = fb.expand(by_kind, inputs, fb.PCCI(1, 1))
    bar = surrogate.narrowed(a=fb.Interval(1.2, 1.4)).bands()["error_bar"]
    np.testing.assert_allclose(bar, np.stack([1.2 * T, 2.8 * T]), atol=1e-14)
    with pytest.raises(fb.errors.InputError, match="kind is a Choice"):
        surrogate.narrowed(kind="one")


def test_phases_are_narrowed_and_errors_stay_honest():
    t = np.linspace(0, 1, 400)

    def wave(w, g):
        return np.sin(w[:, None] * t) * np.exp(-g[:, None] * t)

    inputs = {"w": fb.Interval(60.0, 66.0), "g": fb.Normal(1.0, 0.1)}
    surrogate = fb.expand(wave, inputs, fb.AdaptivePCCI(0.01))
    rng = np.random.default_rng(20261122)
    for _ in range(3):
        low, high = np.sort(rng.uniform(60, 66, 2))
        changes = {"w": fb.Interval(low, high), "g": fb.Normal(rng.uniform(0.9, 1.1), 0.05)}
        bands = surrogate.narrowed(**changes).bands()
        truth = fb.propagate(wave, changes, fb.AdaptivePCCI(1e-4))
        error = np.abs(bands["error_bar"] - truth["error_bar"]).mean()
        width = truth["error_bar"].diff("bound").mean()
        assert error / width < 5 * max(bands.attrs["expected_error"], 1e-5)


def test_runs_near_the_part_tell_its_error():
    def kinked(e, f):
        return np.abs(e) + 0.1 * f

    inputs = {"e": fb.Interval(-1.0, 1.0), "f": fb.Interval(0.0, 1.0)}
    surrogate = fb.expand(kinked, inputs, fb.AdaptivePCCI(1e-4, max_runs=60))
    error = surrogate.bands().attrs["expected_error"]
    at_the_kink = surrogate.narrowed(e=fb.Interval(-0.1, 0.1)).bands()
    assert at_the_kink.attrs["runs_inside"] >= 8
    assert at_the_kink.attrs["expected_error"] > error


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({}, "at least one of a, b, e, f"),
        ({"z": 1.0}, "z must be one of the uncertain inputs a, b, e, f"),
        ({"a": fb.Normal(1.3, 0.1)}, "3σ range ends at 6 standard deviations"),
        ({"a": fb.Normal(1.0, 0.11)}, "a: .* is beyond the runs"),
        ({"a": 5.0}, "a: 5.0 is beyond the runs"),
        ({"a": fb.Interval(0.9, 1.1)}, "a: must be a number or a distribution"),
        ({"e": fb.Interval(0.9, 1.5)}, "e: values must be from 1 to 2"),
        ({"e": fb.Normal(1.5, 0.1)}, "e: must be a number or an Interval"),
        ({"e": "1.5"}, "e must be a number or an input"),
    ],
)
def test_what_is_not_within_the_inputs_is_refused(surrogate, changes, text):
    with pytest.raises(fb.errors.InputError, match=text):
        surrogate.narrowed(**changes)


def test_all_inputs_fixed_is_saved_and_not_doubted(surrogate, tmp_path):
    fixed = surrogate.narrowed(a=1.0, b=1.0, e=1.5, f=0.0)
    assert "not_trusted" not in fixed.diagnostics.attrs
    fb.save_surrogate(fixed, tmp_path / "fixed.npz")
    bands = fb.load_surrogate(tmp_path / "fixed.npz").bands()
    np.testing.assert_allclose(bands["error_bar"], np.stack([T + 1.5 * np.sin(3 * T)] * 2))
