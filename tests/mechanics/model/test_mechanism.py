"""Mechanisms that make no sense are refused by name."""

import numpy as np
import pytest

import flexband as fb
from tests.mechanics.models import block, two_blocks


@pytest.mark.parametrize(
    ("build", "text"),
    [
        (lambda: fb.Mechanism(bodies={}), "at least one body"),
        (lambda: fb.Mechanism(bodies={"a.b": block()}), "without a dot; got 'a.b'"),
        (
            lambda: two_blocks({"pin": fb.Revolute("a", "c.end")}),
            "joint 'pin': body 'c' is not in the mechanism; there is a, b",
        ),
        (
            lambda: two_blocks({"pin": fb.Revolute("a.tip", "b")}),
            "joint 'pin': point must be 'center'; got 'tip'",
        ),
        (lambda: two_blocks({"pin": fb.Revolute("a", (0.0, np.inf))}), "ground point Y"),
        (
            lambda: two_blocks({"pin": fb.Revolute("a", 3.0)}),
            "ground point must be a pair; got 3.0",
        ),  # type: ignore
        (
            lambda: two_blocks(loads={"f": fb.Force(lambda t: t, y=1.0)}),
            "load 'f': .* got a function.* moves along a member is shared by Forces at its nodes",
        ),  # type: ignore
        (
            lambda: two_blocks({"pin": fb.Revolute("a", (np.sin, 0.0))}),
            "joint 'pin': .* got a function. A point that moves is one of a body with a Prescribed",
        ),  # type: ignore
        (
            lambda: two_blocks(loads={"s": fb.Spring("a", "c", 1.0)}),
            "load 's': body 'c' is not in the mechanism",
        ),
        (
            lambda: two_blocks({"pin": fb.Revolute((0, 0), (0, 0))}),
            r"'pin': its points \(0, 0\) and \(0, 0\) are both of the ground",
        ),
        (
            lambda: two_blocks({"pin": fb.Revolute("a", "a")}),
            "its points 'a' and 'a' are both of body 'a'; a Revolute is between two bodies, or a ",
        ),
        (
            lambda: two_blocks({"rod": fb.Distance("b.center", "b", 1.0)}),
            "'rod': its points 'b.center' and 'b' are both of body 'b'",
        ),
        (lambda: two_blocks({"pin": "a"}), r"joints\['pin'\] must be a joint; got 'a'"),  # type: ignore
        (lambda: fb.Mechanism(bodies={"a": "b"}), r"bodies\['a'\] must be a body; got 'b'"),  # type: ignore
        (lambda: two_blocks(loads={"g": 9.81}), r"loads\['g'\] must be a load; got 9.81"),  # type: ignore
    ],
)
def test_bad_mechanisms_are_refused(build, text):
    with pytest.raises(fb.errors.InputError, match=text):
        build()


def test_the_model_of_a_mechanism_does_not_follow_a_mapping_that_changes_later():
    branches = {"a": 2 * np.pi}
    body = fb.RigidBody(mass=1.0, inertia=1.0, points={"end": (1.0, 0.0)})
    mechanism = fb.Mechanism(bodies={"a": body}, branches=branches, sensors={"turn": fb.Angle("a")})
    branches["a"] = 0.0
    motion = fb.simulate(mechanism, duration=0.1, step=0.1)
    assert motion.values[0, 0] == pytest.approx(2 * np.pi, rel=1e-15)
