"""Studies refine what has a default in the discretization of their response."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass, replace

import numpy as np
import pytest
import xarray as xr

import flexband as fb
from flexband.basics.response import Description, Response
from flexband.uncertainty.runs.cases import runs_of_cases
from flexband.uncertainty.runs.counted_runs import Purpose
from flexband.uncertainty.runs.evaluations import EvaluationOptions

INPUTS = {"a": fb.Interval(1.0, 2.0), "b": fb.Normal(0.0, 0.1)}
METHODS = [
    fb.AdaptivePCCI(0.01, phase_resolved=False),
    fb.PCCI(2, 3),
    fb.LHSScanning(5, 30, seed=1),
]


@dataclass(frozen=True)
class Rising(Response):
    """a t + b with an error that falls by `fall` with every refinement."""

    error: float
    fall: float = 3.0
    level: int = 0
    fails_from: int = 100
    default: bool = True
    refines = True

    def __call__(self, a, b):
        if self.level >= self.fails_from:
            raise fb.errors.RunError("too fine", {})
        t = np.linspace(0.0, 1.0, 21)
        error = self.error / self.fall**self.level * np.sin(7.0 * a)
        return xr.DataArray(
            (a * (1.0 + t[:, None]) + b + error).T[:, None],
            dims=("sample", "output", "time"),
            coords={"output": ["y"], "time": t, "unit": ("output", ["m"])},
        )

    def description(self, **values):
        refinements = {"step": replace(self, level=self.level + 1)}
        by_default = ["step"] if self.default else []
        return Description(by_default=by_default, refinements=lambda: refinements)


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.name)
@pytest.mark.parametrize("error", [1e-4, 1e-2, 0.1])
def test_the_default_is_refined_until_its_error_is_a_tenth_of_the_tolerance(method, error):
    bands = fb.propagate(Rising(error), INPUTS, method)
    halved = bands.attrs.get("halved", [])
    assert set(halved) <= {"step"}
    remaining_error = error / 3.0 ** len(halved)
    assert remaining_error < 2e-3
    assert remaining_error > 1e-4 or not halved  # and no more often than that asks for


def test_what_is_given_is_not_refined():
    bands = fb.propagate(Rising(0.1, default=False), INPUTS, fb.PCCI(2, 3))
    assert "halved" not in bands.attrs


def test_an_error_that_does_not_fall_asks_for_nothing_finer():
    bands = fb.propagate(Rising(0.1, fall=1.1), INPUTS, fb.PCCI(2, 3))
    assert len(bands.attrs["halved"]) <= 2


def test_a_discretization_on_which_runs_fail_is_not_taken():
    bands = fb.propagate(Rising(0.1, fails_from=2), INPUTS, fb.PCCI(2, 3))
    assert bands.attrs["halved"] == ["step"]


def slide(mass):
    """A block that sticks to a belt and slips on it."""
    friction = fb.contact.Coulomb(kinetic=0.2, static=0.3)
    belt = fb.PointMass(mass=1.0, velocity=(0.1, 0.0))
    return fb.Mechanism(
        bodies={"block": fb.PointMass(mass=mass), "belt": belt},
        joints={
            "motor": fb.PrescribedPath("belt", lambda t: 0.1 * np.asarray(t), lambda t: 0.0),
            "felt": fb.Slot("block", "belt", friction=friction),
        },
        loads={
            "gravity": fb.Gravity(),
            "spring": fb.Spring("block", (-1.0, 0.0), 100.0, rest_length=1.0),
        },
        sensors={"x": fb.Position("block")},
    )


def test_a_tolerance_of_steps_that_is_left_out_is_small_enough():
    """The bands of its runs have a tenth of the error that the method allows."""
    inputs = {"mass": fb.Interval(1.0, 1.02)}

    def bands(tolerance):
        integrator = fb.GeneralizedAlpha(step_tolerance=tolerance)
        response = fb.dynamic_response(slide, duration=1.5, step=0.05, integrator=integrator)
        return fb.propagate(response, inputs, fb.PCCI(0, 6))

    by_default = bands(None)
    exact = bands(1e-11)
    assert "halved" not in exact.attrs
    width = np.ptp(exact["error_bar"].sel(output="x_X").values, axis=0).mean()
    error = (
        np.abs(by_default["error_bar"] - exact["error_bar"]).sel(output="x_X").mean("time").max()
    )
    assert float(error) < 1e-3 * width


@pytest.mark.parametrize("purpose", [Purpose.DESIGN, Purpose.PROBE])
def test_every_run_is_recorded_under_its_discretization(purpose, tmp_path):
    options = EvaluationOptions(store=tmp_path)
    with closing(runs_of_cases(Rising(0.1), INPUTS, fb.PCCI(2, 3), options)) as all_runs:
        runs = next(all_runs)
        assert runs.start.refined_parts
        runs.start(np.zeros((2, 1)), np.array([[0.2], [0.6]]))
        runs.start(np.array([[1.0]]), np.array([[0.4]]), purpose)
    recorded = fb.execution.open_runs(tmp_path)
    a, b = recorded["inputs"].values.T
    levels = np.char.count(recorded["setting"].values.astype(str), "finer step")
    assert len(levels) == 3
    error = recorded["outputs"].values[:, 0, 0] - a - b
    np.testing.assert_allclose(error, 0.1 / 3.0**levels * np.sin(7.0 * a), atol=1e-12)
