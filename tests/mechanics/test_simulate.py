"""Times, invariance, and runs that are repeated with half the step."""

import importlib
import re
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import flexband as fb
from flexband.basics import checks, progress
from flexband.mechanics.engine import threads
from flexband.mechanics.simulate import TimeGrid
from tests.mechanics.models import (
    beam,
    between_rods,
    block,
    hardening_spring,
    pendulum,
    pendulum_driven,
)


@pytest.mark.parametrize(
    ("duration", "step", "text"),
    [
        (0.0, 1e-3, "duration .* must be positive; got 0"),
        (1.0, -1e-3, "step .* must be positive; got -0.001"),
        (1.0, 0.3, "whole multiple of step; got 1 with step 0.3"),
        (np.nan, 0.1, "duration"),
    ],
)
def test_bad_times_are_refused(duration, step, text):
    with pytest.raises(fb.errors.InputError, match=text):
        fb.simulate(pendulum(), duration=duration, step=step)


def test_times_are_those_the_user_wrote():
    motion = fb.simulate(pendulum(), duration=0.6, step=1e-3)
    assert list(motion.time.values) == [k / 1000 for k in range(601)]


@settings(max_examples=5, deadline=None)
@given(st.floats(-3.0, 3.0), st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))
def test_turning_and_moving_everything_changes_nothing(angle, x, y):
    """A flexible pendulum under a turned field of gravity, seen in turned axes."""

    def tip(turn, at):
        c = np.cos(turn)
        s = np.sin(turn)
        body = beam(elements=2, height=0.02, youngs_modulus=1e8, start=at, angle=turn)
        model = fb.Mechanism(
            bodies={"b": body},
            joints={"hinge": fb.Weld("b.start", at, angle=turn)},
            loads={"gravity": fb.Gravity(9.81 * s, -9.81 * c)},
            sensors={"tip": fb.Position("b.end")},
        )
        motion = fb.simulate(model, duration=0.2, step=1e-3).values - np.array(at)[:, None]
        return np.array([[c, s], [-s, c]]) @ motion

    np.testing.assert_allclose(tip(angle, (x, y)), tip(0.0, (0.0, 0.0)), atol=1e-8)


def test_a_diverging_sample_is_repeated_with_half_the_step_and_hurts_no_other():
    speeds = np.array([0.1, 7.5, 0.2, 7.0, 0.3])
    batch = fb.simulate(hardening_spring(speeds), duration=1.0, step=0.02)
    assert batch.attrs["halved_step"] == [1, 3]
    for k in (0, 2, 4):
        single_run = fb.simulate(hardening_spring(speeds[k]), duration=1.0, step=0.02)
        np.testing.assert_array_equal(batch[k], single_run)
    fine_motion = fb.simulate(hardening_spring(speeds[[1, 3]]), duration=1.0, step=0.01)
    np.testing.assert_array_equal(batch[[1, 3]], fine_motion[:, :, ::2])
    substep_run = fb.simulate(hardening_spring(speeds), duration=1.0, step=0.04, substeps=2)
    np.testing.assert_array_equal(substep_run, batch[:, :, ::2])
    assert substep_run.attrs["halved_step"] == [1, 3]
    with pytest.raises(
        fb.errors.SimulationError, match=r"steps of 0\.02 s and of 0\.01 s\nTake shorter"
    ):
        fb.simulate(hardening_spring(1e6), duration=1.0, step=0.02)


@pytest.mark.filterwarnings("ignore:.*whose rate jumps")
def test_impulses_of_a_sample_that_is_repeated_with_half_the_step_are_those_of_that_run():
    """Beside the spring whose coarse run fails, a disc is set in motion: 0.02 kg m² at 3 rad/s."""
    springs = hardening_spring(np.array([0.1, 7.5]))
    mechanism = fb.Mechanism(
        bodies={**springs.bodies, "d": fb.RigidBody(mass=1.0, inertia=0.02)},
        joints={
            **springs.joints,
            "h": fb.Revolute("d", (0.0, 0.0)),
            "m": fb.PrescribedRotation("d", lambda t: 3 * np.maximum(0.0, t - 0.803)),
        },
        loads=springs.loads,
        sensors={"M": fb.ReactionMoment("m")},
    )
    motion = fb.simulate(mechanism, duration=1.0, step=0.02)
    assert motion.attrs["halved_step"] == [1]
    assert motion.attrs["impulses"] == "at t = 0.803 s: M 0.06 N m s"


def test_a_mechanism_without_sensors_is_refused():
    message = r"no sensors, so it has no outputs; add .* such as Mechanism\(..., sensors="
    with pytest.raises(fb.errors.InputError, match=message):
        fb.simulate(pendulum_driven(lambda t: t, sensors={}), duration=0.01, step=1e-3)
    inputs = {"k": fb.Interval(1.0, 2.0)}

    def builder(k):
        return fb.Mechanism(bodies={"a": block()})

    for response in (
        fb.dynamic_response(builder, duration=0.01, step=1e-3), fb.static_response(builder)
    ):  # fmt: skip
        with pytest.raises(fb.errors.InputError, match=message):
            fb.propagate(response, inputs, fb.PCCI(1, 1))


def test_a_run_that_does_not_fit_into_memory_is_refused_before_it_starts():
    mechanism = fb.Mechanism(bodies={"m": fb.PointMass(mass=1.0)}, sensors={"x": fb.Position("m")})
    with pytest.raises(fb.errors.InputError, match=r"1e\+14 steps, would take 4e\+06 GB of memory"):
        fb.simulate(mechanism, duration=1e5, step=1e-9)
    large_batch = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=np.ones(100_000))}, sensors={"x": fb.Position("m")}
    )
    with pytest.raises(
        fb.errors.InputError, match="100000 samples of 2 outputs at 1000001 times would"
    ):
        fb.simulate(large_batch, duration=1.0, step=1e-6)


@pytest.mark.parametrize("slope", [1e-7, -2e-9])
def test_a_point_between_two_rods_almost_in_line_stands_still_or_is_warned_of(slope):
    """The force in each rod is m g / (2 sin α)."""
    exact = 2.0 * 9.81 / (2 * np.tan(slope))
    with warnings.catch_warnings(record=True) as records:
        warnings.simplefilter("always")
        try:
            motion = fb.simulate(between_rods(slope), duration=0.003, step=1e-3)
        except fb.errors.SimulationError:
            return
    right = np.allclose(motion.sel(output="R_X"), exact, rtol=1e-3)
    assert right or any("almost depend" in str(w.message) for w in records)


def test_a_run_that_fails_in_its_first_step_has_started():
    with pytest.raises(fb.errors.SimulationError, match=r"t = 0\.02 s"):
        fb.simulate(hardening_spring(1e6), duration=1.0, step=0.02)


def swinging_bar():
    bar = fb.RigidBody.bar(length=1.0, height=0.02, width=0.02, density=7800.0)
    return fb.Mechanism(
        bodies={"bar": bar},
        joints={"hinge": fb.Revolute("bar.start", (0.0, 0.0))},
        loads={"gravity": fb.Gravity()},
        sensors={"end": fb.Position("bar.end")},
    )


@pytest.mark.parametrize(
    ("duration", "step", "substeps"),
    [(0.415, 0.005, 1), (0.6, 1e-4, 3), (20.0, 1e-3, 7), (3e-6, 1e-9, 1), (1234.5, 0.5, 4)],
)
def test_times_are_the_nearest_numbers_with_their_digits(duration, step, substeps):
    digits = 14 - int(np.ceil(np.log10(duration)))
    count = round(duration / step) * substeps + 1
    exact = [round(k * (step / substeps), digits) for k in range(count)]
    assert TimeGrid(duration, step, substeps).times().tolist() == exact


def test_tables_of_too_many_steps_are_refused_before_they_are_made(monkeypatch):
    monkeypatch.setattr(checks, "free_memory", lambda: 3e8)
    monkeypatch.setattr(importlib.import_module("flexband.mechanics.simulate"), "run_samples", None)
    with pytest.raises(
        fb.errors.InputError, match="1 sample of 2 outputs at 1000001 times would take"
    ):
        fb.simulate(swinging_bar(), duration=1000.0, step=1e-3, threads=1)


def test_a_long_simulation_tells_its_steps_and_the_time_left(monkeypatch, capsys):
    fb.simulate(swinging_bar(), duration=0.1, step=1e-3)  # which may compile the engine
    capsys.readouterr()
    monkeypatch.setattr(threads, "BEAT", 0.02)
    monkeypatch.setattr(progress.Pace, "many_steps", 300_000)
    stages = []
    messages = []
    listener = progress.ProgressListener()
    listener.stage = stages.append
    listener.warn = messages.append
    with progress.add_listener(listener):
        progress.listener().stage("the first runs")
        fb.simulate(swinging_bar(), duration=300.0, step=1e-3)
    assert stages[1] == "the first runs, runs of 300000 steps"
    assert messages[0] == "each run has 300000 steps"
    assert any(re.search(r"% of runs of 300000 steps, about .* left$", stage) for stage in stages)
    assert stages[-1] == "the first runs"
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(progress.Pace, "long", 0.0)
    fb.simulate(swinging_bar(), duration=300.0, step=1e-3)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "flexband: each run has 300000 steps"
    assert re.fullmatch(r"flexband: .* % of runs of 300000 steps, about .* left", lines[1])
    assert len(lines) == 2
