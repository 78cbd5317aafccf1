"""How firmly the bimetal of a thermostat closes its contact.

A strip of two metals bends as it warms up, without stress while it is free. It sits in rubber and
presses a blade after a gap. The bounds of the force hold for all gaps, temperatures and bushings
within their tolerances; the thickness of the strip scatters.
"""

from functools import partial

import numpy as np

import flexband as fb

LENGTH, WIDTH, THICKNESS = 0.04, 8e-3, 0.8e-3  # m
MODULUS, MISFIT = 150e9, 18e-6  # Pa, difference of the coefficients of expansion in 1/K
RUBBER, BLADE, GAP = 20.0, 5e4, 1e-3  # N m/rad, N/m, m
WARMER = 60.0  # K


def thermostat(thickness=THICKNESS, gap=GAP, rubber=RUBBER, warmer=WARMER):
    area, moment = WIDTH * thickness, WIDTH * thickness**3 / 12
    strip = fb.Cable(
        length=LENGTH, mass_per_length=8000 * area, axial_stiffness=MODULUS * area,
        bending_stiffness=MODULUS * moment, elements=8,
    )  # fmt: skip
    pressed = fb.loads.Characteristic([0.0, 0.0, BLADE * GAP], place=[-GAP, 0.0, GAP])
    return fb.Mechanism(
        bodies={"strip": strip},
        loads={
            "heat": fb.loads.FreeCurvature("strip", 1.5 * MISFIT * warmer / thickness),
            "rubber": fb.loads.Bushing("strip.start", (0.0, 0.0), (1e6, 1e6, rubber)),
            "blade": fb.Spring("strip.end", (LENGTH, -0.02), rest_length=0.02 + gap, pull=pressed),
        },
        sensors={"tip": fb.Position("strip.end"), "contact": fb.SpringForce("blade")},
    )


inputs = {
    "thickness": fb.Normal(THICKNESS, 0.03 * THICKNESS),
    "gap": fb.Interval(0.9 * GAP, 1.1 * GAP),
    "rubber": fb.Interval(15.0, 25.0),
}
firm = fb.Requirement("firm contact", "contact_F", above=0.5, unit="N")
warm = {"warmer": fb.Interval(WARMER - 5.0, WARMER + 5.0)}
response = fb.static_response(thermostat)
study = fb.Study(response, inputs | warm, fb.AdaptivePCCI(0.01), requirements=[firm])


def picture(drawing, plot):
    fb.draw(thermostat(), axes=drawing)
    kelvins = np.linspace(45.0, 75.0, 7)
    runs = [fb.static_response(partial(thermostat, warmer=float(k))) for k in kelvins]
    bands = [fb.propagate(run, inputs, fb.PCCI(2, 2)).sel(output="contact_F") for run in runs]
    for name, color in (("error_bar", "#fdd0a2"), ("mean", "#1f78b4")):
        low, high = np.transpose([band[name].values for band in bands])
        plot.fill_between(
            kelvins, low, high, color=color, label=f"interval {name}".replace("_", " ")
        )
    plot.set(xlabel="warmer by [K]", ylabel="force of the contact [N]")
    plot.legend(loc="upper left")
