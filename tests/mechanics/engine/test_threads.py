"""Ctrl-C, and errors, in work that runs in threads."""

import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from flexband.mechanics.engine import threads
from flexband.mechanics.engine.threads import in_parallel, interruptible, stop_flag

PENDULUM = """
import flexband as fb

def endless(t, x, v, p, force):
    while True:
        force[0, 0] += 1.0

def pendulum(**loads):
    bar = fb.RigidBody.bar(length=1.0, height=0.1, width=0.1, density=1000.0)
    pin = fb.Revolute("bar.start", (0.0, 0.0))
    tip = fb.Position("bar.end")
    return fb.Mechanism(bodies={"bar": bar}, joints={"pin": pin}, loads=loads, sensors={"tip": tip})

fb.simulate(pendulum(), duration=0.1, step=0.01)  # compiles the engine
"""
STATES = {
    "one long run": "fb.simulate(pendulum(), duration=1e4, step=1e-3)",
    "an endless law": "fb.simulate(pendulum(law=law), duration=1.0, step=1e-3)",
    "an endless law at rest": "fb.equilibrium(pendulum(law=law))",
}


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
@pytest.mark.parametrize("state", STATES)
def test_ctrl_c_ends_the_process(state):
    compiling = 'law = fb.ForceLaw(["bar.end"], endless)\n' if "law" in STATES[state] else ""
    setup_code = compiling + 'print("ready", flush=True)\n'
    process = subprocess.Popen(
        [sys.executable, "-c", PENDULUM + setup_code + STATES[state]],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout.readline() == "ready\n"
        time.sleep(0.5)
        assert process.poll() is None
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=30)  # 1 s where the machine does nothing else
    finally:
        process.kill()
    assert errors.strip().endswith("KeyboardInterrupt")
    assert process.returncode == -signal.SIGINT


def test_an_error_stops_the_other_blocks():
    flags = []
    blocks = []

    def run(block):
        flags.append(stop_flag())
        blocks.append(block)
        if block == 1:
            raise OSError("full")
        while block == 0 and not stop_flag().any():
            time.sleep(0.01)
        return 1

    with pytest.raises(OSError, match="full"):
        in_parallel(run, 100, 100, 2)
    assert len(blocks) < 100
    assert flags[0] is flags[1]
    assert np.all(flags[0] == 1)


def test_interruptible_returns_the_result_or_raises_the_error():
    assert interruptible(lambda: 5) == 5
    with pytest.raises(ZeroDivisionError):
        interruptible(lambda: 1 / 0)


def test_only_compiling_is_announced(capfd, monkeypatch):
    def wait():
        time.sleep(0.3)

    threads.while_compiling(wait, after=0.0)
    assert not capfd.readouterr().err
    monkeypatch.setattr(threads, "compiling", {"march"})
    threads.while_compiling(wait, after=0.0)
    assert "compiling the engine" in capfd.readouterr().err
