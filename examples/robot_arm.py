"""How exactly a robot arm with play, backlash and a flexible link holds its load.

The forearm bends, a PID controller drives the wrist through a gear with backlash, and pins have
play, which the weight holds on one side. The load must come to rest within 1.5 mm of its place.
"""

import numpy as np

import flexband as fb

ALLOY, PIN = {"height": 0.04, "width": 0.03, "density": 2700.0}, (0.0, 0.0)  # m, kg/m³
FOREARM = {"length": 0.4, "height": 0.03, "width": 0.03, "density": 1600.0, "poissons_ratio": 0.3,
           "retardation_time": 2e-3, "elements": 2}  # fmt: skip
SHOULDER, ELBOW = fb.ramp(to=np.pi / 3, duration=1.0), fb.ramp(to=-np.pi / 2, duration=1.0)  # rad
GAINS = 60.0, 120.0, 2.0  # N m/rad, N m/(rad s), N m s/rad
TEETH = fb.contact.HuntCrossley(stiffness=2e5, restitution=0.2)  # N m/rad^1.5


def pid(t, x, v, s, p, force, rate):
    """Hold the angle between rotor and forearm at 0; row 2 is their difference."""
    force[2, 2], rate[0] = -p[0] * x[2, 2] - p[1] * s[0] - p[2] * v[2, 2], x[2, 2]


def arm(load=1.0, modulus=3e9, backlash=1.5e-3, elbow=PIN, wrist=PIN):
    return fb.Mechanism(
        bodies={
            "upper": fb.RigidBody.bar(length=0.5, **ALLOY),
            "fore": fb.Beam(**FOREARM, youngs_modulus=modulus, start=(0.5, 0.0)),
            "rotor": fb.RigidBody(mass=0.5, inertia=0.02, position=(0.9, 0.0)),
            "hand": fb.RigidBody.bar(length=0.2, start=(0.9, 0.0), **ALLOY),
            "load": fb.PointMass(mass=load, position=(1.1, 0.0)),
        },
        joints={
            "base": fb.Revolute("upper.start", PIN),
            "elbow": fb.Revolute("upper.end", "fore.start", offset=elbow),
            "wrist": fb.Revolute("fore.end", "hand.start", offset=wrist),
            "bearing": fb.Revolute("rotor", "fore.end"), "grip": fb.Revolute("load", "hand.end"),
            "motor 1": fb.PrescribedRotation("upper", SHOULDER),
            "motor 2": fb.PrescribedRotation("fore.start", "upper", ELBOW),
        },
        loads={"gravity": fb.Gravity(), "motor 3": fb.ForceLaw(
            ["rotor", "fore.end"], pid, GAINS, states={"i": 0.0}, between=[(0, 1)]),
            "gear": fb.contact.AngularStop("hand", "rotor", TEETH, -backlash / 2, backlash / 2)},
        sensors={"load": fb.Position("load"), "M": fb.ReactionMoment("motor 2")},
    )  # fmt: skip


pins = {name: fb.Play(0.05e-3, one_sided=True) for name in ("elbow", "wrist")}  # m
inputs = {"load": fb.Interval.around(1.0, tolerance=0.05), "modulus": fb.Normal(3e9, cv=0.03),
          "backlash": fb.Interval(1e-3, 2e-3), **pins}  # kg, Pa, rad  # fmt: skip
limits = [fb.Requirement(f"place {axis}", output=f"load_{axis}", within=1.5e-3, during=(2.0, 3.0))
          for axis in "XY"]  # fmt: skip
response = fb.dynamic_response(arm, duration=3.0, step=0.02)
study = fb.Study(response, inputs, fb.AdaptivePCCI(tolerance=0.02), requirements=limits)


def picture(drawing, plot):
    fb.draw(arm(), axes=drawing)
    fb.plot.deviations(study.run(), output="load_Y", ax=plot).set(ylabel="load's deviation [m]")
    plot.ticklabel_format(axis="y", scilimits=(-3, -3))
