"""Surrogates: evaluated, saved, and held against fresh runs."""

import subprocess
import sys
import textwrap
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import flexband as fb
from benchmarks.accuracy.formulas import damped_oscillation, formula, two_carriers, wave
from benchmarks.accuracy.references import moments, normal_rule

METHODS = [
    fb.AdaptivePCCI(0.01),
    fb.methods.PhaseResolvedPCCI(2, 1),
    fb.methods.PhaseResolvedPCCI(1, 1),
    fb.ImprovedPCCI(3, 3),
]


@pytest.mark.parametrize("method", METHODS)
def test_bands_of_a_surrogate_are_those_of_propagate(method):
    case = formula(damped_oscillation)
    surrogate = fb.expand(case.response, case.inputs, method)
    xr.testing.assert_identical(surrogate.bands(), fb.propagate(case.response, case.inputs, method))


@pytest.mark.parametrize("method", METHODS)
def test_a_saved_surrogate_is_the_same(method, tmp_path):
    case = formula(wave)
    surrogate = fb.expand(case.response, case.inputs, method)
    file = tmp_path / "deep" / "wave.npz"
    fb.save_surrogate(surrogate, file)
    copy = fb.load_surrogate(file)
    xr.testing.assert_identical(copy.bands(), surrogate.bands())
    points = {"x": np.array([0.3, -1.0]), "e": np.array([0.5, -0.2])}
    xr.testing.assert_identical(copy.evaluate(**points), surrogate.evaluate(**points))
    assert [f.name for f in file.parent.iterdir()] == ["wave.npz"]


def test_a_surrogate_does_not_keep_the_runs():
    def response(x, e):
        return np.outer(x + e, np.ones(10_000))

    inputs = {"x": fb.Normal(0, 1), "e": fb.Interval(0, 1)}
    tracemalloc.start()
    try:
        surrogate = fb.expand(response, inputs, fb.PCCI(3, 3))
        memory, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert len(surrogate.labels) == 0
    assert memory < 1.5 * 16 * 10_000 * 8  # the coefficients


def test_values_and_moments_are_those_of_the_response():
    case = formula(wave)
    surrogate = fb.expand(case.response, case.inputs, fb.AdaptivePCCI(0.001))
    points = {"x": np.array([0.3, -1.0, 1.7]), "e": np.array([0.5, -0.2, 1.0])}
    np.testing.assert_allclose(surrogate.evaluate(**points), case.response(**points), atol=2e-3)
    moments = surrogate.moments(e=0.5)
    t = surrogate.labels["time"].values
    w = 2 * np.pi * 1.025 * t
    s = 2 * np.pi * 0.02 * t
    mean = np.exp(-(s**2) / 2) * np.cos(w)
    square = (1 + np.exp(-2 * s**2) * np.cos(2 * w)) / 2
    np.testing.assert_allclose(moments["mean"][0], mean, atol=2e-3)
    np.testing.assert_allclose(moments["std"][0] ** 2, square - mean**2, atol=2e-3)
    assert surrogate.evaluate(x=0.0, e=[0.0, 0.5]).shape == (2, len(t))


def test_moments_of_two_carriers():
    case = formula(two_carriers)
    surrogate = fb.expand(case.response, case.inputs, fb.AdaptivePCCI(0.005))
    assert int(surrogate.diagnostics["carriers"]) == 2
    x, weights = normal_rule(281)
    mean, variance = moments(weights, case.response(x=x, e=np.full_like(x, -0.4)).values)
    result = surrogate.moments(e=-0.4)
    np.testing.assert_allclose(result["mean"][0], mean, atol=5e-3)
    np.testing.assert_allclose(result["std"][0] ** 2, variance, atol=0.025)


def field_response(stiffness, load, angle):
    x = np.linspace(0.0, 1.0, 5)
    F = np.stack([load / stiffness(x).mean(axis=1), load * np.sin(angle)], axis=1)
    return xr.DataArray(F, dims=("sample", "output"), coords={"output": ["u", "v"]})


FIELD_INPUTS = {
    "stiffness": fb.RandomField(2.0, 0.1, correlation_length=1.0, domain=(0.0, 1.0)),
    "load": fb.Interval(1.0, 2.0),
    "angle": fb.Normal(0.5, 0.1),
}


def test_fields_are_given_by_their_standard_variables(tmp_path):
    surrogate = fb.expand(field_response, FIELD_INPUTS, fb.ImprovedPCCI(8, 1))
    terms = FIELD_INPUTS["stiffness"].dimension
    xi = np.linspace(-1, 1, 3 * terms).reshape(3, terms)
    field = FIELD_INPUTS["stiffness"].value(xi)
    points = {"load": np.array([1.0, 1.5, 2.0]), "angle": np.array([0.4, 0.5, 0.6])}
    values = surrogate.evaluate(stiffness=xi, **points)
    np.testing.assert_allclose(values, field_response(field, **points), atol=1e-4)
    fb.save_surrogate(surrogate, tmp_path / "s.npz")
    copy = fb.load_surrogate(tmp_path / "s.npz")
    xr.testing.assert_identical(copy.evaluate(stiffness=xi, **points), values)


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda s: s.evaluate(x=0.0), "values must be given for e, x; got x"),
        (lambda s: s.evaluate(x=0.0, e=2.0), "e: values must be from -1 to 1; got 2"),
        (lambda s: s.evaluate(x=[0.0, 1.0], e=[0.0, 0.1, 0.2]), "values must be equally many"),
        (lambda s: s.moments(x=0.0), "values must be given for e; got x"),
        (lambda s: s.evaluate(x=np.nan, e=0.0), "x: values must be finite; got nan"),
        (lambda s: s.evaluate(x=abs, e=0.0), "x: values must be finite; got a function"),
        (lambda s: fb.save_surrogate(s, Path(__file__).parent), "is a folder; give the name"),
        (
            lambda s: fb.verify(s, lambda x, e: np.zeros((len(x), 2))).verification,
            r"must return dims \(time\) in all runs, as in the first ones; got \(dim_1\)",
        ),
        (lambda s: fb.load_surrogate("nowhere.npz"), "there is no file nowhere.npz"),
        (lambda s: fb.verify(s, lambda x, e: x, runs=1).verification, "runs must be 2 or more"),
        (
            lambda s: fb.expand(lambda x: x, {"x": fb.Interval(0, 1)}, fb.LHSScanning(9, 2)),  # type: ignore
            "method must be one that expands the response",
        ),
    ],
)
def test_bad_input_is_refused(call, text):
    case = formula(wave)
    surrogate = fb.expand(case.response, case.inputs, fb.ImprovedPCCI(1, 1))
    with pytest.raises(fb.errors.InputError, match=text):
        call(surrogate)


def test_a_surrogate_says_what_it_is_of_in_a_line():
    case = formula(wave)
    surrogate = fb.expand(case.response, case.inputs, fb.ImprovedPCCI(1, 1))
    assert repr(surrogate) == "<Surrogate of e, x; time 1001>"


def test_what_cannot_be_saved_or_loaded_is_refused(tmp_path):
    field = fb.RandomField(1.0, 0.1, 1.0, domain=(0.0, 1.0), correlation=lambda d: np.exp(-(d**2)))
    surrogate = fb.expand(lambda f: f(np.zeros(1))[:, 0], {"f": field}, fb.ImprovedPCCI(1, 0))
    with pytest.raises(
        fb.errors.InputError, match=r"f: .* cannot be saved; fields of inputs may be"
    ):
        fb.save_surrogate(surrogate, tmp_path / "s.npz")
    (tmp_path / "t.npz").write_bytes(b"no archive")
    with pytest.raises(fb.errors.InputError, match="holds no surrogate"):
        fb.load_surrogate(tmp_path / "t.npz")


def test_plain_expansions_run_without_the_machinery_of_phases(tmp_path):
    """From the import to the saved file and back, in an interpreter of its own."""
    code = f"""
        import sys
        import numpy as np
        import flexband as fb

        def response(x, e):
            return np.exp(0.1 * x)[:, None] * np.cos(e[:, None] * np.arange(4))

        inputs = {{"x": fb.Normal(0.0, 1.0), "e": fb.Interval(0.0, 1.0)}}
        for method in (fb.PCCI(), fb.ImprovedPCCI(2, 2), fb.LHSScanning(), fb.MonteCarlo()):
            fb.propagate(response, inputs, method)
        surrogate = fb.expand(response, inputs, fb.PCCI())
        fb.save_surrogate(surrogate, {str(tmp_path / "s.npz")!r})
        for one in (surrogate, fb.load_surrogate({str(tmp_path / "s.npz")!r})):
            one.bands(), one.moments(e=0.5), one.evaluate(x=0.1, e=0.5)
        fb.verify(surrogate, response).verification
        print(*sys.modules)
    """
    run = [sys.executable, "-c", textwrap.dedent(code)]
    modules = subprocess.run(run, capture_output=True, text=True, check=True).stdout.split()
    rooms = {name.split(".")[2] for name in modules if name.startswith("flexband.uncertainty.")}
    assert {"expansions", "inputs", "surrogates"} <= rooms
    assert not {"phases", "phase_resolved", "adaptive"} & rooms


@pytest.mark.parametrize(
    "value",
    ["1.5", True, np.ma.array([1.0, 2.0], mask=[0, 1]), np.datetime64("2020", "D"), 1j, None, [],
     np.zeros(0), np.nan, ["1"], b"1"],
)  # fmt: skip
def test_a_surrogate_is_evaluated_at_numbers(value):
    inputs = {"a": fb.Interval(1.0, 2.0), "b": fb.Normal(0.0, 1.0)}
    surrogate = fb.expand(lambda a, b: np.stack([a, b], axis=1), inputs, fb.PCCI(1, 1))
    for values in ({"a": value, "b": 0.0}, {"a": 1.0, "b": value}):
        with pytest.raises(fb.errors.InputError, match=r"[ab]: values must be finite"):
            surrogate.evaluate(**values)


def test_a_surrogate_says_when_it_extrapolates(tmp_path):
    """Beyond five standard deviations, unless runs reach farther; intervals are refused."""
    field = fb.RandomField(2.0, 0.1, correlation_length=1.0, domain=(0.0, 1.0), terms=2)
    inputs = {"x": fb.Normal(10.0, 1.0), "f": field, "e": fb.Interval(0.0, 1.0)}
    surrogate = fb.expand(
        lambda x, f, e: x * e + f(np.zeros(1))[:, 0], inputs, fb.AdaptivePCCI(phase_resolved=False)
    )
    fb.save_surrogate(surrogate, tmp_path / "s.npz")
    low, high = (surrogate.diagnostics.attrs[f"{end}_xi"] for end in ("lowest", "highest"))
    for expansion in (surrogate, fb.load_surrogate(tmp_path / "s.npz")):
        expansion.evaluate(x=[5.1, 14.9], f=[[-4.9, 4.9]], e=[0.0, 1.0])
        reach = rf"between \({10 + low[2]:.6g}, ξ = {low[2]:.3g}\) and \({10 + high[2]:.6g}, ξ = "
        with pytest.warns(
            fb.errors.FlexbandWarning, match=rf"x \(-10, ξ = -20\) is beyond .* {reach}"
        ):
            expansion.evaluate(x=[9.0, -10.0], f=[[0.0, 7.0]], e=0.5)
        with pytest.warns(fb.errors.FlexbandWarning, match=r"f\[1\] \(ξ = 7\) is beyond .*ξ = -"):
            expansion.evaluate(x=10.0, f=[[0.0, 7.0]], e=0.5)
    with pytest.raises(fb.errors.InputError, match=r"e: values must be from 0 to 1; got 1\.1"):
        surrogate.evaluate(x=10.0, f=[[0.0, 0.0]], e=1.1)


def test_results_have_long_names_and_units():
    def response(x, e):
        values = np.stack([x + e, 2 * x], axis=1)
        unit = ("output", units)
        return xr.DataArray(values, dims=("sample", "output"), coords={"unit": unit})

    inputs = {"x": fb.Normal(0, 1), "e": fb.Interval(0, 1)}
    for method in (fb.PCCI(1, 1), fb.AdaptivePCCI(0.01), fb.LHSScanning(4, 2)):
        for units in (["N", "N"], ["N", "m"]):
            bands = fb.propagate(response, inputs, method, sigmas=2)
            attrs = bands["error_bar"].attrs
            assert attrs["long_name"] == "interval error bar: lowest μ − 2σ and highest μ + 2σ"
            assert attrs.get("units") == ("N" if units == ["N", "N"] else None)
            assert all("long_name" in bands[name].attrs for name in bands.data_vars)
            assert "units" not in bands["mean_at"].attrs


def test_parts_of_the_expected_error_add_up_for_every_k():
    class Coarse:
        """With an error of its step in σ alone, which moves μ ± kσ by k times as much."""

        def __init__(self, h=0.1):
            self.h = h

        def refined(self):
            return Coarse(self.h / 2)

        def __call__(self, x, e):
            return (1 + self.h**2) * x + 0.1 * e

    inputs = {"x": fb.Normal(0, 1), "e": fb.Interval(-1, 1)}
    surrogate = fb.expand(Coarse(), inputs, fb.AdaptivePCCI(0.01, correct=False))
    for k in (0.5, 1.0, 3.0):
        bands = surrogate.bands(k)
        exact = 0.1 + k
        estimate = float(bands["error_bar_discretization_error"])
        true = abs(float(bands["error_bar"][1]) - exact)
        assert true == pytest.approx(0.01 * k, rel=1e-6)
        assert estimate == pytest.approx(0.01 * max(k, np.sqrt((1 + k * k) / 2)), rel=0.02)
        attrs = bands.attrs
        assert attrs["expected_error"] == pytest.approx(
            attrs["expansion_error"] + attrs["discretization_error"], rel=1e-6
        )
