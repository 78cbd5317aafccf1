"""Polynomials, fields and copulas against OpenTURNS and chaospy, where they are installed."""

import numpy as np
import pytest
import scipy.stats as ss

import flexband as fb
from flexband.uncertainty.expansions.densities import DensityPolynomials
from flexband.uncertainty.inputs.distributions.scipy_distribution import as_input
from flexband.uncertainty.inputs.space import Space

CASES = {
    "normal": (fb.Normal(3.0, 0.5), ("Normal", 3.0, 0.5), ("Normal", 3.0, 0.5)),
    "uniform": (fb.Uniform(1.0, 4.0), ("Uniform", 1.0, 4.0), ("Uniform", 1.0, 4.0)),
    "beta": (fb.Beta(2.0, 5.0, -1.0, 3.0), ("Beta", 2.0, 5.0, -1.0, 3.0), ("Beta", 2, 5, -1, 3)),
    "triangular": (
        fb.Triangular(1.0, 1.5, 4.0), ("Triangular", 1.0, 1.5, 4.0), ("Triangle", 1.0, 1.5, 4.0)
    ),
    "weibull": (fb.Weibull(2.0, 3.0, 1.0), ("WeibullMin", 2.0, 3.0, 1.0), ("Weibull", 3, 2, 1)),
    "gamma": (as_input(ss.gamma(3.0, scale=0.5)), ("Gamma", 3.0, 2.0), ("Gamma", 3, 0.5)),
    "gumbel": (fb.Gumbel(np.euler_gamma, cv=np.pi / 6**0.5 / np.euler_gamma), ("Gumbel",), None),
    "truncated": (
        fb.TruncatedNormal(1.0, 0.5, 0.2, 2.5), ("TruncatedNormal", 1.0, 0.5, 0.2, 2.5), None
    ),
}  # fmt: skip


def gauss_points(distribution, count):
    """Return the points and weights of the polynomials of a density, as values of the input."""
    family = DensityPolynomials(distribution)
    xi, weights = family.gauss(count)
    mean, std = family.scale
    return mean + std * xi, weights


@pytest.mark.parametrize("kind", CASES)
def test_gauss_points_are_those_of_openturns(kind):
    ot = pytest.importorskip("openturns")
    distribution, (name, *parameters), _ = CASES[kind]
    for count in (2, 5) if kind == "gumbel" else (2, 5, 8):  # whose tail is cut off there
        rule = ot.GaussProductExperiment(getattr(ot, name)(*parameters), [count])
        nodes, expected = map(np.array, rule.generateWithWeights())
        order = np.argsort(nodes[:, 0])
        x, weights = gauss_points(distribution, count)
        np.testing.assert_allclose(x, nodes[order, 0], rtol=3e-5)
        np.testing.assert_allclose(weights, expected[order], rtol=1e-4, atol=1e-12)


@pytest.mark.parametrize("kind", [kind for kind in CASES if CASES[kind][2]])
def test_gauss_points_are_those_of_chaospy(kind):
    chaospy = pytest.importorskip("chaospy")
    distribution, _, (name, *parameters) = CASES[kind]
    for count in (2, 5):
        rule = chaospy.generate_quadrature(count - 1, getattr(chaospy, name)(*parameters), "g")
        x, weights = gauss_points(distribution, count)
        np.testing.assert_allclose(x, rule[0][0], rtol=1e-5)
        np.testing.assert_allclose(weights, rule[1], rtol=1e-4, atol=1e-12)


@pytest.mark.parametrize("nu", [0.5, 1.5, 2.5])
def test_karhunen_loeve_is_that_of_openturns(nu):
    """Linear elements there, polynomials of high order here."""
    ot = pytest.importorskip("openturns")
    length = 0.7
    end = 2.0
    correlation = fb.fields.exponential if nu == 0.5 else fb.fields.Matern(nu)
    model = ot.MaternModel([length], [1.0], nu)
    mesh = ot.IntervalMesher([400]).build(ot.Interval(0.0, end))
    algorithm = ot.KarhunenLoeveP1Algorithm(mesh, model, 1e-4)
    algorithm.run()
    expected = np.array(algorithm.getResult().getEigenvalues())[:6]
    field = fb.RandomField(
        0.0, 1.0, length, (0.0, end), 6, nodes=48, correlation=correlation,
        discretization=fb.fields.karhunen_loeve,
    )  # fmt: skip
    np.testing.assert_allclose(field.expansion.eigenvalues, expected, rtol=3e-4)


@pytest.mark.parametrize("rho", [-0.5, 0.3, 0.8])
def test_correlated_values_are_those_of_openturns(rho):
    """Nataf's transformation of normal variables, and the correlation of a sample from there."""
    ot = pytest.importorskip("openturns")
    two = {"a": fb.LogNormal(2.0, cv=0.3), "b": fb.Weibull(2.0, 3.0)}
    correlated = fb.Correlated(two, rho)
    score = (correlated.factor @ correlated.factor.T)[0, 1]
    mean, std = two["a"].logarithm
    marginals = [ot.LogNormal(float(mean), float(std), 0.0), ot.WeibullMin(2.0, 3.0, 0.0)]
    copula = ot.NormalCopula(ot.CorrelationMatrix(2, [1.0, score, score, 1.0]))
    joint = ot.JointDistribution(marginals, copula)
    xi = np.random.default_rng(0).standard_normal((20, 2))
    values = Space({"both": correlated}).values(xi, np.zeros((20, 0)))
    expected = np.array(joint.getInverseIsoProbabilisticTransformation()(xi))
    np.testing.assert_allclose(np.stack([values["a"], values["b"]], 1), expected, rtol=1e-9)
    ot.RandomGenerator.SetSeed(0)
    sample = np.array(joint.getSample(1_000_000))
    assert np.corrcoef(sample.T)[0, 1] == pytest.approx(rho, abs=3e-3)
    ranks = ot.CorrelationMatrix(2, [1.0, rho, rho, 1.0])
    expected = np.array(ot.NormalCopula.GetCorrelationFromSpearmanCorrelation(ranks))[0, 1]
    factor = fb.Correlated(two, rho, of="ranks").factor
    assert (factor @ factor.T)[0, 1] == pytest.approx(expected, abs=1e-12)
