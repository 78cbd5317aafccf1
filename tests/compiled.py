"""Compiles what most tests need, on two cores, before the tests all wait for the same code."""

import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context

import numpy as np

import flexband as fb
from flexband.uncertainty.expansions.expansion import SIGMAS
from tests.mechanics.models import Dense, pendulum
from tests.uncertainty.expansions.test_families import waves


def engine():
    """Compile the engine's entries for motions, with steps that each sample chooses, and at rest.

    They share functions, so that one process needs less time for all of them.
    """
    model = pendulum()
    fb.simulate(model, duration=2e-3, step=1e-3)
    law = fb.contact.KeepsRestitution(stiffness=1e8, restitution=0.5)
    stop = fb.contact.AngularStop("bar.end", (0.0, 0.0), law, lower=-2.0)
    fb.simulate(replace(model, loads={**model.loads, "stop": stop}), duration=2e-3, step=1e-3)
    fb.equilibrium(model)


def uncertainty():
    """Compile the search for bounds, plain and with phases, and what tests call of the engine.

    Waves of several random inputs are averaged by both kinds of quadrature.
    """
    t = np.linspace(0, 1, 200)
    wave = {"a": fb.Interval(60.0, 66.0), "b": fb.Normal(1.0, 0.01)}
    fb.propagate(lambda a, b: a[:, None] * b[:, None] * t, wave, fb.PCCI(1, 1))
    fb.propagate(
        lambda a, b: np.sin((a * b)[:, None] * t), wave, fb.methods.PhaseResolvedPCCI(2, 2)
    )
    dense = Dense(pendulum())
    unknowns = dense.structure.pattern.unknowns
    dense.solved(np.zeros(unknowns), np.zeros(unknowns))
    for uniform, normal in (([0.9, 0.5, 0.7, 0.3], [0.1]), ([1.0], [2.0])):
        waves(uniform, normal, np.array([4.0, 12.0])).extremes(SIGMAS)


def assertions():
    """Rewrite the assertions of all tests, which pytest keeps on disk."""
    collect = [sys.executable, "-m", "pytest", "--collect-only", "--numprocesses", "0"]
    subprocess.run(collect, check=True, stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    with ProcessPoolExecutor(2, get_context("spawn")) as processes:
        for task in [processes.submit(task) for task in (engine, uncertainty, assertions)]:
            task.result()
