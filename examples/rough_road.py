"""A quarter of a car on a random road.

The height of the road is a random field of the distance, smooth at first and rough later. The car
drives over it at 12 m/s, so its wheel is moved by a random process in time. The damping of the
strut is an interval.
"""

import numpy as np

import flexband as fb

CAR, WHEEL = 320.0, 35.0  # kg
STRUT, TYRE = 22e3, 180e3  # N/m
SPEED, DURATION = 12.0, 1.5  # m/s, s
HEIGHT, TRAVEL = 0.3, 0.4  # m: lengths of the tyre and of the strut
LIFT = (0.0, 1.0)  # axis of the guides


def roughness(x):
    """Return the standard deviation of the road's height [m] at a distance [m]."""
    return 1e-5 + 0.015 * np.tanh(x / 6.0) ** 2


def quarter_car(road, damping):
    masses = {"car": (CAR, HEIGHT + TRAVEL), "wheel": (WHEEL, HEIGHT), "road": (1.0, 0.0)}
    return fb.Mechanism(
        bodies={name: fb.RigidBody(mass=mass, inertia=1.0, position=(0.0, height))
                for name, (mass, height) in masses.items()},
        joints={
            **{f"guide of {name}": fb.Prismatic(name, (0.0, 0.0), LIFT) for name in masses},
            "height": fb.PrescribedTravel("road", (0.0, 0.0), lambda t: road(SPEED * t), LIFT),
        },
        loads={
            "strut": fb.Spring("wheel", "car", STRUT, TRAVEL, damping=damping),
            "tyre": fb.Spring("road", "wheel", TYRE, HEIGHT),
        },
        sensors={"car": fb.Position("car"), "tyre": fb.SpringForce("tyre")},
    )  # fmt: skip


inputs = {
    "road": fb.RandomField(0.0, roughness, correlation_length=4.0, tolerance=2e-4),  # m, m
    "damping": fb.Interval(1200.0, 2000.0),  # N s/m
}
response = fb.dynamic_response(quarter_car, duration=DURATION, step=2.5e-3)
study = fb.Study(response, inputs, fb.AdaptivePCCI(tolerance=0.02))


def picture(drawing, plot):
    field = study.fields()["road"]
    x = np.linspace(*field.domain, 300)
    drawing.plot(x, 1e3 * field.realizations(x, 6).T, linewidth=0.7)
    drawing.plot(x, 1e3 * np.outer(roughness(x), [-1, 1]), color="0.1", linewidth=1.4)
    drawing.set(xlabel="distance [m]", ylabel="height of the road [mm]")
    bands = 1e3 * (study.run().sel(output="car_Y") - HEIGHT - TRAVEL)
    plot.fill_between(bands.time, *bands["error_bar"], color="#fdd0a2", label="interval error bar")
    plot.fill_between(bands.time, *bands["mean"], color="#1f78b4", label="interval mean")
    plot.set(xlabel="time [s]", ylabel="lift of the car [mm]")
    plot.legend(loc="upper left")
