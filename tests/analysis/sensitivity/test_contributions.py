"""Contributions of inputs to the width of the error bar, against closed forms and new studies."""

import numpy as np
import pytest

import flexband as fb

T = np.linspace(0, 1, 5)


def linear(a, b, e, f):
    return (a + 2 * b)[:, None] * (1 + T) + (3 * e + f)[:, None] * T


INPUTS = {
    "a": fb.Normal(0.0, 1.0),
    "b": fb.Normal(0.0, 1.0),
    "e": fb.Interval(-1.0, 1.0),
    "f": fb.Interval(-1.0, 1.0),
}


@pytest.fixture(scope="module")
def of_linear():
    return fb.expand(linear, INPUTS, fb.PCCI(1, 1))


def test_a_sum_has_a_closed_form(of_linear):
    contributions = fb.analysis.contributions(of_linear, sigmas=2.0, shapley=True)
    root = np.sqrt(5.0)
    expected = {
        "a": 4 * (root - 2) * (1 + T),
        "b": 4 * (root - 1) * (1 + T),
        "e": 6 * T,
        "f": 2 * T,
    }
    width = 4 * root * (1 + T) + 8 * T
    np.testing.assert_allclose(contributions["width"], width, rtol=1e-12)
    for name, value in expected.items():
        np.testing.assert_allclose(contributions["contribution"].sel(name=name), value, atol=1e-12)
    rest = width - sum(expected.values())
    np.testing.assert_allclose(contributions["interaction"], rest, atol=1e-12)
    # the two random inputs share 4 √5 (1 + t): fixing one alone saves √5 − 2 or √5 − 1, the last
    # one 1 or 2
    shares = {"a": (root - 2 + 1) / 2, "b": (root - 1 + 2) / 2}
    for name, value in shares.items():
        np.testing.assert_allclose(
            contributions["shapley"].sel(name=name), 4 * value * (1 + T), atol=1e-12
        )
    np.testing.assert_allclose(contributions["shapley"].sel(name="e"), 6 * T, atol=1e-12)
    np.testing.assert_allclose(contributions["shapley"].sum("name"), width, rtol=1e-12)
    mean = (1 + T).mean() * 4 * shares["a"] / width.mean()
    assert float(contributions["shapley_mean_share"].sel(name="a")) == pytest.approx(
        mean, rel=1e-12
    )
    last = 8 * shares["b"] / width[-1]
    assert float(contributions["shapley_share_at_widest"].sel(name="b")) == pytest.approx(
        last, rel=1e-12
    )
    assert list(contributions["name"].values) == ["b", "e", "a", "f"]
    share = expected["e"][-1] / width[-1]
    assert contributions["share_at_widest"].sel(name="e") == pytest.approx(share, rel=1e-12)
    assert contributions["worst_at"].sel(input="e", bound="upper").values[-1] == 1.0


OF_ALL_KINDS = {
    "k": fb.Interval(-1.0, 1.0),
    "scale": fb.LogNormal(mean=fb.Interval(1.9, 2.1), cv=0.1),
    "road": fb.RandomField(1.0, 0.1, 0.7, domain=(0.0, 1.0), terms=2),
    "pair": fb.Correlated({"x": fb.Normal(1.0, 0.1), "y": fb.Normal(2.0, 0.2)}, {("x", "y"): 0.5}),
}
ORDERS = {"scale": 4, "road": 1, "x": 3, "y": 3}
"""Of the random inputs; those of a road and a pair are exact."""


def of_all_kinds(k, scale, road, x, y):
    return np.exp(0.3 * k)[:, None] * scale[:, None] * road(T) + (x * y**2)[:, None] * T


@pytest.fixture(scope="module")
def all_contributions():
    surrogate = fb.expand(of_all_kinds, OF_ALL_KINDS, fb.PCCI(ORDERS, 4))
    return fb.analysis.contributions(surrogate)


@pytest.mark.parametrize("name", ["k", "scale", "scale.mean", "road", "pair"])
def test_contributions_are_those_of_studies_with_the_input_fixed(name, all_contributions):
    contributions = all_contributions
    lognormal = fb.LogNormal(mean=2.0, cv=0.1)
    fixed = {
        "k": {"k": 0.0},
        "scale.mean": {"scale": lognormal},
        "scale": None,
        "road": {"road": fb.RandomField(1.0, 1e-9, 0.7, domain=(0.0, 1.0), terms=2)},
        "pair": {"x": 1.0, "y": 2.0},
    }[name]
    free_inputs = {k: distribution for k, distribution in OF_ALL_KINDS.items() if k != name}
    random = ORDERS.keys() - {"scale": {"scale"}, "pair": {"x", "y"}}.get(name, set())
    method = fb.PCCI({k: ORDERS[k] for k in random}, 4)
    if name == "scale":  # at the mean of the middle, moved with the mean by the p-box
        free_inputs = free_inputs | {"s": fb.Interval(1.9, 2.1)}
        fixed = {}

        def narrower(s, **others):
            return of_all_kinds(scale=s, **others)
    else:
        narrower = of_all_kinds
    bands = fb.propagate(narrower, free_inputs | fixed, method)
    width = (bands["error_bar"][1] - bands["error_bar"][0]).values
    expected = contributions["width"].values - width
    np.testing.assert_allclose(contributions["contribution"].sel(name=name), expected, atol=2e-6)


def test_inputs_are_fixed_at_their_means():
    """Not at their medians, also if they are correlated."""
    x = fb.LogNormal(mean=1.0, cv=0.5)
    y = fb.Gumbel(mean=2.0, std=0.4)
    for inputs in ({"x": x, "y": y}, {"pair": fb.Correlated({"x": x, "y": y}, 0.5)}):
        inputs |= {"e": fb.Interval(-1.0, 1.0)}
        surrogate = fb.expand(lambda x, y, e: x * y * e, inputs, fb.PCCI(4, 1))
        contributions = fb.analysis.contributions(surrogate)
        if "pair" in inputs:
            remaining_width = contributions["width"] - contributions["contribution"].sel(
                name="pair"
            )
            assert float(remaining_width) == pytest.approx(2 * 1.0 * 2.0, rel=5e-3)
        else:
            remaining_width = contributions["width"] - contributions["contribution"].sel(name="x")
            reference = fb.propagate(lambda y, e: y * e, {"y": y, "e": inputs["e"]}, fb.PCCI(4, 1))
            assert float(remaining_width) == pytest.approx(
                float(np.ptp(reference["error_bar"].values)), rel=2e-3
            )


def test_measured_values_are_fixed_at_their_mean():
    values = np.random.default_rng(3).normal(2.0, 0.2, 400)
    inputs = {"x": fb.Samples(values), "e": fb.Interval(-1.0, 1.0)}
    contributions = fb.analysis.contributions(fb.expand(lambda x, e: x * e, inputs, fb.PCCI(3, 1)))
    remaining_width = contributions["width"] - contributions["contribution"].sel(name="x")
    assert float(remaining_width) == pytest.approx(2 * values.mean(), rel=1e-3)


def test_tolerances_may_interact_negatively():
    def ratio(e, f):
        return np.abs(e + f)

    surrogate = fb.expand(ratio, {"e": fb.Interval(0, 1), "f": fb.Interval(0, 1)}, fb.PCCI(1, 1))
    assert fb.analysis.contributions(surrogate)["interaction"] == pytest.approx(0.0, abs=1e-12)

    def product(e, f):
        return e * f

    inputs = {"e": fb.Interval(-1, 1), "f": fb.Interval(-1, 1)}
    contributions = fb.analysis.contributions(fb.expand(product, inputs, fb.PCCI(1, 1)))
    assert contributions["interaction"] == pytest.approx(
        -2.0
    )  # either alone removes the whole width


def test_options_and_bad_arguments(of_linear):
    inputs = INPUTS | {"kind": fb.Choice("one", "two")}

    def response(a, b, e, f, kind):
        return linear(a, b, e, f) * np.where(kind == "two", 2.0, 1.0)[:, None]

    contributions = fb.analysis.contributions(fb.expand(response, inputs, fb.PCCI(1, 1)))
    single = fb.analysis.contributions(of_linear)
    np.testing.assert_allclose(contributions["width"], 2 * single["width"], rtol=1e-12)
    for changes, text in (
        ({"sigmas": 0.0}, "sigmas"),
        ({"shapley": 1}, "shapley must be True or False"),
        ({"at": {"time": 0}}, "at must name dimensions"),
    ):
        with pytest.raises(fb.errors.InputError, match=text):
            fb.analysis.contributions(of_linear, **changes)
    with pytest.raises(fb.errors.InputError, match="surrogate"):
        fb.analysis.contributions(3)
