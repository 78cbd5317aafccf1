"""Responses of a builder: its result is checked, and failures give its inputs."""

import numpy as np
import pytest

import flexband as fb

from .models import rigid_slider_crank


def test_a_builder_must_return_a_mechanism():
    response = fb.dynamic_response(lambda length: None, duration=0.1, step=0.01)
    with pytest.raises(fb.InputError, match="must return a Mechanism; got None"):
        response(length=np.ones(2))


def test_assembly_errors_give_the_inputs():
    def locked(link_length):
        crank = fb.RigidBody.bar(length=0.2, height=0.01, width=0.01, density=1.0)
        link = fb.RigidBody.bar(
            length=link_length, height=0.01, width=0.01, density=1.0, start=(0.2, 0), angle=1.0
        )
        joints = {
            "A": fb.Revolute("crank.start", (0.0, 0.0)),
            "B": fb.Revolute("crank.end", "link.start"),
            "C": fb.Revolute("link.end", (0.3, 0.3)),
        }
        return fb.Mechanism(bodies={"crank": crank, "link": link}, joints=joints)

    response = fb.dynamic_response(locked, duration=0.01, step=1e-3)
    with pytest.raises(fb.AssemblyError, match=r"sample 1: link_length = 0.1") as caught:
        response(link_length=np.array([0.3, 0.1]))
    assert list(caught.value.failures) == [1]


def test_a_diverging_run_is_reported_with_inputs_and_time():
    def locking(crank_length, link_length):
        return rigid_slider_crank(crank_length, link_length)

    response = fb.dynamic_response(locking, duration=0.3, step=1e-3)
    lengths = np.array([0.2, 0.2, 0.2])
    with pytest.raises(fb.SimulationError) as caught:
        response(crank_length=lengths, link_length=np.array([0.45, 0.15, 0.45]))
    assert list(caught.value.failures) == [1]
    time = caught.value.failures[1][0]
    assert time == pytest.approx(np.arcsin(0.75) / (4 * np.pi), abs=2e-3)  # where it locks
    assert "1 of 3 runs failed" in str(caught.value)
    assert "link_length = 0.15" in str(caught.value)
