"""Compile what a study needs in two processes at once, before it needs it.

The engine, which also computes an equilibrium to compare the start with, the search for bounds and
that with phases are compiled when they are first used, each for 10 to 30 s, once per machine. They
are independent. As a program, this module compiles those that its arguments name.
"""

from __future__ import annotations

import gc
import subprocess
import sys
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from flexband.basics.cores import available_cores
from flexband.basics.progress import listener
from flexband.compilation.caching import is_compiled
from flexband.mechanics.bodies.rigid import RigidBody
from flexband.mechanics.engine.entries import dynamics, statics
from flexband.mechanics.joints.joints import Revolute
from flexband.mechanics.model.mechanism import Mechanism
from flexband.mechanics.response import DynamicResponse
from flexband.mechanics.sensors.motion import Position
from flexband.mechanics.simulate import simulate
from flexband.uncertainty.expansions.bounds.search import descents
from flexband.uncertainty.inputs.distributions.normal import Normal
from flexband.uncertainty.inputs.inputs import Interval
from flexband.uncertainty.methods.pcci import PCCI
from flexband.uncertainty.phase_resolved.method import PhaseResolvedPCCI
from flexband.uncertainty.phases.phase_bounds import search
from flexband.uncertainty.propagate import propagate

if TYPE_CHECKING:
    from flexband.basics.response import ResponseFunction
    from flexband.study.definition import StudyDefinition
    from flexband.uncertainty.methods.method import Method


def _engine() -> None:
    bar = RigidBody.bar(length=1.0, height=0.1, width=0.1, density=1000.0)
    joints = {"pin": Revolute("bar.start", (0.0, 0.0))}
    mechanism = Mechanism(bodies={"bar": bar}, joints=joints, sensors={"end": Position("bar.end")})
    simulate(mechanism, duration=2e-3, step=1e-3, start="static")


def _bounds() -> None:
    _propagate(lambda a, b: a[:, None] * b[:, None] * np.arange(3.0), PCCI(1, 1))


def _phases() -> None:
    t = np.linspace(0, 1, 200)
    _propagate(lambda a, b: np.sin((a * b)[:, None] * t), PhaseResolvedPCCI(2, 2))


def _propagate(response: ResponseFunction, method: Method) -> None:
    propagate(response, {"a": Interval(60.0, 66.0), "b": Normal(1.0, 0.01)}, method)


PARTS: dict[str, tuple[tuple[Callable, ...], Callable[[], None]]] = {
    "engine": ((dynamics, statics), _engine),
    "bounds": ((descents,), _bounds),
    "phases": ((search,), _phases),
}
"""Entries that are compiled, and a small use of them, the longest first."""


def compile_ahead(study: StudyDefinition) -> None:
    """Compile in two processes what a study needs and has no machine code.

    Bounds and phases share functions, and together take as long as the engine. What fails is
    compiled when it is needed. A single missing part is left to this process.
    """
    uses = {
        "engine": isinstance(study.source, DynamicResponse),
        "bounds": True,
        "phases": isinstance(study.method, PhaseResolvedPCCI) or not isinstance(study.method, PCCI),
    }
    part_names = [name for name in PARTS if study.expands and uses[name]]
    missing = [name for name in part_names if not all(map(is_compiled, PARTS[name][0]))]
    if len(missing) < 2 or available_cores() < 2:
        return
    listener().stage("compiling")
    listener().warn("compiling (once per machine, up to a minute) ...")
    silent = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.DEVNULL)
    running: list[subprocess.Popen] = []
    try:
        for names in (missing[:1], missing[1:]):
            running.append(subprocess.Popen([sys.executable, "-m", __name__, *names], **silent))
        while any(process.poll() is None for process in running):
            time.sleep(0.05)
    finally:
        for process in running:
            process.kill()


if __name__ == "__main__":
    gc.disable()  # a compiler makes many objects, and this process ends soon
    for name in sys.argv[1:]:
        PARTS[name][1]()
