"""Methods against exact answers."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

import flexband as fb
from flexband.uncertainty.expansions.bounds.extremes import extremes
from flexband.uncertainty.expansions.families import HERMITE, LEGENDRE
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.polynomials import (
    chebyshev_values,
    chebyshev_zeros,
    scaled_chebyshev_zeros,
)


def cosine(x):
    return np.cos(np.pi * x)


@pytest.mark.parametrize(
    ("method", "exact"), [(fb.PCCI(0, 2), [-1.5503, 1.0]), (fb.ImprovedPCCI(0, 2), [-1.0, 1.0])]
)
def test_cosine(method, exact):
    bands = fb.propagate(cosine, {"x": fb.Interval(-1, 1)}, method)
    np.testing.assert_allclose(bands["mean"], exact, atol=5e-5)
    np.testing.assert_allclose(bands["error_bar"], bands["mean"])
    assert bands.attrs["runs"] == 3 + 1


TIME = np.linspace(0, 10, 21)


def decay(amplitude, rate):
    return amplitude[:, None] * np.exp(-rate[:, None] * TIME)


@pytest.mark.parametrize(
    ("method", "tolerance", "runs"),
    [
        (fb.ImprovedPCCI(1, 8), 1e-9, 18),
        (fb.PCCI(1, 8), 1e-9, 18),
        (fb.LHSScanning(400, 3, seed=1), 2e-3, 1200),
        (fb.MonteCarlo(4000, 3, seed=1), 2e-2, 12000),
    ],
)
def test_decay(method, tolerance, runs):
    inputs = {"amplitude": fb.Normal(1.5, 0.2), "rate": fb.Interval(0.1, 0.2)}
    bands = fb.propagate(decay, inputs, method)
    upper = np.exp(-0.1 * TIME)
    lower = np.exp(-0.2 * TIME)
    np.testing.assert_allclose(bands["mean"], [1.5 * lower, 1.5 * upper], atol=tolerance)
    np.testing.assert_allclose(bands["error_bar"], [1.3 * lower, 1.7 * upper], atol=tolerance)
    np.testing.assert_allclose(bands["error_bar_lower"], [1.3 * lower, 1.3 * upper], atol=tolerance)
    np.testing.assert_allclose(bands["error_bar_upper"], [1.7 * lower, 1.7 * upper], atol=tolerance)
    np.testing.assert_allclose(bands["mean_at"].isel(input=0)[:, 1:].T, [[0.2, 0.1]] * 20)
    assert bands.attrs["runs"] == runs + 1  # one run is made again


def ishigami(x1, x2, x3):
    return np.sin(x1) + 7 * np.sin(x2) ** 2 + 0.1 * x3**4 * np.sin(x1)


def test_ishigami_with_random_inputs():
    inputs = {name: fb.Uniform(-np.pi, np.pi) for name in ("x1", "x2", "x3")}
    bands = fb.propagate(ishigami, inputs, fb.ImprovedPCCI(19, 0))
    deviation = np.sqrt(13.844587940719254)
    np.testing.assert_allclose(bands["mean"], 3.5, rtol=1e-12)
    np.testing.assert_allclose(bands["error_bar"], [3.5 - deviation, 3.5 + deviation], rtol=1e-9)


def test_ishigami_with_an_interval():
    inputs = {
        "x1": fb.Uniform(-np.pi, np.pi),
        "x2": fb.Uniform(-np.pi, np.pi),
        "x3": fb.Interval(-np.pi, np.pi),
    }
    bands = fb.propagate(ishigami, inputs, fb.ImprovedPCCI(19, 4))
    np.testing.assert_allclose(bands["mean"], [3.5, 3.5], rtol=1e-12)
    np.testing.assert_allclose(bands["error_bar"], [-4.488026, 11.488026], atol=1e-6)
    np.testing.assert_allclose(bands["error_bar_lower"], [-4.488026, 0.926092], atol=1e-6)
    np.testing.assert_allclose(np.abs(bands["error_bar_at"]), np.pi)


def test_an_interior_minimum_is_polished():
    inputs = {"a": fb.Interval(0.1, 1), "b": fb.Interval(0, 1)}
    bands = fb.propagate(lambda a, b: (a + b) ** a, inputs, fb.ImprovedPCCI(0, 16))
    np.testing.assert_allclose(bands["mean"], [0.6922006275553464, 2.0], atol=2e-8)
    np.testing.assert_allclose(bands["mean_at"].sel(bound="lower"), [1 / np.e, 0.0], atol=1e-4)
    np.testing.assert_allclose(bands["mean_at"].sel(bound="upper"), [1.0, 1.0])


def test_an_expansion_that_fails_says_so():
    def wave(omega, mean):
        return np.cos((omega + mean) * 5.2)

    inputs = {
        "omega": fb.Normal(0.0, 0.02 * 2 * np.pi),
        "mean": fb.Interval(0.95 * 2 * np.pi, 1.05 * 2 * np.pi),
    }
    exact_mean = [-0.78237570, 0.80775274]
    exact_bar = [-1.05516588, 1.05516695]
    low_order = fb.propagate(wave, inputs, fb.ImprovedPCCI(2, 2))
    error = max(
        np.abs(low_order["mean"] - exact_mean).max(),
        np.abs(low_order["error_bar"] - exact_bar).max(),
    )
    assert error > 0.05
    assert low_order["truncation"] > error / 2
    high_order = fb.propagate(wave, inputs, fb.ImprovedPCCI(12, 12))
    np.testing.assert_allclose(high_order["mean"], exact_mean, atol=1e-5)
    np.testing.assert_allclose(high_order["error_bar"], exact_bar, atol=1e-4)
    assert high_order["truncation"] < 1e-3


coefficient = st.floats(-2, 2).map(lambda x: round(x, 3))


@pytest.mark.filterwarnings("ignore:input .* changes no output:flexband.errors.FlexbandWarning")
@given(st.lists(coefficient, min_size=9, max_size=9))
def test_hybrid_polynomials_are_reproduced(c):
    """Moments and bounds of polynomials of the basis are exact, whatever they are."""
    beta = np.array(c).reshape(3, 3)  # Chebyshev by Hermite

    def response(x, y):
        he = np.stack([np.ones_like(x), x, x**2 - 1])
        return np.einsum("ij,in,jn->n", beta, chebyshev_values(2, y).T, he)

    inputs = {"x": fb.Normal(0, 1), "y": fb.Interval(-1, 1)}
    grid = np.linspace(-1, 1, 4001)
    phi = chebyshev_values(2, grid)
    mean = phi @ beta[:, 0]
    std = np.sqrt((phi @ beta[:, 1]) ** 2 + 2 * (phi @ beta[:, 2]) ** 2)
    for method in (fb.PCCI(2, 2), fb.ImprovedPCCI(2, 2)):
        bands = fb.propagate(response, inputs, method)
        for name, exact in (
            ("mean", [mean.min(), mean.max()]),
            ("error_bar", [(mean - std).min(), (mean + std).max()]),
        ):
            bounds = bands[name].values
            np.testing.assert_allclose(bounds, exact, atol=1e-5)
            assert bounds[0] <= exact[0] + 1e-9  # polished: never worse than the fine scan
            assert bounds[1] >= exact[1] - 1e-9


@given(st.integers(0, 3), st.integers(0, 3), st.integers(0, 2), st.integers(0, 2))
def test_the_expansion_interpolates_its_runs(k, q, n, m):
    nodes = scaled_chebyshev_zeros(q)
    random = [HERMITE, LEGENDRE][:n], [k] * n
    xi, eta = HybridExpansion.design(*random, [nodes] * m)
    assert len(xi) == (k + 1) ** n * (q + 1) ** m
    values = np.random.default_rng(0).standard_normal((len(xi), 4))
    expansion = HybridExpansion.fit(values, *random, [nodes] * m)
    np.testing.assert_allclose(expansion.evaluate(xi, eta), values, atol=1e-11)


def test_random_inputs_alone_are_plain_polynomial_chaos():
    bands = fb.propagate(
        lambda x, y: x**2 + y, {"x": fb.Normal(1, 2), "y": fb.Normal(0, 1)}, fb.PCCI(2, 3)
    )
    np.testing.assert_allclose(bands["mean"], 5.0)
    deviation = np.sqrt(2 * 16 + 4 * 4 + 1)
    np.testing.assert_allclose(bands["error_bar"], [5 - deviation, 5 + deviation])
    assert "mean_at" not in bands
    assert bands.attrs["runs"] == 9 + 1


@pytest.mark.parametrize(
    ("nodes", "exact"), [(chebyshev_zeros(4), 1.9889), (scaled_chebyshev_zeros(4), 1.5702)]
)
def test_lebesgue_constants(nodes, exact):
    x = np.linspace(-1, 1, 20001)
    lagrange = chebyshev_values(4, x) @ np.linalg.inv(chebyshev_values(4, nodes))
    assert np.abs(lagrange).sum(axis=1).max() == pytest.approx(exact, abs=1e-4)


def test_order_zero_is_the_midpoint():
    np.testing.assert_array_equal(scaled_chebyshev_zeros(0), [0.0])
    bands = fb.propagate(lambda x: x, {"x": fb.Interval(2, 4)}, fb.ImprovedPCCI(0, 0))
    np.testing.assert_array_equal(bands["mean"], [3.0, 3.0])


def test_samples_are_reproducible_and_stratified():
    inputs = {"x": fb.Normal(0, 1)}
    batches = []

    def response(x):
        if len(x) > 1:
            batches.append(x)
        return x

    for seed in (5, 5, 6):
        bands = fb.propagate(response, inputs, fb.LHSScanning(50, 2, seed=seed))
    mean = batches[-1].mean()
    std = batches[-1].std(ddof=1)  # Eq. (10)
    np.testing.assert_allclose(bands["error_bar"], [mean - std, mean + std], rtol=1e-12)
    np.testing.assert_array_equal(batches[0], batches[1])
    assert np.any(batches[0] != batches[2])
    from scipy.special import ndtr  # noqa: PLC0415

    np.testing.assert_array_equal(np.sort(np.floor(50 * ndtr(batches[0]))), np.arange(50))


def test_bands_do_not_depend_on_the_batch():
    inputs = {"amplitude": fb.Normal(1.5, 0.2), "rate": fb.Interval(0.1, 0.2)}
    reference = fb.propagate(decay, inputs, fb.PCCI(3, 3))
    reports = []
    parts = fb.propagate(
        decay, inputs, fb.PCCI(3, 3), batch=5, progress=lambda *done: reports.append(done)
    )
    np.testing.assert_array_equal(reference["mean"], parts["mean"])
    assert reports == [(0, 17), (5, 17), (10, 17), (15, 17), (16, 17), (17, 17)]


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: fb.Interval(1.0, 0.0), "lower 1 must not be above upper 0"),
        (lambda: fb.Interval(np.nan, 0.0), "Interval lower"),
        (lambda: fb.Normal(0.0, 0.0), "Normal std must be positive; got 0"),
        (lambda: fb.Uniform(1.0, 1.0), "must be below"),
        (lambda: fb.PCCI(-1, 2), "random_order must be 0 or more; got -1"),
        (lambda: fb.ImprovedPCCI(1, 1.5), "interval_order must be a whole number"),  # type: ignore
        (lambda: fb.PCCI(200, 1), "random_order must be 100 or less; got 200"),
        (lambda: fb.Interval([1, 2], 3), "Interval lower must be 1 number"),  # type: ignore
        (
            lambda: fb.propagate(cosine, {"x": "0.15"}, fb.PCCI(1, 1)),
            "input 'x' must be a number, an Interval",
        ),  # type: ignore
        (lambda: fb.propagate(cosine, {"x": fb.Interval(0, 1)}, fb.PCCI), "method must be"),  # type: ignore
        (
            lambda: fb.propagate(
                lambda f: f, {"f": fb.RandomField(0, 1, 0.01, domain=(0, 1))}, fb.PCCI(3, 3)
            ),
            r"would take about 10\^71 runs, with 118 random and 0 interval variables; "
            "most_runs is 1000000",
        ),
        (
            lambda: fb.propagate(lambda x: x * 1j, {"x": fb.Interval(0, 1)}, fb.PCCI(1, 1)),
            "must return real numbers",
        ),
        (lambda: fb.LHSScanning(1, 10), "samples must be 2 or more; got 1"),
        (lambda: fb.MonteCarlo(10, 10, seed=-1), "seed"),
        (lambda: fb.propagate(cosine, {}, fb.PCCI(1, 1)), "at least one uncertain input"),
        (
            lambda: fb.propagate(cosine, {"y": fb.Interval(0, 1)}, fb.PCCI(1, 1)),
            "inputs name y, which the response does not take; it takes x",
        ),
        (
            lambda: fb.propagate(decay, {"rate": fb.Interval(0, 1)}, fb.PCCI(1, 1)),
            "needs amplitude, which inputs do not name",
        ),
        (
            lambda: fb.propagate(np.log, {"x": fb.Interval(0, 1)}, fb.PCCI(1, 1)),
            "takes them by position",
        ),
        (
            lambda: fb.propagate(lambda x: 1 / x, {"x": fb.Interval(-1, 1)}, fb.PCCI(0, 2)),
            "not finite in 1 of 3 runs, e.g. x = ",
        ),
        (
            lambda: fb.propagate(lambda x: x[:2], {"x": fb.Interval(-1, 1)}, fb.PCCI(0, 2)),
            r"must return shape \(3, ...\); got shape \(2,\)",
        ),
        (
            lambda: fb.propagate(lambda x: 1.0, {"x": fb.Interval(-1, 1)}, fb.PCCI(0, 2)),
            r"got shape \(\)",
        ),
    ],
)
@pytest.mark.filterwarnings("ignore:divide by zero")
def test_bad_input_is_refused(call, text):
    with pytest.raises(fb.errors.InputError, match=text):
        call()


@given(st.data())
def test_orders_of_each_input_reproduce_a_polynomial_of_these_degrees(data):
    """E and σ of a product of powers are known; one order less would miss the highest."""
    orders = [data.draw(st.integers(0, 3)) for _ in range(4)]
    k = {"a": orders[0], "b": orders[1]}
    q = {"x": orders[2], "y": orders[3]}

    def response(a, b, x, y):
        return (1 + a) ** k["a"] * (2 + b) ** k["b"] * (3 + x) ** q["x"] * (3 + y) ** q["y"]

    inputs = {
        "x": fb.Interval(-1.0, 1.0), "a": fb.Normal(0.0, 1.0),
        "y": fb.Interval(-1.0, 1.0), "b": fb.Normal(0.0, 1.0),
    }  # fmt: skip
    bands = fb.propagate(response, inputs, fb.ImprovedPCCI(k, q))
    assert bands.attrs["runs"] == np.prod(np.array(orders) + 1) + 1
    nodes, weights = np.polynomial.hermite_e.hermegauss(12)
    weights = weights / weights.sum()
    mean = weights @ (1 + nodes) ** k["a"] * (weights @ (2 + nodes) ** k["b"])
    square = weights @ (1 + nodes) ** (2 * k["a"]) * (weights @ (2 + nodes) ** (2 * k["b"]))
    lowest = 2.0 ** (q["x"] + q["y"])
    highest = 4.0 ** (q["x"] + q["y"])
    np.testing.assert_allclose(bands["mean"], [mean * lowest, mean * highest], rtol=1e-9)
    top = (mean + np.sqrt(max(square - mean**2, 0.0))) * highest
    assert float(bands["error_bar"][1]) == pytest.approx(top, rel=1e-6)


def test_orders_by_name_are_one_order_where_they_are_equal():
    inputs = {"u": fb.Uniform(0.5, 1.5), "a": fb.Normal(1.0, 0.1), "x": fb.Interval(1.0, 2.0)}

    def response(u, a, x):
        return np.sin(u * x) + a * x

    method = fb.PCCI({"u": 3, "a": 3}, {"x": 4})
    assert method == fb.PCCI({"a": 3, "u": 3}, {"x": 4})
    assert hash(method) == hash(fb.PCCI({"a": 3, "u": 3}, {"x": 4}))
    assert method.label == "PCCI (3/3, 4)"
    xr.testing.assert_equal(
        fb.propagate(response, inputs, method).drop_attrs(),
        fb.propagate(response, inputs, fb.PCCI(3, 4)).drop_attrs(),
    )


@pytest.mark.parametrize(
    ("method", "text"),
    [
        (lambda: fb.PCCI({"a": 1}, 2), "random_order must name all random inputs, a, b; got a"),
        (lambda: fb.PCCI({"a": 1, "b": 1, "x": 1}, 2), "random_order must name all random"),
        (lambda: fb.ImprovedPCCI(1, {}), "interval_order must name all interval inputs, x"),
        (lambda: fb.ImprovedPCCI(1, {"x": -1}), "interval_order of 'x' must be 0 or more"),
        (lambda: fb.ImprovedPCCI({"a": 1.5, "b": 1}, 1), "random_order of 'a' must be a whole"),  # type: ignore
    ],
)
def test_orders_that_do_not_fit_the_inputs_are_refused(method, text):
    inputs = {"a": fb.Normal(0.0, 1.0), "b": fb.Normal(0.0, 1.0), "x": fb.Interval(0.0, 1.0)}
    with pytest.raises(fb.errors.InputError, match=text):
        fb.propagate(lambda a, b, x: a + b + x, inputs, method())


def test_twenty_intervals_without_a_scan_of_all_vertices():
    """Σ_v a_v η_v + b_v η_v², bent up in every other variable and down, where vertices compete."""
    r = np.random.default_rng(0)
    a, b = r.uniform(-1, 1, (2, 20, 50))
    index = np.concatenate([np.zeros((1, 20)), np.eye(20), 2 * np.eye(20)]).astype(int)
    terms = np.concatenate([b.sum(axis=0, keepdims=True) / 2, a, b / 2])
    (bounds,) = extremes(HybridExpansion((), index, terms), (0.0,))
    grid = np.linspace(-1, 1, 4001)[:, None, None]
    values = a * grid + b * grid**2
    np.testing.assert_allclose(bounds.values[0], values.min(axis=0).sum(axis=0), atol=1e-5)
    np.testing.assert_allclose(bounds.values[1], values.max(axis=0).sum(axis=0), atol=1e-5)
