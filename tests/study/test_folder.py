"""Studies on the command line that go on where they were, and tell how far they are."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import flexband as fb
from flexband.cli import app
from flexband.cli.status import lines, state_of
from flexband.study import steps
from flexband.study.folder import StudyFolder
from flexband.study.study import load_study

STUDY = """
import pathlib, time
import flexband as fb

LOG = pathlib.Path(__file__).with_name("log")

def one(a, b):
    with LOG.open("a") as file:
        file.write(f"{a!r} {b!r}\\n")
    time.sleep(PAUSE)
    if pathlib.Path(__file__).with_name("broken").exists() and b > 1.0:
        raise ValueError("too much of b")
    return a + b * b

study = fb.Study(fb.models.samplewise(one), {"a": fb.Interval(1.0, 2.0), "b": fb.Normal(1.0, 0.1)},
                 fb.ImprovedPCCI(2, 2))
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "sum.py"
    path.write_text(STUDY.replace("PAUSE", "0"), encoding="utf-8")
    return path


def call(*arguments, status=0):
    result = CliRunner().invoke(app, [str(a) for a in arguments])
    assert result.exit_code == status, result.output
    return " ".join(result.output.split())


def runs_made(file):
    return len(file.with_name("log").read_text(encoding="utf-8").splitlines())


def bands(out):
    with xr.open_dataset(out / "bands.nc", engine="scipy") as dataset:
        return dataset.load()


def test_a_finished_study_is_not_run_again(file, tmp_path):
    out = tmp_path / "out"
    first = call("run", file, "-o", out, "--verify", 4)
    run_count = runs_made(file)
    written = (out / "bands.nc").stat().st_mtime_ns
    assert run_count == 9 + 1 + 4
    second = call("run", file, "-o", out, "--verify", 4)
    assert "has this result already: no run was made" in second
    assert "Outputs of 10 runs take 8e-05 MB; the study needs about 4 MB of memory." in first
    for output in (first, second):
        assert "sum: improved PCCI (2, 2)" in output
        assert "(14 runs, 4 of them to check the result)" in output
    assert "has this result already" in call("resume", out)
    answer = json.loads(CliRunner().invoke(app, ["resume", str(out), "--json"]).stdout)
    assert (answer["runs"], answer["doubts"]) == (10, [])
    assert (runs_made(file), (out / "bands.nc").stat().st_mtime_ns) == (run_count, written)
    (out / "bands.nc").unlink()
    assert "already: no run" not in call("resume", out)
    assert bands(out).attrs["runs"] == 9 + 1  # as before: the check of the store does not count
    state = state_of(out)
    assert (state["state"], state["recorded"], state["failed"]) == ("finished", 13, 0)
    assert not state["alive"]


def test_status_tells_what_is_done_and_how_long_all_runs_take(file, tmp_path, monkeypatch):
    """The new runs open the store once more; what was run before counts in the rate, too."""
    out = tmp_path / "out"
    states = {}

    def recorder(name, function):
        def call(*arguments, **options):
            states[name] = state_of(out)
            return function(*arguments, **options)

        return call

    monkeypatch.setattr(steps, "contributions", recorder("answers", fb.analysis.contributions))
    monkeypatch.setattr(steps, "verify", recorder("verification", fb.verify))
    call("run", file, "-o", out, "--verify", 4)
    first = states["verification"]
    last = states["answers"]
    assert (first["now"], last["now"]) == ("verification runs", "the answers")
    assert (first["recorded"], last["recorded"], last["done"], last["total"]) == (9, 13, 14, 14)
    seconds = json.loads((out / "study.json").read_text(encoding="utf-8"))["ran"]
    assert last["rate"] == pytest.approx(13 / seconds, rel=1e-9)
    report = lines({**last, "alive": True, "state": "running"})
    assert report[1:3] == ["14 of 14 runs done, 0 failed", "now: the answers"]
    assert "left" not in report[3]
    assert "on average" in report[3]
    assert state_of(out)["now"] is None


def test_status_promises_no_number_that_is_not_known(file, tmp_path, monkeypatch):
    file.write_text(STUDY_WITHOUT_STEP.replace("FOLDER", str(tmp_path)), encoding="utf-8")
    out = tmp_path / "out"
    states = []
    write = StudyFolder.write

    def write_and_read(self, content):
        write(self, content)
        states.append(state_of(out))

    monkeypatch.setattr(StudyFolder, "write", write_and_read)
    call("run", file, "-o", out, "--verify", 0)
    assert not any(state["left"] for state in states)
    running = [lines(state) for state in states if state["state"] == "running" and state["each"]]
    assert running[0][1] == "0 runs done (at most 201 with the same step and elements), 0 failed"
    assert any("now: finer step" in report for report in running)
    assert any("now: the first runs (step 0.1)" in report for report in running)
    assert state_of(out)["total"] > 0


def test_what_serves_is_used_and_other_studies_are_refused(file, tmp_path):
    out = tmp_path / "out"
    call("run", file, "-o", out, "--verify", 0)
    run_count = runs_made(file)
    output = call("run", file, "-o", out, "--verify", 0, "--sigmas", 2)
    assert "has 9 recorded runs; matching runs are reused" in output
    assert bands(out).attrs["sigmas"] == 2
    assert runs_made(file) == run_count + 2
    text = file.read_text(encoding="utf-8").replace("Normal(1.0, 0.1)", "Normal(1.0, 0.2)")
    file.write_text(text, encoding="utf-8")
    call("run", file, "-o", out, "--verify", 0)  # other limits
    assert bands(out).attrs["inputs"].endswith("Normal(mean=1.0, std=0.2)")
    file.write_text(text.replace("a + b", "2 * a + b"), encoding="utf-8")
    before = (out / "study.json").read_bytes()
    refusal = call("run", file, "-o", out, status=1)
    assert "has runs of another response: the code or the data of the response changed" in refusal
    assert "--allow-mismatch" in refusal
    assert "--replace" in refusal
    assert (out / "study.json").read_bytes() == before
    assert "are deleted" in call("run", file, "-o", out, "--verify", 0, "--replace")
    assert float(bands(out)["mean"].sel(bound="upper")) == pytest.approx(5.0 + 0.04, abs=1e-12)
    assert state_of(out)["recorded"] == 9


@pytest.mark.parametrize("command_line", [True, False])
def test_a_refusal_leaves_the_folder_to_its_study(file, tmp_path, command_line):
    out = tmp_path / "out"
    other = tmp_path / "other.py"
    if command_line:
        call("run", file, "-o", out, "--verify", 0)
    else:  # in Python, without study.json
        study = load_study(file)
        fb.propagate(study.response, study.inputs, study.method, store=out)
    text = file.read_text(encoding="utf-8").replace("def one(a, b)", "def one(a, c)")
    text = text.replace('"b": fb', '"c": fb').replace("b * b", "a * c").replace("{b!r}", "{c!r}")
    other.write_text(text, encoding="utf-8")
    before = content(out)
    output = call("run", other, "-o", out, "--allow-mismatch", status=1)
    assert "inputs: 'a, b' before, 'a, c' now" in output
    assert content(out) == before
    run_count = runs_made(file)
    call("run", file, "-o", out, "--verify", 0)
    call("resume", out)
    assert runs_made(file) <= run_count + 2


def test_a_response_that_failed_at_once_can_be_mended(file, tmp_path):
    out = tmp_path / "out"
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace("a + b", "a + misspelt"), encoding="utf-8")
    assert "misspelt" in call("run", file, "-o", out, status=1)
    assert (out / "runs.zarr").exists()
    file.write_text(text, encoding="utf-8")
    call("run", file, "-o", out, "--verify", 0)
    assert state_of(out)["recorded"] == 9


def content(out):
    files = {f for f in out.rglob("*") if f.is_file()}
    return {f: f.read_bytes() for f in files if f.name not in ("holder", "study.lock")}


@pytest.mark.usefixtures("no_drawing")
def test_results_of_another_study_are_replaced_only_if_asked(file, tmp_path, monkeypatch):
    monkeypatch.setattr("flexband.study.comparison.warm_up", lambda *_: None)
    text = file.read_text(encoding="utf-8").replace(
        "fb.models.samplewise(one)", "lambda a, b: a * b"
    )
    other = tmp_path / "product.py"
    renamed = tmp_path / "renamed.py"
    other.write_text(text, encoding="utf-8")
    renamed.write_text(text, encoding="utf-8")
    compare = ["compare", "--samples", 4, "--points", 2, "--orders", "1,1"]
    plain = ["run", "--verify", 0, "--no-store"]
    out = tmp_path / "out"

    def refuse(study, *commands):
        before = content(out)
        for command in commands:
            output = call(*command, file, "-o", out, status=1)
            assert f"{out} has results of another study, {study}. Take another folder" in output
        assert content(out) == before

    call(*compare, other, "-o", out)
    refuse(other, compare, plain, ["run"], ["run", "--allow-mismatch"])
    call(*plain, file, "-o", out, "--replace")
    call(*plain, other, "-o", out, "--replace")
    refuse(other, compare, plain, ["run"])
    call("run", renamed, "-o", out, "--verify", 0)  # the same response
    refuse(renamed, compare, [*compare, "--replace"], plain, ["run"])
    (out / "results.json").write_text("{", encoding="utf-8")  # damaged: study.json tells it too
    refuse(renamed, compare)
    (out / "study.json").write_text("{", encoding="utf-8")
    refuse("a study that is not known", ["run"])
    assert "are deleted" in call("run", file, "-o", out, "--verify", 0, "--replace")


def test_failed_runs_are_listed_and_made_again(file, tmp_path):
    out = tmp_path / "out"
    file.with_name("broken").touch()
    assert "ValueError: too much of b" in call("run", file, "-o", out, status=1)
    state = state_of(out)
    assert state["state"] == "failed"
    assert "too much of b" in state["reason"]
    (failure,) = state["failures"]
    assert failure["inputs"]["b"] > 1
    assert "ValueError: too much of b" in failure["reason"]
    output = call("status", out)
    for text in (
        "failed: run ",
        "b = 1.",
        "too much of b",
        f"`flexband resume {out}` continues if",
    ):
        assert text in output
    assert f"{state['recorded']} runs done and recorded, 1 failed" in output
    assert json.loads(CliRunner().invoke(app, ["status", str(out), "--json"]).stdout) == state
    file.with_name("broken").unlink()
    run_count = runs_made(file)
    output = call("resume", out, "--retry-failed")
    assert "1 failed run is made again" in output
    assert state_of(out)["failed"] == 0
    assert runs_made(file) < run_count + 9 + 1 + 16


def test_a_result_whose_verification_fails_is_told_but_doubted(file, tmp_path):
    out = tmp_path / "out"
    text = file.read_text(encoding="utf-8").replace(
        "return a +", "if len(LOG.read_text().split()) > 20: raise KeyError('worn')\n    return a +"
    )
    file.write_text(text, encoding="utf-8")
    output = call("run", file, "-o", out, "--verify", 4, status=3)
    assert "remark: the result is not verified: the response raised KeyError: 'worn'" in output
    assert "sum: improved PCCI (2, 2)" in output
    state = state_of(out)
    assert (state["state"], state["done"], state["total"]) == ("finished", 10, 14)
    assert state["doubts"] == ["the verification runs failed"]
    options = ["--verify", 4, "--failed", "skip"]
    file.write_text(text.replace("> 20", "== 24"), encoding="utf-8")
    file.with_name("log").unlink()
    output = call("run", file, "-o", tmp_path / "other", *options)
    assert "3 verification runs (1 more failed, and what fails is rarely random)" in output
    assert "verification runs: 4 of 4 runs" in output


def start_command(file, *arguments):
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    return subprocess.Popen(
        [sys.executable, "-m", "flexband", *map(str, arguments)],
        env=environment, cwd=file.parent, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip


def wait_until(condition, seconds=60.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)


@pytest.mark.skipif(os.name == "nt", reason="signals differ")
def test_a_study_that_is_stopped_goes_on(file, tmp_path):
    out = tmp_path / "out"
    log = file.with_name("log")
    file.write_text(STUDY.replace("PAUSE", "0.25"), encoding="utf-8")
    with start_command(file, "run", file, "-o", "out", "--verify", 0) as process:
        wait_until(lambda: log.exists() and runs_made(file) > 0)
        state = state_of(out)
        assert (state["state"], state["alive"], state["total"]) == ("running", True, 10)
        assert state["rate"] is None or state["left"] >= 0
        refusal = call("run", file, "-o", out, status=1)
        assert f"in use by process {process.pid} on" in refusal
        process.send_signal(signal.SIGINT)
        output, errors = process.communicate(timeout=30)
        assert process.returncode == 130
    assert "flexband: stopped; `flexband resume out` continues" in errors
    assert "Traceback" not in output + errors
    assert "improved PCCI (2, 2): 0 of 10 runs" in errors  # lines, since there is no terminal
    assert "\x1b" not in errors
    state = state_of(out)
    assert (state["state"], state["alive"]) == ("stopped", False)
    assert state["reason"] == "Ctrl-C"
    run_count = runs_made(file)
    with start_command(file, "resume", out) as process:
        wait_until(lambda: runs_made(file) > run_count + 1)
        process.kill()
        process.communicate()
    state = state_of(out)
    assert "ended without a word" in state["reason"]
    call("resume", out)
    points = log.read_text(encoding="utf-8").splitlines()
    assert len(set(points)) == 9
    assert len(points) <= 9 + 2 + 2 + 2  # in flight, and made again to confirm
    expected = fb.propagate(lambda a, b: a + b * b, {"a": fb.Interval(1.0, 2.0),
                         "b": fb.Normal(1.0, 0.1)}, fb.ImprovedPCCI(2, 2))  # fmt: skip
    np.testing.assert_array_equal(bands(out)["error_bar"], expected["error_bar"])


def test_a_clock_that_goes_backwards_shows_no_negative_time(tmp_path):
    record = {"state": "running", "done": 5, "total": 3, "elapsed": -4.0, "process": "process 1"}
    (tmp_path / "runs.zarr").mkdir()
    StudyFolder(tmp_path).write(record)
    state = state_of(tmp_path)
    assert state["elapsed"] == 0
    assert "-" not in " ".join(lines({**state, "folder": "out", "state": "running", "left": -1.0}))


STUDY_WITHOUT_STEP = """
import numpy as np
import xarray as xr
import flexband as fb

class Response:
    def __init__(self, step):
        self.step = step

    def left_out(self, **_):
        return ["step"]

    def discretization(self, **_):
        return {"step": self.step}

    def refinements(self, **_):
        return {"step": Response(self.step / 2)}

    def __call__(self, a, b):
        t = np.linspace(0, 1, 30)
        y = (np.exp(-np.outer(a, t)) + b[:, None]) * (1 + self.step**2)
        return xr.DataArray(y, {"time": t}, ("sample", "time"))

inputs = {"a": fb.Interval(0.5, 2.0), "b": fb.Normal(0.0, 0.1)}
study = fb.Study(Response(0.4), inputs, fb.AdaptivePCCI(0.02, correct=False))
"""

KILLED = """
import os, signal, sys
from flexband.execution import growing

def killed(*arguments):
    written(*arguments)
    os.kill(os.getpid(), signal.SIGKILL)

written, growing.write_synced = growing.write_synced, killed
from flexband.__main__ import main
sys.argv[1:] = ["run", sys.argv[1], "-o", sys.argv[2]]
main()
"""


def test_a_run_that_failed_and_succeeded_later_is_not_counted_as_failed(file, tmp_path):
    out = tmp_path / "out"
    file.with_name("broken").touch()
    for _ in range(2):
        assert "too much of b" in call("run", file, "-o", out, status=1)
        assert state_of(out)["failed"] == 1
    file.with_name("broken").unlink()
    call("resume", out)
    assert state_of(out)["failed"] == 0
    assert "0 failed" in call("status", out)


def test_a_study_that_is_killed_before_its_first_run_goes_on(file, tmp_path):
    out = tmp_path / "out"
    command = [sys.executable, "-c", KILLED, str(file), str(out)]
    process = subprocess.run(command, capture_output=True, check=False)
    assert process.returncode == -signal.SIGKILL, process.stderr
    assert (out / "runs.zarr").exists()
    assert not file.with_name("log").exists()
    assert f"`flexband resume {out}` continues" in call("status", out)
    call("resume", out)
    assert "finished" in call("status", out)


def test_a_store_without_a_study_tells_how_to_go_on(file, tmp_path):
    out = tmp_path / "out"
    call("run", file, "-o", out)
    run_count = runs_made(file)
    (out / "study.json").unlink()
    assert "`flexband run` with the study's file and this folder continues" in call("status", out)
    assert "uses the runs that are there" in call("resume", out, status=1)
    call("run", file, "-o", out)
    assert runs_made(file) == run_count + 2  # those that every session makes again


def test_a_study_that_fails_before_its_first_run_leaves_no_study(file, tmp_path):
    file.write_text(file.read_text().replace('"a":', '"c":'), encoding="utf-8")
    call("run", file, "-o", tmp_path / "out", status=1)
    assert not (tmp_path / "out" / "study.json").exists()


def test_folders_that_are_none_are_refused(tmp_path):
    for command in (["status"], ["resume"], ["resume", "--retry-failed"]):
        assert "folder must be that of a study" in call(*command, tmp_path / "none", status=1)
    file = tmp_path / "study.json"
    file.write_text('{"format": 99}', encoding="utf-8")
    assert "newer version of flexband" in call("status", tmp_path, status=1)
    file.write_text('{"format"', encoding="utf-8")
    assert "cannot be read" in call("resume", tmp_path, status=1)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--executor", "magic"], "--executor must be processes, processes:4, or the address"),
        (["--executor", "processes:0"], "workers must be 1 or more; got 0"),
        (["--time-limit", "3"], "--time-limit requires --executor processes"),
        (["--failed", "ignore"], "--failed must be 'stop', 'half-step' or 'skip'"),
        (["--batch", "0"], "--batch must be 1 or more; got 0"),
    ],
)
def test_wrong_options_are_refused_before_the_first_run(options, message, file, tmp_path):
    assert message in call("run", file, "-o", tmp_path / "out", *options, status=2)
    assert not (tmp_path / "out").exists()


def test_runs_in_processes_that_fail_are_left_out(file, tmp_path):
    text = file.read_text(encoding="utf-8").replace(
        "return a +", "if b > 1.2: sys.exit(0)\n    return a +"
    )
    file.write_text(f"import sys\n{text}", encoding="utf-8")
    options = ["--executor", "processes:1", "--failed", "skip", "--time-limit", 20]
    method = ["--method", "monte-carlo", "--samples", 100, "--points", 2]
    output = call("run", file, "-o", tmp_path / "out", *method, *options)
    assert 0 < state_of(tmp_path / "out")["failed"] < 10
    assert "called sys.exit(0)" in call("status", tmp_path / "out")
    assert "of 201 runs failed and were left out" in output


def test_a_study_that_exits_has_not_succeeded(file, tmp_path):
    text = file.read_text(encoding="utf-8").replace(
        "return a +", "raise SystemExit(0)\n    return a +"
    )
    for function in ("fb.models.samplewise(one)", "one"):
        file.write_text(text.replace("fb.models.samplewise(one)", function), encoding="utf-8")
        out = tmp_path / function
        assert "the response called sys.exit(0)" in call("run", file, "-o", out, status=1)
        assert not (out / "bands.nc").exists()


COARSE = """
import numpy as np
import xarray as xr
import flexband as fb

TIMES = np.linspace(0.0, 1.0, 51)

class Swing:
    def __init__(self, h=1.0):
        self.h = h

    def left_out(self, x, e):
        return ["step"]

    def refinements(self, x, e):
        return {"step": Swing(self.h / 2)}

    def __call__(self, x, e):
        wave = np.sin((3 + 0.1 * e + 0.1 * x)[:, None] * (1 - 0.02 * self.h**2) * TIMES)
        found = xr.DataArray(wave, dims=("sample", "time"), coords={"time": TIMES})
        if self.h > 0.9:
            why = {k: (0.1, "the step is too long") for k in range(0, len(x), 2)}
            raise fb.errors.SimulationError("no convergence", why, found)
        return found

inputs = {"x": fb.Normal(0.0, 1.0), "e": fb.Interval(-1.0, 1.0)}
study = fb.Study(Swing(), inputs, fb.AdaptivePCCI(0.01))
"""


def test_runs_of_a_coarse_trial_are_not_counted_as_failed(tmp_path):
    file = tmp_path / "swing.py"
    out = tmp_path / "out"
    file.write_text(COARSE, encoding="utf-8")
    call("run", file, "-o", out)
    state = state_of(out)
    assert state["failed"] == 0
    assert state["replaced"] == len(state["failures"]) > 0
    output = call("status", out)
    assert ", 0 failed" in output
    assert f"{state['replaced']} more failed on a coarse discretization" in output
    assert "failed: run" not in output
