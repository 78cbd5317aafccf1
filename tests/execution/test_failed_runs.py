"""Responses that go wrong in every way, under every policy, in this process and in others."""

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import nullcontext
from functools import partial
from multiprocessing import get_context
from threading import Lock

import numpy as np
import pytest
import xarray as xr

import flexband as fb
from flexband.execution.calls import Workers
from flexband.uncertainty.runs.evaluations import Evaluations
from tests.execution.responses import FAULTS, IN_PROCESS, bad, true_response, wrong

INPUTS = {"a": fb.Interval(1.0, 2.0), "b": fb.Normal(0.0, 1.0)}
LHS = fb.LHSScanning(10, 4)
WORDS = {
    "raises": "ZeroDivisionError: the spring is slack",
    "returns_nan": "not finite",
    "returns_another_shape": r"return \(2,\) per run",
    "calls_exit": "called sys.exit",
    "hangs": "longer than time_limit = 0.3 s",
    "exits": "exit status is 3",
    "kills_its_process": "signal 9 ended it",
}
ERRORS = {
    "returns_nan": fb.errors.InputError,
    "returns_another_shape": fb.errors.InputError,
}
CAUSES = {"raises": ZeroDivisionError, "hangs": TimeoutError}


class Opened(Workers):
    """Worker processes that serve several studies."""

    def __init__(self, perform):
        self.perform = perform

    def open(self):
        return nullcontext(self.perform)


@pytest.fixture(scope="module")
def processes():
    with fb.execution.Processes(2, time_limit=0.3).open() as perform:
        yield Opened(perform)


def one_by_one(fault, **options):
    return fb.models.samplewise(partial(bad, fault=fault, **options))


def status(folder):
    with fb.execution.open_runs(folder) as runs:
        return runs.load()


@pytest.mark.parametrize("fault", FAULTS)
def test_a_failed_run_stops_and_leaves_the_others_recorded(fault, processes, tmp_path):
    response = one_by_one(fault, once=str(tmp_path / "once"))
    study = partial(fb.propagate, response, INPUTS, LHS, store=tmp_path / "s", executor=processes)
    if fault in ("exits", "kills_its_process"):  # its task runs again in a new process
        bands = study()
    else:
        kind = ERRORS.get(fault, fb.errors.RunError)
        with pytest.raises(kind, match=WORDS[fault].split(": ")[-1]) as error:
            study()
        if fault in CAUSES:
            assert isinstance(error.value.__cause__, CAUSES[fault])
            assert "inputs of the run: a = " in str(error.value)
        first_status = status(tmp_path / "s")
        assert (first_status.status == 2).sum() == 1
        assert WORDS[fault].split(": ")[-1].split("\\")[0] in str(
            first_status.reason[first_status.status == 2]
        )
        bands = study()
        assert bands.attrs["runs"] - bands.attrs["runs_repeated"] == 40
    np.testing.assert_array_equal(bands["mean"], fb.propagate(true_response, INPUTS, LHS)["mean"])
    final_status = status(tmp_path / "s")
    assert (final_status.status == 1).sum() == 40


@pytest.mark.parametrize("fault", FAULTS)
def test_failed_runs_are_left_out(fault, processes, tmp_path):
    response = one_by_one(fault)
    folder = tmp_path / "s"
    study = partial(fb.propagate, response, INPUTS, LHS, store=folder, failed="skip")
    bands = study(executor=processes)
    runs = status(folder)
    expected = wrong(*runs.inputs.values.T)
    np.testing.assert_array_equal(runs.status == 2, expected)
    assert all(
        WORDS[fault].split("\\")[0] in str(reason) for reason in runs.reason[expected].values
    )
    assert bands.attrs["runs_failed"] == expected.sum() == 2
    assert np.isfinite(bands["mean"]).all()
    second = study()  # nothing is run again, so that in this process nothing goes wrong
    np.testing.assert_array_equal(bands["mean"], second["mean"])
    assert len(status(folder).run) == len(runs.run)


@pytest.mark.parametrize(
    ("fault", "executor"),
    [*((fault, None) for fault in IN_PROCESS), ("raises", ThreadPoolExecutor)],
)
def test_failed_runs_of_a_vectorized_response_are_found(fault, executor, tmp_path):
    response = partial(bad, fault=fault)
    folder = tmp_path / "s"
    with executor(2) if executor else nullcontext() as pool:
        bands = fb.propagate(
            response, INPUTS, LHS, store=folder, failed="skip", batch=16, executor=pool
        )
    runs = status(folder)
    np.testing.assert_array_equal(runs.status == 2, wrong(*runs.inputs.values.T))
    assert bands.attrs["runs_failed"] == 2


def test_results_without_many_runs_are_not_trusted():
    response = partial(bad, fault="returns_nan", limit=0.0)
    bands = fb.propagate(response, INPUTS, LHS, failed="skip")
    assert bands.attrs["runs_failed"] == 5
    assert "5 of 41 runs failed, and what fails is rarely random" in bands.attrs["not_trusted"]


def test_regression_and_held_out_runs_go_on_without_failed_ones():
    with_all = fb.methods.RegressionPCCI(3, oversampling=4)
    response = partial(bad, fault="returns_nan", limit=1.0)
    bands = fb.propagate(response, INPUTS, with_all, failed="skip")
    assert bands.attrs["runs_failed"] > 0
    exact = fb.propagate(true_response, INPUTS, with_all)
    np.testing.assert_allclose(bands["mean"], exact["mean"], atol=0.05)


def test_verification_leaves_failed_runs_out(tmp_path):
    """What is missed of the others is what it is without the failed ones."""
    surrogate = fb.expand(true_response, INPUTS, fb.AdaptivePCCI(0.3))
    complete = fb.verify(surrogate, true_response, runs=12).verification
    incomplete = fb.verify(
        surrogate, partial(bad, fault="raises"), runs=12, failed="skip"
    ).verification
    faults = wrong(*complete["run_values"].values)
    assert 0 < faults.sum() == incomplete.attrs["runs_failed"] < 6
    expected = complete["missed_in_run"].where(xr.DataArray(~faults, dims="sample"))
    xr.testing.assert_allclose(incomplete["missed_in_run"], expected)
    mean = np.sqrt((complete["run_weight"] * expected**2).mean("sample"))
    xr.testing.assert_allclose(incomplete["missed"], mean)
    assert not faults[incomplete["missed_most_in"]].any()
    assert incomplete.attrs["verdict"].startswith("Estimate confirmed")
    counts = f": {12 - faults.sum()} verification runs ({faults.sum()} more failed"
    assert counts in incomplete.attrs["verdict"]
    assert f"({faults.sum()} more failed, and" in incomplete.attrs["verdict"]
    with pytest.raises(fb.errors.RunError, match="raised ZeroDivisionError: the spring is slack"):
        fb.verify(surrogate, partial(bad, fault="raises"), runs=12)


def test_held_out_runs_of_the_adaptive_method_are_left_out(tmp_path):
    """No run that is fitted is in the corner that fails."""
    inputs = {"a": fb.Interval(1.0, 2.0), "b": fb.Interval(0.0, 1.0)}
    wrong_runs = []

    def corner(a, b):
        failing = (a > 1.5) & (b > 0.5) & (a < 2.0) & (b < 1.0)
        wrong_runs.extend(a[failing])
        return np.where(failing[:, None], np.nan, true_response(a, b))

    bands = fb.propagate(corner, inputs, fb.AdaptivePCCI(), failed="skip", store=tmp_path)
    assert bands.attrs["runs_failed"] == len(wrong_runs) > 0
    assert "what fails is rarely random" in bands.attrs["not_trusted"]
    exact = fb.propagate(true_response, inputs, fb.AdaptivePCCI())
    np.testing.assert_allclose(bands["error_bar"], exact["error_bar"], atol=1e-3)
    second = fb.propagate(corner, inputs, fb.AdaptivePCCI(), failed="skip", store=tmp_path)
    np.testing.assert_array_equal(second["error_bar"], bands["error_bar"])


def test_a_design_that_needs_every_run_says_which_one_failed():
    response = partial(bad, fault="raises", limit=-9.0)
    with pytest.raises(
        fb.errors.RunError, match=r"needs every run of its design.*spring is slack"
    ) as error:
        fb.propagate(response, INPUTS, fb.ImprovedPCCI(2, 6), failed="skip")
    assert "inputs of the run: a = " in str(error.value)
    assert "run 0" not in str(error.value)  # which is another number than that in a store


def test_a_scan_names_the_point_at_which_runs_fail():
    def response(a, b):
        return np.where((a > 1.9)[:, None], np.nan, true_response(a, b))

    with pytest.raises(
        fb.errors.RunError, match=r"1 of 4 points of the scan, one of them a = 2\. Correct"
    ):
        fb.propagate(response, INPUTS, LHS, failed="skip")


def test_a_response_that_raises_is_tried_with_one_sample_once():
    sizes = []

    def response(a, b):
        sizes.append(np.shape(a))
        if not np.all(np.asarray(b) < -0.5):
            raise ZeroDivisionError("the spring is slack")
        return true_response(a, b)

    bands = fb.propagate(response, INPUTS, LHS, failed="skip")
    assert bands.attrs["runs_failed"] == 28
    assert sizes.count(()) == 1


@pytest.mark.parametrize("fault", ["raises", "returns_nan", "calls_exit"])
def test_a_response_that_always_fails_is_given_up(fault, monkeypatch, tmp_path):
    calls = []

    def response(a, b):
        calls.append(len(a))
        return bad(a + 1, b + 9, fault)

    words = WORDS[fault].split(": ")[-1]
    with pytest.raises(fb.errors.RunError, match=rf"all of the first \d+ runs failed.*{words}"):
        fb.propagate(response, INPUTS, LHS, failed="skip", store=tmp_path / "s")
    assert (status(tmp_path / "s").status == 2).sum() <= max(
        Evaluations.failures_before_stop, calls[0]
    )


def test_runs_that_diverge_are_completed_with_half_the_step(tmp_path):
    class Stiff:
        """Explicit Euler steps of x' = −λ x diverge if λ h > 2."""

        def __init__(self, step=0.1):
            self.step = step

        def __call__(self, rate, start):
            steps = round(1 / self.step)
            x = start * (1 - rate * self.step) ** steps
            return np.where(rate * self.step > 2, np.nan, x)

        def refinements(self, **values):
            return {"step": Stiff(self.step / 2)}

        identity = ()

    inputs = {"rate": fb.Interval(1.0, 50.0), "start": fb.Normal(1.0, 0.1)}
    study = partial(fb.propagate, Stiff(), inputs, LHS)
    with pytest.raises(fb.errors.InputError, match="not finite"):
        study()
    # Each range of rates needs its own part of the step.
    bands = study(failed="half step", store=tmp_path)
    runs = status(tmp_path)
    rate, start = runs.inputs.values.T
    for part, low, high in ((1, 0, 20), (2, 20, 40), (4, 40, 80)):
        mask = (rate > low) & (rate <= high)
        assert mask.any()
        exact = start[mask] * (1 - rate[mask] * 0.1 / part) ** (10 * part)
        np.testing.assert_allclose(runs.outputs[mask], exact, rtol=1e-12)
        text = f"completed with 1/{part} of the step" if part > 1 else ""
        assert set(runs.reason[mask].values) == {text}
    assert "runs_failed" not in bands.attrs
    with pytest.raises(fb.errors.InputError, match="requires a response whose `refinements`"):
        fb.propagate(true_response, INPUTS, LHS, failed="half step")


def test_an_executor_that_broke_fails_no_runs(tmp_path):
    response = partial(bad, fault="exits")
    with (
        ProcessPoolExecutor(1, mp_context=get_context("spawn")) as executor,
        pytest.raises(fb.errors.RunError, match="the executor cannot go on: BrokenProcessPool"),
    ):
        fb.propagate(
            response, INPUTS, LHS, store=tmp_path, failed="skip", executor=executor, batch=4
        )
    assert not (status(tmp_path).status == 2).any()
    executor = ThreadPoolExecutor(1)
    executor.shutdown()
    with pytest.raises(fb.errors.RunError, match="cannot go on"):
        fb.propagate(true_response, INPUTS, LHS, executor=executor)


def test_a_response_that_cannot_be_sent_is_refused():
    lock = Lock()

    def response(a, b):
        with lock:
            return true_response(a, b)

    with pytest.raises(fb.errors.InputError, match="cannot be sent to another process"):
        fb.propagate(response, INPUTS, LHS, executor=fb.execution.Processes(1))
