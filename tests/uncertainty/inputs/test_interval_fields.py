"""Interval fields: their samples, and worst cases against exhaustive search."""

from itertools import product

import numpy as np
import pytest
import xarray as xr

import flexband as fb

FIELD = fb.IntervalField(lambda x: 0.9 - 0.1 * x, lambda x: 1 + 0.2 * x, 0.5, domain=(0.0, 1.2))
X = np.linspace(0.0, 1.2, 121)


@pytest.mark.parametrize("smooth", [False, True])
def test_samples_are_between_the_limits_and_reach_them(smooth):
    field = fb.IntervalField(FIELD.lower, FIELD.upper, 0.5, domain=(0.0, 1.2), smooth=smooth)
    assert field.dimension == 4
    low, high = field.limits(X)
    ends = np.array(list(product((-1.0, 1.0), repeat=4)))
    samples = np.concatenate([field.value(ends)(X), field.realizations(X, 500)])
    assert np.all((samples >= low) & (samples <= high))
    np.testing.assert_allclose(field.value(ends)(X)[[0, -1]], [low, high], rtol=1e-14)
    steep = np.abs(np.diff(fb.IntervalField(0, 1, 0.5, (0.0, 1.2), smooth).value(ends)(X))).max()
    assert steep == pytest.approx((1.875 if smooth else 1.0) * 0.01 / 0.5, rel=2e-3)


def test_the_worst_case_is_that_of_all_corners():
    """A weighted mean of the field: its extremes are sums over the control points."""
    weight = np.cos(4 * X)
    inputs = {"h": FIELD, "k": fb.Interval(1.0, 2.0)}

    def response(h, k):
        return (h(X) @ weight)[:, None] * k[:, None] * np.array([1.0, 2.0])

    ends = np.array(list(product((-1.0, 1.0), repeat=4)))
    corners = FIELD.value(ends)(X) @ weight
    expected = np.array([2 * corners.min(), corners.max()])
    assert expected[1] < 0
    for method in (fb.ImprovedPCCI(1, 1), fb.AdaptivePCCI(1e-3), fb.LHSScanning(2, 2)):
        bands = fb.propagate(response, inputs, method)
        np.testing.assert_allclose(bands["mean"][:, 0], expected, rtol=1e-9)
    names = ["h(0)", "h(0.35)", "h(0.85)", "h(1.2)", "k"]
    assert list(bands["input"].values) == names
    at = bands["mean_at"].sel(bound="upper")[:, 0].values
    best = FIELD.value(ends[[corners.argmax()]])(FIELD.places)[0]
    np.testing.assert_allclose(at, [*best, 1.0], rtol=1e-12)
    surrogate = fb.expand(response, inputs, fb.ImprovedPCCI(1, 1))
    result = surrogate.evaluate(h=at[None, :4], k=at[4])
    np.testing.assert_allclose(result[0, 0], expected[1], rtol=1e-9)


def test_a_field_is_found_checked_saved_and_loaded(tmp_path):
    inputs = {"h": fb.IntervalField(0.9, 1.1, 0.8), "e": fb.RandomField(1.0, 0.1, 2.0)}

    def response(h, e):
        x = np.linspace(0.0, 1.0, 9)
        return np.mean(h(x) ** 3 * e(x), axis=1)

    surrogate = fb.expand(response, inputs, fb.AdaptivePCCI(1e-3))
    assert surrogate.space.inputs["h"].domain == (0.0, 1.0)
    assert fb.verify(surrogate, response).verification.attrs["confirmed"] == "yes"
    fb.save_surrogate(surrogate, tmp_path / "s.npz")
    copy = fb.load_surrogate(tmp_path / "s.npz")
    xr.testing.assert_identical(copy.bands(), surrogate.bands())


def test_functions_are_saved_by_name(tmp_path):
    def middle(x):
        return 1 + x

    field = fb.RandomField(
        middle, 0.1, 2.0, domain=(0.0, 1.0), terms=1, correlation=fb.fields.Matern(1.5),
        distribution="lognormal", discretization=fb.fields.karhunen_loeve,
    )  # fmt: skip
    surrogate = fb.expand(lambda f: f(X[:90])[:, 5], {"f": field}, fb.PCCI(2, 0))
    with pytest.raises(fb.errors.InputError, match=r"f: <function .*middle.* cannot be saved"):
        fb.save_surrogate(surrogate, tmp_path / "s.npz")
    fb.fields.Field.functions["middle"] = middle
    try:
        fb.save_surrogate(surrogate, tmp_path / "s.npz")
        assert fb.load_surrogate(tmp_path / "s.npz").space.inputs["f"] == field
    finally:
        del fb.fields.Field.functions["middle"]
    with pytest.raises(fb.errors.InputError, match=r"'middle' must be in Field.functions first"):
        fb.load_surrogate(tmp_path / "s.npz")


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ((1.0, 0.5, 1.0), "lower must not be above upper; got 1 and 0.5"),
        ((lambda x: x, 0.5, 1.0), r"lower must not be above upper; got 1 and 0.5 at 1"),
        ((0.0, 1.0, 0.0), "length must be positive; got 0"),
        ((0.0, np.inf, 1.0), "upper"),
        ((0.0, "a", 1.0), "upper"),
        ((0.0, 1.0, 1e-4), "control points must be 1000 or less; got 10001"),
        ((lambda x: np.ones(2), 2.0, 1.0), "lower must return one value per position"),
        ((0.0, 1.0, 1.0, (1.0, 0.0)), "domain must run upwards"),
        ((0.0, 1.0, 1.0, (0.0, 1.0), 3), "smooth must be True or False"),
    ],
)
def test_impossible_fields_are_refused(arguments, text):
    domain = {} if len(arguments) > 3 else {"domain": (0.0, 1.0)}
    with pytest.raises(fb.errors.InputError, match=text):
        fb.IntervalField(*arguments, **domain).dimension  # noqa: B018


def test_values_that_no_sample_has_are_refused():
    field = fb.IntervalField(0.0, 1.0, 1.0, domain=(0.0, 0.5))
    for value, text in (
        ([[0.0, 0.6]], "which changes over its length"),
        ([[0.5, 1.1]], "between its limits"),
        ([0.5, 0.5], r"shape \(n, 2\); got shape \(2,\)"),
    ):
        with pytest.raises(fb.errors.InputError, match=text):
            field.standard(np.array(value))
    np.testing.assert_allclose(field.standard(np.array([[0.25, 0.75]])), [[-1.0, 1.0]], atol=1e-12)
    wedge = fb.IntervalField(lambda x: -x, lambda x: x, 1.0, domain=(0.0, 1.0))
    with pytest.raises(fb.errors.InputError, match="its limits are equal at 0"):
        wedge.standard(np.zeros((1, 2)))
