"""Methods with given runs that correct step and elements: exact and converged references."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
import xarray as xr

import flexband as fb
from flexband.errors import FlexbandWarning
from flexband.study.comparison import compare
from tests.uncertainty.adaptive.test_correction import (
    BANDS,
    INPUTS,
    TIMES,
    CancellingError,
    StepError,
    jumping,
    off_by_a_third,
    relative,
    ringing,
    smooth,
    with_labels,
)

VALUES = [
    fb.PCCI(2, 2, correct=True),
    fb.ImprovedPCCI(2, 2, correct=True),
    fb.methods.RegressionPCCI(2, correct=True),
    fb.methods.PerturbationChebyshev(2, correct=True),
]
METHODS = [*VALUES, fb.methods.PhaseResolvedPCCI(1, 1, correct=True)]
KINDS = ("fitted", "checked", "refined", "repeated")


def bands_of(response, method):
    return fb.propagate(response, INPUTS, method)


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.name)
@pytest.mark.parametrize("order", [1, 2, 3])
def test_a_known_error_is_corrected_and_what_is_left_of_it_is_expected(method, order):
    response = StepError(smooth(order))
    exact = bands_of(replace(response, h=0.0), fb.AdaptivePCCI(1e-5))
    uncorrected, bands = (bands_of(response, m) for m in (replace(method, correct=False), method))
    before = max(relative(uncorrected, exact))
    after = max(relative(bands, exact))
    assert bands.attrs["corrected"] == "step of u0 by values"
    assert after < before / 12
    assert after / 3 < bands.attrs["expected_error"] < max(5 * after, 1e-3)
    assert "corrected" not in uncorrected.attrs
    assert bands.attrs["runs"] == sum(bands.attrs[f"runs_{kind}"] for kind in KINDS)


@pytest.mark.parametrize(
    ("method", "runs"),
    [
        (fb.PCCI(3, 2, correct=True), (12 + 4, 3 + 2 + 1)),
        (fb.PCCI(0, 2, correct=True), (3 + 4, 2 + 2 + 1)),
        (fb.ImprovedPCCI({"x": 2}, {"e": 3}, correct=True), (12 + 4, 3 + 2 + 1)),
        (fb.methods.RegressionPCCI(2, correct=True), (12 + 4, 6 + 2 + 1)),
        (fb.methods.RegressionPCCI(0, correct=True), (2 + 4, 2 + 2 + 1)),
        (fb.methods.PerturbationChebyshev(2, correct=True), (9 + 4, 3 + 2 + 1)),
        (fb.methods.PhaseResolvedPCCI(1, 1, correct=True), (4 + 4 + 2, 3 + 2 + 1)),
    ],
    ids=str,
)
def test_the_runs_are_as_many_as_is_said(method, runs):
    space = fb.expand(StepError(smooth(2)), INPUTS, fb.PCCI(1, 1)).space
    assert (method.runs(space), method.finer_runs(space, 1)) == runs
    assert replace(method, correct=False).finer_runs(space, 1) == 0
    totals = []
    bands = fb.propagate(
        StepError(smooth(2)), INPUTS, method, progress=lambda done, total: totals.append(total)
    )
    assert bands.attrs["runs_refined"] == runs[1]
    assert bands.attrs["runs"] == sum(runs) + 1  # one is repeated
    assert set(totals) == {sum(runs) + 1}
    with pytest.raises(fb.errors.InputError, match=f"would take {sum(runs)} runs"):
        fb.propagate(StepError(smooth(2)), INPUTS, method, most_runs=sum(runs) - 1)


def test_ringing_is_corrected_by_phases_where_the_method_has_them():
    exact = bands_of(StepError(ringing, 0.0), fb.AdaptivePCCI(1e-4))
    method = fb.methods.PhaseResolvedPCCI(1, 1, correct=True)
    bands = bands_of(StepError(ringing), method)
    after = max(relative(bands, exact))
    assert bands.attrs["corrected"] == "step of u0 by phases"
    assert (
        after
        < max(relative(bands_of(StepError(ringing), replace(method, correct=False)), exact)) / 100
    )
    assert after / 5 < bands.attrs["expected_error"] < 5 * after
    with pytest.warns(FlexbandWarning, match="correct=True corrects nothing"):
        uncorrected = bands_of(StepError(ringing), VALUES[0])
    assert "corrected" not in uncorrected.attrs
    assert uncorrected.attrs["discretization_error"] > 0.05


def test_a_jump_is_not_corrected():
    uncorrected = bands_of(StepError(jumping), fb.PCCI(2, 2))
    with pytest.warns(FlexbandWarning, match="correct=True corrects nothing"):
        bands = bands_of(StepError(jumping), fb.PCCI(2, 2, correct=True))
    for name in BANDS:
        np.testing.assert_allclose(bands[name], uncorrected[name], rtol=1e-12)


def test_step_and_elements_are_corrected_at_once():
    method = fb.PCCI(2, 2, correct=True)
    exact = fb.propagate(CancellingError(None, 0.0, 0.0), INPUTS, fb.PCCI(3, 3))
    bands = fb.propagate(CancellingError(None), INPUTS, method)
    assert bands.attrs["corrected"] == "step of u0 by values; elements of u0 by values"
    assert bands.attrs["runs_refined"] == 2 * 6 + 1
    true = max(relative(bands, exact))
    assert true / 2 < bands.attrs["discretization_error"] < 5 * true


@pytest.mark.parametrize("method", METHODS[:4:3] + METHODS[-1:], ids=lambda method: method.name)
def test_what_compares_runs_with_the_surrogate_corrects_them_as_well(method, tmp_path):
    response = StepError(off_by_a_third)
    surrogate = fb.expand(response, INPUTS, method)
    verification = fb.verify(surrogate, response).verification
    assert verification.attrs["confirmed"] == "yes"
    assert float(verification["missed"].max()) < 1e-6
    at = np.array([[0.3]]), np.array([[0.5]])
    change = surrogate.standard(*at) - surrogate.without_correction.standard(*at)
    np.testing.assert_allclose(change, -0.8 * 1.05, atol=1e-9)
    fb.save_surrogate(surrogate, tmp_path / "s.npz")
    xr.testing.assert_identical(fb.load_surrogate(tmp_path / "s.npz").bands(), surrogate.bands())
    narrow = surrogate.narrowed(e=fb.Interval(0.0, 0.5)).bands()
    assert narrow.attrs["expected_error"] < 0.05


@dataclass(frozen=True)
class Unrefined:
    """A response without finer discretizations."""

    def __call__(self, x, e):
        return with_labels((x[:, None] + e[:, None] * TIMES,))


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.name)
def test_what_cannot_be_corrected_is_refused_by_name(method):
    with pytest.raises(
        fb.errors.InputError, match=r"correct=True.* needs a response that has `refin"
    ):
        fb.propagate(Unrefined(), INPUTS, method)
    with pytest.raises(fb.errors.InputError, match="correct must be"):
        replace(method, correct="yes")


@pytest.mark.parametrize("scan", [fb.LHSScanning, fb.methods.SobolScanning, fb.MonteCarlo])
def test_scans_have_no_expansion_to_correct(scan):
    with pytest.raises(fb.errors.InputError, match="has no argument 'correct'"):
        scan(correct=True)


def test_methods_are_compared_on_one_coarse_model():
    study = fb.Study(StepError(smooth(2)), INPUTS, VALUES[0])
    results = compare(study, fb.PCCI(3, 3), VALUES)
    for result in results:
        assert "corrected" not in result.bands.attrs
        assert not getattr(result.method, "correct", False)
    assert max(float(e.max()) for r in results[1:] for e in r.errors.values()) < 0.2


def falling(length, angle):
    """A pendulum that is released at an angle from the vertical."""
    start_angle = angle - np.pi / 2
    return fb.Mechanism(
        bodies={
            "rod": fb.RigidBody.bar(
                length=length, height=0.02, width=0.02, density=7800.0, angle=start_angle
            )
        },
        joints={"hinge": fb.Revolute("rod.start", (0.0, 0.0))},
        loads={"gravity": fb.Gravity()},
        sensors={"tip": fb.Position("rod.end"), "F": fb.Reaction("hinge")},
    )


def test_a_mechanism_with_a_long_step_is_corrected_to_the_converged_one():
    inputs = {"length": fb.Interval(0.45, 0.5), "angle": fb.Normal(1.0, 0.02)}
    times = {"duration": 1.0, "output_step": 0.02}
    coarse = fb.dynamic_response(falling, step=0.02, **times)
    fine = fb.dynamic_response(falling, step=0.02 / 32, **times)
    exact = fb.propagate(fine, inputs, fb.ImprovedPCCI(4, 4))
    method = fb.ImprovedPCCI(3, 3, correct=True)
    uncorrected, bands = (fb.propagate(coarse, inputs, m) for m in (fb.ImprovedPCCI(3, 3), method))
    width = (exact["error_bar"][1] - exact["error_bar"][0]).mean("time")
    true, before = (
        (abs(b["error_bar"] - exact["error_bar"]).mean("bound").mean("time") / width).values
        for b in (bands, uncorrected)
    )
    assert bands.attrs["corrected"].count("by values") == 1
    assert (true < before / 10).all()
    assert true.max() / 5 < bands.attrs["expected_error"] < 5 * true.max()
