"""Compiles what most tests need, on two cores, before the tests all wait for the same code."""

import os
from concurrent.futures import ProcessPoolExecutor
from contextlib import redirect_stdout
from dataclasses import replace
from multiprocessing import get_context

import numpy as np
import pytest

import flexband as fb
from tests.mechanics.models import Dense, pendulum


def dynamics():
    """Compile the engine's entry for motions."""
    fb.simulate(pendulum(), duration=2e-3, step=1e-3)


def contacts():
    """Compile the engine's entry for motions with steps that each sample chooses."""
    law = fb.contact.KeepsRestitution(stiffness=1e8, restitution=0.5)
    stop = fb.contact.AngularStop("bar.end", (0.0, 0.0), law, lower=-2.0)
    model = pendulum()
    loads = {**model.loads, "stop": stop}
    fb.simulate(replace(model, loads=loads), duration=2e-3, step=1e-3)


def statics():
    """Compile the engine's entry for equilibria."""
    fb.equilibrium(pendulum())


def uncertainty():
    """Compile the search for bounds, plain and with phases, and what tests call of the engine."""
    t = np.linspace(0, 1, 200)
    wave = {"a": fb.Interval(60.0, 66.0), "b": fb.Normal(1.0, 0.01)}
    fb.propagate(lambda a, b: a[:, None] * b[:, None] * t, wave, fb.PCCI(1, 1))
    fb.propagate(
        lambda a, b: np.sin((a * b)[:, None] * t), wave, fb.methods.PhaseResolvedPCCI(2, 2)
    )
    dense = Dense(pendulum())
    unknowns = dense.structure.pattern.unknowns
    dense.solved(np.zeros(unknowns), np.zeros(unknowns))


def assertions():
    """Rewrite the assertions of all tests, which pytest keeps on disk."""
    with open(os.devnull, "w", encoding="utf-8") as nowhere, redirect_stdout(nowhere):
        pytest.main(["--collect-only", "-n", "0"])


if __name__ == "__main__":
    with ProcessPoolExecutor(2, get_context("spawn")) as processes:
        engine, *others = map(processes.submit, (dynamics, uncertainty, statics, assertions))
        engine.result()
        others.append(processes.submit(contacts))  # which starts by the code of dynamics
        for other in others:
            other.result()
