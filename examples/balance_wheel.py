"""The balance wheel of a clock.

A wheel on a torsion spring, with friction in its pin, determines the rate of a clock. The radius
of the wheel is known to ± 0.1 %, the stiffness of the hairspring has a standard deviation of 0.5 %.
The uncertainty of the angle grows with time: the picture shows the last quarter of two seconds.
"""

import flexband as fb

RADIUS, WIDTH, DENSITY = 8e-3, 1.5e-3, 8500.0  # m, m, kg/m³: brass
STIFFNESS, FRICTION = 1.6e-5, 3e-9  # N m/rad, N m s/rad
SWING = 2.0  # rad


def balance_wheel(radius, stiffness):
    return fb.Mechanism(
        bodies={
            "wheel": fb.RigidBody.disc(radius=radius, width=WIDTH, density=DENSITY, angle=SWING)
        },
        joints={"staff": fb.Revolute("wheel", (0.0, 0.0))},
        loads={
            "hairspring": fb.TorsionSpring(
                "wheel", (0.0, 0.0), stiffness, rest_angle=0.0, damping=FRICTION
            ),
        },
        sensors={"angle": fb.Angle("wheel"), "spring": fb.SpringMoment("hairspring")},
    )


inputs = {
    "radius": fb.Interval(0.999 * RADIUS, 1.001 * RADIUS),  # m
    "stiffness": fb.Normal(STIFFNESS, 0.005 * STIFFNESS),  # N m/rad
}
response = fb.dynamic_response(balance_wheel, duration=2.0, step=5e-4)
study = fb.Study(response, inputs, fb.AdaptivePCCI(tolerance=0.01))


def picture(drawing, plot):
    fb.draw(balance_wheel(RADIUS, STIFFNESS), axes=drawing)
    bands = study.run().sel(output="angle", time=slice(1.5, 2.0))
    plot.fill_between(bands.time, *bands["error_bar"], color="#fdd0a2", label="interval error bar")
    plot.fill_between(bands.time, *bands["mean"], color="#1f78b4", label="interval mean")
    plot.set(xlabel="time [s]", ylabel="angle [rad]", ylim=(-2.0, 2.6))
    plot.legend(loc="upper right")
