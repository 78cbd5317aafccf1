"""Ctrl-C ends the command line soon, whatever it is doing, and leaves whole files."""

import os
import signal
import subprocess
import sys
import time

import pytest
import xarray as xr

import flexband as fb
from flexband.uncertainty.expansions.threads import in_threads

STUDY = """
import pathlib, time
import numpy as np
import flexband as fb
from flexband.report.page import charts

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
    {here}
    return a[:, None] * np.ones(3)

{there}
study = fb.Study(response, {{"a": fb.Interval(1.0, 2.0)}}, fb.PCCI(1, 1))
"""
STATES = {
    "a response that catches all": ("catches_all()", ""),
    "a long call": ("long_call()", ""),
    "the report": ("", "charts.chart_data = sleeps"),
}


@pytest.mark.skipif(os.name == "nt", reason="signals differ")
@pytest.mark.parametrize("state", [*STATES, "imports"])
def test_ctrl_c_ends_the_command(state, tmp_path):
    here, there = STATES.get(state, ("", ""))
    (tmp_path / "study.py").write_text(STUDY.format(here=here, there=there), encoding="utf-8")
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


def test_threads_do_not_outlive_an_error():
    done = []

    def work(part):
        if part == 3:
            raise ValueError("three")
        done.append(part)
        time.sleep(0.01)

    with pytest.raises(ValueError, match="three"):
        in_threads(work, range(1000))
    time.sleep(0.05)
    assert len(done) < 100
    in_threads(done.append, [])
