"""Ctrl-C or SIGTERM ends the command line soon, whatever it is doing, and leaves whole files."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest
import xarray as xr
from typer.testing import CliRunner

import flexband as fb
from flexband.cli import app
from flexband.uncertainty.expansions.threads import in_threads

STUDY = """
import pathlib, time
import numpy as np
import flexband as fb
from flexband.report.page import study as page

def sleeps(*arguments):
    pathlib.Path("here").touch()
    time.sleep(30)

def catches_all():
    try:
        sleeps()
    except BaseException:
        catches_all()

def long_call():
    pathlib.Path("here").touch()
    np.linalg.eigvals(np.random.default_rng(0).random((3000, 3000)))

def response(a):
    {call}
    return a[:, None] * np.ones(3)

{setup}
study = fb.Study(response, {{"a": fb.Interval(1.0, 2.0)}}, fb.PCCI(1, 1))
"""
STATES = {
    "a response that catches all": ("catches_all()", ""),
    "a long call": ("long_call()", ""),
    "the report": ("", "page.chart_data = sleeps"),
}


@pytest.mark.skipif(os.name == "nt", reason="signals differ")
@pytest.mark.parametrize("state", [*STATES, "imports"])
def test_ctrl_c_ends_the_command(state, tmp_path):
    call, setup = STATES.get(state, ("", ""))
    (tmp_path / "study.py").write_text(STUDY.format(call=call, setup=setup), encoding="utf-8")
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    if state == "imports":
        program = ["-c", "import flexband.__main__ as m; print(1, flush=True); m.main()"]
    else:
        program = ["-m", "flexband"]
    with subprocess.Popen(
        [sys.executable, *program, "run", "study.py", "--output", "out"],
        env=environment, cwd=tmp_path, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    ) as process:  # fmt: skip
        assert process.stdout is not None
        if state == "imports":
            process.stdout.readline()
            time.sleep(0.1)
        else:
            while not (tmp_path / "here").exists() and process.poll() is None:
                time.sleep(0.02)
        start = time.monotonic()
        process.send_signal(signal.SIGINT)
        output = "".join(process.communicate(timeout=30))
        assert time.monotonic() - start < 10.0  # of the 30 that it would sleep
        assert process.returncode == 130
    assert "flexband: stopped" in output
    assert "Traceback" not in output
    if state == "the report":
        fb.load_surrogate(tmp_path / "out" / "surrogate.npz")
        xr.open_dataset(tmp_path / "out" / "bands.nc", engine="scipy").close()


@pytest.mark.skipif(os.name == "nt", reason="signals differ")
def test_sigterm_says_how_to_go_on(tmp_path):
    """One that a process forked by the response gets is none of the command's."""
    call = "fork(); sleeps()"
    setup = """
def fork():
    import multiprocessing
    child = multiprocessing.get_context("fork").Process(target=time.sleep, args=(30,))
    child.start()
    child.terminate()
    child.join()
    time.sleep(1.5)
"""
    (tmp_path / "study.py").write_text(STUDY.format(call=call, setup=setup), encoding="utf-8")
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    with subprocess.Popen(
        [sys.executable, "-m", "flexband", "run", "study.py", "--output", "out"],
        env=environment, cwd=tmp_path, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    ) as process:  # fmt: skip
        while not (tmp_path / "here").exists() and process.poll() is None:
            time.sleep(0.02)
        assert process.poll() is None
        process.terminate()
        output = "".join(process.communicate(timeout=30))
        assert process.returncode == 143, output
    assert "flexband: stopped; `flexband resume out` continues" in output
    assert "Traceback" not in output


@pytest.mark.parametrize(
    ("interrupt", "status", "reason"),
    [("KeyboardInterrupt", 130, "Ctrl-C"), ("KeyboardInterrupt(15)", 143, "SIGTERM")],
)
def test_the_folder_tells_what_stopped_a_study(interrupt, status, reason, tmp_path):
    text = STUDY.format(call=f"raise {interrupt}", setup="")
    (tmp_path / "study.py").write_text(text, encoding="utf-8")
    out = tmp_path / "out"
    result = CliRunner().invoke(app, ["run", str(tmp_path / "study.py"), "--output", str(out)])
    assert result.exit_code == status
    record = json.loads((out / "study.json").read_text(encoding="utf-8"))
    assert (record["state"], record["reason"]) == ("stopped", reason)


def test_threads_do_not_outlive_an_error():
    finished_parts = []

    def work(part):
        if part == 3:
            raise ValueError("three")
        finished_parts.append(part)
        time.sleep(0.01)

    with pytest.raises(ValueError, match="three"):
        in_threads(work, range(1000))
    time.sleep(0.05)
    assert len(finished_parts) < 100
    in_threads(finished_parts.append, [])
