"""Studies and workers that are killed, stopped, watched and doubled, in processes of their own."""

import importlib
import multiprocessing
import os
import signal
import socket
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from random import Random

import numpy as np
import pytest
import xarray as xr

import flexband as fb
from flexband.execution.journal import Journal
from tests.execution.responses import bad, logged, true_response

INPUTS = {"a": fb.Interval(1.0, 2.0), "b": fb.Normal(0.0, 1.0)}
LHS = fb.LHSScanning(60, 8)
BATCH = 7
CONTEXT = multiprocessing.get_context("forkserver")
CONTEXT.set_forkserver_preload(["flexband.uncertainty.propagate", "flexband.execution.record"])


def study(folder, log, executor=None, seconds=0.0005):
    response = partial(logged, log=str(log), seconds=seconds)
    return fb.propagate(response, INPUTS, LHS, store=folder, batch=BATCH, executor=executor)


def runs_of(log):
    return Path(log).read_text().split("\n")[:-1] if Path(log).exists() else []


def recorded_values(folder):
    """Return the values of all runs that are recorded, in the arrays and the journal, by inputs."""
    path = Path(folder) / "runs.zarr"
    if not (path / "zarr.json").exists():
        return {}
    with fb.execution.open_runs(folder) as runs:
        parts = [(runs.inputs.values, runs.outputs.values)] if "outputs" in runs else []
        in_journal = Journal(path).read(len(runs.run))
    parts += [(entry.inputs, entry.values) for entry in in_journal]
    return {
        f"{a.hex()} {b.hex()}": value.tobytes()
        for inputs, values in parts
        for (a, b), value in zip(inputs, values, strict=True)
    }


def start(target, *arguments):
    process = CONTEXT.Process(target=target, args=arguments)
    process.start()
    return process


def wait_until(condition, process=None):
    end = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end
        assert process is None or process.exitcode is None
        time.sleep(0.002)


@pytest.mark.parametrize("seed", [1])
def test_a_study_that_is_killed_goes_on_where_it_was(seed, tmp_path):
    folder = tmp_path / "s"
    log = tmp_path / "log"
    random = Random(seed)
    before: dict[str, bytes] = {}
    for _ in range(4):
        first_count = len(runs_of(log))
        goal = first_count + random.randint(1, 160)
        process = start(study, folder, log)
        wait_until(lambda goal=goal: len(runs_of(log)) >= goal, process)
        time.sleep(random.random() * 0.02)
        process.kill()
        process.join()
        assert process.exitcode == -signal.SIGKILL
        repeats = set(runs_of(log)[first_count:]) & before.keys()
        assert len(repeats) <= 2  # those that a resume makes
        after = recorded_values(folder)
        assert before.items() <= after.items()
        begun_runs = set(runs_of(log))
        assert len(begun_runs - after.keys()) <= 4 * BATCH  # one call in flight for each kill
        before = after
    assert len(before) > 50
    bands = study(folder, log)
    exact = fb.propagate(true_response, INPUTS, LHS)
    np.testing.assert_array_equal(bands["mean"], exact["mean"])
    np.testing.assert_array_equal(bands["error_bar"], exact["error_bar"])
    count = len(runs_of(log))
    study(folder, log)
    assert len(runs_of(log)) == count + 2
    assert len(fb.execution.open_runs(folder).run) == 480


def test_a_killed_study_leaves_no_workers_and_no_lock(tmp_path):
    """A forked worker inherits open files and survives its study: it must not hold the folder."""
    log = tmp_path / "log"
    pid = tmp_path / "pid"
    process = start(study_in_forks, tmp_path / "s", log, pid)
    wait_until(lambda: len(runs_of(log)) >= 2 * BATCH)
    process.kill()
    process.join()
    try:
        os.kill(int(pid.read_text()), 0)  # it lives
        bands = study(tmp_path / "s", log)
    finally:
        os.kill(int(pid.read_text()), signal.SIGKILL)
    np.testing.assert_array_equal(bands["mean"], fb.propagate(true_response, INPUTS, LHS)["mean"])


def telling(pid):
    Path(pid).write_text(str(os.getpid()))


def study_in_forks(folder, log, pid):
    context = multiprocessing.get_context("fork")
    with ProcessPoolExecutor(1, context, initializer=telling, initargs=(pid,)) as executor:
        study(folder, log, executor)


def test_workers_end_with_their_study(tmp_path):
    log = tmp_path / "log"
    process = start(study, tmp_path / "s", log, fb.execution.Processes(1), 0.01)
    wait_until(lambda: len(runs_of(log)) >= BATCH)
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
    assert children
    process.kill()
    process.join()
    wait_until(lambda: not any(Path(f"/proc/{child}").exists() for child in children))


def test_a_batch_whose_worker_is_killed_runs_again(tmp_path):
    """Killed from outside, in the midst of a call."""
    log = tmp_path / "log"
    process = start(study, tmp_path / "s", log, fb.execution.Processes(2), 0.005)
    wait_until(lambda: len(runs_of(log)) >= 2 * BATCH)
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
    os.kill(int(children[0]), signal.SIGKILL)
    process.join()
    assert process.exitcode == 0
    assert 480 < len(runs_of(log)) <= 480 + BATCH + 3
    assert len(fb.execution.open_runs(tmp_path / "s").run) == 480


def test_interrupting_closes_the_store_at_once(tmp_path):
    code = f"""
import sys; sys.path.insert(0, {str(Path(__file__).parents[2])!r})
from tests.execution.test_kills import study
study({str(tmp_path / "s")!r}, {str(tmp_path / "log")!r}, seconds=0.01)
"""
    process = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE, text=True)
    wait_until(lambda: len(runs_of(tmp_path / "log")) >= 5 * BATCH)
    process.send_signal(signal.SIGINT)
    error = process.communicate()[1]
    assert "KeyboardInterrupt" in error
    with fb.execution.open_runs(tmp_path / "s") as runs:
        finished = len(runs_of(tmp_path / "log"))
        assert finished < LHS.samples * LHS.points
        assert finished - BATCH <= len(runs.run) <= finished
    assert not list((tmp_path / "s" / "runs.zarr").glob("journal-*"))


def test_a_folder_serves_one_study_at_a_time(tmp_path):
    log = tmp_path / "log"
    process = start(study, tmp_path / "s", log, None, 0.05)
    wait_until(lambda: len(runs_of(log)) > 0)
    who = f"in use by process {process.pid} on {socket.gethostname()}"
    with pytest.raises(fb.errors.StoreError, match=who):
        study(tmp_path / "s", log)
    process.kill()
    process.join()


def test_a_store_opens_at_any_moment_of_a_study(tmp_path):
    folder = tmp_path / "s"
    log = tmp_path / "log"
    process = start(study_often_written, folder, log)
    wait_until((folder / "runs.zarr" / "zarr.json").exists)
    counts = []
    while process.is_alive():
        with xr.open_zarr(folder / "runs.zarr", chunks=None) as runs:
            counts.append(len(runs.run))
            if "outputs" in runs:
                runs.load()
                exact = true_response(*runs.inputs.values.T)
                np.testing.assert_array_equal(runs.outputs, exact)
                assert (runs.status == 1).all()
    assert process.exitcode == 0
    assert counts == sorted(counts)
    assert len(set(counts)) > 5
    assert len(fb.execution.open_runs(folder).run) == 480


def study_often_written(folder, log):
    from flexband.execution import record  # noqa: PLC0415

    record.RunRecorder.period = 0.01
    study(folder, log, seconds=0.002)


@pytest.fixture(scope="module")
def dask():
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


@pytest.mark.filterwarnings("ignore")
def test_results_are_the_same_bit_for_bit_with_dask_whose_worker_dies(dask, tmp_path):
    response = partial(bad, fault="kills_its_process", once=str(tmp_path / "once"))
    bands = fb.propagate(response, INPUTS, LHS, store=tmp_path / "s", batch=BATCH, executor=dask)
    assert (tmp_path / "once").exists()
    np.testing.assert_array_equal(bands["mean"], fb.propagate(true_response, INPUTS, LHS)["mean"])
    assert (fb.execution.open_runs(tmp_path / "s").status == 1).all()


def stops_once(a, b, once):
    """Return what `true_response` does, but for the first call, which stops its process."""
    try:
        Path(once).touch(exist_ok=False)
    except FileExistsError:
        return true_response(a, b)
    os.kill(os.getpid(), signal.SIGSTOP)
    return true_response(a, b)


@pytest.mark.skipif(os.name == "nt", reason="signals differ")
@pytest.mark.filterwarnings("ignore")
def test_a_run_on_a_dask_worker_that_is_stopped_goes_to_another(dask, tmp_path):
    response = partial(stops_once, once=str(tmp_path / "once"))
    options = {
        "store": tmp_path / "s",
        "batch": BATCH,
        "executor": fb.execution.Dask(dask, time_limit=2.0),
    }
    bands = fb.propagate(response, INPUTS, LHS, **options)
    np.testing.assert_array_equal(bands["mean"], fb.propagate(true_response, INPUTS, LHS)["mean"])
    assert (fb.execution.open_runs(tmp_path / "s").status == 1).all()


class SlowToLoad:
    """A response that takes longer to load than its calls may take."""

    def __init__(self, seconds=0.0):
        time.sleep(seconds)

    def __call__(self, a, b):
        return true_response(a, b)

    def __reduce__(self):
        return SlowToLoad, (2.5,)


@pytest.mark.filterwarnings("ignore")
def test_loading_a_response_takes_no_time_of_its_calls(dask):
    bands = fb.propagate(
        SlowToLoad(), INPUTS, LHS, executor=fb.execution.Dask(dask, time_limit=1.5)
    )
    np.testing.assert_array_equal(bands["mean"], fb.propagate(true_response, INPUTS, LHS)["mean"])


class SlowCluster:
    """A client of a cluster whose only worker takes some time to come back; or it does not."""

    def __init__(self, returns_after):
        self.asked = 0
        self.returns_after = returns_after

    def nthreads(self):
        self.asked += 1
        return {"second": 1} if self.asked > self.returns_after else {}

    def restart_workers(self, workers, timeout):
        raise TimeoutError(f"{workers} did not come back within {timeout} s")


def test_a_dask_worker_that_is_slow_to_come_back_is_waited_for():
    dask = importlib.import_module("flexband.execution.dask")
    cluster = dask._Timed(SlowCluster(4), 1.0, start=20.0, look=0.01)
    cluster.loaded = {("second", hash(b""))}
    cluster.replace("first")
    assert cluster.workers(b"", b"", "") == {"second": 1}
    cluster = dask._Timed(SlowCluster(float("inf")), 1.0, start=0.1, look=0.01)
    cluster.replace("first")
    with pytest.raises(fb.errors.RunError, match="no Dask worker is left that answers"):
        cluster.workers(b"", b"", "")


@pytest.mark.filterwarnings("ignore")
def test_modules_beside_the_study_reach_the_workers(dask, tmp_path, monkeypatch):
    """A worker on another machine has neither the study's file nor those beside it, or old ones."""
    (tmp_path / "constants15.py").write_text("FACTOR = 3.0\n")
    (tmp_path / "beside15.py").write_text(
        "import constants15\ndef model(a, b):\n    return constants15.FACTOR * a + b\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    response = __import__("beside15").model
    with pytest.raises(ModuleNotFoundError):
        dask.submit(__import__, "beside15").result(timeout=300)
    bands = fb.propagate(response, INPUTS, LHS, executor=dask)
    exact = fb.propagate(response, INPUTS, LHS)
    np.testing.assert_array_equal(bands["mean"], exact["mean"])

    def load(folder):
        sys.path.insert(0, folder)
        return __import__("beside15").__name__

    dask.run(load, str(tmp_path))  # from now on the worker has the modules, and keeps them
    (tmp_path / "constants15.py").write_text("FACTOR = 5.25\n")
    importlib.reload(sys.modules["constants15"])
    bands = fb.propagate(response, INPUTS, LHS, executor=dask)
    assert not np.allclose(bands["mean"], exact["mean"])
    exact = fb.propagate(response, INPUTS, LHS)
    np.testing.assert_array_equal(bands["mean"], exact["mean"])


def fields(x, a, e):
    """Return the values of a field, times a number and a factor of an option."""
    return x * np.exp(np.asarray(a(np.linspace(0.0, 1.0, 3)))) * {"low": 1.0, "high": 2.0}[e]


def test_results_are_the_same_bit_for_bit_in_all_processes(tmp_path):
    inputs = {
        "x": fb.Interval(1.0, 2.0),
        "a": fb.RandomField(1.0, 0.1, correlation_length=0.5, domain=(0.0, 1.0)),
        "e": fb.Choice("low", "high"),
    }
    response = fb.models.samplewise(fields)
    method = fb.LHSScanning(6, 3)
    exact = fb.propagate(response, inputs, method)
    with ProcessPoolExecutor(1, CONTEXT) as pool:
        for number, executor in enumerate((fb.execution.Processes(2), pool)):
            folder = tmp_path / str(number)
            for resume_executor in (executor, None):
                bands = fb.propagate(
                    response, inputs, method, store=folder, executor=resume_executor
                )
                for name in exact.data_vars:
                    np.testing.assert_array_equal(bands[name], exact[name])
            assert len(fb.execution.open_runs(folder).run) == 36
