"""A pick-and-place arm with a flexible forearm.

Seen from above, two motors move a load from one tray to another, from rest to rest. The mass of
the load is an interval and Young's modulus of the forearm is a random field. How far is the load
from its target when the motors have stopped?
"""

import numpy as np

import flexband as fb

UPPER, FORE = 0.40, 0.35  # m
TRAVEL, TURN = 0.4, -1.1  # s, rad: duration and angle of both motors
SHOULDER, ELBOW = 2.1, 0.6  # rad: initial angles
ALUMINIUM = {"width": 0.04, "density": 2700.0}  # m, kg/m³


PLACE = UPPER * np.sin(SHOULDER + TURN) + FORE * np.sin(ELBOW + TURN)  # m: target Y of the load


def turn(t):
    """Return the angle by which both motors have turned [rad], from rest to rest."""
    s = np.clip(t / TRAVEL, 0.0, 1.0)
    return TURN * s**3 * (10 - 15 * s + 6 * s**2)


def arm(load, youngs_modulus):
    tip = UPPER * np.array([np.cos(SHOULDER), np.sin(SHOULDER)])
    place = tip + FORE * np.array([np.cos(ELBOW), np.sin(ELBOW)])
    return fb.Mechanism(
        bodies={
            "upper": fb.RigidBody.bar(length=UPPER, height=0.05, angle=SHOULDER, **ALUMINIUM),
            "fore": fb.Beam(length=FORE, height=0.008, youngs_modulus=youngs_modulus, angle=ELBOW,
                            poissons_ratio=0.33, elements=4, start=tuple(tip), **ALUMINIUM),
            "load": fb.PointMass(mass=load, position=tuple(place)),
        },
        joints={
            "A": fb.Revolute("upper.start", (0.0, 0.0)),
            "B": fb.Revolute("fore.start", "upper.end"),
            "grip": fb.Revolute("load", "fore.end"),
            "shoulder": fb.PrescribedRotation("upper", lambda t: SHOULDER + turn(t)),
            "elbow": fb.PrescribedRotation("fore.start", lambda t: ELBOW + turn(t)),
        },
        sensors={"load": fb.Position("load")},
    )  # fmt: skip


inputs = {"load": fb.Interval(0.45, 0.55),  # kg
          "youngs_modulus": fb.RandomField(70e9, 2e9, correlation_length=0.5)}  # fmt: skip
response = fb.dynamic_response(arm, duration=0.6, step=5e-4)
study = fb.Study(response, inputs, fb.AdaptivePCCI(tolerance=0.01))


def picture(drawing, plot):
    fb.draw(arm(0.5, 70e9), axes=drawing)
    bands = 1e3 * (study.run().sel(output="load_Y", time=slice(0.38, 0.6)) - PLACE)
    plot.fill_between(bands.time, *bands["error_bar"], color="#fdd0a2", label="interval error bar")
    plot.fill_between(bands.time, *bands["mean"], color="#1f78b4", label="interval mean")
    plot.set(xlabel="time [s]", ylabel="Y of the load from its target [mm]", ylim=(-0.6, 0.9))
    plot.legend()
