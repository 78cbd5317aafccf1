"""The yield of parts whose tolerances scatter, against exact distributions."""

import math

import numpy as np
import pytest
from scipy.stats import norm, truncnorm

import flexband as fb
from flexband.errors import InputError


def total(**tolerances):
    return sum(tolerances.values())


def surrogate_of_sum(count, method=None):
    inputs = {f"t{k}": fb.Interval(-1.0, 1.0) for k in range(count)}
    return fb.expand(total, inputs, method or fb.PCCI(0, 1))


def irwin_hall(x, n):
    """P(U₁ + … + U_n ≤ x) of uniform numbers from 0 to 1."""
    terms = ((-1) ** k * math.comb(n, k) * (x - k) ** n for k in range(math.floor(x) + 1))
    return sum(terms) / math.factorial(n)


@pytest.mark.parametrize(("count", "limit"), [(2, 1.0), (3, 2.0), (5, 2.5), (10, 3.0)])
def test_uniform_tolerances_of_a_sum_are_distributed_as_irwin_and_hall_say(count, limit):
    scatter = {f"t{k}": fb.Uniform(-1.0, 1.0) for k in range(count)}
    production = fb.production_yield(
        surrogate_of_sum(count), fb.Requirement("response", below=limit), scatter, accuracy=0.02
    )
    exact = irwin_hall((limit + count) / 2, count)
    assert float(production["failing"][0]) == pytest.approx(1 - exact, rel=0.04)
    assert production["yield_low"][0] < exact < production["yield_high"][0]


def test_capabilities_give_a_normal_sum_that_hardly_is_truncated():
    """Cp = 1.5 is ±4.5σ: of three, below 1.2 is 1.2/(√3 · 2/9) standard deviations."""
    scatter = {f"t{k}": fb.analysis.Capability(cp=1.5) for k in range(3)}
    production = fb.production_yield(
        surrogate_of_sum(3), fb.Requirement("response", below=1.2), scatter, accuracy=0.01
    )
    assert float(production["failing"][0]) == pytest.approx(norm.sf(1.2 / (3**0.5 / 4.5)), rel=0.04)


def test_a_process_aside_from_the_middle():
    scatter = {"t0": fb.analysis.Capability(cp=1.0, cpk=0.4, side="upper")}
    production = fb.production_yield(
        surrogate_of_sum(1), fb.Requirement("response", below=0.8), scatter, accuracy=0.01
    )
    exact = truncnorm(-4.8, 1.2, loc=0.6, scale=1 / 3)
    assert float(production["failing"][0]) == pytest.approx(exact.sf(0.8), rel=0.04)


def test_correlated_tolerances_add_up():
    normal = fb.TruncatedNormal(0.0, 0.2, lower=-1.0, upper=1.0)
    pair = fb.Correlated({"t0": normal, "t1": normal}, correlation=0.6)
    production = fb.production_yield(
        surrogate_of_sum(2), fb.Requirement("response", below=0.8), {"pair": pair}, accuracy=0.01
    )
    spread = 0.2 * (2 + 2 * 0.6) ** 0.5
    assert float(production["failing"][0]) == pytest.approx(norm.sf(0.8 / spread), rel=0.06)


def test_random_inputs_scatter_with_the_tolerances():
    inputs = {"a": fb.Interval(-1.0, 1.0), "x": fb.Normal(0.0, 0.3)}
    surrogate = fb.expand(lambda a, x: a + x, inputs, fb.PCCI(1, 1))
    scatter = {"a": fb.analysis.Capability(cp=5 / 3)}  # σ = 0.2
    production = fb.production_yield(
        surrogate, fb.Requirement("response", below=0.9), scatter, accuracy=0.01
    )
    assert float(production["failing"][0]) == pytest.approx(norm.sf(0.9 / 0.13**0.5), rel=0.05)


def test_several_requirements_and_that_of_all():
    scatter = {"t0": fb.Uniform(-1.0, 1.0)}
    low = fb.Requirement("low", above=-0.9)
    high = fb.Requirement("high", below=0.8)
    production = fb.production_yield(surrogate_of_sum(1), [low, high], scatter, accuracy=0.01)
    np.testing.assert_allclose(production["failing"], [0.05, 0.1, 0.15], rtol=0.05)
    assert "90 % of the parts meet it" in production.attrs["verdict"]


def test_runs_correct_what_the_surrogate_misses():
    """The surrogate is linear, the response is not."""
    batch_sizes = []

    def response(t0, t1):
        batch_sizes.append(len(t0))
        return t0 + t1 + 0.3 * t0**2

    inputs = {name: fb.Interval(-1.0, 1.0) for name in ("t0", "t1")}
    surrogate = fb.expand(response, inputs, fb.PCCI(0, 1))
    scatter = {name: fb.Uniform(-1.0, 1.0) for name in inputs}
    batch_sizes.clear()
    uncorrected = fb.production_yield(surrogate, fb.Requirement("response", below=1.2), scatter)
    assert not batch_sizes
    production = fb.production_yield(
        surrogate, fb.Requirement("response", below=1.2), scatter, response=response, runs=200
    )
    parts = np.random.default_rng(1).uniform(-1, 1, (2, 1_000_000))
    exact = np.mean(response(*parts) > 1.2)
    assert production["failing_low"][0] < exact < production["failing_high"][0]
    assert abs(production["failing"][0] - exact) < abs(uncorrected["failing"][0] - exact) / 2


@pytest.mark.parametrize(
    ("scatter", "message"),
    [
        ({}, "a distribution of every tolerance; t0, t1 have none"),
        ({"t0": fb.Uniform(-1, 1)}, "every tolerance; t1 has none"),
        ({"t0": fb.Uniform(-1, 1), "t2": fb.Uniform(-1, 1)}, "must be .*; got .t2."),
        ({"t0": fb.Uniform(-2, 1), "t1": fb.Uniform(-1, 1)}, "within the interval .* -1 to 1"),
        ({"t0": fb.Normal(0.0, 0.1), "t1": fb.Uniform(-1, 1)}, "within the interval"),
        ({"t0": 0.5}, r"scatter\['t0'\] must be"),
        (3.0, "scatter must be"),
    ],
)
def test_what_does_not_fit_the_tolerances_is_refused(scatter, message):
    with pytest.raises(InputError, match=message):
        fb.production_yield(surrogate_of_sum(2), fb.Requirement("response", below=1.0), scatter)


@pytest.mark.parametrize(
    "options",
    [{"cp": 0.0}, {"cp": 1.0, "cpk": 1.2}, {"cp": 1.0, "cpk": -0.1}, {"cp": 1.0, "cpk": 0.5},
     {"cp": 1.0, "cpk": 0.5, "side": "left"}],
)  # fmt: skip
def test_impossible_capabilities_are_refused(options):
    with pytest.raises(InputError, match="Capability"):
        fb.analysis.Capability(**options)
