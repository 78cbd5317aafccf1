"""Interval quantiles, p-boxes and ranges of values, against closed forms and brute force."""

import re

import numpy as np
import pytest
from scipy.stats import chi2, lognorm, norm

import flexband as fb
from flexband.analysis.quantile_bounds import sorted_quantiles
from flexband.analysis.sampled import SampledSeries, samples_of

P = np.array([0.05, 0.5, 0.95])
Z = norm.ppf(P)
TIME = np.linspace(0.0, 1.0, 12)


def linear(a, b, e):
    value = a + 2 * b + 3 * e
    return np.stack([value, -value], axis=1)


LINEAR = {"a": fb.Normal(1.0, 0.5), "b": fb.Normal(0.0, 1.0), "e": fb.Interval(-1.0, 2.0)}


@pytest.fixture(scope="module")
def of_linear():
    return fb.expand(linear, LINEAR, fb.PCCI(1, 1))


def within(quantiles, expected):
    """Assert that quantiles are exact up to their sampling error, which must be small."""
    error = quantiles["sampling_error"].values
    assert (np.abs(quantiles["quantiles"].values - expected) <= 1.5 * error + 1e-9).all()
    return error.max()


def test_a_linear_response(of_linear):
    quantiles = fb.analysis.quantiles(of_linear, P, at={"dim_1": 0})
    sigma = np.hypot(0.5, 2)
    assert within(quantiles, np.stack([1 - 3 + Z * sigma, 1 + 6 + Z * sigma])) < 0.03 * sigma
    np.testing.assert_array_equal(quantiles["quantiles_at"].sel(input="e"), [[-1] * 3, [2] * 3])
    assert quantiles["quantiles"].dims == ("bound", "probability")


def test_a_lognormal_number_times_an_interval():
    inputs = {"a": fb.LogNormal(mean=1.0, std=0.2), "e": fb.Interval(0.5, 2.0)}
    quantiles = fb.analysis.quantiles(fb.expand(lambda a, e: a * e, inputs, fb.PCCI(6, 1)), P)
    spread = np.sqrt(np.log(1.04))
    exact = lognorm(spread, scale=np.exp(-(spread**2) / 2)).ppf(P)
    assert within(quantiles, np.stack([0.5 * exact, 2 * exact])) < 0.005
    assert quantiles["quantiles"].dims == ("bound", "probability")


def test_a_square_whose_median_is_lowest_inside_the_interval():
    inputs = {"a": fb.Normal(0.0, 1.0), "e": fb.Interval(-1.0, 2.0)}
    quantiles = fb.analysis.quantiles(
        fb.expand(lambda a, e: a**2 + (e - 0.3) ** 2, inputs, fb.PCCI(2, 2)), P
    )
    within(quantiles, chi2(1).ppf(P) + np.array([[0.0], [1.7**2]]))
    assert quantiles["quantiles_at"].values[0, 0] == pytest.approx(0.3, abs=0.02)


def test_an_interval_mean_is_a_parametric_p_box():
    inputs = {"a": fb.Normal(fb.Interval(-1.0, 1.0), 2.0)}
    surrogate = fb.expand(lambda a: a, inputs, fb.PCCI(1, 1))
    assert within(fb.analysis.quantiles(surrogate, P), np.stack([2 * Z - 1, 2 * Z + 1])) < 0.02
    box = fb.analysis.p_box(surrogate, values=np.linspace(-5, 5, 21))
    y = box["value"].values
    exact = norm.cdf(np.stack([(y - 1) / 2, (y + 1) / 2]))
    assert (np.abs(box["distribution"] - exact) <= box["sampling_error"]).all()
    assert float(box["sampling_error"].min()) > 0
    assert float(box["sampling_error"].max()) < 2e-3
    assert list(box["distribution_at"].values[0, :, 10]) == [1.0, -1.0]


def test_without_random_inputs_quantiles_are_bounds():
    surrogate = fb.expand(lambda e: (e - 0.3) ** 2, {"e": fb.Interval(-1.0, 2.0)}, fb.PCCI(1, 2))
    quantiles = fb.analysis.quantiles(surrogate, [1e-6, 0.5])
    np.testing.assert_allclose(quantiles["quantiles"], [[0.0, 0.0], [1.7**2, 1.7**2]], atol=1e-5)
    assert float(quantiles["sampling_error"].max()) == 0
    box = fb.analysis.p_box(surrogate, values=[-0.1, 0.1, 3.0])
    np.testing.assert_array_equal(box["distribution"], [[0, 0, 1], [0, 1, 1]])


def test_without_intervals_both_bounds_are_the_quantile():
    surrogate = fb.expand(lambda a: 2 * a, {"a": fb.Normal(1.0, 0.5)}, fb.PCCI(1, 1))
    quantiles = fb.analysis.quantiles(surrogate, P)
    within(quantiles, np.stack([2 + Z, 2 + Z]))
    assert "quantiles_at" not in quantiles
    box = fb.analysis.p_box(surrogate)
    np.testing.assert_array_equal(*box["distribution"])


def ringing(**v):
    a = v["a"]
    b = v["b"]
    d = v["d"]
    e = v["e"]
    turns = TIME[None] * (6 + a[:, None] + 3 * e[:, None])
    return np.exp(-TIME * (1 + 0.4 * d[:, None])) * np.sin(turns) * (1 + 0.3 * b[:, None])


def test_no_place_of_a_brute_force_search_is_beyond_the_bounds():
    inputs = {name: fb.Normal(0.0, 0.5) for name in "ab"}
    inputs |= {name: fb.Interval(-1.0, 1.0) for name in "de"}
    surrogate = fb.expand(ringing, inputs, fb.PCCI(3, 4))
    quantiles = fb.analysis.quantiles(surrogate, [0.05, 0.9], samples=512)
    series = next(SampledSeries.of_outputs(surrogate.expansions[0]))
    psi = series.basis(samples_of(surrogate.space.families, 512, 0))
    grid = np.linspace(-1, 1, 21)
    eta = np.stack(np.meshgrid(grid, grid), axis=-1).reshape(-1, 2)
    for k in range(12):
        values = series.values(psi, eta, np.full(len(eta), k))
        brute_force = sorted_quantiles(values, np.array([0.05, 0.9]))
        lower, upper = quantiles["quantiles"].values[..., k]
        slack = 2e-3 * np.ptp(brute_force, axis=1)
        assert (lower <= brute_force.min(axis=1) + slack).all()
        assert (upper >= brute_force.max(axis=1) - slack).all()


@pytest.mark.parametrize("method", [fb.PCCI(2, 2), fb.methods.PhaseResolvedPCCI(2, 2)])
def test_samples_of_series_are_values_of_the_expansion(method):
    inputs = {name: fb.Normal(0.0, 0.1) for name in "ab"}
    inputs |= {name: fb.Interval(-1.0, 1.0) for name in "de"}
    t = np.linspace(0, 1, 200)
    response = lambda a, b, d, e: (  # noqa: E731
        np.cos(np.outer(60 + a + e, t)) * (2 + np.outer(b * d, t)) + np.outer(d, t)
    )
    surrogate = fb.expand(response, inputs, method)
    (series,) = SampledSeries.of_outputs(surrogate.expansions[0])
    xi = samples_of(surrogate.space.families, 1100, 0)
    eta = np.array([[0.3, -0.8]])
    times = np.array([0, 71, 199])
    values = series.values(series.basis(xi), np.repeat(eta, 3, axis=0), times)
    exact = surrogate.standard(xi, np.repeat(eta, len(xi), axis=0))[:, times]
    np.testing.assert_allclose(values, exact.T, rtol=0, atol=1e-12)


def test_many_inputs():
    names = [f"a{k}" for k in range(12)], [f"e{k}" for k in range(12)]
    inputs = {k: fb.Normal(0.0, 1.0) for k in names[0]}
    inputs |= {k: fb.Interval(-1.0, 1.0) for k in names[1]}
    surrogate = fb.expand(
        lambda **v: sum((k % 3 - 1) * value for k, value in enumerate(v.values())),
        inputs, fb.methods.RegressionPCCI(order=1),
    )  # fmt: skip
    within(fb.analysis.quantiles(surrogate, P), np.stack([np.sqrt(8) * Z - 8, np.sqrt(8) * Z + 8]))
    z = norm.ppf((1 + 0.9 ** (1 / 12)) / 2)
    span = fb.analysis.value_range(surrogate, 0.9)
    np.testing.assert_allclose(span["range"], [-8 * z - 8, 8 * z + 8])


def test_range_of_a_linear_response(of_linear):
    span = fb.analysis.value_range(of_linear, 0.99)
    z = norm.ppf((1 + np.sqrt(0.99)) / 2)
    ends = np.array([1 - 2.5 * z - 3, 1 + 2.5 * z + 6])
    np.testing.assert_allclose(span["range"].values, np.stack([ends, -ends[::-1]], axis=1))
    worst = span["range_at"].isel(bound=1, dim_1=0)
    np.testing.assert_allclose(worst.values, [1 + 0.5 * z, z, 2.0])  # a, b, e


def test_range_over_all_values_of_bounded_inputs():
    inputs = {"a": fb.Uniform(-1.0, 1.0), "e": fb.Interval(0.0, 1.0)}
    surrogate = fb.expand(lambda a, e: a**3 - 0.5 * a * e, inputs, fb.PCCI(3, 1))
    np.testing.assert_allclose(
        fb.analysis.value_range(surrogate, 1)["range"], [-1.0, 1.0], atol=1e-9
    )
    np.testing.assert_allclose(
        fb.analysis.value_range(surrogate, 1e-12)["range"], [0, 0], atol=1e-9
    )


def test_a_ringing_response_by_its_phases():
    inputs = {"a": fb.Normal(0.0, 0.5), "e": fb.Interval(-1.0, 1.0)}
    time = np.arange(0, 8, 0.02)

    def response(a, e):
        return np.cos(time * (20 + a[:, None] + 2 * e[:, None]))

    surrogate = fb.expand(response, inputs, fb.AdaptivePCCI(tolerance=0.01))
    assert type(surrogate.expansions[0]).__name__ == "PhaseExpansion"
    quantiles = fb.analysis.quantiles(
        surrogate, [0.1, 0.9], at={"dim_1": [10, 30, 399]}, samples=1024
    )
    z = norm.ppf(np.linspace(0, 1, 2001)[1:] - 1 / 4000)
    eta = np.linspace(-1, 1, 401)
    for k, number in enumerate(
        quantiles["dim_1"].values if "dim_1" in quantiles.coords else (10, 30, 399)
    ):
        values = np.cos(time[number] * (20 + 0.5 * z + 2 * eta[:, None]))
        exact = np.quantile(values, [0.1, 0.9], axis=1)
        np.testing.assert_allclose(
            quantiles["quantiles"].values[0, :, k], exact.min(axis=1), atol=0.04
        )
        np.testing.assert_allclose(
            quantiles["quantiles"].values[1, :, k], exact.max(axis=1), atol=0.04
        )
    assert (quantiles["expected_error"] > 0).all()


def test_options_are_compared():
    inputs = {"c": fb.Choice(1.0, 3.0), "a": fb.Normal(0.0, 1.0), "e": fb.Interval(0.0, 1.0)}
    surrogate = fb.expand(lambda c, a, e: c * a + e, inputs, fb.PCCI(1, 1))
    quantiles = fb.analysis.quantiles(surrogate, [0.05, 0.95])
    z = norm.ppf(0.95)
    within(quantiles, np.array([[-3 * z, z], [1 - z, 1 + 3 * z]]))
    assert quantiles["quantiles_choice"].values.tolist() == [["3.0", "1.0"], ["1.0", "3.0"]]
    assert quantiles["quantiles_at"].values[0].tolist() == [[0, 0], [1, 1]]
    assert fb.analysis.value_range(surrogate, 0.9)["range_choice"].values.tolist() == ["3.0", "3.0"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"probabilities": 0.0}, "above 0 and below 1; got 0"),
        ({"probabilities": [0.5, 1.0]}, "above 0 and below 1"),
        ({"probabilities": [0.5, 0.5]}, "different"),
        ({"probabilities": 1e-4}, "samples must be 100000 or more for the probability 0"),
        ({"samples": 1}, "samples must be 2 or more"),
        ({"at": {"time": 0.0}}, "dimensions of the response, dim_1; got 'time'"),
        ({"at": {"dim_1": 2}}, "positions from 0 to 1"),
        ({"seed": -1}, "seed must be 0 or more"),
    ],
)
def test_refused(of_linear, arguments, message):
    with pytest.raises(fb.errors.InputError, match=re.escape(message)):
        fb.analysis.quantiles(of_linear, **arguments)


def test_refused_ranges_and_p_boxes(of_linear):
    with pytest.raises(fb.errors.InputError, match="not all random inputs are bounded"):
        fb.analysis.value_range(of_linear, 1)
    with pytest.raises(fb.errors.InputError, match="must be above 0 and at most 1"):
        fb.analysis.value_range(of_linear, 1.5)
    with pytest.raises(fb.errors.InputError, match=r"dimensions left: dim_1 \(2\)"):
        fb.analysis.p_box(of_linear)
    with pytest.raises(fb.errors.InputError, match="must be one that"):
        fb.analysis.quantiles(None)


def test_the_same_seed_gives_the_same_bits(of_linear):
    first, second = (fb.analysis.quantiles(of_linear, P, seed=3) for _ in range(2))
    assert first.identical(second)
    assert not first.identical(fb.analysis.quantiles(of_linear, P, seed=4))
