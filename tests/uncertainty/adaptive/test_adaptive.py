"""The adaptive method: its sets of orders, its bands, its errors, and what it refuses."""

import inspect
import itertools
import re
import tracemalloc
import warnings
from functools import cache

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import ndtr, ndtri
from scipy.stats import norm

import flexband as fb
from benchmarks.accuracy.formulas import (
    TIMES,
    beating,
    bifurcation,
    chirp,
    damped_oscillation,
    fading_carrier,
    formula,
    pulse,
    two_carriers,
    wave,
)
from flexband.report.text.band_tables import expected_errors, remarks
from flexband.study.comparison import relative_error
from flexband.uncertainty.adaptive.held_out_points import extreme_places, generic_points
from flexband.uncertainty.adaptive.nested_design import NestedDesign
from flexband.uncertainty.adaptive.rare_values import RareValues
from flexband.uncertainty.adaptive.response_runs import ResponseRuns, successful_runs
from flexband.uncertainty.expansions.expansion import Extremes
from flexband.uncertainty.expansions.families import HERMITE, LEGENDRE
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.index_sets import TermSizes, above, first_terms
from flexband.uncertainty.surrogates.unconverged import Cause, in_words, of_attributes


def closed_below(index):
    """Return whether every lower neighbour of every term is there."""
    terms = set(map(tuple, index.tolist()))
    lower = [(*nu[:v], k - 1, *nu[v + 1 :]) for nu in terms for v, k in enumerate(nu) if k]
    return all(mu in terms for mu in lower)


@given(st.integers(1, 6), st.integers(0, 4), st.integers(1, 40), st.integers(0, 10_000))
def test_sets_of_terms_are_downward_closed(m, n, count, seed):
    index = first_terms(m, n, max(count, 1 + m + n))
    assert closed_below(index)
    sizes = np.random.default_rng(seed).random((3, len(index)))
    new_terms = TermSizes(index, sizes).next_terms(12, np.full(m + n, 6))
    all_terms = np.concatenate([index, new_terms])
    assert closed_below(all_terms)
    assert len(np.unique(all_terms, axis=0)) == len(all_terms)
    terms = set(map(tuple, index.tolist()))
    for nu in above(terms):
        assert nu not in terms
        assert closed_below(np.array([*terms, nu]))


def test_sizes_of_products_are_foreseen():
    """Where variables do not interact, a_ν is the product of the decays; the largest is next."""
    index = first_terms(2, 0, 6)
    decay = np.array([0.5, 0.1])
    sizes = np.prod(decay**index, axis=1)[None]
    term_sizes = TermSizes(index, sizes)
    assert term_sizes.estimate_size((3, 0)) == pytest.approx(0.125)
    assert term_sizes.estimate_size((2, 1)) == pytest.approx(0.025)
    new_terms = term_sizes.next_terms(3, np.full(2, 9))
    np.testing.assert_array_equal(new_terms, [[3, 0], [4, 0], [5, 0]])
    assert term_sizes.total(new_terms) == pytest.approx([0.125 + 0.0625 + 0.03125])


def test_even_terms_are_not_hidden_by_odd_ones():
    index = np.array([[0, 0], [1, 0], [0, 1], [2, 0], [0, 2], [1, 1]])
    sizes = np.array([[1.0, 0.0, 0.0, 0.25, 0.25, 0.0]])
    term_sizes = TermSizes(index, sizes)
    assert term_sizes.rates[0] == pytest.approx(0.5)
    new_terms = term_sizes.next_terms(8, np.full(2, 9)).tolist()
    assert [2, 2] in new_terms
    assert [4, 0] in new_terms


@given(st.integers(1, 5), st.integers(0, 3), st.integers(0, 10_000))
def test_a_sparse_expansion_interpolates_its_runs(variables, n, seed):
    n = min(n, variables)
    m = variables - n
    rng = np.random.default_rng(seed)
    index = first_terms(m, n, 1 + m + n)
    term_sizes = TermSizes(index, rng.random((2, len(index))))
    index = np.concatenate([index, term_sizes.next_terms(10, np.full(m + n, 4))])
    families = [(HERMITE, LEGENDRE)[k % 2] for k in range(n)]
    design = NestedDesign(index, families)
    values = rng.standard_normal((len(index), 3))
    terms = np.linalg.solve(design.matrix, values)
    expansion = HybridExpansion(tuple(families), index, terms)
    np.testing.assert_allclose(expansion.evaluate(*design.points), values, atol=1e-8)


def test_a_polynomial_is_found_exactly_with_its_own_orders():
    """Four inputs, of which one does nothing; orders found are those of the polynomial."""

    def response(a, b, x, y):
        del b
        return 2 + (1 + 0.5 * a + 0.2 * (a**2 - 1)) * (1 + x) + 0.3 * (4 * y**3 - 3 * y)

    inputs = {
        "x": fb.Interval(-1.0, 1.0), "a": fb.Normal(0.0, 1.0),
        "y": fb.Interval(-1.0, 1.0), "b": fb.Normal(0.0, 1.0),
    }  # fmt: skip
    with pytest.warns(fb.errors.FlexbandWarning, match="'b' changes no output"):
        bands = fb.propagate(response, inputs, fb.AdaptivePCCI(1e-6, max_runs=60))
    assert bands.attrs["runs"] < 60
    assert bands.attrs["expected_error"] < 1e-6
    std = np.sqrt(0.25 + 2 * 0.04)
    np.testing.assert_allclose(bands["mean"], [2 - 0.3, 4 + 0.3], rtol=1e-9)
    top = 2 + 2 * (1 + std) + 0.3
    assert float(bands["error_bar"][1]) == pytest.approx(top, rel=1e-9)
    assert list(bands["variable"].values) == ["x", "y", "a", "b"]
    orders = dict(zip(bands["variable"].values, bands["orders"].values, strict=True))
    assert orders["y"] >= 3
    assert orders["a"] >= 2
    assert orders["b"] <= 2


@pytest.mark.parametrize("f", [wave, damped_oscillation, two_carriers])
def test_fourteen_fitted_runs_follow_twenty_periods(f):
    case = formula(f, every=2)
    bands = fb.propagate(case.response, case.inputs, fb.AdaptivePCCI(0.01))
    truth = case.reference()
    assert bands.attrs["runs_fitted"] == 14
    assert bands.attrs["runs"] - 1 == 14 + bands.attrs["runs_checked"] <= 30
    assert bands.attrs["stopped"] == "the expansion meets its tolerance"
    assert bands.attrs["stop_reason"] == "tolerance-met"
    for name in ("mean", "error_bar"):
        assert float(relative_error(bands[name], truth[name])) < 0.002
    assert bool(bands["trusted"])


@pytest.mark.parametrize(
    ("p", "q", "slope", "half", "cv"),
    [(-1.42, -2.72, -0.21, 0.12, 0.151), (-2.5, -2.5, 0, 0.1, 0.13), (-1, -3, 0, 0.12, 0.12),
     (-1, -1, 0, 0.1, 0.2)],
)  # fmt: skip
def test_an_interval_and_a_lognormal_variable(p, q, slope, half, cv):
    """Of a^p S^q + c a, E S^q and E S^2q are known; a first fit has few terms of each input."""
    inputs = {"a": fb.Interval(1 - half, 1 + half), "S": fb.LogNormal(1.0, cv=cv)}
    bands = fb.propagate(lambda a, S: a**p * S**q + slope * a, inputs, fb.AdaptivePCCI())
    a = np.linspace(1 - half, 1 + half, 2001)
    variance = np.log(1 + cv**2)
    mean = np.exp((q**2 - q) * variance / 2)
    std = mean * np.sqrt(np.expm1(q**2 * variance))
    low = a**p * (mean - std) + slope * a
    high = a**p * (mean + std) + slope * a
    error = np.abs(bands["error_bar"].values - [low.min(), high.max()]).max()
    assert error <= 5 * bands.attrs["expected_error"] * (high.max() - low.min())


@pytest.mark.parametrize("power", [6, 7, 8])
def test_a_response_that_grows_fast_is_expanded_as_soon_as_runs_show_that_it_does(power):
    """x^p is exact with order p; E x^2p = (2p − 1)!!, of which values beyond 3σ are the most."""
    inputs = {"a": fb.Interval(-1, 1), "x": fb.Normal(0, 1)}
    bands = fb.propagate(lambda a, x: a + x**power, inputs, fb.AdaptivePCCI())
    moment = [np.prod(np.arange(2 * k - 1, 0, -2.0)) for k in range(power + 1)]
    mean = 0.0 if power % 2 else moment[power // 2]
    std = np.sqrt(moment[power] - mean**2)
    np.testing.assert_allclose(bands["error_bar"], [mean - std - 1, mean + std + 1], rtol=1e-6)
    assert bands.attrs["expected_error"] < 0.01
    assert bands.attrs["runs"] < 60


@pytest.mark.parametrize(("power", "cv"), [(8, 0.3), (5, 0.5), (8, 0.5), (3, 1.0)])
def test_what_no_order_follows_at_rare_values_is_not_expected_to_be_right(power, cv):
    """E S^k of a lognormal variable, of which orders up to 8 have a part only."""
    inputs = {"a": fb.Interval(0.9, 1.1), "S": fb.LogNormal(1.0, cv=cv)}
    bands = fb.propagate(lambda a, S: a * S**power, inputs, fb.AdaptivePCCI())
    variance = np.log(1 + cv**2)
    mean = np.exp((power**2 - power) * variance / 2)
    std = mean * np.sqrt(np.expm1(power**2 * variance))
    true = np.array([1.1 * (mean - std), 1.1 * (mean + std)])
    error = np.abs(bands["error_bar"].values - true).max() / np.ptp(true)
    assert error < 5 * bands.attrs["expected_error"]
    assert "tolerance" not in bands.attrs["stopped"]


def test_runs_along_slopes_tell_the_mean_square_of_a_cube_beyond_other_runs():
    rare = RareValues.along_slopes(np.ones((1, 1)), [HERMITE], 0)
    mean_square = rare.weight @ (rare.xi[:, 0] ** 3) ** 2
    exact = 2 * quad(lambda z: norm.pdf(z) * z**6, 2.5, 20)[0]
    assert mean_square == pytest.approx(exact, rel=1e-6)


def test_rare_values_at_which_a_response_fails_are_left_out():
    """Those of x⁸ beyond 4.3 standard deviations, which no point of the design reaches."""
    inputs = {"a": fb.Interval(-1, 1), "x": fb.Normal(0, 1)}

    def response(a, x):
        if np.any(np.abs(x) > 4.3):
            raise fb.errors.InputError("x must be from -4.3 to 4.3")
        return a + x**8

    bands = fb.propagate(response, inputs, fb.AdaptivePCCI())
    assert bands.attrs["expected_error"] > 0.01 or float(bands["error_bar"][1]) > 1500


def test_a_refusal_at_one_rare_value_hides_no_other():
    """x is refused above 3 standard deviations, and there is a stop below −2."""
    inputs = {"e": fb.Interval(-1, 1), "x": fb.Normal(0, 1)}

    def response(e, x):
        if np.any(x > 3.0):
            raise fb.errors.InputError("x must be 3 at most")
        return x + 0.3 * e + 10 * np.maximum(0.0, -x - 2.0)

    bands = fb.propagate(response, inputs, fb.AdaptivePCCI(max_runs=24))
    x = ndtri((np.arange(20_001) + 0.5) / 20_001)
    F = x + 10 * np.maximum(0.0, -x - 2.0)
    true = np.array([F.mean() - F.std() - 0.3, F.mean() + F.std() + 0.3])
    error = np.abs(bands["error_bar"].values - true).max() / np.ptp(true)
    assert 0.02 < error < 5 * bands.attrs["expected_error"]


def test_steep_saturation_does_not_leave_the_range_of_the_runs():
    """|tanh| ≤ 1, and so is σ; high orders grow where a + b is beyond all runs."""
    inputs = {"a": fb.Interval(0, 1), "b": fb.Normal(1.0, 0.1)}
    bands = fb.propagate(lambda a, b: np.tanh(20 * (a + b - 1.3)), inputs, fb.AdaptivePCCI())
    a, (z, w) = np.linspace(0, 1, 401)[:, None], np.polynomial.hermite_e.hermegauss(180)
    F = np.tanh(20 * (a + 1 + 0.1 * z - 1.3))
    w = w / w.sum()
    std = np.sqrt((F - (F @ w)[:, None]) ** 2 @ w)
    true = np.array([(F @ w - std).min(), (F @ w + std).max()])
    error = np.abs(bands["error_bar"].values - true).max() / np.ptp(true)
    assert error < 5 * bands.attrs["expected_error"]
    assert error < 0.15


def true_error(bands, truth):
    """Return the error that `expected_error` is about: relative to the mean width, mean in time."""
    width = (truth["error_bar"][1] - truth["error_bar"][0]).mean()
    return max(float(abs(bands[v] - truth[v]).mean() / width) for v in ("mean", "error_bar"))


@pytest.mark.parametrize("f", [fading_carrier, chirp, bifurcation, beating, pulse])
def test_no_convergence_is_claimed_that_is_not_there(f):
    case = formula(f, every=2)
    bands = fb.propagate(case.response, case.inputs, fb.AdaptivePCCI(0.01, max_runs=40))
    true = true_error(bands, case.reference())
    wrong = f in (chirp, bifurcation, pulse)
    assert bands.attrs["expected_error"] > true / 5
    assert (true > 0.05) == wrong
    assert bool(bands["trusted"]) or wrong
    assert (bands.attrs["stopped"] == "the budget is used up") == (f is not fading_carrier)


TRAPS = {
    "linear in a uniform input": lambda u, e: u + e,
    "a third power": lambda x, e: x**3 + e,
    "saturation": lambda x, e: np.tanh(2 * x) + 0.2 * e,
    "a full sine": lambda x, e: np.sin(np.pi * e) + 0.1 * x,
    "an even product": lambda e, f: (1 - e**2) * (1 - f**2),
    "a product of three": lambda x, y, e: x * y * e,
    "a product of three normals": lambda x, y, z, e: x * y * z + e,
    "a gap that closes in one corner": lambda e, f, g: (
        e + f + g + 20 * np.maximum(0.0, -e - f - g - 1)
    ),
    "a stop": lambda x, e: np.abs(x + e - 0.2),
    "a stop that is reached rarely": lambda x, e: x + 0.3 * e + 10 * np.maximum(0.0, x - 2.0),
    "a pole near a corner": lambda u, e, f: (1 + 0.3 * u) / (1.01 + 0.5 * e + 0.5 * f),
}
"""Of normal x, y, z, uniform u, and e, f, g in [−1, 1]."""

SLOW = "saturation", "a stop", "a stop that is reached rarely"
"""Traps with a kink or a bend in x, whose expansions converge slowly."""


def exact(f):
    """Return interval mean and error bar by 20 001 quantiles or a rule of 40 points of the
    random inputs, and a scan of 41 points along each interval."""
    names = list(inspect.signature(f).parameters)
    intervals = [name for name in names if name in "efg"]
    many = f not in [TRAPS[name] for name in SLOW]
    x, w = np.polynomial.hermite_e.hermegauss(40)
    u = (np.arange(20_001) + 0.5) / 20_001
    axes = {"u": (2 * u - 1, u * 0 + 1)} | {
        k: (x, w) if many else (ndtri(u), u * 0 + 1) for k in "xyz"
    }
    rules = [axes[name] for name in names if name not in intervals]
    points = np.array(list(itertools.product(*(p for p, _ in rules)))).T
    weights = np.array(list(map(np.prod, itertools.product(*(w for _, w in rules)))))
    eta = list(itertools.product(np.linspace(-1, 1, 41), repeat=len(intervals)))
    if not rules:
        values = f(*np.transpose(eta))
        return (values.min(), values.max()), (values.min(), values.max())
    moments = []
    for e in eta:
        values = np.broadcast_to(f(*points, *e), weights.shape)
        mean = np.average(values, weights=weights)
        moments.append((mean, np.sqrt(np.average((values - mean) ** 2, weights=weights))))
    mean, std = np.array(moments).T
    return (mean.min(), mean.max()), ((mean - std).min(), (mean + std).max())


@pytest.mark.parametrize("name", TRAPS)
def test_traps_are_right_or_say_how_wrong_they_are(name):
    f = TRAPS[name]
    kinds = dict.fromkeys("xyz", fb.Normal(0.0, 1.0)) | dict.fromkeys("efg", fb.Interval(-1.0, 1.0))
    kinds["u"] = fb.Uniform(-1.0, 1.0)
    inputs = {k: kinds[k] for k in inspect.signature(f).parameters}
    bands = fb.propagate(f, inputs, fb.AdaptivePCCI(0.01))
    mean, bar = exact(f)
    true = max(np.abs(bands[v] - truth).mean() for v, truth in (("mean", mean), ("error_bar", bar)))
    true = float(true) / (bar[1] - bar[0])
    assert true < 5 * max(bands.attrs["expected_error"], 2e-5)
    assert bands.attrs["expected_error"] < 0.01 or name in (
        *SLOW,
        "a gap that closes in one corner",
        "a pole near a corner",
    )
    assert bands.attrs["expected_error"] < 0.2


def test_thirty_intervals_squared():
    """(Σ xᵢ)² of 30 intervals [0, 1]: from 0 to 900, and 40 runs cannot know."""

    def response(**x):
        return sum(x.values()) ** 2

    inputs = {f"x{k}": fb.Interval(0.0, 1.0) for k in range(30)}
    bands = fb.propagate(response, inputs, fb.AdaptivePCCI(0.01, max_runs=40))
    error = float(np.abs(bands["error_bar"] - [0.0, 900.0]).mean()) / 900
    assert bands.attrs["expected_error"] > error / 5
    assert bands.attrs["expected_error"] > 0.01


def test_all_terms_may_be_in_use():
    bands = fb.propagate(lambda e: abs(e - 0.3), {"e": fb.Interval(-1, 1)}, fb.AdaptivePCCI(1e-9))
    assert bands.attrs["stopped"] == "all orders are in use"


def test_an_output_that_is_small_counts_like_any_other():
    """In other units, of which one is 1e-9 of the other, the same is found."""

    def response(x, e):
        return np.stack([1e6 * (x + e), 1e-6 * np.tanh(2 * x + e)], axis=1)[:, :, None]

    inputs = {"x": fb.Normal(0.0, 1.0), "e": fb.Interval(-1.0, 1.0)}
    bands = fb.propagate(response, inputs, fb.AdaptivePCCI(0.01, max_runs=40))
    assert bands.attrs["expected_error"] > 0.01


def test_generic_points_are_on_no_coordinate_of_the_nested_ones():
    families = HERMITE, LEGENDRE
    xi, eta = generic_points(0, 64, 3, families)
    for nested in NestedDesign(first_terms(3, 2, 40), families).points:
        for coordinates in (xi, eta):
            assert np.abs(coordinates.ravel()[:, None] - nested.ravel()).min() > 1e-4
    batches = [
        np.concatenate(v)
        for v in zip(
            generic_points(0, 8, 3, families), generic_points(8, 56, 3, families), strict=True
        )
    ]
    np.testing.assert_array_equal(batches[0], xi)
    np.testing.assert_array_equal(batches[1], eta)


def test_places_of_extremes_are_apart_and_not_reached_yet():
    values = np.array([[[-1.0, -2.0, -3.0]], [[1.0, 2.0, 3.0]]])
    places = np.array([[[[-1.0], [-0.9], [-0.8]]], [[[1.0], [0.1], [0.9]]]])
    results = [Extremes(values, places)] * 3
    nothing = np.array([np.full((1, 3), np.inf), np.full((1, 3), -np.inf)])
    np.testing.assert_array_equal(extreme_places(results, 8, nothing, 0.01), [[-0.8], [1.0], [0.1]])
    bounds = values + np.array([0.0, 0.03, 0.05])  # of a width of 4
    np.testing.assert_array_equal(extreme_places(results, 8, bounds, 0.01), [[-0.8]])
    assert len(extreme_places(results, 8, bounds, 0.02)) == 0


def test_runs_fitted_later_count_by_the_probability_of_what_is_nearest_to_them():
    index = np.array([[0, 0], [1, 0], [0, 1], [0, 2], [2, 1]])  # of e and x
    design = NestedDesign(index, [HERMITE])
    end = ndtr(-np.sqrt(3) / 2)
    middle = 0.5  # e is nearest to 1, −1 or 0 with 1/4, 1/4 and 1/2
    np.testing.assert_allclose(design.weights(0), [1, 0.25, end, end, middle * end], rtol=1e-5)
    np.testing.assert_array_equal(design.weights(3), design.weights(0)[3:])
    uniform = NestedDesign(np.arange(6)[:, None], [LEGENDRE])
    points = np.sort(LEGENDRE.sequence(6))
    cells = np.diff([-1, *(points[1:] + points[:-1]) / 2, 1]) / 2
    order = np.argsort(LEGENDRE.sequence(6))
    np.testing.assert_allclose(uniform.weights(1)[order[order > 0] - 1], cells[order > 0], 1e-4)


def test_values_at_fixed_times_where_phases_are_not_resolved():
    case = formula(wave)
    method = fb.AdaptivePCCI(0.01, max_runs=24, phase_resolved=False)
    bands = fb.propagate(case.response, case.inputs, method)
    assert bands.attrs["runs"] <= 24
    assert int(bands["carriers"]) == 0
    assert bands.attrs["expected_error"] > 0.05


def test_phases_need_equidistant_times_and_values_do_not():
    times = np.array([0.0, 1.0, 3.0, 3.5])

    def response(x, e):
        values = (x + e)[:, None] * times
        return xr.DataArray(values, dims=("sample", "time"), coords={"time": times})

    inputs = {"x": fb.Normal(0.0, 1.0), "e": fb.Interval(0.0, 2.0)}
    with pytest.raises(fb.errors.InputError, match="equidistant values of 'time'"):
        fb.propagate(response, inputs, fb.AdaptivePCCI())
    bands = fb.propagate(response, inputs, fb.AdaptivePCCI(phase_resolved=False))
    np.testing.assert_allclose(bands["error_bar"], [-1 * times, 3 * times], atol=1e-9)


def test_twenty_inputs():
    """An additive function with one product: bounds and moments are known."""
    m = 10
    n = 10
    weights = 0.7 ** np.arange(10)

    def response(**values):
        x = np.stack([values[f"x{k}"] for k in range(m)])
        a = np.stack([values[f"a{k}"] for k in range(n)])
        return 10 + weights @ x + weights @ a + 0.3 * x[0] * a[0] + 0.2 * x[0] * x[1]

    inputs = {f"x{k}": fb.Interval(-1.0, 1.0) for k in range(m)}
    inputs |= {f"a{k}": fb.Normal(0.0, 1.0) for k in range(n)}
    bands = fb.propagate(response, inputs, fb.AdaptivePCCI(0.001))
    # 40 of them tell that many inputs matter; rounding chooses between points that are as good.
    assert bands.attrs["runs"] in (113, 129)
    total = weights.sum()
    np.testing.assert_allclose(bands["mean"][1], 10 + total + 0.2, rtol=1e-6)
    rest = (weights[1:] ** 2).sum()
    top = 10 + total + 0.2 + np.sqrt(1.3**2 + rest)
    assert float(bands["error_bar"][1]) == pytest.approx(top, rel=1e-6)


def test_a_random_field_of_many_terms():
    """The mean square of a field over its length has known moments."""
    field = fb.RandomField(1.0, 0.2, correlation_length=0.2, domain=(0.0, 1.0))
    assert field.dimension >= 6
    x = np.linspace(0.0, 1.0, 41)

    def response(stiffness, load):
        return load * np.mean(stiffness(x) ** 2, axis=1)

    inputs = {"stiffness": field, "load": fb.Interval(1.0, 2.0)}
    bands = fb.propagate(response, inputs, fb.AdaptivePCCI(1e-3, max_runs=120))
    basis = 0.2 * field.expansion.basis(x)
    square = basis @ basis.T / len(x)  # mean of the squared fluctuation, a quadratic form in ξ
    linear = 2 * basis.mean(axis=1)
    mean = 1 + np.trace(square)
    std = np.sqrt(linear @ linear + 2 * np.sum(square**2))
    np.testing.assert_allclose(bands["mean"], [mean, 2 * mean], rtol=2e-3)
    assert float(bands["error_bar"][1]) == pytest.approx(2 * (mean + std), rel=2e-3)
    assert bands.sizes["variable"] == 1 + field.dimension


def test_the_batch_and_the_order_of_inputs_do_not_change_bands():
    case = formula(damped_oscillation)
    forward = fb.propagate(case.response, case.inputs, fb.AdaptivePCCI())
    reports = []
    reverse = fb.propagate(
        case.response,
        dict(reversed(case.inputs.items())),
        fb.AdaptivePCCI(),
        batch=3,
        progress=lambda *done: reports.append(done),
    )
    xr.testing.assert_equal(forward.drop_attrs(), reverse.drop_attrs())
    assert reports[-1] == (forward.attrs["runs"],) * 2


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: fb.AdaptivePCCI(0.0), "tolerance must be positive; got 0"),
        (lambda: fb.AdaptivePCCI(0.01, max_runs=1), "max_runs must be 2 or more; got 1"),
        (lambda: fb.AdaptivePCCI(0.01, max_runs=2.5), "max_runs must be a whole number"),  # type: ignore
        (
            lambda: fb.propagate(
                lambda x, y, z: x + y + z,
                {k: fb.Interval(0.0, 1.0) for k in "xyz"},
                fb.AdaptivePCCI(0.01, max_runs=3),
            ),
            "max_runs must be 6 or more for 3 variables; got 3",
        ),
    ],
)
def test_bad_input_is_refused(call, text):
    with pytest.raises(fb.errors.InputError, match=text):
        call()


EVERY_OTHER = TIMES[:500:2]
"""25 times per period."""


class Coarse:
    """An oscillator with an error of h² in its frequency and its amplitude; h is the step."""

    def __init__(self, h):
        self.h = h

    def refined(self):
        return Coarse(self.h / 2)

    def __call__(self, x, e):
        frequency = (1 + 0.02 * x + 0.02 * e) * (1 - self.h**2)
        wave = np.cos(2 * np.pi * frequency[:, None] * EVERY_OTHER)
        values = (1 + 2 * self.h**2) * wave + 0.1 * (1 + 3 * self.h**2) * e[:, None]
        return xr.DataArray(values, dims=("sample", "time"), coords={"time": EVERY_OTHER})


@pytest.mark.parametrize("h", [0.1, 0.03])
def test_the_error_of_the_step_is_that_of_the_exact_bands(h):
    """Of bands of order two; the amplitude's part is exact, of the phase's part the mean is."""
    inputs = {"x": fb.Normal(0.0, 1.0), "e": fb.Interval(-1.0, 1.0)}
    bands = fb.propagate(Coarse(h), inputs, fb.AdaptivePCCI(0.001, correct=False))
    exact = fb.propagate(Coarse(0.0), inputs, fb.AdaptivePCCI(0.001))
    width = float((exact["error_bar"][1] - exact["error_bar"][0]).mean())
    for name in ("mean", "error_bar"):
        true = float(abs(bands[name] - exact[name]).mean()) / width
        estimate = float(bands[f"{name}_discretization_error"].mean()) / width
        assert estimate == pytest.approx(true, rel=0.3)
    attrs = bands.attrs
    assert attrs["discretization_error"] > 10 * attrs["expansion_error"]
    total = attrs["expansion_error"] + attrs["discretization_error"]
    assert attrs["expected_error"] == pytest.approx(total, rel=0.5)
    assert attrs["runs_refined"] == 3
    assert attrs["runs"] == attrs["runs_fitted"] + attrs["runs_checked"] + 3 + 1
    assert exact.attrs["discretization_error"] < 1e-9


class Open:
    """An oscillator with errors of its step h, order two, and of its mesh, order four in 1/n."""

    def __init__(self, h=1.0, n=2, left_out=("step", "elements")):
        self.h = h
        self.n = n
        self.open_settings = left_out

    def left_out(self, x, e):
        return list(self.open_settings)

    def refinements(self, x, e):
        return {"step": Open(self.h / 2, self.n), "elements": Open(self.h, 2 * self.n)}

    def discretization(self, x, e):
        return {"step": self.h, "elements": self.n}

    def __call__(self, x, e):
        if self.h > 0.9:
            raise fb.errors.SimulationError("no convergence", {0: (0.1, "the step is too long")})
        lag = 1 - self.h**2 / 4 - 0.3 / self.n**4
        frequency = (1 + 0.02 * x + 0.02 * e) * lag
        wave = np.cos(2 * np.pi * frequency[:, None] * EVERY_OTHER) + 0.1 * e[:, None]
        return xr.DataArray(wave, dims=("sample", "time"), coords={"time": EVERY_OTHER})


@pytest.mark.parametrize("tolerance", [0.05, 0.003])
def test_a_discretization_that_is_left_out_is_chosen_by_the_tolerance(tolerance):
    inputs = {"x": fb.Normal(0.0, 1.0), "e": fb.Interval(-1.0, 1.0)}
    surrogate = fb.expand(Open(), inputs, fb.AdaptivePCCI(tolerance))
    bands = surrogate.bands()
    assert fb.verify(surrogate, Open()).verification.attrs["confirmed"] == "yes"
    exact = fb.propagate(Open(0.0, 10**6, ()), inputs, fb.AdaptivePCCI(1e-5))
    width = float((exact["error_bar"][1] - exact["error_bar"][0]).mean())
    true = max(float(abs(bands[n] - exact[n]).mean()) / width for n in ("mean", "error_bar"))
    attrs = bands.attrs
    assert true < attrs["expected_error"] < tolerance
    assert attrs["expected_error"] > tolerance / 1000  # no finer than it takes
    step, elements = (part.split()[1] for part in attrs["discretization"].split(", "))
    assert 0.001 < float(step) < 0.9
    assert int(elements) <= 32
    parts = attrs["step_error"] + attrs["elements_error"]
    assert attrs["discretization_error"] == pytest.approx(parts, rel=0.01)
    kinds = ("fitted", "checked", "refined", "coarser", "repeated")
    assert attrs["runs"] == sum(attrs[f"runs_{kind}"] for kind in kinds)
    parts = (f"{part} of the response by phases" for part in ("step", "elements"))
    assert attrs["corrected"] == "; ".join(parts)
    uncorrected = fb.propagate(Open(), inputs, fb.AdaptivePCCI(tolerance, correct=False)).attrs
    assert uncorrected["runs_coarser"] > 0
    assert uncorrected["expected_error"] < tolerance
    with pytest.raises(fb.errors.InputError, match="step and elements must be given for PCCI"):
        fb.propagate(Open(), inputs, fb.PCCI())


def test_what_is_left_out_is_halved_a_limited_number_of_times():
    class Noisy(Open):
        """Never converges."""

        def refinements(self, x, e):
            return {"step": Noisy(self.h / 2)}

        def __call__(self, x, e):
            phase = 2.1 * np.log2(self.h)
            wave = np.cos(2 * np.pi * (1 + 0.02 * x + 0.02 * e)[:, None] * EVERY_OTHER + phase)
            return xr.DataArray(wave, dims=("sample", "time"), coords={"time": EVERY_OTHER})

    inputs = {"x": fb.Normal(0.0, 1.0), "e": fb.Interval(-1.0, 1.0)}
    bands = fb.propagate(Noisy(left_out=("step",)), inputs, fb.AdaptivePCCI(0.01))
    assert bands.attrs["discretization"].startswith(f"step {2.0**-9:.6g}")
    assert bands.attrs["discretization_error"] > 0.1
    assert bands.attrs["expansion_error"] < 0.005
    assert remarks(bands)[-1].startswith("The tolerance of 1 % is NOT met by the discretization")


def test_finer_runs_that_fail_are_not_fine_enough_where_the_step_is_left_out():
    class Failing(Open):
        """Only the coarsest step works."""

        def refinements(self, x, e):
            return {"step": Failing(self.h / 2, 100)}

        def __call__(self, x, e):
            if self.h < 1:
                raise fb.errors.SimulationError("no convergence", {0: (0.1, "diverged")})
            return Open(0.8, 100)(x, e)

    inputs = {"x": fb.Normal(0.0, 1.0), "e": fb.Interval(-1.0, 1.0)}
    with pytest.raises(fb.errors.SimulationError):
        fb.propagate(Failing(left_out=("step",)), inputs, fb.AdaptivePCCI(0.01))


class Computed(Open):
    """An oscillator, and a second output, `other`, at each step h and number of elements n."""

    def __init__(self, other, h=0.5, n=100, left_out=("step",), quantities=(), tensor_names=()):
        super().__init__(h, n, left_out)
        self.other = other
        self.names = quantities
        self.tensor_names = tensor_names

    def _at(self, h, n):
        return type(self)(self.other, h, n, self.open_settings, self.names, self.tensor_names)

    def refinements(self, x, e):
        return {"step": self._at(self.h / 2, self.n), "elements": self._at(self.h, 2 * self.n)}

    def quantities(self, x, e):
        return list(self.names)

    def tensors(self, x, e):
        return list(self.tensor_names)

    def __call__(self, x, e):
        wave = super().__call__(x, e).values
        values = np.stack([wave, self.other(wave, x, e, self.h, self.n)], axis=1)
        labels = {"output": ["a", "b"], "time": EVERY_OTHER}
        return xr.DataArray(values, dims=("sample", "output", "time"), coords=labels)


SPREAD = {"x": fb.Normal(0.0, 1.0), "e": fb.Interval(-1.0, 1.0)}


@cache
def oscillator_alone():
    """Return the bands of the first output of `Computed`, without the second."""
    response = Open(0.5, 100, ("step",))
    return fb.propagate(response, SPREAD, fb.AdaptivePCCI(0.01, correct=False))


def noise(x, e, h):
    """Return noise that is another one for every run and step."""
    seeds = np.abs(1e6 * (x + 3 * e + h)).astype(int)
    return np.stack([np.random.default_rng(s).standard_normal(len(EVERY_OTHER)) for s in seeds])


def step_of(bands):
    return float(bands.attrs["discretization"].split(", ")[0].split()[1])


def test_a_component_that_is_rounding_does_not_drive_the_refinement():
    def other(wave, x, e, h, n):
        return 1e-9 * noise(x, e, h)

    response = Computed(other, quantities=("s [Pa]", "s [Pa]"))
    bands = fb.propagate(response, SPREAD, fb.AdaptivePCCI(0.01, correct=False))
    reference = oscillator_alone()
    assert bands.attrs["expected_error"] < 0.01
    assert bands.attrs["discretization"] == reference.attrs["discretization"]
    assert bands.attrs["runs"] == reference.attrs["runs"]
    assert bands.attrs["small_components"] == "b"
    assert any(line.startswith("b: the tolerance is relative") for line in remarks(bands))
    assert bool(bands["trusted"].all())
    error = bands["error_bar_expected_error"].sel(output="b")
    assert 1e-10 < float(error.mean()) < 1e-8  # in the unit of the output
    assert "small_components" not in reference.attrs
    same = Computed(lambda wave, x, e, h, n: 2 * wave, quantities=("s [Pa]", "s [Pa]"))
    assert (
        "small_components"
        not in fb.propagate(same, SPREAD, fb.AdaptivePCCI(0.01, correct=False)).attrs
    )


def test_components_of_a_tensor_are_judged_by_the_widest_and_told_by_their_own():
    def other(wave, x, e, h, n):
        return 1e-2 * (wave + 5 * h * np.cos(7 * EVERY_OTHER))  # which converges slowly

    names = ("s [Pa]", "s [Pa]")
    vector = Computed(other, quantities=names)
    tensor = Computed(other, quantities=names, tensor_names=names[:1])
    reference = oscillator_alone()
    bands = fb.propagate(tensor, SPREAD, fb.AdaptivePCCI(0.01, correct=False))
    assert bands.attrs["discretization"] == reference.attrs["discretization"]
    vector_bands = fb.propagate(vector, SPREAD, fb.AdaptivePCCI(0.01, correct=False))
    assert step_of(vector_bands) < step_of(bands)
    assert bands.attrs["expected_error"] < 0.01
    assert bands.attrs["small_components"] == "b"
    width = (bands["error_bar"][1] - bands["error_bar"][0]).mean("time")
    error_of_b = float((bands["error_bar_expected_error"].mean("time") / width).sel(output="b"))
    assert error_of_b > 0.01 > float(bands["relative_expected_error"].sel(output="b"))
    assert expected_errors(bands)["b"] == pytest.approx(error_of_b, rel=0.2)


def test_a_component_of_a_tensor_is_not_trusted_where_its_own_variation_is_missed():
    def other(wave, x, e, h, n):
        return 1e-2 * noise(x, e, 0)

    names = ("s [Pa]", "s [Pa]")
    tensor = Computed(other, quantities=names, tensor_names=names[:1], left_out=())
    bands = fb.propagate(tensor, SPREAD, fb.AdaptivePCCI(0.1))
    assert bands["trusted"].values.tolist() == [True, False]
    assert bands.attrs["not_trusted"].startswith("b (")


def test_an_output_that_is_zero_in_all_runs_does_not_drive_the_refinement():
    response = Computed(lambda wave, x, e, h, n: 0 * wave)
    bands = fb.propagate(response, SPREAD, fb.AdaptivePCCI(0.01, correct=False))
    reference = oscillator_alone()
    assert bands.attrs["expected_error"] < 0.01
    assert bands.attrs["discretization"] == reference.attrs["discretization"]
    assert np.all(bands["error_bar"].sel(output="b") == 0)


def test_refinement_ends_where_the_error_of_an_output_no_longer_falls():
    def other(wave, x, e, h, n):
        offset = np.where(np.log2(h) % 2 < 1, 1.0, -1.0)  # which no step removes
        return wave + 0.03 * offset * np.cos(2 * np.pi * EVERY_OTHER)

    bands = fb.propagate(Computed(other), SPREAD, fb.AdaptivePCCI(0.01))
    text = "the error of b that is due to the step no longer falls: it oscillates about "
    assert in_words(bands.attrs).startswith(text)
    assert [verdict.cause for verdict in of_attributes(bands.attrs)] == [Cause.STAGNANT]
    assert bands.attrs["discretization_error"] > 0.005
    assert remarks(bands)[-1].endswith("NOT met by the discretization: " + in_words(bands.attrs))
    assert step_of(bands) > 2.0**-8
    of_a = bands["error_bar_discretization_error"].sel(output="a").mean()
    width = (bands["error_bar"][1] - bands["error_bar"][0]).sel(output="a").mean()
    assert float(of_a / width) < 0.005  # the other output went on


def test_an_output_that_vanishes_does_not_drive_the_refinement():
    """As the moment at a pinned end, of which finer meshes leave less and less."""

    def other(wave, x, e, h, n):
        moment = (e + 0.1 * x)[:, None] + 5 * EVERY_OTHER / EVERY_OTHER[-1]
        return h**2 * moment

    bands = fb.propagate(Computed(other), SPREAD, fb.AdaptivePCCI(0.01, correct=False))
    text = "the error of b that is due to the step no longer falls: it oscillates about "
    assert in_words(bands.attrs).startswith(text)
    assert [verdict.cause for verdict in of_attributes(bands.attrs)] == [Cause.STAGNANT]
    assert step_of(bands) >= 2.0**-6
    error = bands["error_bar_discretization_error"].sel(output="b").mean()
    width = (bands["error_bar"][1] - bands["error_bar"][0]).sel(output="b").mean()
    assert error > width


@pytest.mark.parametrize(
    "error",
    [
        fb.errors.AssemblyError(
            "2 of 8 runs failed\nsample 0, t = 0 s: no rank", {0: (0.0, "no rank")}
        ),
        fb.errors.SimulationError(
            "2 of 8 runs failed\nsample 0, t = 1 s: no rank", {0: (1.0, "no rank")}
        ),
        fb.errors.InputError("8 samples would take 80 GB of memory"),
        MemoryError(),
    ],
    ids=lambda error: type(error).__name__,
)
def test_a_level_that_fails_does_not_lose_the_finished_ones(error):
    def other(wave, x, e, h, n):
        if h < 0.05:
            raise error
        return wave + 0.2 * np.cos(3 / h) * np.cos(2 * np.pi * EVERY_OTHER)

    bands = fb.propagate(Computed(other), SPREAD, fb.AdaptivePCCI(0.1))
    assert step_of(bands) > 0.05
    assert bands.attrs["halved"] == ["step"] * round(np.log2(0.5 / step_of(bands)))
    assert bands.attrs["discretization_error"] > 0.1
    assert bands.attrs["not_refined"].startswith("a finer one fails (")
    assert "NOT met by the discretization: a finer one fails" in remarks(bands)[-1]
    kinds = ("fitted", "checked", "refined", "coarser", "repeated")
    assert bands.attrs["runs"] >= sum(bands.attrs[f"runs_{kind}"] for kind in kinds)


def test_runs_that_cannot_start_are_not_tried_with_finer_steps():
    steps = []

    def other(wave, x, e, h, n):
        steps.append(h)
        raise fb.errors.AssemblyError("1 of 8 runs failed", {0: (0.0, "open")})

    with pytest.raises(fb.errors.AssemblyError):
        fb.propagate(Computed(other), SPREAD, fb.AdaptivePCCI(0.01))
    assert len(set(steps)) == 1


def test_what_is_given_too_coarsely_is_told_where_the_rest_is_left_out():
    inputs = {"x": fb.Normal(0.0, 1.0), "e": fb.Interval(-1.0, 1.0)}
    bands = fb.propagate(Open(n=1, left_out=("step",)), inputs, fb.AdaptivePCCI(0.01))
    assert bands.attrs["elements_error"] > 0.01
    assert bands.attrs["step_error"] < 0.005
    assert "the given step or elements are too coarse" in remarks(bands)[-1]


def test_a_response_without_a_finer_one_says_so():
    case = formula(wave)
    bands = fb.propagate(case.response, case.inputs, fb.AdaptivePCCI(0.01))
    assert bands.attrs["discretization_error"] == "not estimated"
    assert "mean_discretization_error" not in bands
    assert bands.attrs["runs_refined"] == 0
    np.testing.assert_array_equal(bands["mean_expected_error"], bands["mean_expansion_error"])


def test_a_finer_run_that_fails_loses_nothing():
    class Failing(Coarse):
        def refined(self):
            def fails(x, e):
                raise fb.errors.SimulationError("no convergence", {0: (0.1, "diverged")})

            return fails

    inputs = {"x": fb.Normal(0.0, 1.0), "e": fb.Interval(-1.0, 1.0)}
    with pytest.warns(fb.errors.FlexbandWarning, match="discretization error is not estimated"):
        bands = fb.propagate(Failing(0.1), inputs, fb.AdaptivePCCI(0.01))
    assert bands.attrs["discretization_error"] == "not estimated"


@pytest.mark.parametrize(
    "quantity", [fb.Uniform(-1.0, 1.0), fb.Interval(-1.0, 1.0), fb.Normal(0.0, 1.0)], ids=repr
)
def test_a_jump_uses_up_all_orders_of_one_input(quantity):
    bands = fb.propagate(lambda x: np.sign(x - 0.123), {"x": quantity}, fb.AdaptivePCCI(0.001))
    assert bands.attrs["stopped"] == "all orders are in use"
    assert bands.attrs["expected_error"] > 0.02


def test_the_place_where_a_response_is_not_smooth_is_named():
    def response(gap, force):
        contact_force = np.maximum(0.0, gap - 0.3)[:, None] * np.sin(9 * EVERY_OTHER)
        smooth = 0.1 * force[:, None] * (1 + EVERY_OTHER)
        outputs = np.stack([smooth, contact_force + smooth], axis=1)
        labels = {"output": ["u", "F"], "time": EVERY_OTHER}
        return xr.DataArray(outputs, dims=("sample", "output", "time"), coords=labels)

    inputs = {"gap": fb.Interval(-1.0, 1.0), "force": fb.Normal(0.0, 1.0)}
    bands = fb.propagate(response, inputs, fb.AdaptivePCCI(0.001, max_runs=60))
    message = bands.attrs["largest_miss"]
    assert message.startswith("of output F, time ")
    assert message.endswith("in gap")
    place = float(re.search(r"gap = (\S+):", message)[1])
    assert abs(place - 0.3) < 0.25  # a held-out run next to it


def test_only_runs_that_fail_are_left_out_of_those_held_out():
    values = np.array([1.0, 2.0, np.nan]).reshape(3, 1, 1)
    runs = ResponseRuns(np.zeros((3, 0)), np.arange(3.0)[:, None], values)
    single = ResponseRuns(*(v[:1] for v in runs))
    np.testing.assert_array_equal(
        successful_runs(single, 0).values, single.values
    )  # bounds at one place
    np.testing.assert_array_equal(successful_runs(runs, 0).values, values[:2])
    with pytest.raises(fb.errors.RunError, match="most of the runs that check the fit"):
        successful_runs(runs, 1)
    with pytest.raises(fb.errors.RunError, match="1 of 3 runs that are fitted"):
        successful_runs(runs, 3)


def test_bands_without_width_are_warned_of():
    """A product of 30 sines of many periods has no terms of low order."""

    def response(a, e):
        return np.sin(40.0 * a(np.linspace(0.0, 1.0, 30))).prod(axis=1) * e

    field = fb.RandomField(1.0, 0.5, correlation_length=0.05, domain=(0.0, 1.0), terms=30)
    inputs = {"a": field, "e": fb.Interval(1.0, 1.01)}
    with pytest.warns(
        fb.errors.FlexbandWarning, match="the response: the bands have no width although"
    ):
        bands = fb.propagate(response, inputs, fb.AdaptivePCCI(max_runs=32))
    assert float(bands["error_bar"][1] - bands["error_bar"][0]) == 0
    assert not bands["trusted"]


def test_a_kink_between_random_inputs_is_not_continued_by_wild_products():
    """Products of high orders oscillate between the axes, where no run is; σ depends on them."""

    def response(x, y):
        return np.maximum(0.0, (x + y) / np.sqrt(2) - 1)

    bands = fb.propagate(response, {"x": fb.Normal(0, 1), "y": fb.Normal(0, 1)}, fb.AdaptivePCCI())
    z = np.linspace(1.0, 9.0, 20001)
    density = np.exp(-z * z / 2) / np.sqrt(2 * np.pi)
    mean, square = (np.trapezoid((z - 1) ** k * density, z) for k in (1, 2))
    std = np.sqrt(square - mean**2)
    true = np.abs(bands["error_bar"].values.ravel() - [mean - std, mean + std]).mean() / (2 * std)
    assert true < 0.05
    assert true < 5 * bands.attrs["expected_error"]


def test_each_output_keeps_one_fit_and_runs_are_held_once():
    rates = np.linspace(0.2, 2.0, 12)[:, None]
    time = np.linspace(0.0, 1.0, 1500)

    def response(a, b, x):
        return np.exp(rates * (a + 0.5 * b + 0.2 * x)[:, None, None] * time)

    inputs = {"a": fb.Interval(-1, 1), "b": fb.Interval(-1, 1), "x": fb.Normal(0, 1)}
    method = fb.AdaptivePCCI(1e-9, 96, phase_resolved=False)
    fb.expand(response, inputs, method)  # compiles
    tracemalloc.start()
    surrogate = fb.expand(response, inputs, method)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    outputs = np.concatenate([expansion.outputs for expansion in surrogate.expansions])
    np.testing.assert_array_equal(np.sort(outputs), np.arange(len(rates)))
    runs = 8 * surrogate.diagnostics.attrs["runs"] * rates.size * time.size
    assert peak < 5 * runs


def test_a_tolerance_that_is_missed_is_warned_of():
    """A jump, of which no polynomials make a band within 1 % in 60 runs."""
    inputs = {"k": fb.Interval(90.0, 110.0), "a": fb.Normal(1.0, 0.05)}
    with pytest.warns(
        fb.errors.ToleranceWarning, match=r"of the error bar's width, above .* of 1 %:"
    ):
        bands = fb.propagate(lambda k, a: (k > 103.0) * a, inputs, fb.AdaptivePCCI(0.01, 60))
    assert bands.attrs["expected_error"] > 0.01
    with warnings.catch_warnings(action="error"):
        fb.propagate(lambda k, a: k * a, inputs, fb.AdaptivePCCI(0.01))


def test_a_step_that_misses_the_tolerance_is_not_blamed_on_the_runs():
    def swing(stiffness, mass):
        body = fb.PointMass(mass=mass, position=(1.2, 0.0))
        spring = fb.Spring("body", (0.0, 0.0), stiffness, rest_length=1.0)
        sensors = {"body": fb.Velocity("body")}
        return fb.Mechanism(bodies={"body": body}, loads={"spring": spring}, sensors=sensors)

    inputs = {"stiffness": fb.Interval(95.0, 105.0), "mass": fb.Normal(1.0, 0.01)}
    coarse = fb.dynamic_response(swing, duration=2.0, step=0.05)
    with pytest.warns(
        fb.errors.ToleranceWarning, match="due to step; give a finer step, or omit it"
    ):
        bands = fb.propagate(coarse, inputs, fb.AdaptivePCCI(0.01))
    assert bands.attrs["step_error"] > 10 * bands.attrs["expansion_error"]


def test_a_step_that_is_left_out_resolves_a_fast_load():
    """The velocity is F (1 − cos ωt) / (m ω); a load of 800 Hz has eight periods."""
    omega = 2 * np.pi * 800.0

    def build(force, mass):
        return fb.Mechanism(
            bodies={"p": fb.PointMass(mass=mass)},
            joints={"s": fb.Slot("p", (0.0, 0.0))},
            loads={"f": fb.Force("p", x=lambda t: force * np.sin(omega * t))},
            sensors={"v": fb.Velocity("p")},
        )

    response = fb.dynamic_response(build, duration=0.01, output_step=2.5e-4)
    inputs = {"force": fb.Interval(900.0, 1100.0), "mass": fb.Normal(1.0, 0.02)}
    bands = fb.propagate(response, inputs, fb.AdaptivePCCI())
    shape = (1 - np.cos(omega * bands["time"].values)) / omega
    inverse = 1.0 + 0.02**2, 0.02  # mean and standard deviation of 1/m, to 1e-3
    exact = np.array([900.0 * (inverse[0] - inverse[1]), 1100.0 * (inverse[0] + inverse[1])])
    bar = bands["error_bar"].sel(output="v_X").transpose("bound", "time").values
    error = (
        np.abs(bar - exact[:, None] * shape).mean() / np.ptp(exact[:, None] * shape, axis=0).mean()
    )
    assert error < 0.02
    assert error < 3 * bands.attrs["expected_error"]
