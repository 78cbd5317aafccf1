"""A falling soft cable.

A rubber cable, pinned at one end, is released from the horizontal. It bends and stretches by large
amounts. There is no damping, so the total energy is constant.
"""

import numpy as np

import flexband as fb

LENGTH, DIAMETER = 1.2, 0.012  # m
AREA, SECOND_MOMENT = np.pi * DIAMETER**2 / 4, np.pi * DIAMETER**4 / 64  # m², m⁴
MODULUS, DENSITY = 4e6, 1100.0  # Pa, kg/m³
ELEMENTS = 24


def cable_pendulum():
    cable = fb.Cable(
        length=LENGTH,
        mass_per_length=DENSITY * AREA,
        axial_stiffness=MODULUS * AREA,
        bending_stiffness=MODULUS * SECOND_MOMENT,
        elements=ELEMENTS,
    )
    return fb.Mechanism(
        bodies={"cable": cable},
        joints={"hinge": fb.Revolute("cable.start", (0.0, 0.0))},
        loads={"gravity": fb.Gravity()},
        sensors={
            **{f"node {k}": fb.Position(f"cable.node {k}") for k in range(ELEMENTS + 1)},
            "kinetic": fb.KineticEnergy(),
            "potential": fb.PotentialEnergy(),
            "elastic": fb.ElasticEnergy(),
        },
    )


def motion():
    return fb.simulate(cable_pendulum(), duration=1.2, step=5e-4)


def picture(drawing, plot):
    fb.draw(cable_pendulum(), axes=drawing, dimensions=False, names=False)
    result = motion()
    for time in np.arange(0.1, 1.0, 0.1):
        places = result.sel(time=time, method="nearest").values[:-3]
        drawing.plot(places[::2], places[1::2], color="#1f78b4", alpha=0.3 + 0.7 * time)
        drawing.annotate(f"{time:.1f} s", places[-2:], fontsize=7)
    for name in ("kinetic", "potential", "elastic"):
        plot.plot(result.time, result.sel(output=name), label=name)
    plot.plot(result.time, result[-3:].sum("output"), "k--", label="sum")
    plot.set(xlabel="time [s]", ylabel="energy [J]")
    plot.legend()
