"""Progress within a batch, and of verification."""

import json
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import xarray as xr

import flexband as fb
from flexband.basics.progress import listener
from flexband.mechanics.engine.batch import run_samples
from flexband.mechanics.kernels.failure_codes import FAILURE
from tests.execution.responses import true_response
from tests.mechanics.models import hardening_spring

INPUTS = {"a": fb.Interval(1.0, 2.0), "b": fb.Normal(0.0, 1.0)}


def halfway(a, b):
    """Tell how many runs are done in the midst of a call, as a simulation does."""
    listener().advance(len(a) // 2, len(a))
    return true_response(a, b)


def test_a_batch_tells_how_many_of_its_runs_are_done(tmp_path):
    reports = []
    study = {"batch": 16, "progress": lambda *report: reports.append(report)}
    fb.propagate(halfway, INPUTS, fb.LHSScanning(8, 4), **study)
    counts = [0, 8, 16, 24, 32, 32, 33]  # the last run is made again
    assert reports == [(k, 33) for k in counts]
    assert not listener().listeners
    reports.clear()
    with ThreadPoolExecutor(2) as executor:  # calls at the same time are told when they end
        fb.propagate(halfway, INPUTS, fb.LHSScanning(8, 4), executor=executor, **study)
    assert reports == [(k, 33) for k in (0, 16, 32, 33)]


def test_verification_tells_its_progress():
    surrogate = fb.expand(true_response, INPUTS, fb.PCCI(1, 1))
    reports = []
    fb.verify(surrogate, halfway, runs=6, progress=lambda *report: reports.append(report))
    assert reports == [(0, 6), (3, 6), (6, 6)]
    with pytest.raises(fb.errors.InputError, match="progress must be a function"):
        fb.verify(surrogate, halfway, progress=3)


@pytest.mark.filterwarnings("ignore:.*runs diverged with steps")
def test_simulations_tell_their_progress_and_run_again_with_shorter_steps(tmp_path, monkeypatch):
    """A mass that hits a stiff spring at 15 m/s is made to diverge with 0.02 s and with 0.01 s."""

    def diverging(system, times, *arguments, samples=None, **options):
        batch = run_samples(system, times, *arguments, samples=samples, **options)
        lanes = np.arange(system.samples) if samples is None else samples
        fast = (system.values.velocity == 15.0).any(axis=0)[lanes]
        batch.failures[fast & (times[1] > 0.006), :2] = FAILURE.diverged, 1
        return batch

    monkeypatch.setattr("flexband.mechanics.simulate.run_samples", diverging)
    response = fb.dynamic_response(hardening_spring, duration=0.2, step=0.02)
    inputs = {"speed": fb.Interval(10.0, 15.0)}
    counts = []
    with pytest.raises(fb.errors.SimulationError, match="speed = 15"):
        fb.propagate(response, inputs, fb.LHSScanning(2, 2))
    bands = fb.propagate(
        response, inputs, fb.LHSScanning(2, 21), failed="half step", store=tmp_path,
        progress=lambda done, total: counts.append(done),
    )  # fmt: skip
    assert counts[0] == 0
    assert len({done for done in counts if 0 < done < 21}) >= 2  # of three blocks of lanes
    assert counts[-1] == 22
    with fb.execution.open_runs(tmp_path) as runs:
        fast_runs = runs.isel(run=runs.inputs.values[:, 0] == 15.0).load()
        assert (runs.status == 1).all()
    assert fast_runs.reason.values.tolist() == ["completed with 1/4 of the step"]
    refinement = fb.dynamic_response(hardening_spring, duration=0.2, step=0.005, output_step=0.02)
    np.testing.assert_array_equal(fast_runs.outputs, refinement(speed=np.array([15.0])))
    assert "runs_failed" not in bands.attrs


def test_runs_are_written_as_netcdf(tmp_path):
    inputs = {"a": fb.Interval(0.0, 1.0), "b": fb.Normal(0.0, 1.0)}
    fb.propagate(lambda a, b: a + b, inputs, fb.PCCI(1, 1), store=tmp_path / "runs")
    runs = fb.execution.open_runs(tmp_path / "runs")
    runs.to_netcdf(tmp_path / "runs.nc")
    with xr.open_dataset(tmp_path / "runs.nc") as dataset:
        assert dataset["outputs"].values.tolist() == runs["outputs"].values.tolist()
        assert json.loads(dataset.attrs["sessions"])[0]["intervals"].startswith("a = Interval")
