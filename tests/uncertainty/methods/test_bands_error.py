"""The error of bands over a tensor product of runs, and that at any point between these."""

import numpy as np
import pytest

import flexband as fb
from flexband.analysis.labelled_answers import expected_error
from flexband.uncertainty.adaptive.held_out_points import generic_points
from flexband.uncertainty.expansions.families import HERMITE
from flexband.uncertainty.phase_resolved.method import HELD
from flexband.uncertainty.surrogates.sigmas import AT_ONE_TIME

NUMBER = np.ones(1)
INPUTS = {"e": fb.Interval(-1, 1), "x": fb.Normal(0, 1)}


def rising(e, x):
    return (e + 0.2 * x + 0.1 * e**2)[:, None] * NUMBER


@pytest.fixture(scope="module")
def surrogate():
    return fb.expand(rising, INPUTS, fb.methods.PhaseResolvedPCCI(1, 1))


def test_nothing_is_missed_of_bounds_at_nodes(surrogate):
    """Orders (1, 1) miss e², which moves no bound: these rest on the ends of the interval."""
    bands = surrogate.bands()
    np.testing.assert_allclose(bands["error_bar"][:, 0], [-1.1, 1.3], atol=1e-12)
    assert bands["error_bar_expected_error"].max() < 0.01
    assert bands.attrs["expected_error"] < 0.005
    assert 0.02 < float(bands["pointwise_error"][0]) < 0.1


@pytest.mark.parametrize("slope", [0.0, 0.1, 0.5])
def test_bounds_between_nodes_have_an_error(slope):
    """With a slope below 2, −e² + slope · e has its maximum between the nodes −1 and 1."""
    bands = fb.propagate(
        lambda e: (slope * e - e**2)[:, None] * NUMBER,
        {"e": INPUTS["e"]},
        fb.methods.PhaseResolvedPCCI(1, 1),
    )
    true = float(abs(bands["error_bar"][:, 0] - [-1 - slope, slope**2 / 4]).mean())
    assert true / 5 < float(bands["error_bar_expected_error"][0]) < 5 * true


def test_what_random_inputs_miss_is_orthogonal():
    """σ of x + 0.002 (x² − 1) is √(1 + 2 · 0.002²): the error is small to second order."""
    bands = fb.propagate(
        lambda x: (x + 0.002 * (x**2 - 1))[:, None] * NUMBER,
        {"x": INPUTS["x"]},
        fb.methods.PhaseResolvedPCCI(1, 0),
    )
    assert float(bands["error_bar_expected_error"][0]) < 0.6 * float(bands["pointwise_error"][0])


def test_answers_and_verification_have_the_error_at_any_point(surrogate):
    diagnostics = surrogate.diagnostics
    np.testing.assert_array_equal(expected_error(surrogate, 1.0), diagnostics["pointwise_error"])
    np.testing.assert_allclose(
        surrogate.bands(3.0)["pointwise_error"], np.sqrt(5) * diagnostics["pointwise_error"]
    )
    assert fb.verify(surrogate, rising, runs=64).verification.attrs["confirmed"] == "yes"
    probabilities = fb.analysis.failure_probability(
        surrogate, fb.Requirement("response", below=2.0)
    )
    assert probabilities.attrs["error"] == "pointwise_error"


def test_bands_of_a_part_have_the_error_at_any_point(surrogate):
    """The ends of [−0.5, 0.5] are no nodes: what is missed there is 0.1 (1 − 0.25)."""
    part = surrogate.narrowed(e=fb.Interval(-0.5, 0.5))
    bands = part.bands()
    true = float(abs(bands["error_bar"][:, 0] - [-0.5 + 0.025 - 0.2, 0.5 + 0.025 + 0.2]).max())
    assert true == pytest.approx(0.075, rel=1e-3)
    assert float(bands["error_bar_expected_error"][0]) > true / 3
    at_one_time = AT_ONE_TIME * bands["error_bar_expected_error"]
    np.testing.assert_array_equal(bands["pointwise_error"], at_one_time)


def test_many_variables_and_outputs_that_nothing_is_missed_of():
    """Places between the nodes are chosen where there are many, and no error is below 2e-5 of σ."""
    inputs = {f"e{k}": fb.Interval(-1, 1) for k in range(6)}
    bands = fb.propagate(
        lambda **e: np.stack([sum(e.values()), sum(e.values()) * 0 + 1], axis=1),
        inputs,
        fb.methods.PhaseResolvedPCCI(0, 1),
    )
    assert np.all(np.isfinite(bands["error_bar_expected_error"]))
    assert bands["error_bar_expected_error"].max() < 1e-4


def test_one_run_of_four_tells_what_is_missed_at_one_time():
    """A narrow bump is met by one of the runs alone; its square is a quarter of the mean square."""
    interval_values = generic_points(0, HELD, 1, [HERMITE])[1][:, 0]
    place = interval_values[
        np.argmax(np.abs(interval_values[:, None] - interval_values + 9 * np.eye(HELD)).min(axis=1))
    ]

    def bumped(e, x):
        return (0.1 * (x + e) + np.exp(-(((e - place) / 0.02) ** 2)))[:, None] * NUMBER

    expansion = fb.expand(bumped, INPUTS, fb.methods.PhaseResolvedPCCI(1, 1))
    error = float(expansion.bands()["pointwise_error"][0])
    errors = np.abs(expansion.held_out.missed[:, 0, 0])
    assert np.sort(errors)[-2] < 0.01
    assert errors.max() > 0.9
    assert error == pytest.approx(AT_ONE_TIME * errors.max() / 2, rel=1e-6)
    assert 2 * error > 1.0
