"""Values of a response: checked, aligned by name over all batches, independent of what is not."""

import json
import warnings

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import flexband as fb
from flexband.study.results.netcdf import write_netcdf

TIMES = np.linspace(0.0, 1.0, 4)
INPUTS = {"x": fb.Normal(0.0, 1.0), "e": fb.Interval(0.5, 1.0)}


def response(x, e):
    """Return outputs u = x + e t and v = e², dims (sample, output, time)."""
    u = x[:, None] + e[:, None] * TIMES
    v = e[:, None] ** 2 + 0 * u
    return xr.DataArray(
        np.stack([u, v], axis=1),
        dims=("sample", "output", "time"),
        coords={"output": ["u", "v"], "time": TIMES, "unit": ("output", ["m", "N"])},
    )


def in_later_batches(change):
    """Return the response, changed in all calls but the first."""
    calls = []

    def later_response(x, e):
        calls.append(len(x))
        return change(response(x, e)) if len(calls) > 1 else response(x, e)

    return later_response


@pytest.mark.parametrize(
    "change",
    [
        lambda F: F.transpose("time", "output", "sample"),
        lambda F: F.isel(output=[1, 0]),
        lambda F: F.isel(time=[3, 0, 2, 1], output=[1, 0]).transpose("output", ...),
    ],
)
def test_batches_are_aligned_by_name(change):
    expected = fb.propagate(response, INPUTS, fb.PCCI(2, 2))
    bands = fb.propagate(in_later_batches(change), INPUTS, fb.PCCI(2, 2), batch=4)
    xr.testing.assert_identical(bands, expected)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda F: F.assign_coords(time=F.time + 1e-9), "coordinate 'time' of the response must"),
        (lambda F: F.assign_coords(output=["u", "w"]), "coordinate 'output' of the response must"),
        (lambda F: F.assign_coords(unit=("output", ["m", "kN"])), "coordinate 'unit' of the"),
        (lambda F: F.drop_vars("unit"), "coordinate 'unit' .* in all runs or in none"),
        (lambda F: F.assign_coords(batch=2), "coordinate 'batch' .* in all runs or in none"),
        (lambda F: F.drop_vars("output"), "coordinate 'output' .* in all runs or in none"),
        (lambda F: F.rename(time="t"), r"dims \(output, time\) in all runs, .* got \(output, t\)"),
        (lambda F: F.values, r"dims \(output, time\) in all runs, .* got \(dim_1, dim_2\)"),
        (lambda F: F.isel(time=slice(3)), r"\(2, 4\) per run, as in the first ones; got \(2, 3\)"),
        (lambda F: F.isel(output=0), r"dims \(output, time\) in all runs"),
    ],
)
def test_other_labels_in_a_later_batch_are_refused(change, text):
    with pytest.raises(fb.errors.InputError, match=text):
        fb.propagate(in_later_batches(change), INPUTS, fb.PCCI(2, 2), batch=4)


def test_later_calls_of_an_adaptive_method_are_aligned_too():
    expected = fb.propagate(response, INPUTS, fb.AdaptivePCCI(1e-9, phase_resolved=False))
    reverse = in_later_batches(lambda F: F.isel(output=[1, 0]))
    method = fb.AdaptivePCCI(1e-9, phase_resolved=False)
    xr.testing.assert_identical(fb.propagate(reverse, INPUTS, method), expected)
    surrogate = fb.expand(response, INPUTS, fb.PCCI(1, 2))
    verification = fb.verify(
        surrogate, lambda x, e: response(x, e).isel(output=[1, 0])
    ).verification
    np.testing.assert_allclose(verification["missed"], 0.0, atol=1e-12)


def test_the_dim_sample_may_be_anywhere():
    expected = fb.propagate(response, INPUTS, fb.PCCI(1, 1))
    result = fb.propagate(lambda x, e: response(x, e).transpose(), INPUTS, fb.PCCI(1, 1))
    xr.testing.assert_identical(result.transpose(*expected["mean"].dims, ...)["mean"],
                                expected["mean"])  # fmt: skip


def test_a_buffer_that_is_used_again_is_copied():
    times = TIMES.copy()
    buffer = np.empty((4, 4))

    def reusing(x, e):
        times[:] = TIMES
        buffer[: len(x)] = x[:, None] * times + e[:, None]
        x[:] = np.nan
        e[:] = np.nan  # arguments may be written into
        return xr.DataArray(buffer[: len(x)], dims=("run", "time"), coords={"time": times})

    bands = fb.propagate(reusing, INPUTS, fb.PCCI(2, 2), batch=4)
    times[:] = 7.0
    np.testing.assert_array_equal(bands["time"], TIMES)
    np.testing.assert_allclose(bands["mean"].sel(bound="upper"), 1.0)


class Plain(fb.Input):
    """An input whose values are its standard variables, not a copy of them."""

    def value(self, standard):
        return standard[:, 0]

    def standard(self, value):
        return value


def test_a_response_cannot_change_the_design():
    def squared(x):
        x *= x
        return x + 0.0

    bands = fb.propagate(squared, {"x": Plain()}, fb.PCCI(2, 0))
    np.testing.assert_allclose(bands["mean"], 1.0)


def x_times(factor):
    return lambda x: x[:, None] * factor


@pytest.mark.parametrize(
    ("result", "text"),
    [
        (lambda x: np.ma.masked_less(x_times(TIMES)(x), 0.0), "got a masked one: fill it first"),
        (lambda x: list(np.ma.masked_less(x_times(TIMES)(x), 0.0)), "got a masked one"),
        (lambda x: x + 0j, "must return real numbers; got ndarray of complex128"),
        (lambda x: x.astype(object), "must return real numbers; got ndarray of object"),
        (lambda x: x.astype("datetime64[s]"), "must return real numbers; got ndarray of datetime"),
        (lambda x: x.astype(str), "must return real numbers; got ndarray of <U"),
        (lambda x: [str(v) for v in x], "must return real numbers; got list of <U"),
        (lambda x: xr.DataArray(x + 0j), "must return real numbers; got DataArray of complex128"),
        (lambda x: {"u": x}, "must return an array; got a dict"),
        (lambda x: xr.Dataset({"u": ("sample", x)}), "must return an array; got a Dataset"),
        (lambda x: [[1.0], [1.0, 2.0]], "must return an array; got a list"),
        (lambda x: None, "the response must return"),
        (lambda x: x.size, r"must return shape \(2, ...\); got shape \(\)"),
        (lambda x: x[:1], r"must return shape \(2, ...\); got shape \(1,\)"),
        (lambda x: x_times(TIMES)(x).T, r"must return shape \(2, ...\); got shape \(4, 2\)"),
        (x_times(TIMES[:0]), "must return a number per run"),
        (lambda x: x / 0 * np.inf, r"not finite in 2 of 2 runs, e.g. x ="),
        (lambda x: np.full(2, 1e200), r"larger than 1e\+150 in 2 of 2 runs, e.g. x = -1. It"),
        (lambda x: np.full(2, 1e-170) * x, "the response is at most 1e-170 in size in 2 runs, and"),
        (lambda x: xr.DataArray(x_times(TIMES)(x), dims=("sample", "bound")), "got 'bound'"),
        (lambda x: xr.DataArray(x_times(TIMES)(x), dims=("sample", "a/b")), "got 'a/b'"),
        (lambda x: xr.DataArray(x_times(TIMES[:2])(x), dims=("sample", "time"),
                                coords={"time": [0.0, np.nan]}), "'time' .* must be finite"),
        (lambda x: xr.DataArray(x_times(TIMES[:2])(x), dims=("sample", "output"),
                                coords={"output": ["u", "u"]}), "output .* got 'u' twice"),
    ],
)  # fmt: skip
@pytest.mark.filterwarnings("ignore:.*encountered:RuntimeWarning")
def test_what_is_not_an_array_of_real_numbers_is_refused(result, text):
    with pytest.raises(fb.errors.InputError, match=text):
        fb.propagate(result, {"x": fb.Normal(0.0, 1.0)}, fb.PCCI(1, 0))


@pytest.mark.parametrize("response", [3.0, "sin", None])
def test_a_response_has_named_arguments(response):
    with pytest.raises(fb.errors.InputError, match="response must be a function"):
        fb.propagate(response, INPUTS, fb.PCCI(1, 1))


@pytest.mark.parametrize(
    "result",
    [
        lambda x: [*x],
        lambda x: pd.DataFrame({"u": x, "v": 2 * x}),
        lambda x: np.round(x).astype(int),
        lambda x: x > 0,
        lambda x: np.matrix(x).T,
        lambda x: xr.DataArray(x, dims="run", coords={"run": np.arange(len(x)), "sample": 3}),
    ],
)
@pytest.mark.filterwarnings("ignore:the matrix subclass:PendingDeprecationWarning")
def test_other_arrays_of_real_numbers_are_taken(result):
    bands = fb.propagate(result, {"x": fb.Normal(0.0, 1.0)}, fb.PCCI(1, 0))
    assert bands["mean"].shape[:1] == (2,)


def test_columns_of_a_table_are_aligned_by_name():
    def table(x):
        frame = pd.DataFrame({"u": x, "v": 2 * x})
        return frame if x[0] < 0 else frame[["v", "u"]]

    bands = fb.propagate(table, {"x": fb.Normal(0.0, 1.0)}, fb.PCCI(1, 0), batch=1)
    np.testing.assert_allclose(bands["error_bar"].sel(bound="upper"), [1.0, 2.0])


METHODS = [
    fb.PCCI({"a": 1, "z": 2}, {"m": 1, "b": 2}),
    fb.ImprovedPCCI(2, 2),
    fb.methods.PhaseResolvedPCCI(1, 1),
    fb.AdaptivePCCI(1e-3, max_runs=40),
    fb.AdaptivePCCI(1e-3, max_runs=40, phase_resolved=False),
    fb.LHSScanning(7, 3),
    fb.MonteCarlo(7, 3),
]


@pytest.mark.parametrize("method", METHODS, ids=lambda m: m.label)
def test_the_order_of_the_inputs_does_not_matter(method, tmp_path):
    times = np.linspace(0.0, 1.0, 101)

    def ringing(**values):
        z, b, a, m = (values[name][:, None] for name in "zbam")
        return (
            a * np.sin(20 * np.exp(0.02 * (z + b)) * times)
            + m * times * sum(values.values())[:, None]
        )

    inputs = {
        "m": fb.Interval(0.9, 1.1),
        "z": fb.Normal(0.0, 1.0),
        "b": fb.Interval(-1.0, 1.0),
        "a": fb.Uniform(0.9, 1.1),
    }
    other = dict(sorted(inputs.items()))
    if isinstance(method.__dict__.get("random_order"), dict):
        equal_method = fb.PCCI({"z": 2, "a": 1}, {"b": 2, "m": 1})
        assert (equal_method, equal_method.label, repr(equal_method)) == (
            method,
            method.label,
            repr(method),
        )
    results = []
    for number, variant in enumerate((inputs, other, dict(reversed(inputs.items())))):
        bands = fb.propagate(ringing, variant, method)
        file = tmp_path / f"{number}.nc"
        write_netcdf(bands, file)
        results.append((file.read_bytes(), json.dumps(bands.attrs, default=str)))
    assert results[0] == results[1] == results[2]


@pytest.mark.parametrize(
    ("kind", "digits"), [(np.float16, 2e-3), (np.float32, 1e-6), (np.longdouble, 1e-12)]
)
def test_numbers_of_any_precision_are_taken_without_a_warning(kind, digits):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        bands = fb.propagate(lambda x, e: (e + x).astype(kind), INPUTS, fb.LHSScanning())
    exact = fb.propagate(lambda x, e: e + x, INPUTS, fb.LHSScanning())
    np.testing.assert_allclose(bands["mean"], exact["mean"], atol=digits)


@pytest.mark.parametrize("size", [1e149, 1e-119])
def test_claims_do_not_depend_on_the_unit_up_to_extreme_ones(size):
    inputs = {"a": fb.Interval(0.0, 1.0), "b": fb.Normal(1.0, 0.1)}
    bands, exact = (
        fb.propagate(
            lambda a, b, s=s: s * np.tanh(3 * a * b), inputs, fb.methods.PhaseResolvedPCCI(2, 3)
        )
        for s in (size, 1.0)
    )
    np.testing.assert_allclose(bands["error_bar"] / size, exact["error_bar"], rtol=1e-9, atol=1e-12)
    assert bands.attrs["expected_error"] == pytest.approx(exact.attrs["expected_error"], rel=1e-9)
