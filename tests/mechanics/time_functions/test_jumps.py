"""Functions of time that prescribe a motion must be continuous."""

import numpy as np
import pytest

import flexband as fb


def driven_bar(angle):
    bar = fb.RigidBody.bar(length=1.0, height=0.1, width=0.1, density=1.0)
    return fb.Mechanism(
        bodies={"bar": bar},
        joints={
            "pin": fb.Revolute("bar.start", (0.0, 0.0)),
            "motor": fb.PrescribedRotation("bar", angle),
        },
        sensors={"angle": fb.Angle("bar")},
    )


@pytest.mark.parametrize(
    ("angle", "at"),
    [
        (lambda t: 0.2 * (t > 0), "0"),
        (lambda t: 0.2 * (t > 0.05037), "0.05037"),
        (lambda t: 1e-3 * np.sin(t) + 1e-5 * (t > 0.05), "0.05"),
        (lambda t: np.floor(16 * t), "0.0625"),
        (lambda t: abs(np.sin(300 * t)) + 0.01 * (t > 0.05037), "0.05037"),  # among larger kinks
        (lambda t: 0.3 - 30 * t + 0.02 * (t > 0.05037), "0.05037"),  # against the slope
        (lambda t: np.array([0.3 * t, 0.3 * t + (t > 0.05)]), "0.05"),
    ],
)
def test_a_drive_that_jumps_is_refused_with_joint_and_time(angle, at):
    with pytest.raises(fb.errors.InputError, match=f"joint 'motor' .* jumps at t = {at} s"):
        fb.simulate(driven_bar(angle), duration=0.1, step=1e-3)


@pytest.mark.parametrize(
    "angle",
    [
        lambda t: 0.3,
        lambda t: 0.3 * (np.sin(t) ** 2 + np.cos(t) ** 2),  # constant up to rounding
        lambda t: 0.2 * np.sin(300 * t),
        lambda t: max(0.0, t - 0.05),
        lambda t: 0.1 * np.sqrt(abs(t - 0.05)),
    ],
)
@pytest.mark.filterwarnings("ignore::flexband.errors.FlexbandWarning")
def test_continuous_drives_are_followed(angle):
    motion = fb.simulate(driven_bar(angle), duration=0.1, step=1e-3).sel(output="angle")
    assert motion.values == pytest.approx([angle(t) for t in motion.time.values], abs=1e-9)
