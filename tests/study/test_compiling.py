"""What a study needs is compiled in several processes, if it has no machine code yet."""

import subprocess
import sys
from typing import ClassVar

import numpy as np
import pytest

import flexband as fb
from flexband.compilation.caching import is_compiled
from flexband.study import compiling


def mechanism(length):
    bar = fb.RigidBody.bar(length=length, height=0.1, width=0.1, density=1000.0)
    return fb.Mechanism(bodies={"bar": bar}, joints={"pin": fb.Revolute("bar.start", (0.0, 0.0))})


def formula(length):
    return length[:, None] * np.arange(3.0)


MOVES = fb.dynamic_response(mechanism, duration=0.1, step=0.01)
LENGTH = {"length": fb.Interval(1.0, 1.1)}


class Process:
    """One that ends at the third look, or never."""

    processes: ClassVar[list] = []
    ends = True

    def __init__(self, command, **_):
        self.looks = 0
        self.killed = False
        Process.processes.append((command[3:], self))

    def poll(self):
        self.looks += 1
        return 0 if self.ends and self.looks > 2 else None

    def kill(self):
        self.killed = True


@pytest.fixture
def processes(monkeypatch):
    monkeypatch.setattr(compiling.subprocess, "Popen", Process)
    monkeypatch.setattr(compiling, "is_compiled", lambda _: False)
    monkeypatch.setattr(compiling, "available_cores", lambda: 2)
    monkeypatch.setattr(Process, "processes", [])
    return Process.processes


@pytest.mark.parametrize(
    ("response", "method", "parts"),
    [
        (MOVES, fb.AdaptivePCCI(), [["engine"], ["bounds", "phases"]]),
        (formula, fb.AdaptivePCCI(), [["bounds"], ["phases"]]),
        (MOVES, fb.PCCI(2, 2), [["engine"], ["bounds"]]),
        (MOVES, fb.MonteCarlo(100), []),
    ],
)
def test_parts_that_a_study_needs(processes, response, method, parts):
    compiling.compile_ahead(fb.Study(response, LENGTH, method))
    assert [names for names, _ in processes] == parts


def test_one_core_and_one_part_need_no_process(processes, monkeypatch):
    study = fb.Study(formula, LENGTH, fb.AdaptivePCCI())
    monkeypatch.setattr(compiling, "available_cores", lambda: 1)
    compiling.compile_ahead(study)
    monkeypatch.setattr(compiling, "available_cores", lambda: 2)
    monkeypatch.setattr(compiling, "is_compiled", lambda entry: entry is compiling.search)
    compiling.compile_ahead(study)
    assert not processes


def test_an_interrupt_ends_the_processes(processes, monkeypatch):
    monkeypatch.setattr(Process, "ends", False)

    def interrupt(_):
        raise KeyboardInterrupt

    monkeypatch.setattr(compiling.time, "sleep", interrupt)
    with pytest.raises(KeyboardInterrupt):
        compiling.compile_ahead(fb.Study(formula, LENGTH, fb.AdaptivePCCI()))
    assert processes
    assert all(process.killed for _, process in processes)


def test_the_parts_compile_their_entries():
    """After their small uses, run as a process, there is machine code of all entries."""
    subprocess.run([sys.executable, "-m", "flexband.study.compiling", *compiling.PARTS], check=True)
    assert all(is_compiled(entry) for entries, _ in compiling.PARTS.values() for entry in entries)
