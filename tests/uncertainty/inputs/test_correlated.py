"""Random inputs that depend on each other, against exact conditional and joint distributions."""

import numpy as np
import pytest
import scipy.stats as ss

import flexband as fb

TWO = {"a": fb.Normal(3.0, 0.2), "b": fb.Normal(2.0, 0.1)}


def std(bands):
    return (bands["error_bar"].values - bands["mean"].values) * [-1, 1]


@pytest.mark.parametrize("method", [fb.ImprovedPCCI(2, 2), fb.PCCI(2, 0), fb.AdaptivePCCI(1e-6)])
@pytest.mark.parametrize("rho", [-0.9, 0.0, 0.6])
def test_a_product_of_two_normals(method, rho):
    inputs = {"both": fb.Correlated(TWO, rho), "c": 1.5}
    bands = fb.propagate(lambda a, b, c: a * b + c, inputs, method)
    covariance = rho * 0.2 * 0.1
    variance = (3 * 0.1) ** 2 + (2 * 0.2) ** 2 + 2 * 6 * covariance + 0.02**2 + covariance**2
    np.testing.assert_allclose(bands["mean"], 2 * [6 + covariance + 1.5], rtol=1e-9)
    np.testing.assert_allclose(std(bands), 2 * [variance**0.5], rtol=1e-6)


def test_three_normals_by_pairs_by_a_matrix_and_in_any_order():
    three = {**TWO, "c": fb.Normal(0.0, 1.0)}
    matrix = np.array([[1, 0.5, -0.3], [0.5, 1, 0], [-0.3, 0, 1]])
    pairs = fb.Correlated(three, {("b", "a"): 0.5, ("a", "c"): -0.3})
    backwards = fb.Correlated(dict(reversed(three.items())), matrix[::-1, ::-1])
    results = [
        fb.propagate(lambda a, b, c: 2 * a + b - c, {"all": joint}, fb.ImprovedPCCI(1, 0))
        for joint in (fb.Correlated(three, matrix), pairs, backwards)
    ]
    spread = np.array([2 * 0.2, 0.1, -1.0])
    for bands in results:
        np.testing.assert_allclose(std(bands), np.sqrt(spread @ matrix @ spread), rtol=1e-12)
        assert bands["error_bar"].equals(results[0]["error_bar"])  # bit for bit


def test_the_ranks_of_two_uniforms_have_the_correlation_of_their_values():
    # of uniform inputs both are the same, and r = 2 sin(π ρ/6) is exact
    two = {"a": fb.Uniform(0.0, 1.0), "b": fb.Uniform(-3.0, 5.0)}
    for of in ("values", "ranks"):
        factor = fb.Correlated(two, 0.7, of=of).factor
        assert factor[1, 0] == pytest.approx(2 * np.sin(np.pi * 0.7 / 6), abs=1e-9)
    bands = fb.propagate(
        lambda a, b: a * b, {"ab": fb.Correlated(two, 0.7)}, fb.LHSScanning(20_000, 2)
    )
    assert bands["mean"].values[0] == pytest.approx(0.5 + 0.7 * 8 / 12, abs=0.01)


def test_scipy_distributions_are_correlated(tmp_path):
    """A linear response has the variance of its parts and of their covariance."""
    two = {"a": ss.gamma(4.0, scale=0.5), "b": ss.norm(3.0, 0.5)}
    inputs = {"both": fb.Correlated(two, 0.5)}
    surrogate = fb.expand(lambda a, b: 2 * a - b, inputs, fb.ImprovedPCCI(12, 1))
    fb.save_surrogate(surrogate, tmp_path / "s.npz")
    for expansion in (surrogate, fb.load_surrogate(tmp_path / "s.npz")):
        np.testing.assert_allclose(expansion.bands()["mean"], 2 * [1.0], rtol=1e-8)
        variance = 4 * 1.0 + 0.25 - 2 * 2 * 0.5 * 1.0 * 0.5
        np.testing.assert_allclose(std(expansion.bands()), 2 * [variance**0.5], rtol=1e-6)


def test_a_surrogate_takes_values_and_is_saved(tmp_path):
    inputs = {"both": fb.Correlated(TWO, 0.5), "e": fb.Interval(1.0, 2.0), "k": 3.0}
    surrogate = fb.expand(lambda a, b, e, k: k * a + b * e, inputs, fb.ImprovedPCCI(1, 1))
    assert surrogate.evaluate(a=3.4, b=1.9, e=1.25).item() == pytest.approx(3 * 3.4 + 1.9 * 1.25)
    assert surrogate.evaluate(a=3.4, b=1.9, e=1.25, k=3.0).item() == pytest.approx(12.575)
    fb.save_surrogate(surrogate, tmp_path / "s.npz")
    copy = fb.load_surrogate(tmp_path / "s.npz")
    assert copy.bands().equals(surrogate.bands())
    assert "confirmed" in fb.verify(copy, lambda a, b, e, k: k * a + b * e).verification.attrs
    with pytest.raises(fb.errors.InputError, match=r"k must be the constant 3.0"):
        surrogate.evaluate(a=3.4, b=1.9, e=1.25, k=4.0)


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: fb.Correlated(TWO, 1.0), "correlation of a and b must be above -1 and below 1"),
        (lambda: fb.Correlated(TWO, np.eye(3)), r"must have shape \(2, 2\); got \(3, 3\)"),
        (lambda: fb.Correlated(TWO, [[1, 0.5], [0.4, 1]]), "must be one number; got 0.5, 0.4"),
        (lambda: fb.Correlated(TWO, [[2, 0.5], [0.5, 1]]), "diagonal of a correlation matrix"),
        (lambda: fb.Correlated(TWO, float("nan")), "correlation must be finite"),
        (lambda: fb.Correlated(TWO, {("a", "x"): 0.5}), "must be 'a' or 'b'; got 'x'"),
        (lambda: fb.Correlated({"a": TWO["a"]}, 0.5), "two or more"),
        (lambda: fb.Correlated({**TWO, "e": fb.Interval(0, 1)}, 0.5), "input 'e' must be a random"),
        (lambda: fb.Correlated({**TWO, "n": 3.0}, 0.5), "input 'n' must be a random number"),
        (lambda: fb.Correlated({**TWO, "p": ss.poisson(3)}, 0.5), "input 'p': poisson is discrete"),
        (
            lambda: fb.Correlated({**TWO, "f": fb.RandomField(1.0, 0.1, 1.0)}, 0.5),
            r"input 'f' must be a random number; got RandomField. Let the response combine",
        ),
        (lambda: fb.Correlated(TWO, 0.5, of="tau"), "must be 'values', 'ranks' or 'scores'"),
        (
            lambda: fb.Correlated({**TWO, "c": TWO["a"]}, -0.6),
            "contradict each other: a–b -0.6, a–c -0.6, b–c -0.6",
        ),
        (
            lambda: fb.propagate(
                lambda a, b: a + b, {"ab": fb.Correlated(TWO, 0.5), "b": 3.0}, fb.PCCI()
            ),
            "two inputs have the name 'b'",
        ),
        (lambda: fb.propagate(lambda a: a, {"a": 1.0}, fb.PCCI()), "at least one uncertain input"),
    ],
)
def test_bad_input_is_refused(call, text):
    with pytest.raises(fb.errors.InputError, match=text):
        call()
