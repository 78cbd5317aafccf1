"""Limits of outputs: corridors, margins against closed forms, verdicts, and what is refused."""

import numpy as np
import pytest
import xarray as xr

import flexband as fb

T = np.linspace(0.0, 1.0, 61)
INPUTS = {"e": fb.Interval(-1.0, 1.0), "x": fb.Normal(0.0, 1.0)}


def moving(e, x):
    """y = (1 + e/10) sin 2πt + x/20 and 2y."""
    y = (1 + 0.1 * e)[:, None] * np.sin(2 * np.pi * T) + 0.05 * x[:, None]
    coords = {"output": ["a", "b"], "time": T, "unit": ("output", ["mm", "N"])}
    return xr.DataArray(np.stack([y, 2 * y], 1), coords, ("sample", "output", "time"))


@pytest.fixture(scope="module")
def surrogate():
    return fb.expand(moving, INPUTS, fb.AdaptivePCCI())


def test_margin_is_the_distance_from_the_error_bar(surrogate):
    margins = fb.analysis.check_requirements(
        surrogate,
        [
            fb.Requirement("a", below=1.3, above=-1.2),
            fb.Requirement("b", below=2.6, during=(0.5, 1.0)),
        ],
        sigmas=2.0,
    )
    swing = np.abs(np.sin(2 * np.pi * T))
    high = np.where(T < 0.5, 1.1, 0.9) * np.sin(2 * np.pi * T) + 0.1
    low = np.where(T < 0.5, 0.9, 1.1) * np.sin(2 * np.pi * T) - 0.1
    np.testing.assert_allclose(margins["margin"][0], np.minimum(1.3 - high, low + 1.2), atol=1e-9)
    late = T >= 0.5
    np.testing.assert_allclose(margins["margin"][1, late], 2.6 - 2 * high[late], atol=1e-9)
    assert np.isnan(margins["margin"][1, ~late]).all()
    assert swing.max() == 1.0
    np.testing.assert_allclose(margins["least_margin"], [0.0, 2.4], atol=1e-9)
    assert margins["side"].values.tolist() == ["above", "below"]
    assert margins["least_margin_at"].values.tolist()[0] == 0.75
    assert margins["worst_inputs"].sel(input="e").values[0] == 1.0
    assert margins["verdict"].values.tolist() == ["undecided", "kept"]
    assert margins.attrs["kept"] == "undecided"
    assert "b below 2.6 from 0.5 to 1: met, least margin 2.4" in margins.attrs["verdict"]


def test_curves_are_numbers_arrays_functions_or_labelled(surrogate):
    curve = 1.2 + T
    curves = [curve, lambda t: 1.2 + t, xr.DataArray(curve, coords={"time": T})]
    margins = [
        fb.analysis.check_requirements(surrogate, fb.Requirement("a", below=below))["margin"]
        for below in curves
    ]
    for margin in margins[1:]:
        np.testing.assert_array_equal(margin, margins[0])
    np.testing.assert_allclose(margins[0][0, 0], 1.2 - 0.15, atol=1e-9)


@pytest.mark.parametrize(
    "ends",
    [(2.0, 1.0), (1.0, 1.0), (np.array([0.0, 3.0]), np.array([1.0, 2.0])), (1.5, np.r_[2, 1])],
)
def test_ends_that_leave_nothing_are_refused_where_they_enter(ends):
    above, below = ends
    with pytest.raises(fb.errors.InputError, match="must be less than below; got above="):
        fb.Requirement("a", above=above, below=below)
    fb.Requirement(
        "a", above=np.zeros(2), below=np.ones(3)
    )  # one does not fit, which the response tells


def test_the_expected_error_decides():
    """tanh is missed: near the bound the limit is neither kept nor not kept."""

    def response(x):
        return np.tanh(2 * x)[:, None] * np.ones(3)

    expansion = fb.expand(response, {"x": fb.Normal(0, 1)}, fb.AdaptivePCCI(0.01, 16))
    bar = expansion.bands(3.0)
    high = float(bar["error_bar"][1, 0])
    error = 3.0 * float(bar["error_bar_expected_error"][0])
    assert error > 1e-3
    for shift, verdict in (
        (-1.1, "not kept"),
        (-0.9, "undecided"),
        (0.9, "undecided"),
        (1.1, "kept"),
    ):
        margins = fb.analysis.check_requirements(
            expansion, fb.Requirement("response", below=high + shift * error)
        )
        assert margins.attrs["kept"] == verdict
        assert float(margins["least_margin_error"][0]) == pytest.approx(error)
        assert bool(margins["run_required"][0])


def test_margin_between_the_times():
    """A peak of sin between two times of a coarse grid, and one on which the limit is kept."""
    t = np.linspace(0, 3, 14)

    def response(e):
        return xr.DataArray(e[:, None] * np.sin(t), dims=("sample", "time"), coords={"time": t})

    expansion = fb.expand(response, {"e": fb.Interval(0.5, 1.0)}, fb.AdaptivePCCI())
    margins = fb.analysis.check_requirements(expansion, fb.Requirement("response", below=1 - 2e-4))
    assert not bool(margins["run_required"][0])
    on_grid = 1 - 2e-4 - np.sin(t).max()
    assert float(margins["least_margin"][0]) == pytest.approx(on_grid)
    assert float(margins["grid_error"][0]) == pytest.approx(1 - np.sin(t).max(), rel=0.02)
    assert margins.attrs["kept"] == "not kept"  # by all rules the peak is above the limit


def test_choices_are_all_checked():
    def response(e, kind):
        return e[:, None] * np.where(kind == "steel", 2.0, 1.0)[:, None] * np.ones(4)

    inputs = {"e": fb.Interval(0.0, 1.0), "kind": fb.Choice("steel", "brass")}
    expansion = fb.expand(response, inputs, fb.AdaptivePCCI())
    margins = fb.analysis.check_requirements(expansion, fb.Requirement("response", below=1.5))
    assert float(margins["least_margin"][0]) == pytest.approx(-0.5)
    assert margins["worst_choice"].values[0] == "steel"
    assert margins["verdict"].values[0] == "not kept"


def test_the_dims_of_an_output_stay(surrogate):
    x = np.linspace(0, 1, 3)

    def response(e):
        y = e[:, None, None] * x[:, None] * np.ones(5)
        return xr.DataArray(y, dims=("sample", "x", "time"), coords={"x": x, "time": np.arange(5)})

    expansion = fb.expand(response, {"e": fb.Interval(-1.0, 1.0)}, fb.AdaptivePCCI())
    margins = fb.analysis.check_requirements(
        expansion, fb.Requirement("response", above=xr.DataArray(-1.5 * x - 0.1, coords={"x": x}))
    )
    np.testing.assert_allclose(margins["margin"][0], 0.1 + 0.5 * x[:, None] * np.ones(5), atol=1e-9)
    number = fb.expand(lambda e: e**2, {"e": fb.Interval(-1, 1)}, fb.AdaptivePCCI())
    assert float(
        fb.analysis.check_requirements(number, fb.Requirement("response", above=-0.5))["margin"][0]
    ) == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"output": "c", "below": 1.0}, "output must be one of a, b; got 'c'"),
        ({"below": 1.0}, "output must be one of a, b; got None"),
        ({"output": "a"}, "below, above or both"),
        ({"output": "a", "below": np.nan}, "below must be"),
        ({"output": "a", "below": True}, "below must be"),
        ({"output": "a", "below": "high"}, "below must be"),
        ({"output": "a", "below": [1.0, 2.0]}, r"shape \(61,\)"),
        ({"output": "a", "below": lambda t: t[:3]}, r"shape \(61,\)"),
        ({"output": "a", "below": lambda t: 1 / 0}, "raised an error"),
        ({"output": "a", "below": xr.DataArray(T, coords={"time": T + 1})}, "values of 'time'"),
        ({"output": "a", "below": xr.DataArray(T, dims="x")}, "dims of the output"),
        ({"output": "a", "below": 1.0, "above": 1.0}, "less than below"),
        ({"output": "a", "below": 1.0, "during": (2, 3)}, "from 0 to 1"),
        ({"output": "a", "below": 1.0, "during": (1, 0)}, "first and last"),
        ({"output": "a", "below": 1.0, "during": 1.0}, "2 numbers"),
    ],
)
def test_refused_by_name(surrogate, options, message):
    with pytest.raises(fb.errors.InputError, match=message):
        fb.analysis.check_requirements(surrogate, fb.Requirement(**{"name": "w", **options}))
