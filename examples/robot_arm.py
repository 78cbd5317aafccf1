"""A robot arm with three motors.

The motors of the shoulder and the elbow follow given angles, each against the link before. That of
the wrist is a PID controller that reads the angle between its two links. The tip swings until the
controller has taken up the weight.
"""

import numpy as np

import flexband as fb

LENGTHS, SECTION = (0.5, 0.4, 0.2), {"height": 0.04, "width": 0.03, "density": 2700.0}  # m, kg/m³
SHOULDER = fb.ramp(to=np.pi / 3, duration=1.0)  # rad
ELBOW = fb.ramp(to=-np.pi / 2, duration=1.0)
WRIST, GAINS = np.pi / 4, (40.0, 60.0, 1.5)  # rad; N m/rad, N m/(rad s), N m s/rad


def pid(t, x, v, s, p, force, rate):
    """Set the moment between the links; row 2 is that of the line between the two points."""
    error = p[0] - x[2, 2]
    force[2, 2] = p[1] * error + p[2] * s[0] - p[3] * v[2, 2]
    rate[0] = error


def robot_arm():
    bodies = {
        name: fb.RigidBody.bar(length=length, **SECTION)
        for name, length in zip(("upper", "lower", "hand"), LENGTHS, strict=True)
    }
    wrist = fb.ForceLaw(
        ["hand.start", "lower.end"], pid, (WRIST, *GAINS), states={"i": 0.0}, between=[(0, 1)]
    )
    return fb.Mechanism(
        bodies=bodies,
        joints={
            "base": fb.Revolute("upper.start", (0.0, 0.0)),
            "pin 1": fb.Revolute("lower.start", "upper.end"),
            "pin 2": fb.Revolute("hand.start", "lower.end"),
            "shoulder": fb.PrescribedRotation("upper", SHOULDER),
            "elbow": fb.PrescribedRotation("lower", "upper", ELBOW),
        },
        loads={"gravity": fb.Gravity(), "wrist": wrist},
        sensors={"tip": fb.Position("hand.end"), "M": fb.ReactionMoment("elbow"),
                 "power": fb.sensors.Power("shoulder"), "i": fb.LawState("wrist", "i", "rad s")},
    )  # fmt: skip


def motion():
    return fb.simulate(robot_arm(), duration=5.0, step=2e-3)


def picture(drawing, plot):
    fb.draw(robot_arm(), axes=drawing)
    result = motion()
    plot.plot(result.sel(output="tip_X"), result.sel(output="tip_Y"), color="#1f78b4")
    plot.set(xlabel="tip_X [m]", ylabel="tip_Y [m]")
