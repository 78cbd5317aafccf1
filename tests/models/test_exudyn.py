"""A model in Exudyn, run sample by sample, against the same mechanism in flexband."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import flexband as fb

pytest.importorskip("exudyn.itemInterface")
EXAMPLE = Path(__file__).parents[2] / "examples" / "models" / "exudyn_pendulum.py"


def test_a_double_pendulum():
    own = runpy.run_path(str(EXAMPLE))
    first_length, density = own["LENGTH"], own["DENSITY"]

    def bar(length, start):
        mass = density * length
        points = {"start": (-length / 2, 0.0), "end": (length / 2, 0.0)}
        return fb.RigidBody(mass=mass, inertia=mass * length**2 / 12,
                            position=(start + length / 2, 0.0), points=points)  # fmt: skip

    def double_pendulum(second_length, friction):
        return fb.Mechanism(
            bodies={"first": bar(first_length, 0.0), "second": bar(second_length, first_length)},
            joints={"upper": fb.Revolute("first.start", (0.0, 0.0)),
                    "lower": fb.Revolute("first.end", "second.start")},
            loads={"gravity": fb.Gravity(),
                   "friction": fb.TorsionSpring("first", "second", stiffness=0.0,
                                                damping=friction)},
            sensors={"first": fb.Angle("first"), "second": fb.Angle("second")},
        )  # fmt: skip

    values = {"second_length": np.array([0.29, 0.31]), "friction": np.array([0.02, 0.03])}
    found = own["response"](**values)
    step = {"step": own["STEP"], "output_step": 10 * own["STEP"]}
    expected = fb.dynamic_response(double_pendulum, duration=own["DURATION"], **step)(**values)
    assert found.dims == ("sample", "output", "time")
    assert np.ptp(found.values, axis=0).max() > 0.05
    np.testing.assert_allclose(found, expected.values, atol=4e-5)
    np.testing.assert_allclose(found["time"], expected["time"])
    assert own["study"].response is own["response"]
