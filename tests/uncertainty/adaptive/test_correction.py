"""The correction of the error of step and elements: exact references, and who must know of it."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
import xarray as xr

import flexband as fb
from flexband.analysis.selection import select_places

TIMES = np.linspace(0.0, 1.0, 201)
FEW_TIMES = np.linspace(0.0, 1.0, 21)
INPUTS = {"x": fb.Normal(0.0, 1.0), "e": fb.Interval(-1.0, 1.0)}
CORRECTED = fb.AdaptivePCCI(1e-2)
PLAIN = fb.AdaptivePCCI(1e-2, correct=False)
BANDS = ("mean", "error_bar")


@dataclass(frozen=True)
class StepError:
    """A response with a known error of its step h; h = 0 is exact."""

    law: Callable
    h: float = 1.0

    def refinements(self, **values):
        return {"step": replace(self, h=self.h / 2)}

    def discretization(self, **values):
        return {"step": self.h}

    def __call__(self, **values):
        values = {name: v[:, None] for name, v in values.items()}
        return with_labels(self.law(self.h, **values))


def with_labels(outputs):
    return xr.DataArray(
        np.stack(np.broadcast_arrays(*outputs), axis=1),
        dims=("sample", "output", "time"),
        coords={
            "output": [f"u{k}" for k in range(len(outputs))],
            "time": np.linspace(0.0, 1.0, outputs[0].shape[-1]),
        },
    )


def ringing(h, x, e):
    """Phase, amplitude and base are off by errors of second order, and of fourth."""
    phase = (
        2
        * np.pi
        * (20 + 0.3 * x + 0.5 * e)
        * TIMES
        * (1 + 0.01 * (1 + 0.1 * x) * h**2 + 1e-4 * h**4)
    )
    amplitude = (1 + 0.1 * e + 0.05 * x) * (1 + 0.05 * h**2)
    return (amplitude * np.cos(phase) + (1 + 0.1 * h**2) * TIMES * e,)


def smooth(order):
    def law(h, x, e):
        shift = (
            0.3 * (1 + 0.3 * e + 0.1 * x) * np.sin(3 * TIMES) * (h**order + 0.05 * h ** (2 * order))
        )
        return ((2 + x + e) * np.exp(-TIMES) + shift,)

    return law


def jumping(h, x, e):
    """An event is noticed at the next of the steps."""
    event = 0.5 + 0.1 * e + 0.02 * x
    step = 0.03 * h
    return (np.where(step * np.ceil(event / step) < TIMES, 1.0, 0.0) + 0.1 * x,)


def first(law, h=1.0):
    return StepError(law, h)


def relative(bands, exact):
    width = float((exact["error_bar"][1] - exact["error_bar"][0]).mean())
    return [float(np.abs(bands[name] - exact[name]).mean()) / width for name in BANDS]


@pytest.mark.parametrize(
    ("law", "kind", "gain"),
    [
        (ringing, "phases", 100),
        (smooth(1), "values", 12),
        (smooth(2), "values", 12),
        (smooth(3), "values", 12),
    ],
)
def test_a_known_error_is_corrected_and_what_is_left_of_it_is_expected(law, kind, gain):
    exact = fb.propagate(StepError(law, 0.0), INPUTS, fb.AdaptivePCCI(1e-4))
    uncorrected, bands = (fb.propagate(StepError(law), INPUTS, m) for m in (PLAIN, CORRECTED))
    assert bands.attrs["corrected"] == f"step of u0 by {kind}"
    assert "corrected" not in uncorrected.attrs
    before = max(relative(uncorrected, exact))
    after = max(relative(bands, exact))
    assert before > 0.03
    assert after < before / gain
    assert after / 3 < bands.attrs["expected_error"] < max(5 * after, 1e-3)


def test_a_jump_is_not_corrected_and_its_error_is_that_without_correction():
    uncorrected, bands = (fb.propagate(StepError(jumping), INPUTS, m) for m in (PLAIN, CORRECTED))
    assert "corrected" not in bands.attrs
    for name in (*BANDS, *(f"{band}_expected_error" for band in BANDS)):
        np.testing.assert_array_equal(bands[name], uncorrected[name])


def test_a_small_error_is_not_corrected():
    bands = fb.propagate(StepError(smooth(2), 0.01), INPUTS, CORRECTED)
    assert "corrected" not in bands.attrs
    assert bands.attrs["runs_refined"] == 2


def test_outputs_are_corrected_one_by_one():
    def law(h, x, e):
        return (*ringing(h, x, e), *jumping(h, x, e), *smooth(2)(h, x, e), *smooth(2)(0.0, x, e))

    bands = fb.propagate(StepError(law), INPUTS, CORRECTED)
    single = fb.propagate(StepError(smooth(2)), INPUTS, CORRECTED)
    assert bands.attrs["corrected"] == "step of u2 by values; step of u0 by phases"
    np.testing.assert_allclose(bands["mean"][:, 2], single["mean"][:, 0], rtol=1e-9)


def off_by_a_third(h, x, e):
    """The error of the step is a third of the width of the error bar."""
    bar = (1 + 0.2 * e) * (1 + FEW_TIMES)
    return ((x * bar) / 2 + e + 0.8 * h**2 * (1 + 0.1 * e),)


@pytest.fixture(scope="module", params=[CORRECTED, fb.PCCI(2, 2, correct=True)], ids=str)
def shifted(request):
    surrogate = fb.expand(StepError(off_by_a_third), INPUTS, request.param)
    assert surrogate.diagnostics.attrs["corrected"] == "step of u0 by values"
    return surrogate


def test_verification_confirms_a_corrected_surrogate(shifted):
    verification = fb.verify(shifted, StepError(off_by_a_third)).verification
    assert verification.attrs["confirmed"] == "yes"
    assert "correct" in verification.attrs["verdict"]
    assert float(verification["missed"].max()) < 1e-6
    wrong = replace(shifted, correction=())
    assert fb.verify(wrong, StepError(off_by_a_third)).verification.attrs["confirmed"] == "no"


def test_runs_follow_the_surrogate_before_its_correction(shifted):
    xi = np.array([[0.3], [-1.0]])
    eta = np.array([[0.5], [-0.2]])
    run = StepError(off_by_a_third)(x=xi[:, 0], e=eta[:, 0])
    exact = StepError(off_by_a_third, 0.0)(x=xi[:, 0], e=eta[:, 0])
    np.testing.assert_allclose(shifted.without_correction.standard(xi, eta), run, atol=1e-9)
    np.testing.assert_allclose(shifted.standard(xi, eta), exact, atol=1e-9)
    np.testing.assert_allclose(shifted.apply_correction(run.values, xi, eta), exact, atol=1e-9)


@pytest.fixture(scope="module")
def converged():
    return fb.expand(StepError(off_by_a_third, 0.0), INPUTS, PLAIN)


@pytest.fixture(scope="module")
def probability(converged):
    return largest_probability(converged)


def largest_probability(surrogate, response=None):
    limit = fb.Requirement("u0", above=-5.0, below=3.5)
    probabilities = fb.analysis.failure_probability(surrogate, limit, response=response, seed=1)
    return float(probabilities["probability"].max())


@pytest.mark.parametrize("response", [None, StepError(off_by_a_third)])
def test_probabilities_are_those_of_the_converged_response(shifted, response, probability):
    assert largest_probability(shifted, response) == pytest.approx(probability, rel=0.1)


def test_probabilities_of_the_runs_are_others(shifted, probability):
    assert largest_probability(shifted.without_correction) > 2 * probability


def test_allocated_tolerances_are_those_of_the_converged_response(shifted, converged):
    limit = fb.Requirement("u0", above=-2.2, below=2.4)
    expected = fb.analysis.allocate(converged, limit, {"e": 1.0}, sigmas=1.0)
    bands = fb.analysis.allocate(
        shifted, limit, {"e": 1.0}, sigmas=1.0, response=StepError(off_by_a_third)
    )
    assert bands.attrs["confirmed"] == "yes"
    np.testing.assert_allclose(bands["tolerance"], expected["tolerance"], rtol=1e-3)


def test_parts_of_a_surrogate_and_files_have_its_correction(shifted, tmp_path):
    fb.save_surrogate(shifted, tmp_path / "s.npz")
    copy = fb.load_surrogate(tmp_path / "s.npz")
    xr.testing.assert_identical(copy.bands(), shifted.bands())
    narrow = copy.narrowed(e=fb.Interval(0.0, 0.5))
    part = select_places(narrow, {"time": [0.0, 0.5, 1.0]})
    for surrogate, middle in ((copy, 0.0), (narrow, 0.25), (part, 0.25)):
        at = np.zeros((1, 1)), np.zeros((1, 1))
        change = surrogate.standard(*at) - surrogate.without_correction.standard(*at)
        np.testing.assert_allclose(change, -0.8 * (1 + 0.1 * middle), atol=1e-9)


@dataclass(frozen=True)
class CancellingError(StepError):
    """A response whose errors of step and elements cancel, and change each other."""

    n: float = 1.0

    def refinements(self, **values):
        return {"step": replace(self, h=self.h / 2), "elements": replace(self, n=self.n / 2)}

    def __call__(self, x, e):
        h = self.h**2
        n = self.n**2
        shift = (0.5 * h - 0.5 * n - 0.1 * h * n) * np.cos(2 * TIMES)
        return with_labels((x[:, None] * (1 + TIMES) + e[:, None] * (1 + 0.2 * shift) + shift,))


def test_errors_of_step_and_elements_that_cancel_are_not_underestimated():
    exact = fb.propagate(CancellingError(None, 0.0, 0.0), INPUTS, PLAIN)
    bands = fb.propagate(CancellingError(None), INPUTS, CORRECTED)
    assert bands.attrs["corrected"] == "step of u0 by values; elements of u0 by values"
    true = max(relative(bands, exact))
    assert true > 0.01
    assert true / 2 < bands.attrs["discretization_error"] < 5 * true
    kinds = ("fitted", "checked", "refined", "coarser", "repeated")
    assert bands.attrs["runs"] == sum(bands.attrs[f"runs_{kind}"] for kind in kinds)


def test_a_third_level_is_the_last_that_is_asked_for():
    """A response that cannot be made finer than a quarter of its step is not asked to be."""

    class LimitedStepError(StepError):
        def refinements(self, **values):
            if self.h < 0.5:
                raise ValueError("no finer mesh can be made")
            return super().refinements(**values)

    bands = fb.propagate(LimitedStepError(ringing), INPUTS, CORRECTED)
    assert bands.attrs["refined"] == ["step"]
