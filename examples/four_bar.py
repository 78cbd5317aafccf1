"""A four-bar linkage with a flexible coupler and a tolerance.

The crank of a wiper drive turns at constant speed. The length of the coupler has a tolerance of
± 1 mm and Young's modulus is random. How do they affect the angle of the rocker and the deflection
of the coupler?
"""

import numpy as np

import flexband as fb

CRANK, COUPLER, ROCKER, GROUND = 0.08, 0.30, 0.20, 0.32  # m
SPEED = 6 * np.pi  # rad/s: three turns per second
STEEL = {"height": 0.012, "width": 0.01, "density": 7800.0}  # m, m, kg/m³


def angle(t):
    return np.pi / 3 + SPEED * t


def four_bar(coupler_length, youngs_modulus):
    return fb.Mechanism(
        bodies={
            "crank": fb.RigidBody.bar(length=CRANK, angle=angle(0.0), **STEEL),
            "coupler": fb.Beam(
                length=coupler_length, height=0.006, width=0.01, density=1140.0,  # polyamide
                youngs_modulus=youngs_modulus, poissons_ratio=0.39, retardation_time=5e-4,
                elements=6, start=(0.04, 0.07), angle=0.4,
            ),
            "rocker": fb.RigidBody.bar(length=ROCKER, start=(GROUND, 0.0), angle=1.6, **STEEL),
        },
        joints={
            "A": fb.Revolute("crank.start", (0.0, 0.0)),
            "B": fb.Revolute("coupler.start", "crank.end"),
            "C": fb.Revolute("coupler.end", "rocker.end"),
            "D": fb.Revolute("rocker.start", (GROUND, 0.0)),
            "motor": fb.PrescribedRotation("crank", angle),
        },
        sensors={"rocker": fb.Angle("rocker"), "bend": fb.Deflection("coupler")},
    )  # fmt: skip


inputs = {
    "coupler_length": fb.Interval(COUPLER - 0.001, COUPLER + 0.001),  # m
    "youngs_modulus": fb.Normal(2.8e9, 0.2e9),  # Pa
}
response = fb.dynamic_response(four_bar, duration=0.35, step=2.5e-4)
study = fb.Study(response, inputs, fb.AdaptivePCCI(tolerance=0.01))


def picture(drawing, plot):
    fb.draw(four_bar(COUPLER, 2.8e9), axes=drawing)
    bands = 1e3 * study.run().sel(output="bend")
    plot.fill_between(bands.time, *bands["error_bar"], color="#fdd0a2", label="interval error bar")
    plot.fill_between(bands.time, *bands["mean"], color="#1f78b4", label="interval mean")
    plot.set(xlabel="time [s]", ylabel="deflection of the coupler [mm]")
    plot.legend()
