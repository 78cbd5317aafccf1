"""A rigid–flexible slider–crank with tolerances and random material.

The crank turns at constant speed; the link is an elastic beam; a spring holds the slider. The
length of the crank and the stiffness of the spring are intervals, Young's modulus and Poisson's
ratio of the link are random fields. How uncertain are the reactions at the crank's pin A, and does
it bear them?
"""

import numpy as np

import flexband as fb

LINK = 0.45  # m


def slider_crank(crank_length, spring_stiffness, youngs_modulus, poissons_ratio, **mesh):
    crank = fb.RigidBody.bar(length=crank_length, height=0.01, width=0.01, density=7800.0)
    link = fb.Beam(
        length=LINK, height=0.01, width=0.01, density=2700.0, start=(crank_length, 0.0),
        youngs_modulus=youngs_modulus, poissons_ratio=poissons_ratio,
        **({"elements": 4} | mesh),
    )  # fmt: skip
    slider = fb.RigidBody.block(
        length=0.08, height=0.08, width=0.2, density=7800.0, position=(crank_length + LINK, 0.0)
    )
    return fb.Mechanism(
        bodies={"crank": crank, "link": link, "slider": slider},
        joints={
            "A": fb.Revolute("crank.start", (0.0, 0.0)),
            "B": fb.Revolute("link.start", "crank.end"),
            "C": fb.Revolute("slider", "link.end"),
            "guide": fb.Prismatic("slider", (0.0, 0.0), axis=(1.0, 0.0)),
            "motor": fb.PrescribedRotation("crank", lambda t: 4 * np.pi * t),
        },
        loads={"spring": fb.Spring("slider", (2.0, 0.0), spring_stiffness)},  # relaxed at t = 0
        sensors={"F": fb.Reaction("A")},
    )


inputs = {
    "crank_length": fb.Interval(0.194, 0.206),
    "spring_stiffness": fb.Interval(970.0, 1030.0),
    "youngs_modulus": fb.RandomField(69e9, 0.69e9, correlation_length=2.0, domain=(0.0, LINK)),
    "poissons_ratio": fb.RandomField(0.34, 0.0034, correlation_length=2.0, domain=(0.0, LINK)),
}
units = {"crank_length": "m", "spring_stiffness": "N/m", "youngs_modulus": "Pa"}
response = fb.dynamic_response(slider_crank, duration=0.6, step=1e-4, output_step=5e-4)
strength = fb.Requirement("F_X", above=-1600.0, below=1600.0)  # N, of the pin
study = fb.Study(
    response, inputs, fb.AdaptivePCCI(tolerance=0.01), requirements=strength, units=units
)


def picture(drawing, plot):
    fb.draw(slider_crank(0.2, 1000.0, 69e9, 0.34), axes=drawing)
    bands = study.run().sel(output="F_X")
    plot.fill_between(bands.time, *bands["error_bar"], color="#fdd0a2", label="interval error bar")
    plot.fill_between(bands.time, *bands["mean"], color="#1f78b4", label="interval mean")
    plot.set(xlabel="time [s]", ylabel="X force at A [N]")
    plot.legend()
