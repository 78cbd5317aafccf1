"""Distributions whose parameters are intervals, against the exact extremes over the parameters."""

import numpy as np
import pytest

import flexband as fb


def test_the_mean_of_a_normal_is_an_interval():
    inputs = {"e": fb.Normal(fb.Interval(4.8, 5.2), fb.Interval(0.1, 0.3)), "k": 2}
    bands = fb.propagate(lambda e, k: k * e, inputs, fb.AdaptivePCCI())
    np.testing.assert_allclose(bands["mean"], [9.6, 10.4])
    np.testing.assert_allclose(bands["error_bar"], [9.0, 11.0])
    assert bands["input"].values.tolist() == ["e.mean", "e.std"]
    np.testing.assert_allclose(bands["error_bar_at"], [[4.8, 5.2], [0.3, 0.3]])


@pytest.mark.parametrize("method", [fb.ImprovedPCCI(2, 2), fb.AdaptivePCCI(1e-6)])
def test_the_square_of_a_uniform_number_whose_bounds_are_intervals(method):
    inputs = {"e": fb.Uniform(fb.Interval(1.8, 2.2), fb.Interval(3.0, 4.0))}
    surrogate = fb.expand(lambda e: e**2, inputs, method)
    a, b = np.meshgrid([1.8, 1.93, 2.2], [3.0, 3.6, 4.0])
    moments = surrogate.moments(**{"e.lower": a.ravel(), "e.upper": b.ravel()})
    mean = ((a**2 + a * b + b**2) / 3).ravel()
    variance = ((b**5 - a**5) / (5 * (b - a))).ravel() - mean**2
    np.testing.assert_allclose(moments["mean"], mean, rtol=1e-6)
    np.testing.assert_allclose(moments["std"], np.sqrt(variance), rtol=1e-5)
    assert surrogate.evaluate(**{"e.lower": 2.0, "e.upper": 3.5, "e": 3.1}) == pytest.approx(9.61)


def test_parameters_of_correlated_inputs_are_intervals(tmp_path):
    two = {"a": fb.Normal(fb.Interval(1.0, 3.0), 0.2), "b": fb.Normal(2.0, 0.1)}
    inputs = {"both": fb.Correlated(two, 0.5)}
    surrogate = fb.expand(lambda a, b: a + b, inputs, fb.ImprovedPCCI(1, 1))
    fb.save_surrogate(surrogate, tmp_path / "s.npz")
    spread = np.sqrt(0.2**2 + 0.1**2 + 2 * 0.5 * 0.2 * 0.1)
    for expansion in (surrogate, fb.load_surrogate(tmp_path / "s.npz")):
        np.testing.assert_allclose(expansion.bands()["error_bar"], [3 - spread, 5 + spread])
        assert expansion.evaluate(**{"a": 2.1, "a.mean": 2.5, "b": 1.9}).item() == pytest.approx(
            4.0
        )


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: fb.Normal(1.0, fb.Interval(-0.1, 0.1)), "Normal std must be positive; got -0.1"),
        (lambda: fb.Uniform(fb.Interval(0, 2), fb.Interval(1, 3)), "Uniform lower 2 must be below"),
        (lambda: fb.Normal(fb.Normal(0, 1), 1.0), "Normal mean must be finite numbers"),
    ],
)
def test_parameters_that_leave_their_range_in_an_interval_are_refused(call, text):
    with pytest.raises(fb.errors.InputError, match=text):
        call()
