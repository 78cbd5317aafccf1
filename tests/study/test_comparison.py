"""Comparisons of methods: relative errors, and times without compilation."""

import numpy as np
import pytest
import xarray as xr

import flexband as fb
from flexband.study.comparison import compare, relative_error, warm_up
from flexband.uncertainty.methods.pcci import ImprovedPCCI


def test_relative_error_is_over_both_bounds():
    reference = xr.DataArray([[1.0, 1.0], [3.0, -3.0]], dims=("bound", "time"))
    values = xr.DataArray([[1.0, 2.0], [3.0, -3.0]], dims=("bound", "time"))
    assert relative_error(values, reference) == 1 / 8
    outputs = xr.concat([reference, 1e-14 * reference], dim="output")
    assert np.isnan(relative_error(outputs, outputs)).values.tolist() == [False, True]


def test_compare_needs_no_labels():
    study = fb.Study(lambda x: x**2, {"x": fb.Interval(0, 1)}, fb.PCCI(0, 2))
    reference, result = compare(study, fb.LHSScanning(2, 11), [fb.ImprovedPCCI(0, 2)])
    assert not reference.errors
    assert float(result.errors["mean"]) < 1e-12
    assert (reference.runs, result.runs) == (11, 3)


def test_everything_is_compiled_before_the_clock_starts():
    calls = []

    class Recorded(ImprovedPCCI):
        name = "recorded"

        def solve(self, space, evaluate, sigmas=1.0):
            calls.append("solve")
            return super().solve(space, evaluate, sigmas)

    def response(x):
        calls.append(len(x))
        return x**2

    study = fb.Study(response, {"x": fb.Interval(0, 1)}, fb.PCCI(0, 2))
    warm_up(study, [Recorded(0, 1), Recorded(0, 2)])
    assert calls == [1, "solve"]  # one run; one method of the class, without runs
    calls.clear()
    _, result = compare(study, fb.LHSScanning(2, 3), [Recorded(0, 2)])
    assert calls == [1, "solve", 3, 1, "solve", 3, 1]  # one run is made again
    assert result.runs == 3


def test_inputs_of_one_kind_are_warmed_up():
    for quantity in (fb.Interval(0, 1), fb.Normal(0, 1)):
        study = fb.Study(lambda x: x**2, {"x": quantity}, fb.PCCI())
        warm_up(study, [fb.methods.PhaseResolvedPCCI(), fb.AdaptivePCCI(), fb.MonteCarlo()])


class Stepped:
    """A response with an error of h² that leaves out its step h."""

    def __init__(self, h=1.0):
        self.h = h

    def left_out(self, x):
        return ["step"]

    def refinements(self, x):
        return {"step": Stepped(self.h / 2)}

    def discretization(self, x):
        return {"step": self.h}

    def __call__(self, x):
        return x[:, None] * np.linspace(1.0, 2.0, 40) * (1.0 + self.h**2)


@pytest.mark.parametrize("method", [fb.AdaptivePCCI(0.04), fb.PCCI(1, 1)])
def test_methods_are_compared_on_the_step_that_the_adaptive_one_chooses(method):
    study = fb.Study(Stepped(), {"x": fb.Interval(1.0, 2.0)}, method)
    with pytest.warns(
        fb.errors.FlexbandWarning, match=r"left out: step; adaptive PCCI .* chooses step"
    ):
        reference, result = compare(study, fb.LHSScanning(2, 5), [fb.PCCI(1, 1)])
    assert float(result.errors["mean"]) < 1e-12
    factor = float(reference.bands["mean"][0, 0])
    assert 1.0 < factor < (1.02 if method.name == "adaptive PCCI" else 1.005)
