"""A suspension that drives over a kerb.

The damping of a trailing-arm suspension is an interval, the stiffness of its spring is random.
"""

import numpy as np

import flexband as fb

CAR, WHEEL = 320.0, 35.0  # kg: a quarter of the car, and a wheel
ARM, MOUNT = 0.5, 0.35  # m: from the pivot to the wheel and to the spring
KERB, RISE = 0.06, 0.05  # m, s: height, and time to climb it
TYRE, RIDE = 180e3, 0.30  # N/m, m: stiffness of the tyre, height of axle and pivot at rest
LIFT = (0.0, 1.0)  # axis of the guides


def road(t):
    s = np.clip((t - 0.2) / RISE, 0.0, 1.0)
    return KERB * s**2 * (3 - 2 * s)


def suspension(damping, stiffness):
    strut = 0.40 + 9.81 * CAR * ARM / MOUNT / stiffness  # m: length without the car's weight
    tyre = RIDE + 9.81 * (CAR + WHEEL) / TYRE
    return fb.Mechanism(
        bodies={
            "car": fb.RigidBody(mass=CAR, inertia=80.0, position=(0.0, RIDE),
                                points={"pivot": (0, 0), "mount": (MOUNT, 0.40)}),
            "arm": fb.RigidBody(mass=WHEEL, inertia=1.0, position=(0.0, RIDE), center=(ARM, 0.0),
                                points={"pivot": (0, 0), "seat": (MOUNT, 0), "axle": (ARM, 0)}),
            "road": fb.RigidBody(mass=1.0, inertia=1.0, position=(ARM, 0.0),
                                 points={"top": (0, 0), "guide": (0, -0.15)}),
        },
        joints={
            "body": fb.Prismatic("car.pivot", (0.0, 0.0), LIFT),
            "pivot": fb.Revolute("arm.pivot", "car.pivot"),
            "contact": fb.Prismatic("road.guide", (ARM, 0.0), LIFT),
            "kerb": fb.PrescribedTravel("road.guide", (ARM, -0.15), road, LIFT),
        },
        loads={
            "gravity": fb.Gravity(),
            "strut": fb.Spring("arm.seat", "car.mount", stiffness, strut, damping=damping),
            "tyre": fb.Spring("arm.axle", "road.top", TYRE, tyre, damping=200.0),
        },
        sensors={"car": fb.Position("car"), "tyre": fb.SpringForce("tyre")},
    )  # fmt: skip


inputs = {"damping": fb.Interval(3500.0, 5500.0), "stiffness": fb.Normal(45e3, 3e3)}  # N s/m, N/m
response = fb.dynamic_response(suspension, duration=2.0, step=2e-3)
study = fb.Study(response, inputs, fb.AdaptivePCCI(tolerance=0.01))


def picture(drawing, plot):
    fb.draw(suspension(4500.0, 45e3), axes=drawing, dimensions=False)
    bands = 1e3 * (study.run().sel(output="car_Y") - RIDE)
    plot.fill_between(bands.time, *bands["error_bar"], color="#fdd0a2", label="interval error bar")
    plot.fill_between(bands.time, *bands["mean"], color="#1f78b4", label="interval mean")
    plot.set(xlabel="time [s]", ylabel="lift of the car [mm]")
    plot.legend()
