"""The methods that PCCI is compared with: Sobol' scanning, perturbation and regression."""

import itertools

import numpy as np
import pytest

import flexband as fb
from flexband.study.comparison import compare, usual_methods
from flexband.uncertainty.expansions.index_sets import bounded_terms
from flexband.uncertainty.inputs.space import Space

UNIFORM = fb.Uniform(-np.pi, np.pi)
ISHIGAMI = {"x1": UNIFORM, "x2": UNIFORM, "x3": fb.Interval(-np.pi, np.pi)}


def ishigami(x1, x2, x3):
    return np.sin(x1) + 7 * np.sin(x2) ** 2 + 0.1 * x3**4 * np.sin(x1)


def linear(a, b, x):
    """Of mean 2 + 3x and variance (0.3 (1 + x))² + 4/3."""
    return 3 * x + (1 + x) * a + 2 * b


LINEAR = {"a": fb.Normal(0.0, 0.3), "b": fb.Uniform(0.0, 2.0), "x": fb.Interval(0.0, 1.0)}
LINEAR_BAR = [2 - np.sqrt(0.09 + 4 / 3), 5 + np.sqrt(0.36 + 4 / 3)]


@pytest.mark.parametrize(("step", "improved"), [(0.01, False), (1.0, True)])
def test_perturbation_is_exact_where_the_response_is_linear_in_random_inputs(step, improved):
    bands = fb.propagate(linear, LINEAR, fb.methods.PerturbationChebyshev(2, step, improved))
    np.testing.assert_allclose(bands["mean"], [2, 5], atol=1e-12)
    np.testing.assert_allclose(bands["error_bar"], LINEAR_BAR, atol=1e-9)
    assert bands.attrs["runs"] == (1 + 2 * 2) * 3 + 1
    assert float(bands["truncation"]) < 1e-9


def test_perturbation_does_not_see_curvature_but_tells_of_it():
    """Of u = x ξ²: the mean is x σ², which a linearization about 0 finds to be 0."""
    inputs = {"xi": fb.Normal(0.0, 0.5), "x": fb.Interval(1.0, 2.0)}
    bands = fb.propagate(
        lambda xi, x: x * xi**2, inputs, fb.methods.PerturbationChebyshev(1, improved=True)
    )
    np.testing.assert_allclose(bands["mean"], 0.0, atol=1e-12)
    assert float(bands["truncation"]) >= 2 * 0.25  # the largest error of the mean
    exact = fb.propagate(lambda xi, x: x * xi**2, inputs, fb.ImprovedPCCI(2, 1))
    np.testing.assert_allclose(exact["mean"], [0.25, 0.5])
    linearization = fb.propagate(ishigami, ISHIGAMI, fb.methods.PerturbationChebyshev(4))
    np.testing.assert_allclose(linearization["mean"], 0.0, atol=1e-9)  # instead of 3.5
    slope = (1 + 0.1 * np.pi**4) * np.sin(0.1 * np.pi / 3**0.5) / (0.1 * np.pi / 3**0.5)
    np.testing.assert_allclose(linearization["error_bar"][1], slope * np.pi / 3**0.5, rtol=1e-9)


def test_perturbation_without_random_inputs_is_the_chebyshev_interval_method():
    inputs = {"x": fb.Interval(-1, 1)}
    for improved, lower in ((False, -1.5503), (True, -1.0)):  # Eq. (20)
        method = fb.methods.PerturbationChebyshev(2, improved=improved)
        bands = fb.propagate(lambda x: np.cos(np.pi * x), inputs, method)
        np.testing.assert_allclose(bands["mean"], [lower, 1.0], atol=5e-5)


@pytest.mark.parametrize(("dimension", "order", "q"), [(3, 4, 1.0), (4, 5, 0.5), (2, 0, 1.0)])
def test_terms_of_bounded_order(dimension, order, q):
    grid = np.array(list(itertools.product(range(order + 1), repeat=dimension)))
    expected = grid[(grid**q * (grid > 0)).sum(axis=1) <= order**q + 1e-9]
    result = bounded_terms(dimension, order, q, 1000)
    assert not result[0].any()
    assert sorted(map(tuple, result.tolist())) == sorted(map(tuple, expected.tolist()))


def test_regression_is_exact_for_polynomials_of_its_order(tmp_path):
    method = fb.methods.RegressionPCCI(2, oversampling=1.5)
    surrogate = fb.expand(linear, LINEAR, method)
    bands = surrogate.bands()
    np.testing.assert_allclose(bands["mean"], [2, 5], atol=1e-10)
    np.testing.assert_allclose(bands["error_bar"], LINEAR_BAR, atol=1e-10)
    assert bands.attrs["runs"] == 15 + 1  # 10 terms
    assert float(bands["error_bar_expected_error"]) < 1e-4  # all that so few runs can tell
    assert fb.verify(surrogate, linear).verification.attrs["confirmed"] == "yes"
    fb.save_surrogate(surrogate, tmp_path / "model.npz")
    assert fb.load_surrogate(tmp_path / "model.npz").bands().equals(bands)


@pytest.mark.parametrize(
    ("order", "q", "tolerance"), [(6, 1.0, 3.0), (10, 1.0, 5e-3), (12, 0.75, 5e-3)]
)
def test_regression_converges_and_expects_no_less_than_its_error(order, q, tolerance):
    bands = fb.propagate(ishigami, ISHIGAMI, fb.methods.RegressionPCCI(order, q))
    errors = np.abs(bands["mean"] - 3.5), np.abs(bands["error_bar"] - [-4.488026, 11.488026])
    assert float(np.max(errors)) < tolerance
    assert float(np.max(errors)) < 5 * float(bands["error_bar_expected_error"])
    assert bool(bands["trusted"])


def test_regression_that_misses_most_is_not_trusted():
    bands = fb.propagate(ishigami, ISHIGAMI, fb.methods.RegressionPCCI(3))
    assert not bool(bands["trusted"])
    assert float(bands["error_bar_expected_error"]) > 1.0


def test_seeds_of_regression_are_other_points():
    first, second, third = (
        fb.propagate(ishigami, ISHIGAMI, fb.methods.RegressionPCCI(3, seed=seed))
        for seed in (1, 1, 2)
    )
    assert first.equals(second)
    assert not np.allclose(first["mean"], third["mean"])


def test_sobol_points_are_more_accurate_than_a_latin_hypercube():
    def error(method):
        bands = fb.propagate(ishigami, ISHIGAMI, method)
        return float(np.abs(bands["error_bar"] - [-4.488026, 11.488026]).max())

    sobol = np.mean([error(fb.methods.SobolScanning(512, 4, seed)) for seed in range(3)])
    latin = np.mean([error(fb.LHSScanning(512, 4, seed)) for seed in range(3)])
    assert sobol < 2e-3
    assert latin > 10 * sobol
    with pytest.raises(fb.errors.InputError, match="at most 21201 variables"):
        fb.methods.SobolScanning(4).normals(30_000)


@pytest.mark.parametrize(
    ("method", "message"),
    [
        (
            lambda: fb.methods.RegressionPCCI(oversampling=1.0),
            "oversampling must be above 1: .*; got 1",
        ),
        (
            lambda: fb.methods.RegressionPCCI(q_norm=1.5),
            "q_norm must be above 0 and at most 1 .*; got 1.5",
        ),
        (lambda: fb.methods.RegressionPCCI(order=-1), "order must be .*; got -1"),
        (lambda: fb.methods.PerturbationChebyshev(step=0.0), "step must be above 0 and at most 1"),
        (lambda: fb.methods.PerturbationChebyshev(improved=2), "improved must be True or False"),
        (lambda: fb.methods.PerturbationChebyshev({"x": -1}), "interval_order of 'x'"),
    ],
)
def test_bad_options(method, message):
    with pytest.raises(fb.errors.InputError, match=message):
        method()


def test_too_many_terms_and_too_few_runs():
    forty_inputs = {f"x{i}": fb.Interval(0, 1) for i in range(40)}

    def total(**x):
        return sum(x.values())

    with pytest.raises(
        fb.errors.InputError, match="more than 5000 terms in 40 variables; choose a lower"
    ):
        fb.propagate(total, forty_inputs, fb.methods.RegressionPCCI(4))
    one_input = {"x": fb.Interval(0, 1)}  # a third of the points are at its two ends
    with pytest.raises(fb.errors.InputError, match="cannot determine 13 terms; choose a larger"):
        fb.propagate(lambda x: x, one_input, fb.methods.RegressionPCCI(12, oversampling=1.01))


def many_inputs(random, intervals):
    inputs = {f"r{i}": fb.Normal(0, 1) for i in range(random)}
    return inputs | {f"i{i}": fb.Interval(0, 1) for i in range(intervals)}


@pytest.mark.parametrize(
    ("random", "intervals", "advice"),
    [
        (1, 6, r"samples=100 and points=4 would take 409600 \(--samples 100 --points 4 on"),
        (1, 10, r"samples=100 and points=2 would take 102400 .*, at the ends of the intervals"),
        (1, 15, r"samples=30 and points=2 would take 983040 "),
        (0, 10, r"points=3 would take 59049 \(--points 3 on"),
        (1, 20, r"No scan fits, since the ends of 20 intervals alone are 2\^20 points"),
    ],
)
def test_a_scan_that_is_too_large_says_which_would_fit(random, intervals, advice):
    space = Space(many_inputs(random, intervals))
    with pytest.raises(
        fb.errors.InputError, match=rf"would take .* runs.*most_runs is 1000000\. {advice}"
    ):
        fb.propagate(lambda **x: sum(x.values()), space.inputs, fb.LHSScanning())


def test_compare_refuses_a_reference_and_leaves_out_methods_with_too_many_runs():
    study = fb.Study(lambda **x: sum(x.values()), many_inputs(2, 7), fb.AdaptivePCCI())
    with pytest.raises(fb.errors.InputError, match="--samples 100 --points 3"):
        compare(study, fb.LHSScanning(), [fb.PCCI(1, 1)])
    reference = fb.LHSScanning(16, 2)
    assert [
        type(method).__name__ for method in usual_methods(study, reference, [(1, 4), (2, 4)])
    ] == [
        *2 * ["PCCI"], *2 * ["ImprovedPCCI"], "PhaseResolvedPCCI", "AdaptivePCCI",
        "RegressionPCCI", "PerturbationChebyshev", "SobolScanning", "MonteCarlo",
    ]  # fmt: skip
    methods = [fb.PCCI(1, 5), fb.methods.RegressionPCCI(1), fb.methods.PerturbationChebyshev(1)]
    with pytest.warns(fb.errors.FlexbandWarning, match=r"left out: PCCI.* would take 1119744 runs"):
        results = compare(study, reference, methods)
    assert [result.runs for result in results] == [16 * 2**7, 20, 5 * 2**7]
    for result in results[1:]:
        assert float(result.errors["mean"]) < 0.05


def test_choices_are_compared_too():
    inputs = {"x": fb.Interval(0, 1), "a": fb.Normal(0, 1), "c": fb.Choice(1.0, 3.0)}
    study = fb.Study(lambda x, a, c: c * (x + a), inputs, fb.AdaptivePCCI())
    reference = fb.LHSScanning(1000, 2)
    methods = usual_methods(study, reference, [(1, 1)])
    _, *results = compare(study, reference, methods)
    assert len(results) == len(methods)
    for result in results:
        np.testing.assert_allclose(result.bands["error_bar"], [-3.0, 6.0], atol=0.3)
    assert results[0].runs == 2 * 4
