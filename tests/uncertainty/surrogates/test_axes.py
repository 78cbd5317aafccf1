"""Outputs without a time axis: each is judged on its own, as with a time axis of length one."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import flexband as fb
from flexband.uncertainty.surrogates.axes import axes_of, names_of_outputs

INPUTS = {"a": fb.Interval(0.0, 1.0), "b": fb.Normal(1.0, 0.1)}
METHODS = [
    fb.AdaptivePCCI(max_runs=40),
    fb.methods.PhaseResolvedPCCI(2, 2),
    fb.methods.RegressionPCCI(4),
    fb.PCCI(2, 3),
    fb.ImprovedPCCI(2, 3),
    fb.methods.PerturbationChebyshev(2),
    fb.LHSScanning(20, 3),
]


def two_outputs(a, b):
    """Return a smooth force of 10⁶ and a steep one of 1."""
    return np.stack([1e6 * a * b, np.tanh(6 * (a + b - 1.3))], axis=1)


def without_time(a, b):
    """Return outputs that have no time."""
    coords = {"output": ["F", "x"], "unit": ("output", ["N", "m"])}
    return xr.DataArray(two_outputs(a, b), coords, ("sample", "output"))


def at_one_time(a, b):
    """Return the same with a time axis of length one."""
    return without_time(a, b).expand_dims(time=[0.0], axis=2)


def along_quantities(a, b):
    """Return the outputs along a dim of texts of another name."""
    return without_time(a, b).rename(output="quantity")


def assert_equal(actual: xr.Dataset, reference: xr.Dataset) -> None:
    """Compare answers, of which the second one has a time axis of length one."""
    assert set(actual.data_vars) <= set(reference.data_vars)
    for name in actual.data_vars:
        expected = (
            reference[name].squeeze("time") if "time" in reference[name].dims else reference[name]
        )
        assert actual[name].dims == expected.dims, name
        if actual[name].dtype.kind == "f":
            slack = 1e-9 * np.nanmax(np.abs(expected.values), initial=1e-12)
            np.testing.assert_allclose(
                actual[name], expected, rtol=1e-9, atol=slack, err_msg=str(name)
            )
        else:
            assert (actual[name].values == expected.values).all(), name


@pytest.mark.parametrize("method", METHODS, ids=lambda case: case.label)
def test_outputs_without_time_are_judged_as_at_one_time(method):
    actual, reference = (fb.propagate(r, INPUTS, method) for r in (without_time, at_one_time))
    assert_equal(actual, reference)
    assert actual.attrs.get("expected_error") == reference.attrs.get("expected_error")
    assert not any(
        "over time" in variable.attrs.get("long_name", "") for variable in actual.values()
    )


def test_the_error_of_one_output_is_not_that_of_another():
    bands = fb.propagate(without_time, INPUTS, fb.AdaptivePCCI(max_runs=30))
    smooth, steep = bands["relative_expected_error"].values
    assert smooth < 1e-9
    assert steep > 1e-3
    assert bands.attrs["expected_error"] == pytest.approx(steep, rel=1e-6)
    for name in ("trusted", "carriers", "relative_expected_error"):
        assert bands[name].dims == ("output",)


def test_ringing_is_not_looked_for_along_outputs():
    k = np.arange(200)

    def waves(a, b):
        return b[:, None] * np.cos(2 * np.pi * (0.05 + 0.005 * a[:, None]) * k)

    def outputs(a, b):
        return xr.DataArray(waves(a, b), {"output": [f"F{n}" for n in k]}, ("sample", "output"))

    method = fb.methods.PhaseResolvedPCCI(1, 1)
    assert fb.propagate(waves, INPUTS, method)["carriers"] == 1
    assert not fb.propagate(outputs, INPUTS, method)["carriers"].values.any()


ANSWERS = {
    "contributions": fb.analysis.contributions,
    "narrowed": lambda s: s.narrowed(a=fb.Interval(0.2, 0.4)).bands(2.0),
    "quantiles": fb.analysis.quantiles,
    "range": fb.analysis.value_range,
    "sobol": fb.analysis.sobol_indices,
    "limits": lambda s: fb.analysis.check_requirements(
        s, [fb.Requirement("F", below=2e6), fb.Requirement("x", above=-2.0)]
    ),
    "tolerance": lambda s: fb.analysis.tolerance_for(s, "a"),
    "probability": lambda s: fb.analysis.failure_probability(s, fb.Requirement("x", below=0.9)),
    "verify": lambda s: (
        fb.verify(s, at_one_time if "time" in s.labels.dims else without_time).verification
    ),
    "p-box": lambda s: fb.analysis.p_box(s, "x", *([0.0] * ("time" in s.labels.dims))),
}


@pytest.fixture(scope="module")
def surrogates():
    """Return the surrogate of outputs that have no time, and of the same at one time."""
    method = fb.AdaptivePCCI(max_runs=40)
    return [fb.expand(response, INPUTS, method) for response in (without_time, at_one_time)]


@pytest.mark.parametrize("name", ANSWERS)
def test_answers_are_those_at_one_time(name, surrogates):
    answer, expected = (ANSWERS[name](surrogate) for surrogate in surrogates)
    assert_equal(answer, expected)


def test_saved_surrogates_keep_the_axes(tmp_path):
    surrogate = fb.expand(without_time, INPUTS, fb.AdaptivePCCI(max_runs=40))
    fb.save_surrogate(surrogate, tmp_path / "one.npz")
    copy = fb.load_surrogate(tmp_path / "one.npz")
    xr.testing.assert_identical(copy.bands(), surrogate.bands())


def test_labels_that_are_texts_are_outputs():
    bands = fb.propagate(along_quantities, INPUTS, fb.AdaptivePCCI(max_runs=30))
    assert bands["relative_expected_error"].dims == ("quantity",)


def test_outputs_that_come_last_are_put_before_time():
    times = np.linspace(0, 1, 5)

    def response(a, b):
        values = a[:, None, None] * times[:, None] + b[:, None, None] * np.array([1.0, 1e6])
        coords = {"time": times, "output": ["x", "F"]}
        return xr.DataArray(values, coords, ("sample", "time", "output"))

    bands = fb.propagate(response, INPUTS, fb.AdaptivePCCI())
    assert bands["mean"].dims == ("bound", "output", "time")
    np.testing.assert_allclose(bands["mean"].sel(bound="upper", output="x"), times + 1, rtol=1e-6)


@pytest.mark.parametrize(
    ("dims", "coords", "expected"),
    [
        (("sample",), {}, ((), (), None, 1)),
        (("sample", "dim_1"), {}, ((), (), "dim_1", 3)),
        (("sample", "output"), {}, (("output",), (3,), None, 1)),
        (("sample", "kind"), {"kind": ["a", "b", "c"]}, (("kind",), (3,), None, 1)),
        (("bound", "output", "time"), {}, (("output",), (3,), "time", 3)),
    ],
)
def test_time_is_the_last_dim_unless_it_names_outputs(dims, coords, expected):
    values = xr.DataArray(np.zeros((2, 3, 3)[: len(dims)]), coords, dims)
    assert axes_of(values) == expected


def test_names_are_those_of_all_dims_but_time():
    coords = {"output": ["F", "x"], "time": [0.0, 1.0]}
    assert names_of_outputs(xr.DataArray(np.zeros((1, 2, 2)), coords, ("sample", *coords))) == [
        "F",
        "x",
    ]
    assert names_of_outputs(xr.DataArray(np.zeros((1, 2)), dims=("sample", "t"))) == [
        "the response"
    ]


@pytest.mark.parametrize("at", [{"time": 0.5}, {"time": [0.5, 1.0]}, {"output": "x"}])
@pytest.mark.parametrize("labelled", [True, False])
def test_answers_at_one_time_are_those_of_all_times_there(at, labelled):
    times = np.linspace(0, 1, 3)

    def response(a, b):
        values = np.stack([a[:, None] * (1 + times), b[:, None] * times + a[:, None]], axis=1)
        coords = {"output": ["F", "x"], "time": times}
        result = xr.DataArray(values, coords, ("sample", "output", "time"))
        return result if labelled else result.drop_vars("output").rename(output="place")

    if not labelled:
        at = {{"output": "place"}.get(k, k): 1 if k == "output" else v for k, v in at.items()}
    surrogate = fb.expand(response, INPUTS, fb.AdaptivePCCI())
    for answer, name in (
        (fb.analysis.quantiles, "quantiles"),
        (fb.analysis.value_range, "range"),
        (fb.analysis.contributions, "width"),
    ):
        all_times = answer(surrogate)[name]
        part = answer(surrogate, at=at)[name]
        index = {"place": 1} if "place" in at else at
        expected = all_times.isel(index) if "place" in at else all_times.sel(index)
        np.testing.assert_allclose(part, expected, rtol=1e-6, atol=1e-9)
