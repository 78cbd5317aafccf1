"""Static equilibrium against closed forms."""

import numpy as np
import pytest

import flexband as fb


def test_hanging_chain_of_springs_in_series():
    k, m = np.array([100.0, 200.0, 400.0]), 1.5
    model = fb.Mechanism(
        bodies={
            "a": fb.PointMass(mass=m, position=(0.0, -1.0)),
            "b": fb.PointMass(mass=m, position=(0.0, -2.0)),
        },
        loads={
            "upper": fb.Spring("a", (0.0, 0.0), k, 1.0),
            "lower": fb.Spring("b", "a", 50.0, 1.0),
            "gravity": fb.Gravity(),
        },
        sensors={"a": fb.Position("a"), "b": fb.Position("b")},
    )
    found = fb.equilibrium(model)
    a = -1.0 - 2 * m * 9.81 / k
    np.testing.assert_allclose(found.sel(output="a_Y"), a, rtol=1e-8)
    np.testing.assert_allclose(found.sel(output="b_Y"), a - 1.0 - m * 9.81 / 50.0, rtol=1e-8)
    assert found.unit.sel(output="a_Y") == "m"


def test_pendulum_comes_to_rest_below_its_pin_with_its_weight_in_the_pin():
    bar = fb.RigidBody.bar(length=1.0, height=0.02, width=0.02, density=1000.0, angle=-0.3)
    model = fb.Mechanism(
        bodies={"bar": bar},
        joints={"pin": fb.Revolute("bar.start", (0.0, 0.0))},
        loads={"gravity": fb.Gravity()},
        sensors={"tip": fb.Position("bar.end"), "F": fb.Reaction("pin")},
    )
    found = fb.equilibrium(model)
    np.testing.assert_allclose(found, [0.0, -1.0, 0.0, 9.81 * 0.4], atol=1e-6)


def test_a_mechanism_that_cannot_rest_is_refused():
    model = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0)}, loads={"f": fb.Force("m", x=1.0)},
        sensors={"m": fb.Position("m")},
    )  # fmt: skip
    with pytest.raises(fb.AssemblyError, match="no equilibrium was found"):
        fb.equilibrium(model)


def test_bad_requests_are_refused():
    model = fb.Mechanism(bodies={"m": fb.PointMass(mass=1.0)})
    with pytest.raises(fb.InputError, match="steps must be 1 or more; got 0"):
        fb.equilibrium(model, steps=0)
