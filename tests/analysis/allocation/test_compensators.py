"""Compensators: closed forms of linear responses, and brute force on random quadratic ones."""

from itertools import product

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

import flexband as fb

SLOPE = np.array([3.0, -2.0])


def shifted(a, b, c):
    """Return 3 a − 2 b + 1.5 c."""
    return (3 * a - 2 * b + 1.5 * c)[:, None]


def opposed(a, c):
    """Return a + c at one time, and a − c at another."""
    return xr.DataArray(np.stack([a + c, a - c], axis=1), {"time": [0.0, 1.0]}, ("sample", "time"))


def inputs(reach, names="ab"):
    return {k: fb.Interval(-1.0, 1.0) for k in names} | {"c": fb.Compensator(-reach, reach)}


@settings(max_examples=10, deadline=None)
@given(st.floats(0.01, 6.0))
def test_margin_of_a_linear_response(reach):
    # L − max(0, Σ |J| t − |a| C)
    surrogate = fb.expand(shifted, inputs(reach), fb.PCCI(1, 1))
    margins = fb.analysis.check_requirements(
        surrogate, fb.Requirement("response", below=4.0, above=-4.0)
    )
    exact = 4.0 - max(0.0, 5.0 - 1.5 * reach)
    assert margins["least_margin"].item() == pytest.approx(exact, abs=1e-5)
    assert margins["least_margin"].item() <= exact + 1e-9


def test_one_adjustment_is_for_the_whole_motion():
    # at a = t one instant wants c = −C, the other c = C; adjusted at each, the margin were L
    surrogate = fb.expand(opposed, inputs(1.0, "a"), fb.PCCI(1, 1))
    margins = fb.analysis.check_requirements(
        surrogate, fb.Requirement("response", below=1.5, above=-1.5)
    )
    assert margins["least_margin"].item() == pytest.approx(0.5, abs=1e-5)
    assert margins["worst_inputs"].sel(input="c").item() == pytest.approx(0.0, abs=1e-5)
    at_start = fb.analysis.check_requirements(
        surrogate, fb.Requirement("response", below=1.5, above=-1.5, during=(0.0, 0.0))
    )
    assert at_start["least_margin"].item() == pytest.approx(1.5, abs=1e-5)
    allocation = fb.analysis.allocate(
        surrogate, fb.Requirement("response", below=0.5, above=-0.5), {"a": 1.0}, response=opposed
    )
    assert allocation["tolerance"].item() == pytest.approx(0.5, rel=1e-4)


def test_limits_share_the_adjustment():
    # c within ±1 cannot lift a + c above 0 and keep a − c above 0 at a = −1
    surrogate = fb.expand(opposed, inputs(1.0, "a"), fb.PCCI(1, 1))
    first = fb.Requirement("response", above=0.0, during=(0, 0))
    second = fb.Requirement("response", above=0.0, during=(1, 1))
    for limits, margin in (([first], 0.0), ([second], 0.0), ([first, second], -1.0)):
        margins = fb.analysis.check_requirements(surrogate, limits)
        assert margins["least_margin"].min() == pytest.approx(margin, abs=1e-5)


@pytest.mark.parametrize("reach", [0.2, 1.0])
def test_tolerances_with_an_adjustment(reach):
    # Σ |J| t ≤ L + |a| C with the cost Σ 1/t: t ∝ √(1/|J|)
    surrogate = fb.expand(shifted, inputs(reach), fb.PCCI(1, 1))
    allocation = fb.analysis.allocate(
        surrogate,
        fb.Requirement("response", below=0.6, above=-0.6),
        {"a": 1.0, "b": 1.0},
        response=shifted,
    )
    t = np.sqrt(1 / np.abs(SLOPE))
    t *= (0.6 + 1.5 * reach) / (np.abs(SLOPE) @ t)
    assert allocation["tolerance"].values == pytest.approx(t, rel=3e-4)
    assert np.abs(SLOPE) @ allocation["tolerance"].values <= 0.6 + 1.5 * reach
    assert allocation.attrs["confirmed"] == "yes"
    saving = (1 / t).sum() / (0.6 + 1.5 * reach)
    assert allocation["saving"].item() == pytest.approx(saving, rel=1e-2)


def test_two_compensators():
    def response(a, b, c, d):
        return np.stack([a + c, a + 2 * b + d, a - b + 0.5 * c], axis=1)

    all_inputs = inputs(0.5) | {"d": fb.Compensator(-1.0, 1.0)}
    surrogate = fb.expand(response, all_inputs, fb.PCCI(1, 1))
    margins = fb.analysis.check_requirements(
        surrogate, fb.Requirement("response", below=2.0, above=-2.0)
    )
    grid = np.linspace(-1, 1, 81)
    worst = np.inf
    for a, b in product((-1.0, 1.0), repeat=2):
        values = [np.abs([a + c, a - b + 0.5 * c]).max() for c in grid / 2]
        worst = min(worst, 2 - max(min(values), np.abs(a + 2 * b + grid).min()))
    assert margins["least_margin"].item() == pytest.approx(worst, abs=0.02)
    three = inputs(0.5) | {k: fb.Compensator(-1.0, 1.0) for k in "bd"}
    with pytest.raises(
        fb.errors.InputError, match="at most 2 inputs can be a Compensator; got b, c, d"
    ):
        fb.analysis.check_requirements(
            fb.expand(response, three, fb.PCCI(1, 1)), fb.Requirement("response", below=1.0)
        )


@pytest.mark.parametrize("seed", range(2))
def test_quadratic_responses_against_brute_force(seed):
    rng = np.random.default_rng(seed)
    linear = rng.normal(size=(3, 6))
    square = 0.3 * rng.normal(size=(3, 3, 6))

    def quadratic(a, b, c):
        x = np.stack([a, b, c], axis=1)
        y = x @ linear + np.einsum("ni,nj,ijt->nt", x, x, square)
        return xr.DataArray(y, {"time": np.arange(6.0)}, ("sample", "time"))

    surrogate = fb.expand(quadratic, inputs(1.0), fb.PCCI(1, 2))
    grid = np.linspace(-1, 1, 41)
    a, b, c = (axis.ravel() for axis in np.meshgrid(grid, grid, grid, indexing="ij"))
    largest = np.abs(quadratic(a, b, c).values).max(axis=1).reshape(41, 41, 41).min(axis=2).max()
    margins = fb.analysis.check_requirements(
        surrogate, fb.Requirement("response", below=5.0, above=-5.0)
    )
    assert margins["least_margin"].item() == pytest.approx(5.0 - largest, abs=0.1)
    limit = (largest + best_of(quadratic, np.zeros(1), np.zeros(1))[0]) / 2
    t = np.linspace(0.02, 1.0, 50)
    first, second = (axis.ravel() for axis in np.meshgrid(t, t))
    signs = product((-1, 1), repeat=2)
    at_worst = np.max([best_of(quadratic, i * first, j * second) for i, j in signs], axis=0)
    cheapest = (1 / first + 1 / second)[at_worst <= limit].min()
    keeps = fb.Requirement("response", below=limit, above=-limit)
    allocation = fb.analysis.allocate(surrogate, keeps, {"a": 1.0, "b": 1.0}, response=quadratic)
    assert allocation.attrs["cost"] < cheapest < 1.1 * allocation.attrs["cost"]
    assert allocation.attrs["confirmed"] == "yes"
    tolerances = allocation["tolerance"].sel(name=["a", "b"]).values
    for i, j in product((-1, 1), repeat=2):
        assert best_of(quadratic, i * tolerances[:1], j * tolerances[1:], 4001)[0] <= limit * (
            1 + 1e-3
        )


def best_of(response, a, b, count=201):
    """Return the largest |y| with the best of many c, at a and b."""
    c = np.linspace(-1, 1, count)
    values = response(np.repeat(a, count), np.repeat(b, count), np.tile(c, len(a))).values
    return np.abs(values).max(axis=1).reshape(-1, count).min(axis=1)


def test_scatter_is_after_the_adjustment():
    # the mean is adjusted by c, the scatter is not: 3 σ = 3 · 0.2
    all_inputs = {
        "a": fb.Interval(-1.0, 1.0),
        "b": fb.Normal(0.0, 0.1),
        "c": fb.Compensator(-2.0, 2.0),
    }
    surrogate = fb.expand(shifted, all_inputs, fb.PCCI(1, 1))
    margins = fb.analysis.check_requirements(
        surrogate, fb.Requirement("response", below=1.0, above=-1.0), sigmas=3.0
    )
    assert margins["least_margin"].item() == pytest.approx(1.0 - 0.6, abs=1e-5)


def test_sizes_and_compensators_together():
    # |b p(a) + c| ≤ 1 with |c| ≤ 0.5, where p is least: b ≤ 1.5 / min p
    def valleys(a, b, c):
        return ((a**4 - 0.5 * a**3 - a**2 + 0.2 * a + 1) * b + c)[:, None]

    all_inputs = {
        "a": fb.Sizing(-1.0, 1.0),
        "b": fb.Interval(-4.0, 4.0),
        "c": fb.Compensator(-0.5, 0.5),
    }
    surrogate = fb.expand(valleys, all_inputs, fb.PCCI(1, 4))
    allocation = fb.analysis.allocate(
        surrogate, fb.Requirement("response", below=1.0, above=-1.0), {"b": 1.0}, response=valleys
    )
    p = valleys(np.linspace(-1, 1, 20001), 1.0, 0.0).min()
    assert allocation["tolerance"].item() == pytest.approx(1.5 / p, rel=3e-4)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [((1.0, 1.0), "lower 1 must be below upper 1"), ((np.inf, 2.0), "Compensator lower")],
)
def test_refused_compensators(arguments, message):
    with pytest.raises(fb.errors.InputError, match=message):
        fb.Compensator(*arguments)


def test_no_costs_of_compensators_and_no_grades_with_them():
    surrogate = fb.expand(shifted, inputs(1.0), fb.PCCI(1, 1))
    with pytest.raises(fb.errors.InputError, match="which are a, b; got 'c'"):
        fb.analysis.allocate(surrogate, fb.Requirement("response", below=1.0), {"c": 1.0})
    with pytest.raises(fb.errors.InputError, match="a Sizing or a Compensator; these are c"):
        fb.analysis.allocate(
            surrogate,
            fb.Requirement("response", below=1.0),
            {"a": fb.analysis.Grades({"fine": (0.1, 1.0)})},
        )
