"""Distributions: their polynomials against closed forms, moments against quadrature, bad input."""

from itertools import product

import numpy as np
import pytest
import scipy.stats as ss
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import loggamma, roots_genlaguerre, roots_jacobi
from scipy.stats import norm

import flexband as fb
from flexband.uncertainty.expansions.densities import DensityPolynomials
from flexband.uncertainty.expansions.families import HERMITE, transform
from flexband.uncertainty.expansions.points.sequences import GENZ_KEISTER, PATTERSON
from flexband.uncertainty.inputs.distributions.bandwidth import bandwidth
from flexband.uncertainty.inputs.distributions.scipy_distribution import as_input
from flexband.uncertainty.phases.integration.rules import rule

DATA = np.random.default_rng(5).gamma(6.0, 0.5, 60)
KINDS = {
    "weibull": fb.Weibull(2.0, 3.0, 1.0),
    "gumbel": fb.Gumbel(4.0, cv=0.2),
    "beta": fb.Beta(2.0, 5.0, -1.0, 3.0),
    "singular": fb.Beta(0.5, 0.7),
    "triangular": fb.Triangular(1.0, 1.5, 4.0),
    "truncated": fb.TruncatedNormal(1.0, 0.5, lower=0.2),
    "scipy": as_input(ss.gamma(3.0, loc=1.0, scale=0.5)),
    "lognormal": fb.LogNormal(2.0, cv=0.3),
    "heavy": as_input(ss.t(8.0, loc=5.0, scale=0.3)),
    "samples": fb.Samples(DATA),
}
ALL = pytest.mark.parametrize("kind", KINDS)
OWN = pytest.mark.parametrize("kind", [k for k in KINDS if k not in ("lognormal", "heavy")])


def own_polynomials(distribution):
    return DensityPolynomials(distribution)


@pytest.mark.parametrize(("a", "b"), [(2.0, 5.0), (0.5, 0.5), (0.7, 30.0)])
def test_polynomials_of_a_beta_variable_are_those_of_jacobi(a, b):
    family = fb.Beta(a, b).family
    for count in (3, 12, 40):
        x, w = roots_jacobi(count, b - 1, a - 1)
        mean = a / (a + b)
        std = np.sqrt(a * b / ((a + b) ** 2 * (a + b + 1)))
        gauss = family.gauss(count)
        np.testing.assert_allclose(gauss[0], ((x + 1) / 2 - mean) / std, atol=1e-12)
        np.testing.assert_allclose(gauss[1], w / w.sum(), atol=1e-12)


def test_polynomials_of_exponential_and_gamma_variables_are_those_of_laguerre():
    for distribution, shape in ((fb.Weibull(1.0, 1.0), 1.0), (as_input(ss.gamma(2.5)), 2.5)):
        x, w = roots_genlaguerre(5, shape - 1)
        gauss = distribution.family.gauss(5)
        np.testing.assert_allclose(gauss[0], (x - shape) / np.sqrt(shape), rtol=1e-6, atol=1e-8)
        np.testing.assert_allclose(gauss[1], w / w.sum(), rtol=1e-6)


def test_nested_points_of_normal_and_uniform_densities_are_the_published_ones():
    x = own_polynomials(fb.Normal(3.0, 2.0)).sequence(9)
    np.testing.assert_allclose(np.sort(x[1::2]), np.sort(GENZ_KEISTER), atol=1e-9)
    np.testing.assert_allclose(x[2::2], -x[1::2], atol=1e-9)
    x = own_polynomials(fb.Uniform(-1.0, 1.0)).sequence(15) / np.sqrt(3)
    np.testing.assert_allclose(np.sort(x[1::2]), np.sort(PATTERSON), atol=1e-9)


@OWN
def test_polynomials_are_orthogonal_and_nested_points_stable(kind):
    family = KINDS[kind].family
    x, w = family.gauss(12)
    P = family.values(10, x) / np.sqrt(family.norms(10))
    np.testing.assert_allclose((P * w[:, None]).T @ P, np.eye(11), atol=1e-10)
    assert np.abs(family.values(10, family.of_normal(np.linspace(-4.5, 4.5, 99)))).max() < 1.001
    values = family.values(4, family.gauss(5)[0])
    np.testing.assert_allclose(transform(family, 4) @ values, np.eye(5), atol=1e-12)
    points = family.sequence(family.highest + 1)
    low, high = (KINDS[kind].support - np.array(family.scale[0])) / family.scale[1]
    assert points[0] == 0
    assert low < points.min() < points.max() < high
    assert np.diff(np.sort(points)).min() > 0.01
    assert family.highest in range(6, 21, 2)
    mean = np.linalg.inv(family.values(2, points[:3]))[0]  # the rule of three points
    third = mean @ points[:3] ** 3 - w @ x**3
    assert abs(third) < 1e-9


@ALL
def test_values_have_the_distribution(kind):
    """Values, normal variables and ξ belong together; mean and std by quadrature are SciPy's."""
    distribution = KINDS[kind]
    z = np.linspace(-6, 5, 56)
    x = distribution.at_normal(z)
    assert np.all(np.diff(x) > 0)
    np.testing.assert_allclose(distribution.to_normal(x), z, atol=1e-4 if kind == "scipy" else 1e-7)
    xi = distribution.family.of_normal(z)
    np.testing.assert_allclose(distribution.value(xi[:, None]), x, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(distribution.standard(x), xi, atol=1e-6)
    points, w = distribution.quantiles.rule(2)
    x = distribution.at_normal(points)
    mean, std = (
        (DATA.mean(), DATA.std(ddof=1)) if kind == "samples" else distribution.frozen.stats("mv")
    )
    std = std if kind == "samples" else np.sqrt(std)
    assert w @ x == pytest.approx(mean, rel=1e-8)
    assert np.sqrt(w @ (x - w @ x) ** 2) == pytest.approx(
        std, rel=1e-5 if kind == "heavy" else 1e-8
    )


@given(
    st.sampled_from(["beta", "weibull", "triangular", "truncated", "gumbel"]),
    st.floats(0.05, 0.95),
    st.floats(0.05, 0.95),
    st.integers(1, 8),
)
@settings(max_examples=10, deadline=None)
def test_gauss_points_integrate_polynomials_of_any_density(kind, u, v, count):
    """E x^j with count points, j < 2 count, against SciPy's quantiles on a fine rule."""
    distribution = {
        "beta": lambda: fb.Beta(0.2 + 8 * u, 0.2 + 8 * v),
        "weibull": lambda: fb.Weibull(1.0, 1 + 9 * u),
        "triangular": lambda: fb.Triangular(0.0, u, 1.0),
        "truncated": lambda: fb.TruncatedNormal(0.0, 1.0, -4 * u, 3 * v),
        "gumbel": lambda: fb.Gumbel(u, v),
    }[kind]()
    family = distribution.family
    x, w = family.gauss(count)
    fine, weights = distribution.quantiles.rule(40)
    fine = family.of_normal(fine)
    for j in range(2 * count):
        size = weights @ np.abs(fine) ** j
        assert w @ x**j == pytest.approx(weights @ fine**j, abs=1e-10 * size)
    assert len(set(family.sequence(family.highest + 1))) == family.highest + 1


FUNCTIONS = [lambda x: 1 / (1 + (x / 6) ** 2), lambda x: np.tanh(x / 4), lambda x: x**2 - x]


def exact(distribution, f):
    """Return mean and standard deviation of a function, by adaptive quadrature over the density."""
    if distribution.frozen is None:  # normal kernels
        c, p, h = distribution.kernels
        t = np.linspace(-8, 8, 801)
        x = c[:, None] + h[:, None] * t
        w = p[:, None] * np.exp(-t * t / 2)
        w /= w.sum()
        mean = np.sum(w * f(x))
        return mean, np.sqrt(np.sum(w * (f(x) - mean) ** 2))
    low, high = distribution.frozen.ppf([1e-14, 1 - 1e-14])
    pdf = distribution.frozen.pdf
    kinks = [
        distribution.frozen.mean(),
        getattr(distribution, "mode", distribution.frozen.median()),
    ]
    if distribution == KINDS["singular"]:  # no density at the ends
        low = 0.0
        high = 1.0
        pdf = np.ones_like
        kinks = []
        original, f = f, lambda u: original(distribution.frozen.ppf(u))
    mean = quad(lambda x: f(x) * pdf(x), low, high, points=kinks, limit=200)[0]
    var = quad(lambda x: (f(x) - mean) ** 2 * pdf(x), low, high, points=kinks, limit=200)[0]
    return mean, np.sqrt(var)


@ALL
def test_moments_of_functions(kind):
    """By tensor, adaptive and sampling methods; a quadratic function is exact for own densities."""
    distribution = KINDS[kind]
    mean, std = np.transpose([exact(distribution, f) for f in FUNCTIONS])

    def response(x):
        return np.stack([f(x) for f in FUNCTIONS], axis=1)[:, :, None]

    heavy = kind in ("heavy", "lognormal", "gumbel")
    limits = {
        fb.ImprovedPCCI(8, 1): 2e-3 if heavy else 1e-5,
        fb.AdaptivePCCI(1e-3): 1e-2 if heavy else 1e-3,
        fb.LHSScanning(2000, 2, 1): 0.03,
    }
    for method, limit in limits.items():
        low, high = fb.propagate(response, {"x": distribution}, method)["error_bar"].values[..., 0]
        np.testing.assert_allclose(((low + high) / 2 - mean) / std, 0, atol=limit)
        np.testing.assert_allclose((high - low) / 2 / std, 1, atol=limit)
    if distribution.family is not HERMITE:
        low, high = fb.propagate(response, {"x": distribution}, fb.PCCI(2, 1))["error_bar"].values[
            ..., 0
        ]
        assert (low + high)[2] / 2 == pytest.approx(mean[2], rel=1e-6)
        assert (high - low)[2] / 2 == pytest.approx(std[2], rel=1e-6)


B = np.sqrt(6) / np.pi
C = np.sqrt(3)
WAVES = {
    "gumbel": (
        fb.Gumbel(0.0, 1.0),
        lambda t: np.exp(loggamma(1 - 1j * B * t) - 1j * t * B * np.euler_gamma),
    ),
    "laplace": (as_input(ss.laplace(scale=0.5**0.5)), lambda t: 1 / (1 + t * t / 2)),
    "logistic": (as_input(ss.logistic(scale=C / np.pi)), lambda t: C * t / np.sinh(C * t)),
    "beta": (fb.Beta(1.0, 1.0, -1.0, 1.0), lambda t: np.sinc(t / np.pi)),
}


@pytest.mark.parametrize("kind", WAVES)
def test_rules_for_phases_against_characteristic_functions(kind):
    distribution, wave = WAVES[kind]
    family = distribution.family
    mean, std = family.scale
    for t in (0.3, 1.0, 5.0, 20.0):
        reach = t * std * np.abs(family.of_normal(np.array([-4.5, 4.5]))).max()
        xi, w = rule(family, 2, reach / 2)
        assert w @ np.exp(1j * t * (mean + std * xi)) == pytest.approx(wave(t), abs=2e-4)
        assert len(xi) < 40 + 2 * reach


@pytest.mark.parametrize("distribution", [fb.Gumbel(0.0, 0.2), fb.Beta(2.0, 2.0, -1.0, 1.0)])
def test_a_frequency_with_the_distribution(distribution):
    """E cos((10 + x) t) over many periods, against quadrature."""
    times = np.linspace(0.0, 10.0, 161)
    bands = fb.propagate(
        lambda x: np.cos((10 + x[:, None]) * times), {"x": distribution}, fb.AdaptivePCCI()
    )
    z, w = distribution.quantiles.rule(60)
    mean = w @ np.cos((10 + distribution.at_normal(z)[:, None]) * times)
    square = w @ np.cos((10 + distribution.at_normal(z)[:, None]) * times) ** 2
    np.testing.assert_allclose(bands["mean"][0], mean, atol=2e-3)
    np.testing.assert_allclose(bands["error_bar"][1], mean + np.sqrt(square - mean**2), atol=2e-3)


def test_the_logarithm_of_a_lognormal_number_represents_it_and_its_density_does_not():
    """Ernst et al., 2012: E 1/x² − projection, with 12 orders of a number whose cv is 1.

    In the logarithm the misfit is e^{−…}/12!; polynomials of the number leave 17 % and more.
    """
    distribution = fb.LogNormal(1.0, cv=1.0)
    points, w = distribution.quantiles.rule(30)
    x = distribution.at_normal(points)
    f = 1 / (1 + x)
    variance = w @ f**2 - (w @ f) ** 2
    misfits = []
    for family in (own_polynomials(distribution), HERMITE):
        P = family.values(12, family.of_normal(points)) / np.sqrt(family.norms(12))
        terms = (w * f) @ P
        misfits.append(np.sqrt(1 - np.sum(terms[1:] ** 2) / variance))
    assert misfits[0] > 50 * misfits[1]


def test_scipy_distributions_are_inputs(tmp_path):
    assert as_input(ss.norm(3.0, 0.2)) == fb.Normal(3.0, 0.2)
    assert as_input(ss.uniform(1.0, 2.0)) == fb.Uniform(1.0, 3.0)
    assert as_input(ss.lognorm(0.2, scale=3.0)).frozen.median() == pytest.approx(3.0)
    inputs = {"g": ss.gamma(4.0, scale=0.5), "e": fb.Interval(0.0, 1.0), "s": KINDS["samples"]}
    surrogate = fb.expand(lambda g, e, s: g * (1 + e) + s, inputs, fb.ImprovedPCCI(1, 1))
    fb.save_surrogate(surrogate, tmp_path / "s.npz")
    for expansion in (surrogate, fb.load_surrogate(tmp_path / "s.npz")):
        mean = expansion.bands()["mean"] - DATA.mean()
        np.testing.assert_allclose(mean, [2.0, 4.0], rtol=1e-8)
        assert expansion.evaluate(g=1.5, e=0.0, s=4.0) == pytest.approx(5.5)


BOX = fb.Interval(2.0, 2.4)


@pytest.mark.parametrize(
    "distribution",
    [
        fb.Normal(BOX, fb.Interval(0.1, 0.2)),
        fb.Normal(BOX, cv=fb.Interval(0.1, 0.2)),
        fb.LogNormal(BOX, fb.Interval(0.1, 0.2)),
        fb.LogNormal(BOX, cv=fb.Interval(0.1, 0.2)),
        fb.LogNormal.of_logarithm(fb.Interval(0.0, 0.2), fb.Interval(0.1, 0.3)),
        fb.TruncatedNormal(BOX, 0.5, fb.Interval(1.0, 1.2), fb.Interval(3.0, 3.2)),
        fb.Uniform(fb.Interval(0.0, 0.5), BOX),
        fb.Triangular(fb.Interval(0.0, 0.2), fb.Interval(1.0, 1.2), BOX),
        fb.Beta(BOX, fb.Interval(2.5, 2.8), fb.Interval(-1.0, 0.0), fb.Interval(1.0, 1.2)),
        fb.Beta(mean=fb.Interval(0.4, 0.5), std=fb.Interval(0.15, 0.18)),
        fb.Weibull(fb.Interval(1.0, 1.2), BOX, fb.Interval(0.0, 0.5)),
        fb.Weibull(mean=BOX, cv=fb.Interval(0.3, 0.35)),
        fb.Gumbel(BOX, fb.Interval(0.1, 0.2)),
        fb.Gumbel(BOX, cv=fb.Interval(0.1, 0.2)),
        fb.ScipyDistribution("gamma", (("a", BOX), ("loc", 1.0), ("scale", fb.Interval(1, 1.1)))),
    ],
    ids=str,
)
def test_every_parameter_may_be_an_interval(distribution, tmp_path):
    ends = ((box.lower, box.upper) for box in distribution.intervals.values())
    means = [
        distribution.with_parameters(
            dict(zip(distribution.intervals, corner, strict=True))
        ).frozen.mean()
        for corner in product(*ends)
    ]
    surrogate = fb.expand(lambda x: x, {"x": distribution}, fb.PCCI(5, 5))
    fb.save_surrogate(surrogate, tmp_path / "s.npz")
    for expansion in (surrogate, fb.load_surrogate(tmp_path / "s.npz")):
        mean = expansion.bands()["mean"].values
        np.testing.assert_allclose(mean, [min(means), max(means)], rtol=1e-3)


@pytest.mark.filterwarnings("ignore:.*multiples of")
def test_mean_and_spread_of_samples_are_those_of_the_data():
    for data in (DATA, np.repeat([1.0, 2.0, 2.5, 7.0], 9), np.append(np.zeros(40), 1.0)):
        family = fb.Samples(data).family
        np.testing.assert_allclose(family.scale, [data.mean(), data.std(ddof=1)], rtol=1e-12)
    with pytest.warns(
        fb.errors.FlexbandWarning, match=r"their mean is uncertain by 35 % .* by 27 %"
    ):
        fb.Samples(DATA[:8])
    assert fb.Samples(DATA) == fb.Samples(DATA[::-1].tolist())
    third = np.mean((DATA - DATA.mean()) ** 3)
    x, w = fb.Samples(DATA, bandwidth=1e-3).family.gauss(8)
    assert w @ x**3 * DATA.std(ddof=1) ** 3 == pytest.approx(third, rel=0.03)
    x, w = fb.Samples(DATA, bandwidth=1e300).family.gauss(8)  # the limit is a normal distribution
    np.testing.assert_allclose([w @ x**k for k in range(1, 7)], [0, 1, 0, 3, 0, 15], atol=1e-6)


def test_intervals_around_a_nominal_value():
    assert fb.Interval.around(10, percent=5) == fb.Interval(9.5, 10.5)
    assert fb.Interval.around(-10, percent=5) == fb.Interval(-10.5, -9.5)
    assert fb.Interval.around(10, tolerance=0.2) == fb.Interval(9.8, 10.2)
    assert fb.Interval.around(10, plus=0.1, minus=0) == fb.Interval(10.0, 10.1)


def test_cv_and_std_say_the_same():
    for kind in (fb.Normal, fb.LogNormal, fb.Gumbel, fb.TruncatedNormal):
        assert kind(5.0, cv=0.2) == kind(5.0, 1.0)
        assert repr(kind(5.0, cv=0.2)) == f"{kind.__name__}(mean=5.0, std=1.0)"
    mean, std = fb.LogNormal(5.0, cv=0.2).frozen.stats("mv")
    assert (mean, std) == pytest.approx((5.0, 1.0))
    inputs = {"e": fb.LogNormal(fb.Interval(4.8, 5.2), cv=0.1)}
    bands = fb.propagate(lambda e: e, inputs, fb.ImprovedPCCI(4, 2))
    np.testing.assert_allclose(bands["error_bar"], [4.8 * 0.9, 5.2 * 1.1], rtol=1e-7)


def test_weibull_and_beta_by_their_moments():
    for mean, cv, location in ((320e6, 0.1, 0.0), (3.0, 1.0, 0.0), (5.0, 0.02, 4.0), (1, 3.0, 0)):
        distribution = fb.Weibull(mean=mean, cv=cv, location=location)
        assert distribution == fb.Weibull(distribution.scale, distribution.shape, location)
        assert distribution == fb.Weibull(mean=mean, std=cv * mean, location=location)
        moments = [float(moment) for moment in distribution.frozen.stats("mv")]
        assert moments == pytest.approx([mean, (cv * mean) ** 2], rel=1e-9)
    assert fb.Weibull(mean=2.0, cv=1.0).shape == pytest.approx(1.0)  # exponential
    distribution = fb.Beta(mean=70.0, std=5.0, lower=60.0, upper=90.0)
    assert [float(moment) for moment in distribution.frozen.stats("mv")] == pytest.approx(
        [70.0, 25.0]
    )
    assert fb.Beta(mean=0.5, std=12**-0.5) == pytest.approx(fb.Beta(1.0, 1.0))
    inputs = {"e": fb.Weibull(mean=fb.Interval(4.8, 5.2), cv=fb.Interval(0.1, 0.2))}
    inputs["b"] = fb.Beta(mean=fb.Interval(0.2, 0.4), std=0.1)
    bands = fb.propagate(lambda e, b: e + b, inputs, fb.ImprovedPCCI(6, 2))
    low = 4.8 + 0.2 - np.hypot(4.8 * 0.2, 0.1)
    high = 5.2 + 0.4 + np.hypot(5.2 * 0.2, 0.1)
    np.testing.assert_allclose(bands["error_bar"], [low, high], rtol=1e-5)
    assert list(bands["input"].values) == ["b.mean", "e.cv", "e.mean"]


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: fb.Weibull(1.0), "Weibull must have either scale and shape, or mean and one of"),
        (lambda: fb.Weibull(1.0, 2.0, mean=3.0), "got scale=1.0, shape=2.0, mean=3.0"),
        (lambda: fb.Weibull(mean=1.0), "Weibull must have either std or cv; got neither"),
        (lambda: fb.Weibull(mean=1.0, std=1.0, cv=1.0), "Weibull must have either std or cv"),
        (lambda: fb.Weibull(mean=1.0, cv=0.1, location=2.0), "mean must be above the location 2"),
        (lambda: fb.Weibull(mean=1.0, cv=20.0), r"above 0.000128 and below 15.8 for"),
        (lambda: fb.Weibull(mean=fb.Interval(0.5, 9.0), std=9.0), "above .* = 0.5; got 9"),
        (lambda: fb.Beta(mean=2.0, std=0.1), "Beta mean must be above lower 0 and below upper 1"),
        (lambda: fb.Beta(mean=0.5, std=0.5), "Beta std must be above 1e-05 and below 0.4903 for"),
        (lambda: fb.Beta(mean=0.5, cv=-1), "Beta cv must be positive; got -1"),
        (lambda: fb.Beta(mean=0.5, std=1e-6), "Beta std must be above 1e-05 and below 0.49"),
        (lambda: fb.Normal(1.0), "Normal must have either std or cv; got neither"),
        (lambda: fb.Normal(1, 2, cv=0.1), "must have either std or cv; got both: std=2 and cv=0.1"),
        (lambda: fb.Normal(0.0, cv=0.1), "Normal cv must be given as std where the mean is 0"),
        (lambda: fb.Normal(1.0, "a"), "Normal std must be finite numbers; got the text 'a'"),
        (lambda: fb.LogNormal(-1.0, 1.0), "LogNormal mean must be positive; got -1"),
        (lambda: fb.LogNormal(1.0, cv=-0.1), "LogNormal cv must be positive; got -0.1"),
        (lambda: fb.LogNormal(1.0, 1e9), "LogNormal std must be 100 times the mean 1 or less"),
        (lambda: fb.LogNormal(np.ones(3), 1.0), "LogNormal mean must be 1 number; got"),
        (lambda: fb.LogNormal.of_logarithm(0.0, 1e3), "must be smaller for the LogNormal to be"),
        (lambda: fb.LogNormal.of_logarithm(0.0, 1e300), "must be smaller for the LogNormal to be"),
        (lambda: fb.LogNormal.of_logarithm(0.0, fb.Interval(-1.0, 1.0)), "log_std must be pos"),
        (lambda: fb.LogNormal(1.0, log_mean=0.0, log_std=1.0), "LogNormal must have either mean"),
        (fb.LogNormal, "or log_mean and log_std; got none"),
        (lambda: fb.ScipyDistribution("norm", 3), "pairs of a name, .* and a number; got 3"),
        (lambda: fb.LogNormal(fb.Interval(-1.0, 1.0), 1.0), "LogNormal mean must be positive; got"),
        (lambda: fb.Weibull(0.0, 2.0), "Weibull scale must be positive; got 0"),
        (lambda: fb.Weibull(1.0, 0.1), "Weibull shape must be from 0.2 to 10000; got 0.1"),
        (lambda: fb.Gumbel(1.0, 0.0), "is written as a number, or as an Interval"),
        (lambda: fb.Gumbel(1.0, 0.0), "Gumbel std must be positive; got 0"),
        (lambda: fb.Beta(-2.0, 1.0), "Beta alpha must be positive; got -2"),
        (lambda: fb.Beta(2.0, 1e-4), "Beta beta must be 0.02 or more; got 0.0001"),
        (lambda: fb.LogNormal(1.0, cv=0), "is written as a number, or as an Interval"),
        (lambda: fb.Uniform(1.0, 1.0), "is written as a number, or as an Interval"),
        (lambda: fb.Samples([3.0] * 9), "is written as a number, or as an Interval"),
        (lambda: fb.Beta(2.0, 1.0, 3.0, 3.0), "Beta lower 3 must be below upper 3"),
        (lambda: fb.Triangular(0.0, 2.0, 1.0), "Triangular mode must be from lower 0 to upper"),
        (lambda: fb.TruncatedNormal(0.0, 1.0, 3.0, 2.0), "TruncatedNormal lower 3 must be below"),
        (lambda: fb.TruncatedNormal(0.0, 1.0, upper=-50.0), "limits are 50 standard deviations"),
        (lambda: fb.TruncatedNormal(0.0, 1.0, np.inf), "TruncatedNormal lower must be finite"),
        (lambda: fb.Samples([1.0, 2.0]), r"Samples values must be 5 numbers or more.*\(2,\)"),
        (lambda: fb.Samples([3.0] * 9), "Samples values must differ; all 9 are 3"),
        (lambda: fb.Samples([1, 2, 3, 4, np.nan]), "Samples values must be finite numbers"),
        (lambda: fb.Samples(DATA, bandwidth=-1.0), "Samples bandwidth must be 0 or more; got -1"),
        (lambda: fb.ScipyDistribution("os", ()), "scipy.stats has no continuous distribution 'os'"),
        (lambda: fb.ScipyDistribution("gamma", ()), r"scipy.stats.gamma\(\) needs a"),
        (lambda: fb.ScipyDistribution("norm", (("x", 1.0),)), "one of loc, scale, and a number"),
        (lambda: as_input(ss.cauchy()), "must have a finite variance"),
        (lambda: as_input(ss.gamma(-1.0)), "has parameters out of their range"),
        (lambda: as_input(ss.gamma(4.0, loc=1e15)), "must have quantiles that are more than round"),
        (lambda: as_input(ss.poisson(3.0)), "poisson is discrete; a Choice has"),
        (lambda: as_input(ss.norm), "norm must have parameters"),
        (lambda: fb.Interval.around(10), "must have either percent, or tolerance, or plus"),
        (lambda: fb.Interval.around(10, plus=0.1), "or plus and minus; got plus"),
        (lambda: fb.Interval.around(0, percent=5), "percent must be given as tolerance around 0"),
        (lambda: fb.Interval.around(1, plus=1, minus=-1), "minus must be zero or positive; got -1"),
    ],
)  # fmt: skip
def test_impossible_distributions_are_refused(call, text):
    with pytest.raises(fb.errors.InputError, match=text):
        call()


def test_heavy_tails_are_remarked():
    with pytest.warns(fb.errors.FlexbandWarning, match=r"order 8 miss 3\.4 % of its variance"):
        as_input(ss.pareto(2.5))


@pytest.mark.parametrize("response", ["refuses", "is infinite", "raises"])
def test_values_of_the_other_sign_are_explained(response):
    def modulus(e):
        if response == "refuses" and np.any(e <= 0):
            raise fb.errors.InputError("E must be positive")
        if response == "raises" and np.any(e <= 0):
            raise ZeroDivisionError("E")
        return np.where(e > 0, e, np.inf)

    text = r"e = -\S+ is a value of Normal\(mean=1.0, std=0.5\). A LogNormal or a TruncatedNormal"
    error = fb.errors.RunError if response == "raises" else fb.errors.InputError
    with pytest.raises(error, match=text):
        fb.propagate(modulus, {"e": fb.Normal(1.0, cv=0.5)}, fb.ImprovedPCCI(6, 1))
    bands = fb.propagate(modulus, {"e": fb.LogNormal(1.0, cv=0.5)}, fb.ImprovedPCCI(6, 1))
    np.testing.assert_allclose(bands["error_bar"], [0.5, 1.5], rtol=1e-5)


def test_the_quantiles_of_a_scipy_distribution_are_computed_once():
    assert as_input(ss.gamma(2.5)) is as_input(ss.gamma(2.5, loc=0.0))
    assert as_input(ss.gamma(2.5)) is not as_input(ss.gamma(2.6))
    with pytest.raises(fb.errors.InputError, match="gamma a must be 1 number"):
        as_input(ss.gamma([1.0, 2.0]))


@pytest.mark.parametrize("kind", [fb.Normal, fb.LogNormal])
def test_a_coefficient_of_variation_in_per_cent_is_remarked_on(kind):
    with pytest.warns(fb.errors.FlexbandWarning) as records:
        kind(2.0, cv=5)
    assert f"{kind.__name__} cv is 5, a standard deviation of 5 times" in str(records[0].message)
    assert "is it in per cent? A cv of 0.05 is 5 %" in str(records[0].message)
    kind(2.0, cv=1.0)  # warnings are errors
    fb.Normal(2.0, 6.0)
    fb.Gumbel(2.0, cv=1.5)
    fb.LogNormal.of_logarithm(0.0, 0.9)  # whose cv is 1.1


@pytest.mark.parametrize("separation", [0.0, 4.0, 20.0])
def test_the_bandwidth_of_samples_survives_two_suppliers(separation, monkeypatch):
    """Beyond the upper mean by 3.5 σ, in the median of draws; Silverman's rule finds 6·10⁻²."""
    sigma = 0.01
    tail_shares = []
    wide = []

    def record_width(values):
        wide.append(bandwidth(values) / sigma)
        return wide[-1] * sigma

    of_samples = "flexband.uncertainty.inputs.distributions.samples.bandwidth"
    monkeypatch.setattr(of_samples, record_width)
    for seed in range(40):
        rng = np.random.default_rng(31_000 + seed)
        groups = [rng.normal(350 + k * separation * sigma, sigma, 60) for k in (0, 1)]
        values = np.sort(np.concatenate(groups if separation else groups[:1]))
        place = np.array([350 + (separation + 3.5) * sigma])
        tail_shares.append(norm.sf(fb.Samples(values).to_normal(place)[0]))
    assert len(wide) == 40
    assert np.median(wide) < 0.45
    assert np.quantile(wide, 0.95) < 0.5
    assert 3e-5 < np.median(tail_shares) < 4e-4


def test_samples_without_a_bandwidth_are_themselves():
    values = np.array([1.0, 2.0, 2.5, 4.0, 7.0])
    with pytest.warns(fb.errors.FlexbandWarning):
        samples = fb.Samples(values, bandwidth=0)
    quantiles = samples.at_normal(norm.ppf((np.arange(100) + 0.5) / 100))
    np.testing.assert_allclose(quantiles, values[np.arange(100) // 20], atol=1e-4)
    bands = fb.propagate(lambda x: x**2, {"x": samples}, fb.PCCI(2, 0))
    np.testing.assert_allclose(bands["mean"], np.mean(values**2), rtol=1e-6)


def test_values_on_a_grid_are_rounded_not_discrete():
    rng = np.random.default_rng(5)
    fine = rng.normal(10.0, 1.0, 400)
    with pytest.warns(fb.errors.FlexbandWarning, match="are multiples of 0.2, which is taken for"):
        rounded = fb.Samples(np.round(fine / 0.2) * 0.2)
    z = np.linspace(-2, 2, 9)
    np.testing.assert_allclose(rounded.at_normal(z), fb.Samples(fine).at_normal(z), atol=0.12)


def test_a_probability_that_rests_on_smoothing_says_so():
    values = np.random.default_rng(2).normal(0.0, 1.0, 50)
    surrogate = fb.expand(lambda x: x, {"x": fb.Samples(values)}, fb.AdaptivePCCI())
    rare = fb.analysis.failure_probability(surrogate, fb.Requirement("response", below=3.0))
    assert "Probabilities below 1/50 rest on the smoothing of x" in rare.attrs["verdict"]
    likely = fb.analysis.failure_probability(surrogate, fb.Requirement("response", below=1.0))
    assert "smoothing" not in likely.attrs["verdict"]


def test_a_ufunc_takes_no_names():
    with pytest.raises(fb.errors.InputError, match=r"write lambda x: np.sin\(x\)"):
        fb.propagate(np.sin, {"x": fb.Normal(0, 1)}, fb.PCCI(1, 0))
