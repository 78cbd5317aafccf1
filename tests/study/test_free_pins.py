"""Before the runs: which requirements the play of pins leaves undecided, and which body is free."""

import warnings

import pytest

import flexband as fb
from flexband.study.free_pins import warn_of_free_pins
from tests.mechanics.joints.test_offsets import four_bar

INPUTS = {"pin0": fb.Play(1e-3), "pin1": fb.Play(1e-3, one_sided=True)}
RATE = fb.Requirement("rocker speed", output="rate", below=10.0)
ANGLE = fb.Requirement("rocker", output="out", below=10.0)


def free_four_bar(pin0, pin1):
    """Return the four-bar linkage without its motor."""
    mechanism = four_bar(pin0, pin1)
    joints = {name: joint for name, joint in mechanism.joints.items() if name != "motor"}
    return fb.Mechanism(bodies=mechanism.bodies, joints=joints, sensors=mechanism.sensors)


def warning_of(builder, requirements, inputs=INPUTS):
    response = fb.dynamic_response(builder, duration=0.1, step=0.05)
    study = fb.Study(response, inputs, fb.PCCI(1, 1), requirements=requirements)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        warn_of_free_pins(study)
    return str(caught[0].message) if caught else ""


def test_a_speed_depends_on_how_pins_move_and_an_angle_of_a_prescribed_motion_does_not():
    text = warning_of(four_bar, [RATE, ANGLE])
    assert text.startswith(
        "1 requirement will be UNDECIDED (rocker speed (below 10)): pin0 may change during a run"
    )
    assert "nothing prescribes" not in text
    assert text.endswith("write Play(…, one_sided=True)")
    assert warning_of(four_bar, [ANGLE]) == ""
    assert "(rate below 10)" in warning_of(four_bar, [fb.Requirement("rate", below=10.0)])
    assert warning_of(four_bar, [fb.Requirement("out", below=10.0)]) == ""


def test_the_bodies_whose_motion_is_free_are_named():
    text = warning_of(free_four_bar, [ANGLE])
    assert "1 requirement will be UNDECIDED (rocker (below 10))" in text
    bodies = " and ".join(four_bar().bodies)
    assert f"and nothing prescribes the motion of {bodies}; bounds hold only" in text


@pytest.mark.parametrize("requirements", [[], [RATE]])
def test_nothing_is_said_without_requirements_or_where_loads_hold_all_pins(requirements):
    inputs = dict.fromkeys(INPUTS, fb.Play(1e-3, one_sided=True)) if requirements else INPUTS
    assert warning_of(free_four_bar, requirements, inputs) == ""
