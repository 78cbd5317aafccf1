"""Choices with probabilities: random inputs that are one of several options."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

import flexband as fb
from flexband.report.page.inputs import known_of
from flexband.uncertainty.expansions.discrete import DiscretePolynomials

SHARES = np.array([0.9, 0.09, 0.01])
SUPPLIERS = fb.Choice("A", "B", "C", probabilities=SHARES)
LEVELS = np.array([0.0, 1.0, 2.5])
SLOPES = np.array([0.5, -0.5, 0.5])
STD = 0.2
INPUTS = {"supplier": SUPPLIERS, "x": fb.Normal(0.0, STD), "e": fb.Interval(-1.0, 1.0)}
E = np.linspace(-1.0, 1.0, 2001)[:, None]


def response(supplier, x, e):
    """Return level + x + slope · e of one supplier."""
    (option,) = set(supplier.tolist())
    k = "ABC".index(option)
    values = LEVELS[k] + np.asarray(x) + SLOPES[k] * np.asarray(e)
    return xr.DataArray(values[:, None], {"output": ["u"]}, ("sample", "output"))


@pytest.fixture(scope="module")
def surrogate():
    return fb.expand(response, INPUTS, fb.AdaptivePCCI(0.01))


def exact_moments():
    """Return μ and σ at all E: those of the mixture, with the scatter between the groups."""
    means = LEVELS + SLOPES * E
    mean = means @ SHARES
    return mean, np.sqrt((STD**2 + means**2) @ SHARES - mean**2)


@pytest.mark.parametrize(
    "method",
    [
        fb.AdaptivePCCI(0.01),
        fb.PCCI(1, 2),
        fb.ImprovedPCCI(2, 2),
        fb.methods.PhaseResolvedPCCI(1, 2),
    ],
)
def test_bands_are_those_of_the_mixture(method):
    bands = fb.propagate(response, INPUTS, method)
    mean, std = exact_moments()
    np.testing.assert_allclose(bands["mean"][:, 0], [mean.min(), mean.max()], atol=1e-9)
    ends = [(mean - std).min(), (mean + std).max()]
    np.testing.assert_allclose(bands["error_bar"][:, 0], ends, atol=1e-6)


def test_regression_has_no_terms_beyond_the_options():
    even = INPUTS | {"supplier": fb.Choice("A", "B", "C", probabilities=(0.4, 0.35, 0.25))}
    bands = fb.propagate(response, even, fb.methods.RegressionPCCI(3))
    means = (LEVELS + SLOPES * E) @ (0.4, 0.35, 0.25)
    np.testing.assert_allclose(bands["mean"][:, 0], [means.min(), means.max()], atol=1e-9)


@pytest.mark.parametrize("method", [fb.LHSScanning(4000, 5), fb.MonteCarlo(20000, 5)])
def test_samples_have_options_as_often_as_these_are_likely(method):
    bands = fb.propagate(response, INPUTS, method)
    mean, std = exact_moments()
    np.testing.assert_allclose(bands["mean"][:, 0], [mean.min(), mean.max()], atol=0.02)
    ends = [(mean - std).min(), (mean + std).max()]
    np.testing.assert_allclose(bands["error_bar"][:, 0], ends, atol=0.04)


@pytest.mark.parametrize("limit", [1.2, 1.9, 2.6])
def test_probabilities_are_bounded_for_all_options_together(surrogate, limit):
    of_options = norm.sf((limit - LEVELS - SLOPES * E) / STD)
    exact = of_options @ SHARES
    requirement = fb.Requirement("u", "u", below=limit)
    probabilities = fb.analysis.failure_probability(surrogate, requirement)[
        "probability"
    ].values.ravel()
    np.testing.assert_allclose(probabilities, [exact.min(), exact.max()], rtol=0.12)


def test_the_least_probability_is_that_of_all_options_at_one_place():
    """It is min Σ wP = 6.7 %, and not Σ w min P = 3·10⁻⁵."""

    def opposite(side, x, e):
        return np.asarray(x) + np.asarray(side) * np.asarray(e)

    inputs = {
        "side": fb.Choice(-0.5, 0.5, probabilities=(0.5, 0.5)),
        "x": fb.Normal(0.0, STD),
        "e": fb.Interval(-1.0, 1.0),
    }
    expansion = fb.expand(opposite, inputs, fb.AdaptivePCCI(0.01))
    requirement = fb.Requirement("u", below=0.3)
    probability = fb.analysis.failure_probability(expansion, requirement)[
        "probability"
    ].values.ravel()
    exact = [norm.sf(1.5), (norm.sf(-1.0) + norm.sf(4.0)) / 2]
    np.testing.assert_allclose(probability, exact, rtol=0.12)


def test_a_ringing_frequency_that_depends_on_an_option():
    """E cos(ω t) of two groups of frequencies: that of each group has a closed form."""
    time = np.linspace(0.0, 2.0, 161)
    shares = np.array([0.3, 0.7])
    rates = np.array([5.0, 5.3])

    def ringing(grade, f, e):
        frequency = np.asarray(grade) * np.asarray(e) + np.asarray(f)
        values = np.cos(2 * np.pi * frequency[:, None] * time)
        return xr.DataArray(values, {"time": time}, ("sample", "time"))

    inputs = {
        "grade": fb.Choice(*rates, probabilities=shares),
        "f": fb.Normal(0.0, 0.05),
        "e": fb.Interval(0.99, 1.01),
    }
    expansion = fb.expand(ringing, inputs, fb.AdaptivePCCI(0.01))
    assert expansion.diagnostics["carriers"] == 1
    wave = [
        shares @ (np.cos(k * np.outer(rates, angle)) * np.exp(-((k * 0.05 * angle) ** 2) / 2))
        for angle in [2 * np.pi * time]
        for k in (1, 2)
    ]
    moments = expansion.moments(e=1.0)
    np.testing.assert_allclose(moments["mean"].values.ravel(), wave[0], atol=2e-4)
    variance = 0.5 + 0.5 * wave[1] - wave[0] ** 2
    np.testing.assert_allclose(moments["std"].values.ravel() ** 2, variance, atol=4e-4)


def test_a_surrogate_of_options_is_saved_evaluated_and_narrowed(surrogate, tmp_path):
    fb.save_surrogate(surrogate, tmp_path / "surrogate.npz")
    copy = fb.load_surrogate(tmp_path / "surrogate.npz")
    assert copy.bands().equals(surrogate.bands())
    values = copy.evaluate(supplier=np.array(["C", "A"]), x=0.1, e=1.0).values[:, 0]
    np.testing.assert_allclose(values, [3.1, 0.6], atol=1e-9)
    bands = copy.narrowed(supplier="B").bands()
    np.testing.assert_allclose(bands["mean"][:, 0], [0.5, 1.5], atol=1e-9)
    np.testing.assert_allclose(bands["error_bar"][:, 0], [0.3, 1.7], atol=1e-9)
    for change in ("D", fb.Interval(0.0, 1.0)):
        with pytest.raises(fb.errors.InputError, match="supplier: must be one of"):
            copy.narrowed(supplier=change)
    with pytest.raises(fb.errors.InputError, match="supplier: must be one of 'A', 'B', 'C'"):
        copy.evaluate(supplier="D", x=0.0, e=0.0)


def test_shares_of_the_variance_are_those_of_a_sum(surrogate):
    indices = fb.analysis.sobol_indices(surrogate.narrowed(e=0.0))
    of_options = SHARES @ LEVELS**2 - (SHARES @ LEVELS) ** 2
    share = of_options / (of_options + STD**2)
    first = indices["first_order"].sel(name="supplier").values.ravel()
    np.testing.assert_allclose(first, share, rtol=1e-6)


def test_the_range_of_values_is_that_of_the_options_and_not_of_what_is_between():
    """A polynomial through the levels 0, 2, 1.9 of three options reaches 2.2 between them."""

    def level(supplier, e):
        return np.where(supplier == "B", 2.0, np.where(supplier == "C", 1.9, 0.0)) + 0.1 * e

    expansion = fb.expand(
        level, {"supplier": SUPPLIERS, "e": fb.Interval(-1.0, 1.0)}, fb.AdaptivePCCI(0.01)
    )
    result = fb.analysis.value_range(expansion, 1.0)
    np.testing.assert_allclose(result["range"], [-0.1, 2.1], atol=1e-9)
    assert result["range_choice"].values.tolist() == ["A", "B"]


@pytest.mark.parametrize(
    ("probabilities", "message"),
    [
        ((0.5, 0.6), "must add up to 1; got .* which are 1.1"),
        ((0.5, 0.25, 0.25), "must have a number for each of 2 options"),
        ((1.0, 0.0), "must be positive"),
        ((np.nan, 0.5), "must be finite"),
    ],
)
def test_impossible_probabilities_are_refused(probabilities, message):
    with pytest.raises(fb.errors.InputError, match=f"Choice probabilities {message}"):
        fb.Choice("A", "B", probabilities=probabilities)


def test_a_page_tells_how_likely_options_are():
    assert known_of(SUPPLIERS, 1.0) == ("choice", "A (90 %), B (9 %), C (1 %)")


@given(st.lists(st.floats(0.01, 1.0), min_size=2, max_size=7), st.integers(0, 2**31))
def test_polynomials_are_orthogonal_and_make_every_function(weights, seed):
    shares = np.array(weights) / np.sum(weights)
    points = np.linspace(0, 1, len(shares)) - shares.argmax() / (len(shares) - 1)
    family = DiscretePolynomials(tuple(points), tuple(shares))
    order = len(shares) - 1
    values = family.values(order, points)
    gram = values.T @ (shares[:, None] * values)
    np.testing.assert_allclose(gram, np.diag(family.norms(order)), atol=1e-7)
    assert np.abs(values).max() <= 1 + 1e-9
    assert np.linalg.matrix_rank(values) == len(shares)
    assert not family.values(order + 2, points)[:, order + 1 :].any()
    samples = family.of_normal(np.random.default_rng(seed).standard_normal(20000))
    often = [(samples == x).mean() for x in points]
    np.testing.assert_allclose(often, shares, atol=0.02)
